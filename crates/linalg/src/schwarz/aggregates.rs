//! Aggregates, which are small compact sets of strongly coupled nodes of one body, and the rigid
//! motions of each.

use super::Nodes;
use super::partition::bisect;
use super::vertices::Vertices;
use crate::csr::CsrMatrix;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Rigid motions of an aggregate.
pub(super) const MODES: usize = 6;

/// Maximum number of nodes of an aggregate. Half as many would save a tenth of the iterations and
/// triple the size of the coarse factors.
const LEAF: usize = 48;

/// A coupling connects nodes if it exceeds this value, relative to the geometric mean of their
/// diagonal blocks. Typical values are 0.1 to 0.3 between neighbours of equal stiffness, and 3·10⁻⁵
/// between solid and an element of density 10⁻³, whose stiffness is 10⁻⁹.
const STRENGTH: f64 = 0.02;

/// A rigid motion counts if this much of it is independent of the others.
const INDEPENDENT: f64 = 1e-3;

/// Coarse unknowns: some rigid motions of each aggregate.
#[derive(Debug)]
pub(super) struct Aggregates {
    /// Number of motions of each aggregate, at most [`MODES`].
    pub modes: Vec<u8>,
    /// Aggregate of each unknown, and the unknown's displacement in each motion; `None` for
    /// multipliers.
    pub motions: Vec<Option<(u32, [f64; MODES])>>,
}

/// Couplings between vertices: the Frobenius norm ‖a_ij‖ of the displacements' entries.
fn couplings(a: &CsrMatrix, vertices: &Vertices, moves: &(impl Fn(u32) -> bool + Sync), v: usize) -> Vec<(u32, f64)> {
    let mut row: BTreeMap<u32, f64> = BTreeMap::new();
    for &i in vertices.members(v).iter().filter(|&&i| moves(i)) {
        let (columns, values) = a.row(i as usize);
        for (&j, value) in columns.iter().zip(values).filter(|(j, _)| moves(**j)) {
            *row.entry(vertices.of[j as usize]).or_default() += value * value;
        }
    }
    row.into_iter().map(|(w, sum)| (w, sum.sqrt())).collect()
}

impl Aggregates {
    /// Divides the nodes of each body into boxes, and the nodes of each box into connected sets.
    pub fn new(a: &CsrMatrix, vertices: &Vertices, nodes: &Nodes) -> Self {
        let origins = a.pattern.origins();
        let moves = |i: u32| !nodes.is_multiplier(origins[i as usize]);
        let body = |v: u32| nodes.body(vertices.nodes[v as usize]);
        let mut of_body: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut apart = Vec::new();
        for v in 0..vertices.len() as u32 {
            if !vertices.members(v as usize).iter().any(|&i| moves(i)) {
                continue;
            }
            match body(v) {
                Some(_) if vertices.is_long(v as usize) => apart.push(v),
                Some(body) => of_body.entry(body).or_default().push(v),
                None => apart.push(v),
            }
        }
        let position = |v: u32| nodes.position(vertices.nodes[v as usize]);
        let leaves: Vec<Vec<u32>> = of_body
            .into_values()
            .flat_map(|ids| {
                let parts = ids.len().div_ceil(LEAF);
                bisect(ids, parts, &position, &|_| 1)
            })
            .collect();
        let diagonal: Vec<f64> = (0..vertices.len())
            .into_par_iter()
            .map(|v| {
                let own = couplings(a, vertices, &|i| moves(i) && vertices.of[i as usize] as usize == v, v);
                own.first().map_or(0.0, |(_, size)| *size)
            })
            .collect();
        let connected = |leaf: &Vec<u32>| {
            let mut leaf = leaf.clone();
            leaf.sort_unstable();
            components(a, vertices, &leaf, &diagonal, &moves)
        };
        let mut sets: Vec<Vec<u32>> = leaves.par_iter().flat_map_iter(connected).collect();
        let first_apart = sets.len();
        sets.extend(apart.into_iter().map(|v| vec![v]));
        let modes_of = |(k, set): (usize, &Vec<u32>)| {
            let members = set.iter().flat_map(|&v| vertices.members(v as usize)).copied().filter(|&i| moves(i));
            let members: Vec<u32> = members.collect();
            let rows: Vec<[f64; MODES]> = if k >= first_apart {
                identity(members.len())
            } else {
                rigid_motions(&members, |i| {
                    let origin = origins[i as usize];
                    (nodes.position(origin / 3), (origin % 3) as usize)
                })
            };
            (members, rows)
        };
        let found: Vec<_> = sets.par_iter().enumerate().map(modes_of).collect();
        let mut motions = vec![None; a.n()];
        let mut modes = Vec::with_capacity(found.len());
        for (members, rows) in found {
            let (rows, count) = independent(rows);
            if count == 0 {
                continue;
            }
            for (i, row) in members.into_iter().zip(rows) {
                motions[i as usize] = Some((modes.len() as u32, row));
            }
            modes.push(count as u8);
        }
        Self { modes, motions }
    }
}

