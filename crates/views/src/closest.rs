//! Closest points on triangles and segments, by a tree of boxes.

use crate::vector::{cross, dot, norm, subtract};

/// A triangle or a segment (its last two corners are the same).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Simplex {
    pub corners: [[f64; 3]; 3],
    /// Unit normal of a triangle; zero for a segment.
    pub normal: [f64; 3],
}

/// Triangles or segments, sorted into nested boxes.
#[derive(Debug, Default)]
pub(crate) struct ClosestPoint {
    simplices: Vec<Simplex>,
    boxes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    min: [f64; 3],
    max: [f64; 3],
    /// The simplices below.
    start: u32,
    end: u32,
    /// The second child; the first one follows its parent. 0: a leaf.
    second: u32,
}

const ALONG_X: [f64; 3] = [1.0, 0.0, 0.0];

/// Largest number of simplices in a leaf.
const LEAF: usize = 4;

impl ClosestPoint {
    pub fn new(simplices: Vec<Simplex>) -> Self {
        let mut tree = Self { simplices, boxes: Vec::new() };
        if !tree.simplices.is_empty() {
            tree.build(0, tree.simplices.len());
        }
        tree
    }

    /// Triangles for [`nearest`](Self::nearest): they get the same normal, so that directions do not matter.
    pub fn of_triangles(triangles: impl Iterator<Item = [[f64; 3]; 3]>) -> Self {
        Self::new(triangles.map(|corners| Simplex { corners, normal: ALONG_X }).collect())
    }

    /// The point nearest to `x` on [triangles](Self::of_triangles); `None` if there is none within a radius. \[L\]
    pub fn nearest(&self, x: [f64; 3], radius: f64) -> Option<[f64; 3]> {
        self.of(x, (ALONG_X, 0.0), radius)
    }

    fn build(&mut self, start: usize, end: usize) -> usize {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in self.simplices[start..end].iter().flat_map(|s| s.corners) {
            for c in 0..3 {
                min[c] = min[c].min(corner[c]);
                max[c] = max[c].max(corner[c]);
            }
        }
        let number = self.boxes.len();
        self.boxes.push(Node { min, max, start: start as u32, end: end as u32, second: 0 });
        if end - start > LEAF {
            let size = subtract(max, min);
            let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
            let key = |s: &Simplex| s.corners.iter().map(|p| p[axis]).sum::<f64>();
            let middle = (end - start) / 2;
            self.simplices[start..end].select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
            self.build(start, start + middle);
            self.boxes[number].second = self.build(start + middle, end) as u32;
        }
        number
    }

    /// Closest point to `x` within `radius`, on segments or on triangles whose unit normal n
    /// satisfies n·facing > limit; `None` if there is none. \[L\]
    pub fn of(&self, x: [f64; 3], (facing, limit): ([f64; 3], f64), radius: f64) -> Option<[f64; 3]> {
        let mut best = (radius, None);
        let mut open: Vec<u32> = if self.boxes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(at) = open.pop() {
            let node = &self.boxes[at as usize];
            let outside: [f64; 3] = std::array::from_fn(|c| (node.min[c] - x[c]).max(x[c] - node.max[c]).max(0.0));
            if norm(outside) >= best.0 {
                continue;
            }
            if node.second > 0 {
                // The nearer child is looked at first.
                let mut children = [at + 1, node.second];
                let away = |child: u32| {
                    let of = &self.boxes[child as usize];
                    (0..3).map(|c| (0.5 * (of.min[c] + of.max[c]) - x[c]).powi(2)).sum::<f64>()
                };
                if away(children[0]) < away(children[1]) {
                    children.swap(0, 1);
                }
                open.extend(children);
                continue;
            }
            for simplex in &self.simplices[node.start as usize..node.end as usize] {
                let segment = simplex.normal == [0.0; 3];
                if !segment && dot(simplex.normal, facing) <= limit {
                    continue;
                }
                let [a, b, c] = simplex.corners;
                let point = if segment { on_segment(x, a, b) } else { on_triangle(x, a, b, c) };
                let distance = norm(subtract(point, x));
                if distance < best.0 {
                    best = (distance, Some(point));
                }
            }
        }
        best.1
    }
}

/// Smallest distance from the ends at which a triangle crosses a segment, as a fraction of its
/// length.
const ENDS: f64 = 1e-6;

impl ClosestPoint {
    /// Whether a triangle crosses the segment from `p` to `q` away from its ends.
    pub fn crosses(&self, p: [f64; 3], q: [f64; 3]) -> bool {
        let along = subtract(q, p);
        let mut open: Vec<u32> = if self.boxes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(at) = open.pop() {
            let node = &self.boxes[at as usize];
            if !meets_box(p, along, node) {
                continue;
            }
            if node.second > 0 {
                open.extend([at + 1, node.second]);
                continue;
            }
            let mut inside = self.simplices[node.start as usize..node.end as usize].iter();
            if inside.any(|simplex| crossing(p, along, simplex.corners)) {
                return true;
            }
        }
        false
    }
}

