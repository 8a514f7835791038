//! Vectors of three numbers, and triangles of them.

pub(crate) use slipstick_mesh::vector::{cross, dot, norm, subtract};

/// The direction of a vector; zero for zero.
pub(crate) fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = norm(a);
    a.map(|c| if length > 0.0 { c / length } else { 0.0 })
}

pub(crate) fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + b[c])
}

pub(crate) fn scaled(factor: f64, a: [f64; 3]) -> [f64; 3] {
    a.map(|component| factor * component)
}

/// Twice the vector area of a triangle.
pub(crate) fn area(corners: [[f64; 3]; 3]) -> [f64; 3] {
    cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]))
}

pub(crate) fn unit_normal(corners: [[f64; 3]; 3]) -> [f64; 3] {
    unit(area(corners))
}

/// Unit normal of a triangle and its quality, 4√3 A / Σ l²: 1 if it is equilateral, 0 if it is flat.
pub(crate) fn shape(corners: [[f64; 3]; 3]) -> ([f64; 3], f64) {
    let [a, b, c] = corners;
    let twice = area(corners);
    let squares: f64 = [subtract(b, a), subtract(c, b), subtract(a, c)].iter().map(|&e| dot(e, e)).sum();
    let quality = if squares > 0.0 { 2.0 * 3f64.sqrt() * norm(twice) / squares } else { 0.0 };
    (unit(twice), quality)
}
