//! Vectors of three numbers.

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// The direction of a vector; zero for zero.
pub(crate) fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = norm(a);
    a.map(|c| if length > 0.0 { c / length } else { 0.0 })
}

/// Twice the vector area of a triangle.
pub(crate) fn area(corners: [[f64; 3]; 3]) -> [f64; 3] {
    cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]))
}

pub(crate) fn unit_normal(corners: [[f64; 3]; 3]) -> [f64; 3] {
    unit(area(corners))
}