/// Slab test: whether a segment intersects a box.
fn meets_box(p: [f64; 3], along: [f64; 3], node: &Node) -> bool {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for c in 0..3 {
        if along[c] == 0.0 {
            if p[c] < node.min[c] || p[c] > node.max[c] {
                return false;
            }
            continue;
        }
        let (a, b) = ((node.min[c] - p[c]) / along[c], (node.max[c] - p[c]) / along[c]);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    from <= to
}

/// Whether a triangle crosses a segment between its ends.
///
/// Method: T. Möller, B. Trumbore, Fast, minimum storage ray/triangle intersection, J. Graphics
/// Tools 2 (1997) 21–28.
fn crossing(p: [f64; 3], along: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> bool {
    let (u, v) = (subtract(b, a), subtract(c, a));
    let h = cross(along, v);
    let determinant = dot(u, h);
    if determinant == 0.0 {
        return false;
    }
    let from = subtract(p, a);
    let s = dot(from, h) / determinant;
    let g = cross(from, u);
    let t = dot(along, g) / determinant;
    let where_on = dot(v, g) / determinant;
    s >= 0.0 && t >= 0.0 && s + t <= 1.0 && (ENDS..=1.0 - ENDS).contains(&where_on)
}

/// `a` + `s` `u` + `t` `v`: coordinates that all corners share stay the same bit for bit.
fn combined(a: [f64; 3], (s, u): (f64, [f64; 3]), (t, v): (f64, [f64; 3])) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + (s * u[c] + t * v[c]))
}

fn on_segment(x: [f64; 3], a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let along = subtract(b, a);
    let size = dot(along, along);
    let s = if size > 0.0 { (dot(subtract(x, a), along) / size).clamp(0.0, 1.0) } else { 0.0 };
    combined(a, (s, along), (0.0, along))
}

/// The point of a triangle nearest to `x`, by the region of its plane in which `x` lies.
///
/// Method: C. Ericson, Real-Time Collision Detection (2005), section 5.1.5.
fn on_triangle(x: [f64; 3], a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> [f64; 3] {
    let (u, v) = (subtract(b, a), subtract(c, a));
    let ends = |p: [f64; 3]| (dot(u, subtract(x, p)), dot(v, subtract(x, p)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (ends(a), ends(b), ends(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let [in_a, in_b, in_c] = [d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2];
    if in_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return on_segment(x, a, b);
    }
    if in_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return on_segment(x, a, c);
    }
    if in_a <= 0.0 && d4 >= d3 && d5 >= d6 {
        return on_segment(x, b, c);
    }
    let sum = in_a + in_b + in_c;
    combined(a, (in_b / sum, u), (in_c / sum, v))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points over the interior, over each edge and beyond each corner of a right triangle.
    #[test]
    fn each_region_of_a_triangle() {
        let (a, b, c) = ([0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        for (x, nearest) in [
            ([0.5, 0.5, 3.0], [0.5, 0.5, 0.0]),
            ([1.0, -1.0, 1.0], [1.0, 0.0, 0.0]),
            ([-1.0, 1.0, 0.0], [0.0, 1.0, 0.0]),
            ([2.0, 2.0, -1.0], [1.0, 1.0, 0.0]),
            ([-1.0, -2.0, 1.0], a),
            ([4.0, -1.0, 0.0], b),
            ([-1.0, 5.0, 0.0], c),
        ] {
            assert_eq!(on_triangle(x, a, b, c), nearest, "{x:?}");
        }
    }

    /// The tree finds the same points as a search through all triangles, and none that faces away.
    #[test]
    fn the_tree_finds_the_nearest() {
        let corner = |k: usize| [(k * 37 % 101) as f64, (k * 53 % 97) as f64, (k * 71 % 89) as f64];
        let simplices: Vec<Simplex> = (0..60)
            .map(|k| {
                let [a, b, c] = [corner(k), corner(k + 100), corner(k + 200)];
                Simplex { corners: [a, b, c], normal: crate::vector::unit_normal([a, b, c]) }
            })
            .collect();
        let tree = ClosestPoint::new(simplices.clone());
        let facing = [1.0, 0.0, 0.0];
        for k in 300..340 {
            let x = corner(k);
            let found = norm(subtract(tree.of(x, (facing, 0.0), f64::INFINITY).expect("one faces x"), x));
            let faces = simplices.iter().filter(|s| dot(s.normal, facing) > 0.0);
            let all = faces.map(|s| norm(subtract(on_triangle(x, s.corners[0], s.corners[1], s.corners[2]), x)));
            assert_eq!(found, all.fold(f64::INFINITY, f64::min));
        }
        assert_eq!(ClosestPoint::default().of([0.0; 3], (facing, 0.0), f64::INFINITY), None);
    }
}
