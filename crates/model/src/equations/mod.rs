//! The discrete contact problem of one load step: solids, interfaces, enforcement, prescribed
//! motion, loads.
//!
//! Each value is built from the previous one:
//!
//! ```text
//! ContactModel    never changes: mesh, solids, interfaces, supports, loads
//!   └ Design        determined by the density: scalings of elements, stiffness at the contact
//!       └ Step        fixed data of a load step: previous state, pseudo-time
//!           └ Evaluated, with ContactState    at unknowns y: kinematics, measures, each node's law (evaluated once), residual
//! ```
//!
//! [`Design`] implements [`StepProblem`](slipstick_path::StepProblem), on which the march and the
//! adjoint sweep work. Buffers are in a [`Workspace`] that the caller provides. Unknowns are the
//! displacements d of all nodes and, for the Lagrange and augmented Lagrangian methods, the
//! multiplier components ζ_j in the frame of each slave node. Each interface has its own method.
//!
//! | method | y | h | F |
//! |---|---|---|---|
//! | Lagrange | d, ζ | – | R = f_int + f_co, C |
//! | penalty | d | ζ_τ | R |
//! | augmented | d, ζ | – | as Lagrange at convergence; solved by Uzawa around R(d; ẑ) |

mod design;
mod expansion;
mod layout;
pub mod motion;
mod parameters;
mod positions;
mod results;
mod step;
mod terms;
mod variation;

pub use bolts::{Bolt, Bolts, Keeps, PreloadPoint, preload_at};
pub use conditions::{PairState, Unknown};
use dependent::Dependent;
pub use design::Design;
pub use element_fields::{ElementFields, StateResults};
use enforcement::HistoryLayout;
pub use enforcement::{DEFAULT_COMPLEMENTARITY, DEFAULT_STIFFNESS, Enforcement, GivenStiffness, Method, Uzawa};
pub(crate) use evaluated::Known;
pub use evaluated::{ContactState, Kinematics, NodeState, Step, Workspace};
use layout::{conditions, pair, partition, points, share, slaves};
use loads::LoadState;
pub use loads::{Loaded, Loads};
use loose::LooseBodies;
pub use motion::linear;
pub use motion::prescribed;
use motion::{dependent, loose, rigid, rotation};
use nalgebra::Vector3;
pub use pair::{FrictionPoint, ModelInterface, OffsetPoint};
pub use parameters::Parameter;
use pattern::ContactPattern;
use points::ContactPoints;
use prescribed::Prescribed;
use results::element_fields;
pub(crate) use results::point_forces;
pub(crate) use results::stored::ByPoint;
pub use results::{ContactResults, NodalContact};
use rigid::RigidBodies;
pub use share::Share;
use slaves::{ContactElements, SlaveData, StartDesign};
use slipstick_mesh::{ContactMap, Mesh};
pub use slipstick_path::LoadTime;
use slipstick_path::{Held, StateError, StepState, Unknowns};
use slipstick_solid::{Evaluation, Interpolation, InvertedElements, Material, SolidModel};
pub use springs::Springs;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use step::evaluated;
pub use step::pattern;
pub use temperature::Temperatures;
pub use terms::node;
use terms::{bolts, enforcement, law, loads, springs, supports, temperature, viscosity};
pub use variation::Variation;
pub use viscosity::Viscosity;

/// Effect of the density on the elements.
#[derive(Debug, Clone)]
struct Penalization {
    interpolation: Interpolation,
    /// Which elements are designed.
    designed: Vec<bool>,
}

