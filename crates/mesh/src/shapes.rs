//! Shape functions and integration points of second-order elements and of faces.

use crate::{HEX_EDGES, HEX_FACE_CENTRES, HEX_FACES, TET_EDGES, WEDGE_CORNERS, WEDGE_EDGES, WEDGE_QUADRILATERALS};

/// Shape functions and their derivatives with respect to the parent coordinates.
pub type Shapes<const N: usize> = ([f64; N], [[f64; 3]; N]);

/// Parent coordinates (ξ, η, ζ) of the nodes of a hex27.
pub const HEX27_NODES: [[f64; 3]; 27] = {
    let mut out = [[0.0; 3]; 27];
    let mut i = 0;
    while i < 8 {
        out[i] = crate::geometry::HEX_CORNERS[i];
        i += 1;
    }
    i = 0;
    while i < 12 {
        let [a, b] = HEX_EDGES[i];
        let mut c = 0;
        while c < 3 {
            out[8 + i][c] = 0.5 * (out[a][c] + out[b][c]);
            c += 1;
        }
        i += 1;
    }
    i = 0;
    while i < 6 {
        let [a, _, c, _] = HEX_FACES[i];
        let mut d = 0;
        while d < 3 {
            out[HEX_FACE_CENTRES[i]][d] = 0.5 * (out[a][d] + out[c][d]);
            d += 1;
        }
        i += 1;
    }
    out
};

/// Parent coordinates (r, s, ζ) of the nodes of a wedge18, as of [`WEDGE_CORNERS`].
pub const WEDGE18_NODES: [[f64; 3]; 18] = {
    let mut out = [[0.0; 3]; 18];
    let mut i = 0;
    while i < 18 {
        let [a, b] = match i {
            0..6 => [i, i],
            6..15 => WEDGE_EDGES[i - 6],
            _ => [WEDGE_QUADRILATERALS[i - 15][0], WEDGE_QUADRILATERALS[i - 15][2]],
        };
        let mut c = 0;
        while c < 3 {
            out[i][c] = 0.5 * (WEDGE_CORNERS[a][c] + WEDGE_CORNERS[b][c]);
            c += 1;
        }
        i += 1;
    }
    out
};

/// Points and weights of the nine-point rule of wedge18, as in CalculiX: three in the triangle, for degree 2, by
/// three along the axis, for degree 5. Elements with straight edges in their triangles pass the patch test, also
/// if their other edges are curved.
pub const WEDGE18_POINTS: [([f64; 3], f64); 9] = {
    const NEAR: f64 = 1.0 / 6.0;
    const FAR: f64 = 2.0 / 3.0;
    const TRIANGLE: [[f64; 2]; 3] = [[NEAR, NEAR], [FAR, NEAR], [NEAR, FAR]];
    let mut out = [([0.0; 3], 0.0); 9];
    let mut i = 0;
    while i < 9 {
        let ([r, s], (zeta, weight)) = (TRIANGLE[i % 3], LINE[i / 3]);
        out[i] = ([r, s, zeta], weight / 6.0);
        i += 1;
    }
    out
};

/// Points and weights of the eight-point rule of tet10, exact for polynomials of degree 3, so that
/// curved elements pass the patch test. Four points would suffice for the rank of the stiffness,
/// but not for the patch test. Source: C. A. Felippa, Engrg. Comput. 21 (2004) 867–890.
pub const TET10_POINTS: [([f64; 3], f64); 8] = {
    const A: f64 = 0.328_163_302_516_381_7;
    const B: f64 = 0.108_047_249_898_428_6;
    const WA: f64 = 0.136_217_842_537_087_4 / 6.0;
    const WB: f64 = 0.113_782_157_462_912_6 / 6.0;
    const FAR_A: f64 = 1.0 - 3.0 * A;
    const FAR_B: f64 = 1.0 - 3.0 * B;
    [
        ([A, A, A], WA),
        ([FAR_A, A, A], WA),
        ([A, FAR_A, A], WA),
        ([A, A, FAR_A], WA),
        ([B, B, B], WB),
        ([FAR_B, B, B], WB),
        ([B, FAR_B, B], WB),
        ([B, B, FAR_B], WB),
    ]
};

/// √(3/5)
const G: f64 = 0.774_596_669_241_483_4;

/// Points and weights of the three-point Gauss rule, exact for polynomials of degree 5.
const LINE: [(f64, f64); 3] = [(-G, 5.0 / 9.0), (0.0, 8.0 / 9.0), (G, 5.0 / 9.0)];

/// Points and weights of the 3×3×3 Gauss rule of hex27, exact for polynomials of degree 5 in each
/// coordinate.
pub const HEX27_POINTS: [([f64; 3], f64); 27] = {
    let mut out = [([0.0; 3], 0.0); 27];
    let mut i = 0;
    while i < 27 {
        let (x, y, z) = (LINE[i % 3], LINE[i / 3 % 3], LINE[i / 9]);
        out[i] = ([x.0, y.0, z.0], x.1 * y.1 * z.1);
        i += 1;
    }
    out
};

