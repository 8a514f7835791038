//! The overhang filter for additive manufacturing.

use crate::map::DesignMap;

/// Exponent P of the smooth maximum.
const EXPONENT: f64 = 40.0;

/// Parameter ε of the smooth minimum.
const ROUNDING: f64 = 1e-4;

/// Density ξ₀ at which the smooth maximum of equal densities is exact.
const EXACT: f64 = 0.5;

/// Number of supporting elements n_S.
const SUPPORTS: usize = 5;

/// A box of `cells` hexahedra along x, y and z in the frame of the box, printed in layers.
///
/// Element `(i, j, k)` has the number `first + i + cells[0] (j + cells[1] k)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrintedBox {
    /// The first element.
    pub first: u32,
    /// Numbers of elements along x, y and z.
    pub cells: [usize; 3],
    /// The axis along which the layers are stacked: 0, 1 or 2.
    pub axis: usize,
    /// Whether the first layer is that with the highest coordinate, instead of the lowest.
    pub downwards: bool,
    /// Along each axis, whether the lower and the upper face lie in a symmetry plane.
    pub mirrored: [[bool; 2]; 3],
}

impl PrintedBox {
    fn element(&self, [i, j, k]: [usize; 3]) -> u32 {
        self.first + (i + self.cells[0] * (j + self.cells[1] * k)) as u32
    }

    /// All elements, layer by layer, each with its supports.
    fn supported(&self) -> impl Iterator<Item = Supported> + '_ {
        let [u, v] = [(self.axis + 1) % 3, (self.axis + 2) % 3];
        let height = self.cells[self.axis];
        let layer = move |layer: usize| if self.downwards { height - 1 - layer } else { layer };
        let all = (0..height)
            .flat_map(move |n| (0..self.cells[u]).flat_map(move |a| (0..self.cells[v]).map(move |b| (n, a, b))));
        all.map(move |(n, a, b)| {
            let mut at = [0; 3];
            (at[self.axis], at[u], at[v]) = (layer(n), a, b);
            let below = n.checked_sub(1).map(|n| {
                let mut below = at;
                below[self.axis] = layer(n);
                let mut supports = [Some(self.element(below)); SUPPORTS];
                for (side, &axis) in [u, v].iter().enumerate() {
                    for up in [false, true] {
                        supports[1 + 2 * side + usize::from(up)] = self.beside(below, axis, up);
                    }
                }
                supports
            });
            Supported { element: self.element(at), below }
        })
    }

    /// The neighbour along an axis; beyond a symmetry plane, the element itself.
    fn beside(&self, at: [usize; 3], axis: usize, up: bool) -> Option<u32> {
        let mut beside = at;
        let last = if up { self.cells[axis] - 1 } else { 0 };
        if at[axis] == last {
            return self.mirrored[axis][usize::from(up)].then(|| self.element(at));
        }
        beside[axis] = if up { at[axis] + 1 } else { at[axis] - 1 };
        Some(self.element(beside))
    }
}

/// An element and those that support it; `below` is `None` on the build plate.
#[derive(Clone, Copy, Debug)]
struct Supported {
    element: u32,
    below: Option<[Option<u32>; SUPPORTS]>,
}

/// Densities that can be printed without supports: no element is denser than the densest of five
/// elements of the layer below, the one under it and its four neighbours, up to smoothing.
///
/// From the lowest layer to the highest, `ξ = smin(x, Ξ)` with `Ξ = smax(ξ below)`:
///
/// `smin(x, Ξ) = ½ (x + Ξ − ((x − Ξ)² + ε)^½ + ε^½)`, `smax(ξ) = (Σ ξ^P)^(1/Q)`,
/// `Q = P + ln 5 / ln ½`, `P = 40`, `ε = 10⁻⁴`.
///
/// The build plate supports the lowest layer as five solid elements do. Elements that are `held` keep
/// their densities and support others with them. The result is `φ = ξ/ξ_max`, where `ξ_max ≈ 1.0045`
/// is the largest ξ that the smooth functions give for x ≤ 1, so that φ is in [0, 1]. It is a
/// [`DesignMap`] over all elements; those outside the boxes do not change.
///
/// Source: Langelaar, Struct. Multidiscip. Optim. 55 (2017) 871–883, where ξ = x in the lowest layer
/// and φ = ξ. Tests: `two_layers_by_hand`, `the_pull_back_is_the_exact_transpose`.
#[derive(Clone, Debug)]
pub struct OverhangFilter {
    /// From the lowest layer to the highest of each box.
    order: Vec<Supported>,
    held: Vec<bool>,
    /// ξ_max.
    largest: f64,
}

