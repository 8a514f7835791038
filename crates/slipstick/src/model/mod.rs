//! The discrete contact problem of one load step: solids, interfaces, enforcement, prescribed motion, loads.
//!
//! [`ContactModel`] puts the crates together: it implements [`StepProblem`](slipstick_path::StepProblem), which the march and the adjoint sweep work
//! on. Unknowns are the displacements d of all nodes and, for the Lagrange and augmented Lagrangian methods, the
//! multiplier components ζ_j in the frame of each slave node. Each interface has a method of its own.
//!
//! | method | y | h | F |
//! |---|---|---|---|
//! | Lagrange | d, ζ | – | R = f_int + f_co, C |
//! | penalty | d | ζ_τ | R |
//! | augmented | d, ζ | – | as Lagrange at convergence; solved by Uzawa around R(d; ẑ) |

pub mod course;
mod enforcement;
mod forces;
mod law;
mod loads;
pub mod node;
mod parameters;
mod partition;
mod parts;
pub mod pattern;
mod place;
pub mod prescribed;
mod results;
mod share;
mod step;

use enforcement::FixedUnknowns;
pub use enforcement::{DEFAULT_COMPLEMENTARITY, DEFAULT_STIFFNESS, Enforcement, GivenStiffness, Method, Uzawa};
pub use loads::Loads;
use nalgebra::Vector3;
use node::{NodeSettings, NodeStep};
pub use parameters::Parameter;
use pattern::ContactPattern;
pub use place::{PairState, Unknown};
use prescribed::Prescribed;
pub use results::{ContactResults, NodalContact};
pub use share::Share;
use slipstick_contact::enforcement::{NodeMeasures, Stiffness};
use slipstick_contact::kinematics::{NodeKinematics, PreviousRow};
use slipstick_contact::{ContactInterface, InterfaceError};
use slipstick_linalg::BlockMatrix;
use slipstick_mesh::Mesh;
use slipstick_path::{Held, StateError, StepState, Timings};
use slipstick_solid::{ElementScaling, Interpolation, InvertedElements, SolidModel, model::Scatter};
use std::ops::Range;

/// An interface with what the model adds to its geometry.
#[derive(Debug, Clone)]
pub struct ModelInterface {
    /// Names of the slave and the master surface.
    pub surfaces: [String; 2],
    /// Geometry.
    pub interface: ContactInterface,
    /// Coefficient of friction μ.
    pub friction: f64,
    /// Part of the area around a slave node below which its contact condition is compliant,
    /// [`NodeMeasures::compliance`].
    pub edge_cover: f64,
    /// How contact and friction are enforced.
    pub enforcement: Enforcement,
}

/// Constant data of a slave node.
#[derive(Debug, Clone, Copy)]
struct SlaveData {
    interface: u32,
    /// Reference area of the slave surface around the node. \[L²\]
    area: f64,
    /// Facet size around the node. \[L\]
    size: f64,
    /// How many times the area counts with its mirror images.
    images: f64,
}