/// The discrete contact problem; see the module's description. It never changes while a path is
/// marched.
#[derive(Clone)]
pub struct ContactModel {
    /// The part of this rank, and the slave nodes in it.
    share: Share,
    own: Vec<bool>,
    solid: Arc<SolidModel>,
    penalization: Penalization,
    coordinates: Vec<f64>,
    /// Displacements at rest, three per node; empty: zero.
    rest: Vec<f64>,
    /// The nodes from this one on belong to no body.
    solid_nodes: usize,
    /// Elements of each body.
    bodies: Vec<Range<usize>>,
    /// Displacements that follow from others: rigid bodies, linear equations.
    dependent: Dependent,
    points: ContactPoints,
    interfaces: Vec<ModelInterface>,
    /// Uzawa's iteration, if a pair has the augmented Lagrangian.
    uzawa: Option<Uzawa>,
    prescribed: Prescribed,
    loads: Loads,
    /// Mass of each element of the solid per reference volume; empty unless a load acts on it.
    mass_densities: Vec<f64>,
    springs: Springs,
    bolts: Bolts,
    temperatures: Temperatures,
    viscosity: Viscosity,
    /// Bodies that supports alone do not hold.
    loose: LooseBodies,
    slaves: Vec<SlaveData>,
    contact_elements: ContactElements,
    start: StartDesign,
    unknowns: Unknowns,
    history: HistoryLayout,
    pattern: ContactPattern,
    floors: Floors,
    /// How often the kinematics of contact were computed.
    kinematics: Arc<AtomicU64>,
}

/// The parts of a [`ContactModel`].
#[derive(Debug, Clone)]
pub struct ModelParts {
    /// Elements and slave nodes of this rank.
    pub share: Share,
    /// The bodies.
    pub solid: SolidModel,
    /// Which elements are designed.
    pub designed: Vec<bool>,
    /// Effect of the density on an element.
    pub interpolation: Interpolation,
    /// Contact pairs.
    pub interfaces: Vec<ModelInterface>,
    /// Uzawa's iteration, if a pair has the augmented Lagrangian.
    pub uzawa: Option<Uzawa>,
    /// Prescribed motion.
    pub prescribed: Prescribed,
    /// Loads.
    pub loads: Loads,
    /// Springs between nodes and to the ground.
    pub springs: Springs,
    /// Bodies that are cut and pulled together.
    pub bolts: Bolts,
    /// Changes of temperature.
    pub temperatures: Temperatures,
    /// Viscous forces.
    pub viscosity: Viscosity,
}

/// Lower bounds of the [`Scales`](slipstick_path::Scales), derived from the problem's data, because
/// forces and displacements are zero at rest.
#[derive(Debug, Clone, Copy)]
struct Floors {
    thermal_motion: f64,
    force: f64,
    displacement: f64,
    multiplier: f64,
    /// Stiffness of an element of mean size against compression. \[F/L\]
    stiffness: f64,
}

/// Lower bound of the bodies' own stiffness at an interface, as a fraction of the stiffer side.
const LEAST_SHARE: f64 = 1e-6;

/// Smallest fraction of a characteristic size that a relative tolerance refers to.
const FLOOR: f64 = 1e-6;

/// λ + 2μ of the small-strain limit, at most that of ν = 0.499999.
fn compression_modulus(material: &Material) -> f64 {
    let (modulus, ratio) = (material.youngs_modulus(), material.poisson_ratio().min(0.499_999));
    modulus * (1.0 - ratio) / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
}

/// Largest magnitude of α ΔT of an element at any waypoint.
fn largest_expansion(solid: &SolidModel, temperatures: &Temperatures) -> f64 {
    let at = |time: LoadTime| {
        let changes = temperatures.of_elements(time);
        let of = |(e, change): (usize, f64)| (solid.thermal_expansion(e) * change).abs();
        changes.into_iter().enumerate().map(of).fold(0.0, f64::max)
    };
    temperatures.times().map(at).fold(0.0, f64::max)
}