impl OverhangFilter {
    /// `held`: for every element of the mesh, whether it keeps its density. The boxes share no
    /// elements.
    ///
    /// # Panics
    ///
    /// If a box has elements that the mesh does not have.
    pub fn new(boxes: &[PrintedBox], held: Vec<bool>) -> Self {
        let order: Vec<Supported> = boxes.iter().flat_map(PrintedBox::supported).collect();
        assert!(order.iter().all(|at| (at.element as usize) < held.len()), "the boxes are part of the mesh");
        // a contraction by a factor of about 0.01
        let largest = (0..20).fold(1.0, |largest, _| smooth_min(1.0, smooth_max(&[largest; SUPPORTS]).0).0);
        Self { order, held, largest }
    }

    /// ξ of every element of the boxes, x of the others.
    fn printed(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.held.len(), "one density per element");
        let mut printed = x.to_vec();
        for at in self.free() {
            let element = at.element as usize;
            printed[element] = smooth_min(x[element], self.support(at, &printed).0).0;
        }
        printed
    }

    fn free(&self) -> impl DoubleEndedIterator<Item = &Supported> {
        self.order.iter().filter(|at| !self.held[at.element as usize])
    }

    /// Ξ, and its derivatives with respect to the ξ of the supports.
    fn support(&self, at: &Supported, printed: &[f64]) -> (f64, [f64; SUPPORTS]) {
        match at.below {
            Some(below) => smooth_max(&below.map(|element| element.map_or(0.0, |element| printed[element as usize]))),
            None => smooth_max(&[self.largest; SUPPORTS]),
        }
    }
}

/// Ξ = (Σ ξ^P)^(1/Q), and its derivatives. ξ ≥ 0.
fn smooth_max(xi: &[f64; SUPPORTS]) -> (f64, [f64; SUPPORTS]) {
    let largest = xi.iter().fold(0.0_f64, |largest, xi| largest.max(*xi));
    if largest <= 0.0 {
        return (0.0, [0.0; SUPPORTS]);
    }
    let root = EXPONENT + (SUPPORTS as f64).ln() / EXACT.ln();
    // relative to the largest, so that powers of small densities do not underflow
    let ratios = xi.map(|xi| xi / largest);
    let sum: f64 = ratios.iter().map(|ratio| ratio.powf(EXPONENT)).sum();
    let max = largest.powf(EXPONENT / root) * sum.powf(1.0 / root);
    let factor = EXPONENT / root * max / (largest * sum);
    (max, ratios.map(|ratio| factor * ratio.powf(EXPONENT - 1.0)))
}

/// ½ (x + Ξ − ((x − Ξ)² + ε)^½ + ε^½), and its derivatives with respect to x and Ξ.
fn smooth_min(x: f64, support: f64) -> (f64, [f64; 2]) {
    let apart = x - support;
    let root = (apart * apart + ROUNDING).sqrt();
    let min = 0.5 * (x + support - root + ROUNDING.sqrt());
    (min, [0.5 * (1.0 - apart / root), 0.5 * (1.0 + apart / root)])
}