/// The discrete problem of a load step; see the module's description.
pub struct ContactModel {
    /// The part of this rank, and which slave nodes are in it.
    share: Share,
    own: Vec<bool>,
    solid: SolidModel,
    interpolation: Interpolation,
    /// Design density of every element; elements outside of the design have density 1.
    density: Vec<f64>,
    designed: Vec<bool>,
    /// What the density makes of every element, and the derivative: zero outside of the design.
    scalings: Vec<ElementScaling>,
    scaling_slopes: Vec<ElementScaling>,
    coordinates: Vec<f64>,
    /// Elements of each body.
    bodies: Vec<Range<usize>>,
    interfaces: Vec<ModelInterface>,
    /// Uzawa's iteration, where a pair has the augmented Lagrangian.
    uzawa: Option<Uzawa>,
    prescribed: Prescribed,
    loads: Loads,
    /// Pseudo-time at the end of the step.
    time: f64,
    slaves: Vec<SlaveData>,
    /// Elements at each slave node's facets, and at each interface's master facets: for E_eff.
    slave_elements: Vec<Vec<u32>>,
    master_elements: Vec<Vec<u32>>,
    /// The bodies' own stiffness at each slave node: E_eff/h. \[F/L³\]
    hardness: Vec<f64>,
    /// The same at the start design.
    start_hardness: Vec<f64>,
    /// ∂ln/∂ln E of that for each body: one list per slave node.
    start_shares: Vec<Vec<f64>>,
    /// ε or c of each slave node.
    stiffness: Vec<Stiffness>,
    /// Constants of the law of each slave node; they belong to the model, so they do not follow the design.
    settings: Vec<NodeSettings>,
    variation: f64,
    /// While a step is rescued, ε and c of the Lagrange method over the bodies' own stiffness.
    rescue: Option<f64>,
    /// Whether nodes that slid before start a step as sliding on (1) or sticking (−1).
    onward: f64,
    /// Unknowns that are not solved for, by which multipliers are held.
    fixed: FixedUnknowns,
    groups: Vec<u32>,
    held: Held,
    /// Evaluate what the tangent needs along with the residual.
    foresee: bool,
    pattern: ContactPattern,
    scatter: Option<Scatter>,
    matrix: Option<BlockMatrix>,
    // previous state
    previous_rows: Vec<PreviousRow>,
    previous_kinematics: Vec<NodeKinematics>,
    /// Displacements that these are of, and whether gradients came with them.
    previous_at: Option<(Vec<f64>, bool)>,
    previous_history: Vec<f64>,
    // current evaluation
    evaluated: Option<(Vec<f64>, bool)>,
    /// Displacements at which the step started, whether its iteration has still to begin, and whether the current
    /// evaluation is there.
    start: Option<Vec<f64>>,
    at_start: bool,
    starting: bool,
    kinematics: Vec<NodeKinematics>,
    kinematics_at: Option<(Vec<f64>, bool)>,
    steps: Vec<NodeStep>,
    status: Vec<u8>,
    internal: Vec<f64>,
    /// Norm of all multipliers at the last residual.
    traction_norm: f64,
    floors: Floors,
    timings: Timings,
}

/// Lower bounds of the scales, from the problem's own data, so that a start at rest has scales too.
#[derive(Debug, Clone, Copy)]
struct Floors {
    force: f64,
    displacement: f64,
    multiplier: f64,
}

/// Part of the stiffer side that the bodies' own stiffness at an interface is at least.
const LEAST_SHARE: f64 = 1e-6;

/// Smallest part of a characteristic size that a relative tolerance is measured against.
const FLOOR: f64 = 1e-6;