/// Sets of vertices of a leaf that are connected by strong couplings.
fn components(
    a: &CsrMatrix,
    vertices: &Vertices,
    leaf: &[u32],
    diagonal: &[f64],
    moves: &(impl Fn(u32) -> bool + Sync),
) -> Vec<Vec<u32>> {
    let mut root: Vec<usize> = (0..leaf.len()).collect();
    fn find(root: &mut [usize], mut k: usize) -> usize {
        while root[k] != k {
            root[k] = root[root[k]];
            k = root[k];
        }
        k
    }
    for (k, &v) in leaf.iter().enumerate() {
        for (w, size) in couplings(a, vertices, moves, v as usize) {
            let Ok(l) = leaf.binary_search(&w) else { continue };
            if size * size > STRENGTH * STRENGTH * diagonal[v as usize] * diagonal[w as usize] {
                let (one, other) = (find(&mut root, k), find(&mut root, l));
                root[one.max(other)] = one.min(other);
            }
        }
    }
    let mut sets: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for (k, &v) in leaf.iter().enumerate() {
        let r = find(&mut root, k);
        sets.entry(r).or_default().push(v);
    }
    sets.into_values().collect()
}

fn identity(count: usize) -> Vec<[f64; MODES]> {
    (0..count).map(|i| std::array::from_fn(|k| f64::from(u8::from(i == k)))).collect()
}

/// Values of the translations, and of the rotations about the centre, at unknowns with given
/// positions and directions.
fn rigid_motions(members: &[u32], place: impl Fn(u32) -> ([f64; 3], usize)) -> Vec<[f64; MODES]> {
    let mut centre = [0.0; 3];
    for &i in members {
        let (x, _) = place(i);
        (0..3).for_each(|k| centre[k] += x[k] / members.len() as f64);
    }
    let radius = members.iter().fold(0.0, |radius: f64, &i| {
        let (x, _) = place(i);
        (0..3).fold(radius, |radius, k| radius.max((x[k] - centre[k]).abs()))
    });
    let scale = if radius > 0.0 { 1.0 / radius } else { 0.0 };
    let row = |&i: &u32| {
        let (x, direction) = place(i);
        let r: [f64; 3] = std::array::from_fn(|k| scale * (x[k] - centre[k]));
        let mut row = [0.0; MODES];
        row[direction] = 1.0;
        // ω × r for the unit vectors ω
        let (next, last) = ((direction + 1) % 3, (direction + 2) % 3);
        row[3 + next] = r[last];
        row[3 + last] = -r[next];
        row
    };
    members.iter().map(row).collect()
}

/// Orthonormal columns with the same span, and their number; the others are zero.
fn independent(mut rows: Vec<[f64; MODES]>) -> (Vec<[f64; MODES]>, usize) {
    let mut count = 0;
    for k in 0..MODES {
        let mut column: Vec<f64> = rows.iter().map(|row| row[k]).collect();
        let size = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        for _ in 0..2 {
            for l in 0..count {
                let shared: f64 = column.iter().zip(&rows).map(|(x, row)| x * row[l]).sum();
                column.iter_mut().zip(&rows).for_each(|(x, row)| *x -= shared * row[l]);
            }
        }
        let left = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        rows.iter_mut().for_each(|row| row[k] = 0.0);
        if left > INDEPENDENT * size && left > 0.0 {
            column.iter().zip(&mut rows).for_each(|(x, row)| row[count] = x / left);
            count += 1;
        }
    }
    (rows, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source: the motions of any rigid body are x ↦ t + ω × x. The columns are orthonormal, and
    /// their combinations reproduce each of these motions.
    #[test]
    fn rigid_motions_are_spanned() {
        let places = [[0.0, 0.1, 0.0], [2.0, 0.0, 0.3], [0.2, 1.5, -1.0], [1.0, 1.0, 2.0]];
        let members: Vec<u32> = (0..12).collect();
        let at = |i: u32| (places[i as usize / 3], i as usize % 3);
        let (rows, count) = independent(rigid_motions(&members, at));
        assert_eq!(count, 6);
        let dot = |k: usize, v: &[f64]| rows.iter().zip(v).map(|(row, v)| row[k] * v).sum::<f64>();
        for k in 0..6 {
            let column: Vec<f64> = rows.iter().map(|row| row[k]).collect();
            assert!((0..6).all(|l| (dot(l, &column) - f64::from(u8::from(k == l))).abs() < 1e-14));
        }
        let (t, w) = ([0.3, -0.2, 0.5], [0.7, 1.1, -0.4]);
        let turned = |x: [f64; 3]| [w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2], w[0] * x[1] - w[1] * x[0]];
        let motion: Vec<f64> = members.iter().map(|&i| t[at(i).1] + turned(at(i).0)[at(i).1]).collect();
        for (i, expected) in motion.iter().enumerate() {
            let found: f64 = (0..6).map(|k| rows[i][k] * dot(k, &motion)).sum();
            assert!((found - expected).abs() < 1e-13);
        }
        // two nodes cannot rotate about the line between them, and one node cannot rotate at all
        assert_eq!(independent(rigid_motions(&members[..6], at)).1, 5);
        assert_eq!(independent(rigid_motions(&members[..3], at)).1, 3);
    }
}