impl DesignMap for OverhangFilter {
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut densities = self.printed(x);
        self.free().for_each(|at| densities[at.element as usize] /= self.largest);
        densities
    }

    fn pull_back(&self, x: &[f64], d_phi: &[f64]) -> Vec<f64> {
        assert_eq!(d_phi.len(), self.held.len(), "one derivative per element");
        let printed = self.printed(x);
        let mut gradient = d_phi.to_vec();
        self.free().for_each(|at| gradient[at.element as usize] /= self.largest);
        for at in self.free().rev() {
            let element = at.element as usize;
            let (support, by_supports) = self.support(at, &printed);
            let [by_x, by_support] = smooth_min(x[element], support).1.map(|slope| slope * gradient[element]);
            gradient[element] = by_x;
            for (below, slope) in at.below.iter().flatten().zip(by_supports) {
                if let Some(below) = below {
                    gradient[*below as usize] += by_support * slope;
                }
            }
        }
        gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::tests::pseudo_random;

    fn printed_box(cells: [usize; 3], axis: usize, downwards: bool) -> PrintedBox {
        PrintedBox { first: 0, cells, axis, downwards, mirrored: [[false; 2]; 3] }
    }

    #[test]
    fn two_layers_by_hand() {
        let filter = OverhangFilter::new(&[printed_box([3, 1, 2], 2, false)], vec![false; 6]);
        let x = [0.3, 0.0, 0.9, 0.8, 0.2, 0.4];
        let root = 40.0 + 5.0_f64.ln() / 0.5_f64.ln();
        let max = |xi: &[f64]| xi.iter().map(|xi| xi.powi(40)).sum::<f64>().powf(1.0 / root);
        let min = |x: f64, s: f64| 0.5 * (x + s - ((x - s).powi(2) + 1e-4).sqrt() + 0.01);
        let mut top = 1.0;
        for _ in 0..50 {
            top = min(1.0, max(&[top; 5]));
        }
        assert!((top - 1.0045).abs() < 1e-4);
        let low = [0.3, 0.0, 0.9].map(|x| min(x, max(&[top; 5])));
        // the first has no left neighbour, and all lack those in front and behind
        let supports = [max(&low[..2]), max(&low), max(&low[1..])];
        let expected = [low[0], low[1], low[2], min(0.8, supports[0]), min(0.2, supports[1]), min(0.4, supports[2])];
        for (found, expected) in filter.apply(&x).iter().zip(expected) {
            assert!((found - expected / top).abs() < 1e-14);
        }
        // 0.8 rests on 0.3, 0.2 beside 0.9
        let found = filter.apply(&x);
        assert!((found[3] - 0.3).abs() < 0.03 && (found[4] - 0.2).abs() < 0.01);
    }

    /// A body of solid elements can be printed; what hangs over by two elements cannot, unless it is
    /// held; what is held supports others; and all densities stay in [0, 1].
    #[test]
    fn overhangs_vanish() {
        let cells = [6, 1, 3];
        let full = OverhangFilter::new(&[printed_box(cells, 2, false)], vec![false; 18]).apply(&[1.0; 18]);
        assert!(full.iter().all(|phi| (0.99..=1.0).contains(phi)), "{full:?}");
        // a column one element wide under a wide top: the elements next to the column are supported
        let mut x = [0.0; 18];
        [0, 6].into_iter().for_each(|e| x[e] = 1.0);
        x[12..18].fill(1.0);
        let one = printed_box(cells, 2, false);
        let phi = OverhangFilter::new(&[one], vec![false; 18]).apply(&x);
        assert!(phi[12..14].iter().all(|phi| *phi > 0.99) && phi[14..].iter().all(|phi| *phi < 0.02), "{phi:?}");
        let mut held = vec![false; 18];
        held[9] = true;
        x[9] = 1.0;
        let phi = OverhangFilter::new(&[one], held).apply(&x);
        assert!(phi[9] == 1.0 && phi[12..17].iter().all(|phi| *phi > 0.99) && phi[17] < 0.02, "{phi:?}");
        // printed downwards, the top lies on the plate
        let mut turned = x;
        turned[9] = 0.0;
        let phi = OverhangFilter::new(&[printed_box(cells, 2, true)], vec![false; 18]).apply(&turned);
        assert!(phi[12..].iter().all(|phi| *phi > 0.99));
        // noise does not leave the bounds
        let noise = pseudo_random(18, 3);
        let filter = OverhangFilter::new(&[one], vec![false; 18]);
        assert!(filter.apply(&noise).iter().chain(&filter.apply(&[0.0; 18])).all(|phi| (0.0..=1.0).contains(phi)));
    }

    /// Half of a symmetric body behaves as the whole.
    #[test]
    fn symmetry_planes_mirror_the_supports() {
        let half: Vec<f64> = pseudo_random(3 * 4, 4).to_vec();
        // layers of 3 in the half, of 6 in the whole, along y; the plane is at the lower end of x
        let whole: Vec<f64> =
            half.chunks(3).flat_map(|row| row.iter().rev().chain(row).copied().collect::<Vec<f64>>()).collect();
        let mut part = printed_box([3, 4, 1], 1, false);
        part.mirrored[0][0] = true;
        let part = OverhangFilter::new(&[part], vec![false; 12]).apply(&half);
        let all = OverhangFilter::new(&[printed_box([6, 4, 1], 1, false)], vec![false; 24]).apply(&whole);
        for (row, (part, all)) in part.chunks(3).zip(all.chunks(6)).enumerate() {
            assert!(part.iter().zip(&all[3..]).all(|(a, b)| (a - b).abs() < 1e-14), "{row}");
        }
    }

    /// Two boxes, held elements, and one outside the boxes; central differences of order 4.
    #[test]
    fn the_pull_back_is_the_exact_transpose() {
        for (axis, downwards) in [(0, false), (1, true), (2, false)] {
            let second = PrintedBox { first: 24, cells: [2, 2, 2], ..printed_box([0; 3], axis, !downwards) };
            let first = PrintedBox { mirrored: [[true, false]; 3], ..printed_box([2, 3, 4], axis, downwards) };
            let held = (0..33).map(|e| e == 5 || e == 26).collect();
            let filter = OverhangFilter::new(&[first, second], held);
            let (x, d) = (pseudo_random(33, 5), pseudo_random(33, 6));
            let value = |x: &[f64]| filter.apply(x).iter().zip(d.iter()).map(|(phi, d)| phi * d).sum::<f64>();
            let gradient = filter.pull_back(&x, &d);
            for entry in 0..33 {
                let step = 2e-5;
                let at = |steps: f64| {
                    let mut moved = x.to_vec();
                    moved[entry] += steps * step;
                    value(&moved)
                };
                let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
                let error = (difference - gradient[entry]).abs();
                assert!(error < 1e-9 * gradient[entry].abs().max(1.0), "axis {axis}, entry {entry}: {error:e}");
            }
            assert_eq!(gradient[32], d[32]);
        }
    }
}
