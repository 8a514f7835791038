//! The data of a state that a quantity can read, and its derivatives with respect to them.

use super::ElementData;
use slipstick_status::ContactStatus;

/// A state of the load path.
#[derive(Clone, Copy, Debug, Default)]
pub struct StateView<'a> {
    /// Load step of the load case that ends at this state or, for an
    /// [increment](super::Quantity::accumulates), contains it; from 1.
    pub step: usize,
    /// Number of load steps of the load case.
    pub steps: usize,
    /// Pseudo-time of the state.
    pub time: f64,
    /// Nodal displacements `d`, entry `3·node + component`. \[L\]
    pub displacement: &'a [f64],
    /// Nodal internal forces `f_int(d, φ)`, entry `3·node + component`. \[F\]
    pub internal_force: &'a [f64],
    /// Nodal forces of the loads `f_ext(d, t)`, entry `3·node + component`. \[F\]
    pub external_force: &'a [f64],
    /// Forces that supports and prescribed motions exert on the bodies, entry `3·node + component`;
    /// zero where nothing is prescribed. Empty unless the quantity [reads](super::Reads) it. \[F\]
    pub reaction: &'a [f64],
    /// Slave nodes of all contact pairs. Empty unless the quantity [reads](super::Reads) it.
    pub contact: &'a [ContactNode],
    /// Density of every element.
    pub density: &'a [f64],
    /// Data of the elements, with [`ElementList::width`](super::ElementList::width) entries each. Empty unless
    /// the quantity [reads](super::Reads) them.
    pub elements: ElementData<&'a [f64]>,
    /// The state before, at the start of the (sub-)step. Empty unless the quantity
    /// [reads](super::Reads) it.
    pub previous: PreviousView<'a>,
}

/// The state at the start of a (sub-)step, as [increments](super::Quantity::accumulates) see it.
/// The fields are those of [`StateView`].
#[derive(Clone, Copy, Debug, Default)]
pub struct PreviousView<'a> {
    /// Nodal displacements. \[L\]
    pub displacement: &'a [f64],
    /// Nodal forces of the loads. \[F\]
    pub external_force: &'a [f64],
    /// Forces of supports and prescribed motions. \[F\]
    pub reaction: &'a [f64],
    /// Multiplier ζ of each slave node, as in [`ContactNode`]; zero at open nodes. Empty unless the quantity
    /// also reads contact. \[F/L²\]
    pub multiplier: &'a [[f64; 3]],
}

/// The contact of a slave node at a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactNode {
    /// Node of the mesh.
    pub node: u32,
    /// Number of the contact pair, from 0.
    pub pair: u32,
    /// Open, stick or slip.
    pub status: ContactStatus,
    /// Multiplier ζ = (normal, ξ, η) in the node's frame; normal ≥ 0 in compression. \[F/L²\]
    pub multiplier: [f64; 3],
    /// The same multiplier as a vector z; −A z is the contact force on the slave. \[F/L²\]
    pub vector: [f64; 3],
    /// Weighted gap g̃, ≥ 0 open. \[L³\]
    pub gap: f64,
    /// Weighted objective slip increment ũ_τ of the last (sub-)step. \[L³\]
    pub slip: [f64; 2],
    /// Tributary area A_j of the part of the surface that faces the master. \[L²\]
    pub area: f64,
    /// Area of the slave surface around the node in the reference configuration. \[L²\]
    pub reference_area: f64,
    /// Whether traction at slip follows the pressure: not under a bound on the shear stress, nor on ties.
    pub follows_pressure: bool,
    /// Coefficient of friction at the start of the (sub-)step over that at its end; 1 without a path of
    /// friction, and where friction has ended.
    pub friction_ratio: f64,
}

impl ContactNode {
    /// Contact pressure ζ_n; 0 at open nodes, where the multiplier is only round-off. \[F/L²\]
    pub fn pressure(&self) -> f64 {
        self.transmitted()[0]
    }

    /// Multiplier ζ; zero at open nodes, where it is only round-off. \[F/L²\]
    pub fn transmitted(&self) -> [f64; 3] {
        if self.status.is_closed() { self.multiplier } else { [0.0; 3] }
    }
}

/// Derivatives with respect to the fields of a [`ContactNode`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactDerivative {
    /// With respect to ζ.
    pub multiplier: [f64; 3],
    /// With respect to z.
    pub vector: [f64; 3],
    /// With respect to g̃.
    pub gap: f64,
    /// With respect to ũ_τ.
    pub slip: [f64; 2],
    /// With respect to A_j.
    pub area: f64,
}

impl ContactDerivative {
    /// Whether all entries vanish.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

/// Partial derivatives with respect to the fields of a [`StateView`], each at fixed values of the
/// others; quantities add to the existing values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateDerivative {
    /// With respect to the displacements.
    pub displacement: Vec<f64>,
    /// With respect to the internal forces.
    pub internal_force: Vec<f64>,
    /// With respect to the forces of the loads.
    pub external_force: Vec<f64>,
    /// With respect to the reactions; empty if the view has none.
    pub reaction: Vec<f64>,
    /// With respect to the data of the slave nodes; empty if the view has none.
    pub contact: Vec<ContactDerivative>,
    /// With respect to the densities of the elements.
    pub density: Vec<f64>,
    /// With respect to the data of the elements; empty if the view has none.
    pub elements: ElementData<Vec<f64>>,
    /// By the state before; empty if the view has none.
    pub previous: PreviousDerivative,
}

/// Partial derivatives with respect to the fields of a [`PreviousView`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PreviousDerivative {
    /// By the displacements.
    pub displacement: Vec<f64>,
    /// By the forces of the loads.
    pub external_force: Vec<f64>,
    /// By the reactions.
    pub reaction: Vec<f64>,
    /// By the multipliers of the slave nodes.
    pub multiplier: Vec<[f64; 3]>,
}

impl StateDerivative {
    /// Zero derivatives for a view.
    pub fn zero(view: &StateView) -> Self {
        Self {
            displacement: vec![0.0; view.displacement.len()],
            internal_force: vec![0.0; view.internal_force.len()],
            external_force: vec![0.0; view.external_force.len()],
            reaction: vec![0.0; view.reaction.len()],
            contact: vec![ContactDerivative::default(); view.contact.len()],
            density: vec![0.0; view.density.len()],
            elements: view.elements.map(|values| vec![0.0; values.len()]),
            previous: PreviousDerivative {
                displacement: vec![0.0; view.previous.displacement.len()],
                external_force: vec![0.0; view.previous.external_force.len()],
                reaction: vec![0.0; view.previous.reaction.len()],
                multiplier: vec![[0.0; 3]; view.previous.multiplier.len()],
            },
        }
    }

    /// Adds what the next state's increment depends on here, where the slave nodes are `contact`.
    pub fn add_later(&mut self, later: &PreviousDerivative, contact: &[ContactNode]) {
        add(&mut self.displacement, &later.displacement);
        add(&mut self.external_force, &later.external_force);
        add(&mut self.reaction, &later.reaction);
        let nodes = self.contact.iter_mut().zip(contact).zip(&later.multiplier);
        for ((to, _), from) in nodes.filter(|((_, at), _)| at.status.is_closed()) {
            to.multiplier.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        }
    }
}

/// Adds to a list that is empty if nothing else was added.
fn add(to: &mut Vec<f64>, from: &[f64]) {
    to.resize(to.len().max(from.len()), 0.0);
    to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
}
