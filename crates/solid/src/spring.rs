//! Linear springs between two nodes, or from a node to the ground.
//!
//! ```text
//! fixed direction n    W = k/2 (n·w)²            f = k (n·w) n
//! all directions       W = k/2 w·w               f = k w
//! line                 W = k/2 (l − L)²          f = k (l − L) e,   l = ‖r + w‖,   e = (r + w)/l
//! ```
//!
//! with the displacement w of the first end relative to the second, and the vector r, of length L, from
//! the second end to the first in the reference configuration. f is the force of the spring's first end on
//! the residual: the spring pulls its end with −f.

/// The direction in which a spring acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Acts {
    /// Along a unit vector, which does not turn.
    Along([f64; 3]),
    /// Equally in all directions.
    Everywhere,
    /// Along the line between its ends, which it follows, with this vector r between them. \[L\]
    Line([f64; 3]),
}

/// A spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// The node at its first end.
    pub node: u32,
    /// The node at its second end; `None`: the ground.
    pub to: Option<u32>,
    /// k. \[F/L\]
    pub stiffness: f64,
    /// The direction in which it acts.
    pub acts: Acts,
}

/// Below this fraction of its length, a spring along a line has no direction.
const SHORT: f64 = 1e-12;

impl Spring {
    /// Both ends, each with the sign of its displacement in w.
    fn ends(&self) -> impl Iterator<Item = (u32, f64)> {
        [(self.node, 1.0)].into_iter().chain(self.to.map(|to| (to, -1.0)))
    }

    /// w of displacements `d`, three per node. \[L\]
    fn relative(&self, d: &[f64]) -> [f64; 3] {
        std::array::from_fn(|c| self.ends().map(|(node, sign)| sign * d[3 * node as usize + c]).sum())
    }

    /// The current length of a spring along a line, and its direction; it has none if its ends meet.
    fn line(r: [f64; 3], w: [f64; 3]) -> (f64, [f64; 3]) {
        let at: [f64; 3] = std::array::from_fn(|c| r[c] + w[c]);
        let length = norm(at);
        let direction = if length > SHORT * norm(r) { at.map(|x| x / length) } else { [0.0; 3] };
        (length, direction)
    }

    /// Strain energy at displacements `d`. \[F L\]
    pub fn energy(&self, d: &[f64]) -> f64 {
        let w = self.relative(d);
        let squares = match self.acts {
            Acts::Along(n) => dot(n, w).powi(2),
            Acts::Everywhere => dot(w, w),
            Acts::Line(r) => (Self::line(r, w).0 - norm(r)).powi(2),
        };
        0.5 * self.stiffness * squares
    }

    /// f at displacements `d`. \[F\]
    pub fn force(&self, d: &[f64]) -> [f64; 3] {
        let w = self.relative(d);
        match self.acts {
            Acts::Along(n) => n.map(|n_c| self.stiffness * dot(n, w) * n_c),
            Acts::Everywhere => w.map(|w| self.stiffness * w),
            Acts::Line(r) => {
                let (length, e) = Self::line(r, w);
                e.map(|e| self.stiffness * (length - norm(r)) * e)
            }
        }
    }

    /// ∂f/∂w, which is symmetric, row by row. \[F/L\]
    pub fn slope(&self, d: &[f64]) -> [f64; 9] {
        let unit = |at: usize| f64::from(u8::from(at / 3 == at % 3));
        std::array::from_fn(|at| {
            let (a, b) = (at / 3, at % 3);
            self.stiffness
                * match self.acts {
                    Acts::Along(n) => n[a] * n[b],
                    Acts::Everywhere => unit(at),
                    Acts::Line(r) => {
                        let (length, e) = Self::line(r, self.relative(d));
                        let across = if e == [0.0; 3] { 0.0 } else { 1.0 - norm(r) / length };
                        e[a] * e[b] + across * (unit(at) - e[a] * e[b])
                    }
                }
        })
    }

    /// The directions in which it restrains w at displacements `d`: unit vectors.
    pub fn restrained(&self, d: &[f64]) -> Vec<[f64; 3]> {
        match self.acts {
            Acts::Along(n) => vec![n],
            Acts::Everywhere => vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Acts::Line(r) => vec![Self::line(r, self.relative(d)).1],
        }
    }