impl ContactModel {
    /// Puts a model together.
    ///
    /// Of `solid`, and of the interfaces, the model takes the elements and slave nodes of `share`. `start` is the density of every element at the start design; it sizes the penalty method's default stiffness.
    /// `largest_motion` is the largest prescribed displacement on the path; with the loads, it sizes the tolerances of a start
    /// at rest.
    pub fn new(
        mesh: &Mesh,
        share: Share,
        solid: SolidModel,
        mut interfaces: Vec<ModelInterface>,
        uzawa: Option<Uzawa>,
        prescribed: Prescribed,
        loads: Loads,
        interpolation: Interpolation,
        designed: Vec<bool>,
        start: &[f64],
        largest_motion: f64,
    ) -> Self {
        let coordinates: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
        let nodes = mesh.nodes.len();
        let (slaves, slave_elements, master_elements) = slave_data(mesh, &interfaces);
        // a pair without multipliers has rows all the same where another pair has them, with nothing to solve for
        let multipliers =
            if interfaces.iter().any(|i| i.enforcement.method.has_multipliers()) { slaves.len() } else { 0 };
        let mut groups: Vec<u32> = (0..nodes as u32).collect();
        let mut fixed = FixedUnknowns::new(prescribed.fixed());
        if multipliers > 0 {
            groups.extend(interfaces.iter().flat_map(|i| i.interface.slave_nodes()).map(|s| s.node));
            for model in &interfaces {
                let method = model.enforcement.method;
                for slave in model.interface.slave_nodes() {
                    // no traction acts across a symmetry plane
                    let planes = slave.mirrored.iter().filter(|&&across| across).count();
                    let none = !method.has_multipliers();
                    fixed.add_multiplier([none, none || planes > 0, none || planes > 1], method);
                }
            }
        }
        let masters = interfaces.iter().flat_map(|i| i.interface.master_facets());
        let bulk = if share.is_part() {
            loads.couple(mesh.node_neighbours_in(|e| share.has_element(e)), &share)
        } else {
            mesh.node_neighbours()
        };
        let own: Vec<bool> =
            interfaces.iter().flat_map(|i| i.interface.slave_nodes()).map(|s| share.has_node(s.node)).collect();
        let pattern = ContactPattern::new(bulk, masters, own.clone(), multipliers > 0);
        if share.is_part() {
            interfaces.iter_mut().for_each(|i| i.interface.evaluate_only(|node| share.has_node(node)));
        }
        let modulus = (0..solid.elements()).map(|e| solid.material(e).youngs_modulus()).fold(0.0, f64::max);
        let volume: f64 = mesh.element_volumes().iter().sum();
        let size = (volume / mesh.elements.len() as f64).cbrt();
        // what a load would press an element by
        let driven = largest_motion.max(loads.largest(&coordinates) / (modulus * size));
        let motion = if driven > 0.0 { driven } else { size };
        let floors = Floors {
            force: FLOOR * modulus * size * motion,
            displacement: FLOOR * motion,
            multiplier: FLOOR * modulus * motion / size,
        };
        let elements = solid.elements();
        let count = slaves.len();
        let mut model = Self {
            share,
            own,
            solid,
            interpolation,
            density: vec![1.0; elements],
            designed,
            scalings: vec![ElementScaling::SOLID; elements],
            scaling_slopes: vec![ElementScaling { factor: 0.0, gamma: 0.0 }; elements],
            internal: vec![0.0; coordinates.len()],
            coordinates,
            bodies: mesh.bodies.iter().map(|body| body.elements.clone()).collect(),
            interfaces,
            uzawa,
            prescribed,
            loads,
            time: 0.0,
            slaves,
            slave_elements,
            master_elements,
            hardness: vec![1.0; count],
            start_hardness: Vec::new(),
            start_shares: Vec::new(),
            stiffness: Vec::new(),
            settings: Vec::new(),
            variation: 1.0,
            rescue: None,
            onward: 1.0,
            fixed,
            groups,
            held: Held::None,
            foresee: false,
            pattern,
            scatter: None,
            matrix: None,
            previous_rows: vec![PreviousRow::default(); count],
            previous_kinematics: Vec::new(),
            previous_at: None,
            previous_history: Vec::new(),
            evaluated: None,
            start: None,
            at_start: false,
            starting: false,
            kinematics: Vec::new(),
            kinematics_at: None,
            steps: vec![NodeStep::default(); count],
            status: vec![0; count],
            traction_norm: 0.0,
            floors,
            timings: Timings::default(),
        };
        model.set_density(start);
        model.start_hardness.clone_from(&model.hardness);
        model.start_shares = model.hardness_shares();
        model.stiffness = model.node_stiffness();
        let settings = |j: usize| {
            let SlaveData { area: reference_area, interface, size, .. } = model.slaves[j];
            let multipliers = model.method_of(j).has_multipliers();
            let edge_stiffness = if multipliers { DEFAULT_STIFFNESS * model.hardness[j] } else { f64::INFINITY };
            let edge_cover = model.interfaces[interface as usize].edge_cover;
            NodeSettings { reference_area, size, edge_stiffness, edge_cover, multipliers }
        };
        model.settings = (0..count).map(settings).collect();
        model
    }

