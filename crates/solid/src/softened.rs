//! Elements whose bulk modulus falls faster with the density than their shear modulus.
//!
//! Nearly incompressible material keeps its volume even where it is light: at ν = 0.49, an element of density 0.2
//! has, with p = 3, only 1 % of the shear stiffness, but as much stiffness against a change of volume as half of the
//! solid's shear modulus. Enclosed, such elements and voids resist like a liquid. With a Poisson's ratio ν₀ of the
//! void, an element with stiffness factor s has the energy
//!
//! ```text
//! W = s [ r Ψ + (1 − r) Ψ₀ ],      r = φ^q
//! ```
//!
//! where Ψ₀ is the same law with the same shear modulus and ν₀. For laws that are linear in the bulk modulus, the
//! bulk modulus is s (r K + (1 − r) K₀), and the shear modulus s μ. Bulk and shear moduli of their own are
//! interpolated in Sigmund, Clausen, Comput. Methods Appl. Mech. Engrg. 196 (2007) 1874–1889.
//!
//! Both terms are integrated like any element, one after the other, the second one only where 1 − r is not zero.

use crate::block::{ElementBlock, State};
use crate::interpolation::ElementScaling;
use crate::law::{Constant, Form, Hooke, Material, Value};
use crate::section::Section;

/// A term of the energy of all elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Term {
    /// All of it: no element has a second law.
    Whole,
    /// s r Ψ, and s Ψ of elements without a second law.
    Solid,
    /// s (1 − r) Ψ₀.
    Soft,
}

impl Term {
    /// Whether a block has it: elements with memory have no second law.
    pub fn has(self, block: &dyn ElementBlock) -> bool {
        self != Self::Soft || block.memory().is_none()
    }
}

/// The two terms of a state, or one if no element has a second law.
pub(crate) struct Terms<'a> {
    state: State<'a>,
    section_of: &'a [u32],
    /// Of each section, whether it has a second law.
    second: Vec<bool>,
    /// With a second law: the sections with Ψ₀, and the scalings of both terms.
    parts: Option<(Vec<Section>, [Vec<ElementScaling>; 2])>,
}

impl<'a> Terms<'a> {
    /// `section_of` has the section of each element.
    pub fn new(state: State<'a>, section_of: &'a [u32]) -> Self {
        let second: Vec<bool> = state.sections.iter().map(|section| section.softened().is_some()).collect();
        let any = second.contains(&true);
        let mut of = Self { state, section_of, second, parts: None };
        if any {
            let soft = state.sections.iter().map(|section| section.softened().unwrap_or(*section)).collect();
            let scalings = [Term::Solid, Term::Soft].map(|term| of.scalings(term));
            of.parts = Some((soft, scalings));
        }
        of
    }

    /// Each term with its state.
    pub fn each(&self) -> impl Iterator<Item = (Term, State<'_>)> {
        let solid = match &self.parts {
            None => (Term::Whole, self.state),
            Some((_, [solid, _])) => (Term::Solid, State { scalings: solid, ..self.state }),
        };
        let soft = self
            .parts
            .as_ref()
            .map(|(sections, [_, soft])| (Term::Soft, State { sections, scalings: soft, partial: true, ..self.state }));
        std::iter::once(solid).chain(soft)
    }

    /// Derivatives of a term's scalings by the densities from those of the whole.
    pub fn slopes(&self, term: Term, slopes: &[ElementScaling]) -> Vec<ElementScaling> {
        let of = |(e, (scaling, slope)): (usize, (&ElementScaling, &ElementScaling))| {
            let [share, by_ratio] = self.share(term, e, scaling);
            ElementScaling { factor: share * slope.factor + by_ratio * scaling.factor * slope.bulk, ..*slope }
        };
        self.state.scalings.iter().zip(slopes).enumerate().map(of).collect()
    }

    fn scalings(&self, term: Term) -> Vec<ElementScaling> {
        let of = |(e, scaling): (usize, &ElementScaling)| {
            let [share, _] = self.share(term, e, scaling);
            ElementScaling { factor: share * scaling.factor, ..*scaling }
        };
        self.state.scalings.iter().enumerate().map(of).collect()
    }

    /// A term's share of the energy of an element, and its derivative with respect to r.
    fn share(&self, term: Term, element: usize, scaling: &ElementScaling) -> [f64; 2] {
        let ratio = scaling.bulk;
        let second = self.second[self.section_of[element] as usize];
        match term {
            Term::Solid if second => [ratio, 1.0],
            Term::Soft if second => [1.0 - ratio, -1.0],
            Term::Soft => [0.0, 0.0],
            Term::Whole | Term::Solid => [1.0, 0.0],
        }
    }
}

impl Section {
    /// The section with the law Ψ₀; `None` if it has none.
    fn softened(&self) -> Option<Self> {
        let material = self.material.with_poisson_ratio(self.void_poisson_ratio?)?;
        Some(Self { material, ..*self })
    }
}

impl Material {
    /// The law with the same shear modulus and another Poisson's ratio in its small-strain limit. `None` if its
    /// constants do not include either Young's modulus and Poisson's ratio or a bulk modulus, if the stress depends
    /// on the deformations before, or if the ratio is outside (−1, 1/2).
    pub fn with_poisson_ratio(&self, poisson_ratio: f64) -> Option<Self> {
        if self.kind().has_memory() || !(-1.0 < poisson_ratio && poisson_ratio < 0.5) {
            return None;
        }
        let shear = self.youngs_modulus() / (2.0 * (1.0 + self.poisson_ratio()));
        let limit = Hooke::new(2.0 * shear * (1.0 + poisson_ratio), poisson_ratio);
        let mut changed = false;
        let mut value = |(constant, value): (&'static Constant, Value)| match (constant.key, constant.form) {
            ("youngs_modulus", Form::Modulus(_)) => Value::Number(limit.youngs_modulus),
            ("poisson_ratio", Form::Number(_)) => {
                changed = true;
                Value::Number(poisson_ratio)
            }
            ("bulk_modulus", Form::Modulus(_)) => {
                changed = true;
                Value::Number(limit.bulk())
            }
            _ => value,
        };
        let values: Vec<Value> = self.constants().map(&mut value).collect();
        if changed { self.kind().with_values(&values).ok() } else { None }
    }
}