    /// n·w of a vector of displacements, or of their rates.
    pub fn along(&self, n: [f64; 3], d: &[f64]) -> f64 {
        dot(n, self.relative(d))
    }

    /// Adds its force at displacements `d` to the residual. \[F\]
    pub fn add_force(&self, d: &[f64], out: &mut [f64]) {
        self.add(self.force(d), out);
    }

    /// Adds ∂wᵀ/∂d times a vector.
    pub fn add(&self, by_relative: [f64; 3], out: &mut [f64]) {
        for (node, sign) in self.ends() {
            (0..3).for_each(|c| out[3 * node as usize + c] += sign * by_relative[c]);
        }
    }

    /// Adds K v with K = ∂f/∂d, which is symmetric.
    pub fn add_tangent_product(&self, d: &[f64], v: &[f64], out: &mut [f64]) {
        let (slope, w) = (self.slope(d), self.relative(v));
        self.add(std::array::from_fn(|a| (0..3).map(|b| slope[3 * a + b] * w[b]).sum()), out);
    }

    /// Calls `add` with row, column and block of its tangent.
    pub fn tangent(&self, d: &[f64], mut add: impl FnMut(u32, u32, &[f64; 9])) {
        let slope = self.slope(d);
        for (row, first) in self.ends() {
            for (column, second) in self.ends() {
                add(row, column, &slope.map(|entry| first * second * entry));
            }
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn norm(a: [f64; 3]) -> f64 {
    a[0].hypot(a[1]).hypot(a[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: [f64; 6] = [0.3, -0.2, 0.5, 0.1, 0.4, -0.6];

    fn springs() -> Vec<Spring> {
        let acts = [Acts::Along([0.6, 0.0, -0.8]), Acts::Everywhere, Acts::Line([1.0, -0.5, 0.2])];
        let both = |acts| [None, Some(1)].map(|to| Spring { node: 0, to, stiffness: 7.0, acts });
        acts.into_iter().flat_map(both).collect()
    }

    /// Forces are the derivatives of the energy, and the tangent those of the forces: central differences.
    #[test]
    fn forces_and_tangent_match_finite_differences() {
        let h = 1e-6;
        for spring in springs() {
            let moved = |i: usize, by: f64| {
                let mut d = D;
                d[i] += by;
                d
            };
            let force = |d: &[f64]| {
                let mut force = [0.0; 6];
                spring.add_force(d, &mut force);
                force
            };
            let mut tangent = [[0.0; 6]; 6];
            spring.tangent(&D, |row, column, block| {
                (0..9).for_each(|at| tangent[3 * row as usize + at / 3][3 * column as usize + at % 3] += block[at]);
            });
            for i in 0..6 {
                let energy = (spring.energy(&moved(i, h)) - spring.energy(&moved(i, -h))) / (2.0 * h);
                assert!((energy - force(&D)[i]).abs() < 1e-8, "{spring:?}: {energy} {}", force(&D)[i]);
                let (up, down) = (force(&moved(i, h)), force(&moved(i, -h)));
                let mut unit = [0.0; 6];
                unit[i] = 1.0;
                let mut product = [0.0; 6];
                spring.add_tangent_product(&D, &unit, &mut product);
                for row in 0..6 {
                    let slope = (up[row] - down[row]) / (2.0 * h);
                    assert!((slope - tangent[row][i]).abs() < 1e-8, "{spring:?}");
                    assert!((product[row] - tangent[row][i]).abs() < 1e-14, "{spring:?}");
                }
            }
        }
    }

    /// A spring of length 3 is turned by 90° and stretched to 5: force 2 k along its new direction.
    #[test]
    fn a_line_turns_with_its_ends() {
        let spring = Spring { node: 0, to: Some(1), stiffness: 7.0, acts: Acts::Line([3.0, 0.0, 0.0]) };
        let d = [-3.0, 5.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!((spring.force(&d), spring.energy(&d)), ([0.0, 14.0, 0.0], 14.0));
        let mut residual = [0.0; 6];
        spring.add_force(&d, &mut residual);
        assert_eq!(residual, [0.0, 14.0, 0.0, 0.0, -14.0, 0.0]);
    }
}