/// Shape functions of a tet10 at the parent coordinates of its corners 1, 2 and 3.
pub fn tet10_shapes([x, y, z]: [f64; 3]) -> Shapes<10> {
    let corner = [1.0 - x - y - z, x, y, z];
    let slope = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (mut values, mut slopes) = ([0.0; 10], [[0.0; 3]; 10]);
    for i in 0..4 {
        values[i] = corner[i] * (2.0 * corner[i] - 1.0);
        slopes[i] = slope[i].map(|s| (4.0 * corner[i] - 1.0) * s);
    }
    for (edge, [a, b]) in TET_EDGES.into_iter().enumerate() {
        values[4 + edge] = 4.0 * corner[a] * corner[b];
        slopes[4 + edge] = std::array::from_fn(|c| 4.0 * (corner[a] * slope[b][c] + corner[b] * slope[a][c]));
    }
    (values, slopes)
}

/// Quadratic shape function of the node at −1, 0 or 1, and its derivative.
pub fn quadratic(node: f64, x: f64) -> (f64, f64) {
    if node == 0.0 { (1.0 - x * x, -2.0 * x) } else { (0.5 * x * (x + node), x + 0.5 * node) }
}

/// Shape functions of a hex27 in the parent cube.
pub fn hex27_shapes(at: [f64; 3]) -> Shapes<27> {
    let (mut values, mut slopes) = ([0.0; 27], [[0.0; 3]; 27]);
    for (i, node) in HEX27_NODES.iter().enumerate() {
        let [x, y, z] = [0, 1, 2].map(|c| quadratic(node[c], at[c]));
        values[i] = x.0 * y.0 * z.0;
        slopes[i] = [x.1 * y.0 * z.0, x.0 * y.1 * z.0, x.0 * y.0 * z.1];
    }
    (values, slopes)
}

/// Shape functions of a wedge18 at the parent coordinates of [`WEDGE18_NODES`]: products of quadratic functions
/// of a triangle and of a line.
pub fn wedge18_shapes([r, s, zeta]: [f64; 3]) -> Shapes<18> {
    let triangle = triangle6([r, s]);
    let (mut values, mut slopes) = ([0.0; 18], [[0.0; 3]; 18]);
    for (i, node) in WEDGE18_NODES.iter().enumerate() {
        let (across, [by_r, by_s]) = triangle[TRIANGLE_OF_WEDGE18[i]];
        let along = quadratic(node[2], zeta);
        values[i] = across * along.0;
        slopes[i] = [by_r * along.0, by_s * along.0, across * along.1];
    }
    (values, slopes)
}

/// The node of a triangle with six nodes below or above each node of a wedge18.
pub(crate) const TRIANGLE_OF_WEDGE18: [usize; 18] = [0, 1, 2, 0, 1, 2, 3, 4, 5, 3, 4, 5, 0, 1, 2, 3, 4, 5];

/// Shape functions of a triangle with six nodes, and their derivatives: corners, then the middles of the edges.
fn triangle6([x, y]: [f64; 2]) -> [(f64, [f64; 2]); 6] {
    let linear = [(1.0 - x - y, [-1.0, -1.0]), (x, [1.0, 0.0]), (y, [0.0, 1.0])];
    std::array::from_fn(|i| {
        let (l, slope) = linear[i % 3];
        if i < 3 {
            return (l * (2.0 * l - 1.0), slope.map(|s| (4.0 * l - 1.0) * s));
        }
        let (next, next_slope) = linear[(i + 1) % 3];
        (4.0 * l * next, [0, 1].map(|c| 4.0 * (l * next_slope[c] + next * slope[c])))
    })
}

/// Shape functions of a face and their derivatives with respect to its two parent coordinates: a
/// triangle with three or six nodes, or a quadrilateral with four or nine.
pub fn face_shapes(nodes: usize, [x, y]: [f64; 2]) -> Vec<(f64, [f64; 2])> {
    const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    match nodes {
        3 => vec![(1.0 - x - y, [-1.0, -1.0]), (x, [1.0, 0.0]), (y, [0.0, 1.0])],
        4 => {
            let bilinear = |[a, b]: [f64; 2]| {
                let (along, across) = (1.0 + a * x, 1.0 + b * y);
                (0.25 * along * across, [0.25 * a * across, 0.25 * along * b])
            };
            CORNERS.map(bilinear).to_vec()
        }
        6 => triangle6([x, y]).to_vec(),
        _ => {
            let node = |at: [f64; 2]| {
                let [along, across] = [0, 1].map(|c| quadratic(at[c], [x, y][c]));
                (along.0 * across.0, [along.1 * across.0, along.0 * across.1])
            };
            let middle = |i: usize| [0, 1].map(|c| 0.5 * (CORNERS[i][c] + CORNERS[(i + 1) % 4][c]));
            CORNERS.into_iter().chain((0..4).map(middle)).chain([[0.0; 2]]).map(node).collect()
        }
    }
}