    /// Sets the density of every element (1 outside of the design). Values are taken as they are; the caller keeps them
    /// in [0, 1].
    pub fn set_density(&mut self, density: &[f64]) {
        self.density.copy_from_slice(density);
        for e in (0..density.len()).filter(|&e| self.designed[e]) {
            self.scalings[e] = self.interpolation.scaling(density[e]);
            self.scaling_slopes[e] = self.interpolation.derivative(density[e]);
        }
        let stiffness = |elements: &[u32]| {
            let sum: f64 = elements
                .iter()
                .map(|&e| self.scalings[e as usize].factor * self.solid.material(e as usize).youngs_modulus())
                .sum();
            sum / elements.len() as f64
        };
        let master: Vec<f64> = self.master_elements.iter().map(|m| stiffness(m)).collect();
        self.hardness = (0..self.slaves.len())
            .map(|j| {
                let (s, m) = (stiffness(&self.slave_elements[j]), master[self.slaves[j].interface as usize]);
                // the two sides give way one after the other; φ_min = 0 and φ = 0 would leave nothing
                (s * m / (s + m)).max(LEAST_SHARE * s.max(m)) / self.slaves[j].size
            })
            .collect();
        // while the model is put together, there is no start design yet
        if !self.start_hardness.is_empty() {
            self.stiffness = self.node_stiffness();
        }
        self.evaluated = None;
        self.pattern.reset();
        self.matrix = None;
        self.scatter = None;
    }

    /// The density of every element.
    pub fn density(&self) -> &[f64] {
        &self.density
    }

    /// What the density makes of every element.
    pub fn scalings(&self) -> &[ElementScaling] {
        &self.scalings
    }

    /// Derivatives of [`scalings`](Self::scalings) with respect to the element's density: zero outside of the design.
    pub fn scaling_slopes(&self) -> &[ElementScaling] {
        &self.scaling_slopes
    }

    /// The solid bodies.
    pub fn solid(&self) -> &SolidModel {
        &self.solid
    }

    /// Smallest J of each element at displacements `d`, whatever its scaling, of the whole mesh.
    pub fn smallest_determinants(&self, mesh: &Mesh, d: &[f64]) -> Vec<f64> {
        if self.share.is_part() {
            let whole = SolidModel::new(mesh, self.solid.sections().to_vec());
            return whole.map_or_else(|_| Vec::new(), |whole| whole.smallest_determinants(d));
        }
        self.solid.smallest_determinants(d)
    }

    /// Volume of the smallest element. \[L³\]
    pub fn smallest_element(&self) -> f64 {
        // those of other ranks are 0 here
        let volumes = self.solid.element_volumes().into_iter().filter(|volume| *volume > 0.0);
        -self.share.largest(-volumes.fold(f64::INFINITY, f64::min))
    }

    /// The part of this rank.
    pub fn share(&self) -> &Share {
        &self.share
    }

    /// The interfaces.
    pub fn interfaces(&self) -> &[ModelInterface] {
        &self.interfaces
    }

    /// Sets the coefficient of friction of all interfaces.
    pub fn set_friction(&mut self, friction: f64) {
        self.interfaces.iter_mut().for_each(|i| i.friction = friction);
    }

    /// Time spent on solids and contact, if it is measured.
    pub fn timings(&self) -> Timings {
        self.timings
    }

    /// Measures time from now on, or no more, from zero.
    pub fn set_timings(&mut self, timings: Timings) {
        self.timings = timings;
    }

    /// Prescribed motion.
    pub fn prescribed(&self) -> &Prescribed {
        &self.prescribed
    }

    /// Whether loads act on the bodies, besides prescribed motions.
    pub fn has_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// Numbers of the loads that act on prescribed displacements only, and so do nothing.
    pub fn idle_loads(&self) -> Vec<usize> {
        self.loads.idle(self.prescribed.fixed(), &self.coordinates)
    }

    /// Global numbers of all slave nodes, interface after interface: the order of nodal contact results. A node on a sharp
    /// edge is repeated for each of the patches that meet there.
    pub fn slave_nodes(&self) -> Vec<u32> {
        self.interfaces.iter().flat_map(|i| i.interface.slave_nodes()).map(|s| s.node).collect()
    }

