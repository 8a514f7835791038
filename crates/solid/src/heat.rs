//! Thermal expansion: the bodies' equations in terms of the deformation without it.
//!
//! An element whose temperature changes by ΔT expands freely by the stretch θ = 1 + α ΔT, uniform over
//! the element. The material is elastic, and yields, with respect to the expanded element:
//!
//! ```text
//! F = θ F_e      W = θ³ Ψ(F_e)      f = ∂W/∂u
//! ```
//!
//! per reference volume, so that the Cauchy stress is that of Ψ at F_e, whatever θ. In terms of the
//! displacements v of the expanded element over θ, this is the element without expansion:
//!
//! ```text
//! v = (u − (θ − 1) X)/θ      1 + ∂v/∂X = F/θ = F_e      f = θ² f₀(v)      ∂f/∂u = θ K₀(v)
//! ```
//!
//! For small-strain laws ε_e = ε − α ΔT and v = u − (θ − 1) X, without factors. Test:
//! `expanded_elements_are_those_of_another_size` (tests/suite/heat.rs).

use crate::assembly::local;
use crate::block::State;
use crate::interpolation::ElementScaling;

/// Free expansion of the elements.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Heat<'a> {
    /// Of the nodes in the reference configuration, three each.
    pub coordinates: &'a [f64],
    /// θ of each element, by the mesh's number.
    pub stretches: &'a [f64],
}

/// How an integral over an element depends on θ, apart from v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Power {
    /// θ: derivatives of forces with respect to displacements.
    Tangent = 1,
    /// θ²: forces.
    Force = 2,
    /// θ³: energies.
    Energy = 3,
}

impl<'a> State<'a> {
    /// θ of an element.
    #[inline(always)]
    pub fn stretch(&self, element: usize) -> f64 {
        self.heat.map_or(1.0, |heat| heat.stretches[element])
    }

    /// v at the nodes of an element.
    #[inline(always)]
    pub fn local<const N: usize>(&self, nodes: &[u32; N], element: usize, section: usize) -> [[f64; 3]; N] {
        let mut d = local(nodes, self.d);
        if let Some(heat) = &self.heat {
            let stretch = heat.stretches[element];
            let divisor = if self.small_strains(section) { 1.0 } else { stretch };
            heat.without_expansion(nodes, stretch, divisor, &mut d);
        }
        d
    }

    /// The scaling of an integral over an element.
    #[inline(always)]
    pub fn scaling(&self, element: usize, section: usize, power: Power) -> ElementScaling {
        self.scaled(self.scalings[element], element, section, power)
    }

    /// The same for any scaling, or for its slopes.
    #[inline(always)]
    pub fn scaled(&self, scaling: ElementScaling, element: usize, section: usize, power: Power) -> ElementScaling {
        match self.heat {
            None => scaling,
            Some(_) => ElementScaling { factor: scaling.factor * self.power(element, section, power), ..scaling },
        }
    }

    /// θ to a power, 1 for small-strain laws.
    pub fn power(&self, element: usize, section: usize, power: Power) -> f64 {
        if self.small_strains(section) { 1.0 } else { self.stretch(element).powi(power as i32) }
    }

    /// ∂v/∂u of an element, times the unit tensor.
    pub fn by_displacement(&self, element: usize, section: usize) -> f64 {
        if self.small_strains(section) { 1.0 } else { 1.0 / self.stretch(element) }
    }

    /// ∂v/∂X of an element from ∂u/∂X.
    pub fn without_expansion(&self, h: [[f64; 3]; 3], element: usize, section: usize) -> [[f64; 3]; 3] {
        if self.heat.is_none() {
            return h;
        }
        let (stretch, factor) = (self.stretch(element), self.by_displacement(element, section));
        let entry = |a: usize, b: usize| factor * (h[a][b] - if a == b { stretch - 1.0 } else { 0.0 });
        std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)))
    }

    fn small_strains(&self, section: usize) -> bool {
        self.sections[section].material.small_strains()
    }
}

impl Heat<'_> {
    /// Replaces u by v, with X from the first node.
    pub fn without_expansion(&self, nodes: &[u32], stretch: f64, divisor: f64, d: &mut [[f64; 3]]) {
        let x = |node: u32, c: usize| self.coordinates[3 * node as usize + c];
        let first = d[0];
        for (d, &node) in d.iter_mut().zip(nodes) {
            for c in 0..3 {
                let expanded = (stretch - 1.0) * (x(node, c) - x(nodes[0], c));
                // relative to the first node: a translation causes no round-off
                d[c] = first[c] + (d[c] - first[c] - expanded) / divisor;
            }
        }
    }
}