impl ContactModel {
    /// Assembles a model.
    ///
    /// `start` is the density of every element at the start design; it sizes the penalty method's
    /// default stiffness. `largest_motion` is the largest prescribed displacement on the path;
    /// together with the loads, it sets the tolerances of a start at rest.
    pub fn new(mesh: &Mesh, parts: ModelParts, start: &[f64], largest_motion: f64) -> Self {
        let ModelParts { share, solid, designed, interpolation, interfaces, uzawa, prescribed, .. } = parts;
        let ModelParts { loads, springs, bolts, temperatures, viscosity, .. } = parts;
        let coordinates: Vec<f64> = mesh.nodes.iter().flatten().copied().collect();
        let map = ContactMap::new(mesh);
        let (slaves, contact_elements) = slaves::tables(mesh, &map, &interfaces);
        let masters = interfaces.iter().flat_map(|i| i.interface.master_facets());
        let dependent = Dependent { rigid: RigidBodies::new(mesh), linear: prescribed.linear().clone() };
        let masters = masters.map(|facet| {
            let mut nodes = map.parents(facet.iter().copied());
            dependent.add_sources(&mut nodes);
            nodes
        });
        let mut bulk = if share.is_part() {
            loads.couple(mesh.node_neighbours_in(|e| share.has_element(e)), &share)
        } else {
            mesh.node_neighbours()
        };
        springs.couple(&mut bulk, &share);
        bolts.couple(&mut bulk, &share);
        supports::TemporarySupports::couple(prescribed.temporary(), &mut bulk, &share);
        dependent.couple(&mut bulk);
        let own: Vec<bool> =
            interfaces.iter().flat_map(|i| i.interface.slave_nodes()).map(|s| share.has_node(s.node)).collect();
        let multipliers = interfaces.iter().any(|i| i.enforcement.method.has_multipliers());
        let pattern = ContactPattern::new(bulk, masters, own.clone(), multipliers && !slaves.is_empty());
        let points = ContactPoints::new(map, &dependent, prescribed.fixed());
        let modulus = (0..solid.elements()).map(|e| solid.material(e).youngs_modulus()).fold(0.0, f64::max);
        let volume: f64 = mesh.element_volumes().iter().sum();
        let size = (volume / mesh.elements.len() as f64).cbrt();
        let of_mass = if loads.depend_on_mass() { solid.elements() } else { 0 };
        let mass_densities: Vec<f64> = (0..of_mass).map(|element| solid.mass_density(element)).collect();
        let thermal_motion = largest_expansion(&solid, &temperatures) * volume.cbrt();
        // the displacement by which a load would compress an element
        let force = loads.largest(&coordinates, &mass_densities).max(bolts.largest());
        let driven = largest_motion.max(force / (modulus * size)).max(thermal_motion);
        let motion = if driven > 0.0 { driven } else { size };
        let compression = |e: usize| compression_modulus(solid.material(e));
        let stiffness = size * (0..solid.elements()).map(compression).fold(0.0, f64::max);
        let floors = Floors {
            thermal_motion,
            stiffness,
            force: FLOOR * modulus * size * motion,
            displacement: FLOOR * motion,
            multiplier: FLOOR * modulus * motion / size,
        };
        let loose = LooseBodies::new(mesh, &dependent, prescribed.fixed(), modulus * size);
        let mut model = Self {
            share,
            own,
            solid: Arc::new(solid),
            penalization: Penalization { interpolation, designed },
            coordinates,
            rest: Vec::new(),
            solid_nodes: mesh.bodies.iter().map(|body| body.nodes.end).max().unwrap_or(0),
            bodies: mesh.bodies.iter().map(|body| body.elements.clone()).collect(),
            dependent,
            points,
            interfaces,
            uzawa,
            prescribed,
            loads,
            mass_densities,
            springs,
            bolts,
            temperatures,
            viscosity,
            loose,
            slaves,
            contact_elements,
            start: StartDesign::default(),
            unknowns: Unknowns::default(),
            history: HistoryLayout::default(),
            pattern,
            floors,
            kinematics: Arc::default(),
        };
        model.start_at(start.to_vec());
        model.history = model.history_layout();
        model.unknowns = model.count_unknowns();
        if model.fixes_positions().is_empty() {
            model.unknowns.positions = model.coordinates.len();
        }
        model
    }