    /// The state at rest: no displacement, no multiplier, no history.
    pub fn rest(&self) -> StepState {
        StepState { unknowns: vec![0.0; 3 * self.block_rows()], history: vec![0.0; self.tangential_history()] }
    }

    /// Number of block rows: nodes, then multipliers.
    fn block_rows(&self) -> usize {
        self.pattern.rows()
    }

    fn displacement_count(&self) -> usize {
        self.coordinates.len()
    }

    /// Multiplier components of slave node j in y.
    fn multiplier(&self, y: &[f64], j: usize) -> Vector3<f64> {
        let at = self.displacement_count() + 3 * j;
        Vector3::new(y[at], y[at + 1], y[at + 2])
    }

    /// Measures of slave node j (in the order of [`Self::slave_nodes`]) at the state that was evaluated last.
    pub fn measures(&self, j: usize) -> NodeMeasures {
        self.steps[j].measures(&self.kinematics[j], &self.settings[j])
    }

    /// Current positions x = X + d.
    fn positions(&self, y: &[f64]) -> Vec<f64> {
        self.coordinates.iter().zip(y).map(|(x, d)| x + d).collect()
    }

    /// Mortar rows and frames of all interfaces at positions `x`.
    fn kinematics_of(
        interfaces: &mut [ModelInterface],
        x: &[f64],
        with_gradient: bool,
        out: &mut Vec<NodeKinematics>,
    ) -> Result<(), StateError> {
        let mut part = Vec::new();
        out.clear();
        for interface in interfaces {
            interface.interface.evaluate(x, with_gradient, &mut part).map_err(|e| match e {
                InterfaceError::Folded { node } => StateError::FoldedSurface { node },
                InterfaceError::FoldedFacet { nodes } => StateError::FoldedFacet { nodes: nodes.to_vec() },
                other => unreachable!("interface was built: {other}"),
            })?;
            out.append(&mut part);
        }
        Ok(())
    }
}

impl std::fmt::Debug for ContactModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ContactModel")
            .field("elements", &self.solid.elements())
            .field("slave_nodes", &self.slaves.len())
            .field("interfaces", &self.interfaces.len())
            .finish_non_exhaustive()
    }
}

/// An inverted element is a trial state that is none.
pub(crate) fn inverted(error: InvertedElements) -> StateError {
    StateError::InvertedElements { elements: error.elements }
}

type SlaveTables = (Vec<SlaveData>, Vec<Vec<u32>>, Vec<Vec<u32>>);

/// Reference areas, sizes and adjacent elements of all slave nodes.
fn slave_data(mesh: &Mesh, interfaces: &[ModelInterface]) -> SlaveTables {
    let touching = mesh.node_elements();
    let elements_at = |nodes: &mut dyn Iterator<Item = u32>| {
        let mut all: Vec<u32> = nodes.flat_map(|n| touching.of(n as usize).iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    let (mut slaves, mut slave_elements, mut master_elements) = (Vec::new(), Vec::new(), Vec::new());
    for (i, model) in interfaces.iter().enumerate() {
        let interface = &model.interface;
        let areas: Vec<f64> =
            interface.slave_facets().iter().map(|f| slipstick_mesh::facet_area(&f.corners(&mesh.nodes))).collect();
        for slave in interface.slave_nodes() {
            let around: f64 = slave.facets.iter().map(|&(f, _)| areas[f as usize]).sum();
            let share = |f: u32| areas[f as usize] / interface.slave_facets()[f as usize].len() as f64;
            slaves.push(SlaveData {
                interface: i as u32,
                area: slave.facets.iter().map(|&(f, _)| share(f)).sum(),
                size: (around / slave.facets.len() as f64).sqrt(),
                images: f64::from(1 << slave.mirrored.iter().filter(|&&across| across).count()),
            });
            slave_elements.push(elements_at(&mut std::iter::once(slave.node)));
        }
        master_elements.push(elements_at(&mut interface.master_facets().iter().flatten().copied()));
    }
    (slaves, slave_elements, master_elements)
}