    fn count_unknowns(&self) -> Unknowns {
        let mut unknowns = Unknowns {
            history: self.history.solid.end,
            parameters: self.all_parameters().len(),
            ..Unknowns::displacements(self.prescribed.fixed(), self.solid.elements())
        };
        // if any pair has multipliers, the nodes of all pairs have multiplier rows; unused ones
        // count as prescribed
        if self.pattern.rows() > unknowns.groups.len() {
            for model in &self.interfaces {
                let method = model.enforcement.method;
                for slave in model.interface.slave_nodes() {
                    // no traction acts across a symmetry plane
                    let planes = slave.mirrored.iter().filter(|&&across| across).count();
                    let none = !method.has_multipliers();
                    let own = [none, none || planes > 0, none || planes > 1];
                    unknowns.fixed[Held::None as usize].extend(own);
                    unknowns.fixed[Held::Augmented as usize].extend(if method == Method::Lagrange {
                        own
                    } else {
                        [true; 3]
                    });
                    unknowns.fixed[Held::All as usize].extend([true; 3]);
                    unknowns.groups.push(slave.node);
                }
            }
        }
        unknowns
    }

    /// The solid bodies.
    pub fn solid(&self) -> &SolidModel {
        &self.solid
    }

    /// The solids of the whole mesh, also on a rank that has only a part of them.
    pub(crate) fn whole_solid(&self, mesh: &Mesh) -> Cow<'_, SolidModel> {
        match self.share.is_part() {
            true => Cow::Owned(SolidModel::new(mesh, self.solid.all_sections()).expect("its parts were built")),
            false => Cow::Borrowed(&self.solid),
        }
    }

    /// How often this rank evaluated the elements and the kinematics of contact since the model was built:
    /// names and counts.
    pub fn evaluations(&self) -> Vec<(&'static str, u64)> {
        let solid = Evaluation::ALL.map(Evaluation::name).into_iter().zip(self.solid.evaluations());
        solid.chain([("contact kinematics", self.kinematics.load(Ordering::Relaxed))]).collect()
    }

    /// Volume of the smallest element. \[L³\]
    pub fn smallest_element(&self) -> f64 {
        // elements of other ranks are 0 here
        let volumes = self.solid.element_volumes().into_iter().filter(|volume| *volume > 0.0);
        -self.share.largest(-volumes.fold(f64::INFINITY, f64::min))
    }

    /// Elements and slave nodes that this rank assembles.
    pub fn counts_here(&self) -> [usize; 2] {
        let elements = (0..self.solid.elements()).filter(|&element| self.share.has_element(element)).count();
        [elements, self.own.iter().filter(|own| **own).count()]
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
    pub(crate) fn set_friction(&mut self, friction: f64) {
        self.interfaces.iter_mut().for_each(|i| i.friction = friction);
    }

    /// Sets the exponent by which densities are penalized; it takes effect with the next [`Design`].
    pub(crate) fn set_penalization(&mut self, penalization: f64) {
        self.penalization.interpolation.simp.penalization = penalization;
    }

    /// Sets the interpolation of the energies of designed elements; it takes effect with the next [`Design`].
    pub(crate) fn set_energy_interpolation(&mut self, energy: Option<slipstick_solid::EnergyInterpolation>) {
        self.penalization.interpolation.energy = energy;
    }

    /// Whether void elements follow linear elasticity.
    pub fn interpolates_energies(&self) -> bool {
        self.penalization.interpolation.energy.is_some()
    }

    /// Whether an element is designed.
    pub fn is_designed(&self, element: u32) -> bool {
        self.penalization.designed.get(element as usize).copied().unwrap_or(false)
    }

    /// Whether any element is designed.
    pub fn has_design(&self) -> bool {
        self.penalization.designed.contains(&true)
    }

    /// Prescribed motion.
    pub fn prescribed(&self) -> &Prescribed {
        &self.prescribed
    }

    /// Viscous forces.
    pub fn viscosity(&self) -> &Viscosity {
        &self.viscosity
    }

    /// Stretch of the free thermal expansion of every element at a pseudo-time, 1 + α ΔT; empty if no
    /// temperature ever changes.
    pub fn stretches(&self, time: LoadTime) -> Vec<f64> {
        let changes = self.temperatures.of_elements(time);
        changes.iter().enumerate().map(|(e, change)| 1.0 + self.solid.thermal_expansion(e) * change).collect()
    }

    /// Whether temperatures change.
    pub(crate) fn has_temperatures(&self) -> bool {
        !self.temperatures.is_empty()
    }

    /// Displacement that thermal expansion may cause in a body of the size of all. \[L\]
    pub(crate) fn thermal_motion(&self) -> f64 {
        self.floors.thermal_motion
    }

    /// Whether loads act on the bodies, in addition to prescribed motions.
    pub fn has_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// Numbers of the loads that act only on prescribed displacements, or on no mass, and so have no effect.
    pub fn idle_loads(&self) -> Vec<usize> {
        let at =
            LoadState { time: LoadTime::default(), x: &self.coordinates, masses: &self.mass_densities, part: None };
        self.loads.idle(self.prescribed.fixed(), &self.dependent, at)
    }

    /// Global numbers of all slave nodes, interface by interface: the order of nodal contact
    /// results. A node on a sharp edge is repeated for each of the patches that meet there.
    pub fn slave_nodes(&self) -> Vec<u32> {
        self.interfaces.iter().flat_map(|i| i.interface.slave_nodes()).map(|s| s.node).collect()
    }

    /// The state at rest: no deformation, no multiplier, no history. Bodies may be elsewhere than in
    /// the mesh, as a [`Variation`] says.
    pub fn rest(&self) -> StepState {
        let mut unknowns = vec![0.0; self.unknowns.count()];
        unknowns[..self.rest.len()].copy_from_slice(&self.rest);
        StepState { unknowns, history: vec![0.0; self.unknowns.history] }
    }

    /// Norm of the displacements from their values at rest. \[L\]
    fn distance_from_rest(&self, y: &[f64]) -> f64 {
        let rest = self.rest.iter().copied().chain(std::iter::repeat(0.0));
        y[..self.displacement_count()].iter().zip(rest).map(|(d, rest)| (d - rest) * (d - rest)).sum::<f64>().sqrt()
    }

    fn displacement_count(&self) -> usize {
        self.coordinates.len()
    }

    /// The contact pair of a slave node.
    fn pair(&self, slave: &SlaveData) -> &ModelInterface {
        &self.interfaces[slave.interface as usize]
    }

    /// Multiplier components of slave node j in y.
    fn multiplier(&self, y: &[f64], j: usize) -> Vector3<f64> {
        let at = self.displacement_count() + 3 * j;
        Vector3::new(y[at], y[at + 1], y[at + 2])
    }

    /// y with the displacements that follow from others.
    fn placed<'a>(&self, y: &'a [f64]) -> Cow<'a, [f64]> {
        if self.dependent.is_empty() {
            return Cow::Borrowed(y);
        }
        let mut placed = y.to_vec();
        self.dependent.place(&mut placed);
        Cow::Owned(placed)
    }

    /// Current positions x = X + d.
    pub(crate) fn positions(&self, y: &[f64]) -> Vec<f64> {
        self.coordinates.iter().zip(y).map(|(x, d)| x + d).collect()
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

/// With an inverted element, the trial state is invalid.
pub(crate) fn inverted(error: InvertedElements) -> StateError {
    StateError::InvertedElements { elements: error.elements }
}
