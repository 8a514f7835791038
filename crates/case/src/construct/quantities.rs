//! From the quantities, the objective and the constraints of a case to those of the library.

use std::collections::BTreeSet;
use std::sync::Arc;

use slipstick_design::quantity::{
    Compliance, ContactForce, ContactPressure, ContactResultant, ContactShare, Displacement, ExternalWork, ForcePart,
    FrictionWork, Gap, GapMeasure, Moment, Patch, PlasticStrain, PressureMeasure, Quantity, QuantityError, Reaction,
    StrainEnergy, Stress, VectorMeasure, Volume,
};
use slipstick_design::response::{Constraint, Curve, ObservedSteps, Reduction, Response, Term};
use slipstick_mesh::Mesh;
use slipstick_model::model::ContactModel;
use slipstick_model::quantities::{column_names, external_work};

use super::BuildError;
use crate::file::{
    self, BoxRegion, Case, Combination, Contact, CurveToFollow, ForceComponent, ForceWord, GapWord, NamedBound,
    PressureWord, QuantityKind, QuantityTerm, VectorComponent, VectorWord,
};

/// What a case asks for: its quantities, and what it minimises and bounds.
pub(super) struct Requested {
    pub quantities: Vec<Arc<dyn Quantity>>,
    pub objective: Option<Response>,
    pub constraints: Vec<Constraint>,
}

pub(super) fn requested(case: &Case, mesh: &Mesh, model: &ContactModel) -> Result<Requested, BuildError> {
    let context = Context { case, mesh, model };
    let taken = column_names(mesh, model);
    if let Some(number) = case.quantities.iter().position(|q| taken.contains(&q.name) || RESERVED.contains(&&*q.name)) {
        let message = format!("`{}` is the name of a column that every run writes", case.quantities[number].name);
        return Err(BuildError::new(format!("quantity[{number}].name"), message, "choose another name"));
    }
    let of = |(number, quantity): (usize, &file::Quantity)| context.quantity(number, quantity);
    let quantities = case.quantities.iter().enumerate().map(of).collect::<Result<Vec<_>, _>>()?;
    let objective = context.objective(&quantities)?;
    let constraints = context.constraints(&quantities)?;
    Ok(Requested { quantities, objective, constraints })
}

/// Columns of tables that names of quantities would repeat.
const RESERVED: [&str; 19] = [
    "step",
    "load_case",
    "time",
    "iteration",
    "objective",
    "volume_fraction",
    "change",
    "optimality",
    "violation",
    "discreteness",
    "newton_iterations",
    "uzawa_iterations",
    "increments",
    "halvings",
    "inner_iterations",
    "seconds",
    "open",
    "stick",
    "slip",
];

struct Context<'a> {
    case: &'a Case,
    mesh: &'a Mesh,
    model: &'a ContactModel,
}

impl Context<'_> {
    fn quantity(&self, number: usize, quantity: &file::Quantity) -> Result<Arc<dyn Quantity>, BuildError> {
        let file::Quantity { name, kind } = quantity;
        let key = kind.key();
        let fail =
            |error: QuantityError| BuildError::new(format!("quantity[{number}].{key}"), error, "change the value");
        let constant =
            |message: String, help: &str| Err(BuildError::new(format!("quantity[{number}].{key}"), message, help));
        let undesigned = |body: &str| {
            let message = format!("`{body}` is not designed, so its volume does not change");
            BuildError::new(format!("quantity[{number}].{key}"), message, "name a body of [design], or omit `body`")
        };
        let count = self.mesh.nodes.len();
        let patch = |slave: &str, within: &Option<String>| self.patch(number, key, slave, within.as_deref());
        Ok(match kind {
            QuantityKind::Reaction { set, component } => {
                let measure = measure(*component).map_err(fail)?;
                let counts = |unknown: &u32| counts(measure, *unknown as usize % 3);
                let unknowns: Vec<u32> = self.prescribed(set).into_iter().filter(counts).collect();
                if unknowns.is_empty() {
                    let message = format!("no such component is prescribed at `{set}`, so its reaction is always 0");
                    return constant(message, "name the set of a [[dirichlet]], and a component that it prescribes");
                }
                Arc::new(Reaction::new(name, unknowns, measure).map_err(fail)?)
            }
            QuantityKind::Moment { set, point, direction } => {
                let unknowns = self.prescribed(set);
                if unknowns.is_empty() {
                    let message = format!("nothing is prescribed at `{set}`, so its moment is always 0");
                    return constant(message, "name the set of a [[dirichlet]]");
                }
                Arc::new(Moment::new(name, &unknowns, &self.mesh.nodes, *point, *direction).map_err(fail)?)
            }
            QuantityKind::ContactForce { slave, component, within } => {
                let patch = patch(slave, within)?;
                let along = |direction| VectorMeasure::along(direction).map(ForcePart::Resultant);
                let part = match component {
                    ForceComponent::Direction(direction) => along(*direction).map_err(fail)?,
                    ForceComponent::Word(ForceWord::X) => along([1.0, 0.0, 0.0]).map_err(fail)?,
                    ForceComponent::Word(ForceWord::Y) => along([0.0, 1.0, 0.0]).map_err(fail)?,
                    ForceComponent::Word(ForceWord::Z) => along([0.0, 0.0, 1.0]).map_err(fail)?,
                    ForceComponent::Word(ForceWord::Norm) => ForcePart::Resultant(VectorMeasure::Norm),
                    ForceComponent::Word(ForceWord::Normal) => ForcePart::Normal,
                    ForceComponent::Word(ForceWord::Tangential) => ForcePart::Tangential,
                    ForceComponent::Word(ForceWord::Nodal) if self.is_prescribed(slave, VectorMeasure::Norm) => {
                        let message = format!(
                            "all components of all nodes of `{slave}` are prescribed, and their forces do not count"
                        );
                        return constant(message, "exchange slave and master, or prescribe fewer components");
                    }
                    ForceComponent::Word(ForceWord::Nodal) => {
                        let mut nodes = self.mesh.set_nodes(slave).map(|nodes| nodes.to_vec()).unwrap_or_default();
                        if let Some(within) = within.as_ref().and_then(|set| self.mesh.set_nodes(set)) {
                            let within: BTreeSet<u32> = within.iter().copied().collect();
                            nodes.retain(|node| within.contains(node));
                        }
                        let force = ContactForce::new(nodes, count, 0.0).map_err(fail)?;
                        return Ok(Arc::new(force.named(name).without_reactions(self.model.prescribed().fixed())));
                    }
                };
                if matches!(part, ForcePart::Resultant(_)) && self.is_with_itself(slave) {
                    let message =
                        format!("`{slave}` touches itself, so the resultant of its contact forces is always 0");
                    return constant(message, "choose the component \"normal\", \"tangential\" or \"nodal\"");
                }
                Arc::new(ContactResultant::new(name, patch, part))
            }
            QuantityKind::ContactPressure { slave, measure, sharpness, within } => {
                let measure = match measure {
                    PressureWord::Peak => PressureMeasure::Peak { p: *sharpness },
                    PressureWord::Mean => PressureMeasure::Mean,
                    PressureWord::Spread => PressureMeasure::Spread,
                    PressureWord::Minimum => PressureMeasure::Minimum { k: *sharpness },
                };
                Arc::new(ContactPressure::new(name, patch(slave, within)?, measure).map_err(fail)?)
            }
            QuantityKind::ContactShare { slave, within } => Arc::new(ContactShare::new(name, patch(slave, within)?)),
            QuantityKind::Gap { slave, measure, sharpness, within } => {
                let measure = match measure {
                    GapWord::Mean => GapMeasure::Mean,
                    GapWord::Minimum => GapMeasure::Minimum { k: *sharpness },
                };
                Arc::new(Gap::new(name, patch(slave, within)?, measure).map_err(fail)?)
            }
            QuantityKind::FrictionWork { slave, within } => Arc::new(FrictionWork::new(name, patch(slave, within)?)),
            QuantityKind::ExternalWork { set: None } => Arc::new(external_work(name, self.mesh)),
            QuantityKind::ExternalWork { set: Some(set) } => {
                let nodes = self.mesh.set_nodes(set).unwrap_or_default();
                let prescribed = self.prescribed(set);
                let loaded = self.loaded();
                if prescribed.is_empty() && !nodes.iter().any(|node| loaded.contains(node)) {
                    let message =
                        format!("no load and no prescribed motion acts on `{set}`, so their work is always 0");
                    return constant(message, "name the set of a [[dirichlet]] or [[load]], or omit `set`");
                }
                let unknowns = |node: u32| (0..3).map(move |c| 3 * node + c);
                let work = ExternalWork::new(name);
                if let Some(rigid) = self.mesh.rigid.iter().find(|rigid| self.mesh.bodies[rigid.body].name == *set) {
                    // loads and motions at the reference point act through the nodes
                    let nodes = self.mesh.bodies[rigid.body].nodes.clone();
                    return Ok(Arc::new(work.on(nodes.flat_map(|node| unknowns(node as u32)).collect())));
                }
                // a node of a rigid body counts as prescribed, but only loads act on it from outside
                let of_rigid = |node: u32| {
                    self.mesh.rigid.iter().any(|rigid| self.mesh.bodies[rigid.body].nodes.contains(&(node as usize)))
                };
                let fixed = self.model.prescribed().fixed();
                let driven = prescribed.into_iter().filter(|unknown| !of_rigid(unknown / 3));
                let free = nodes.iter().filter(|&&node| !of_rigid(node)).flat_map(|&node| unknowns(node));
                let free = free.filter(|&unknown| !fixed[unknown as usize]);
                let loaded = nodes.iter().filter(|&&node| of_rigid(node)).flat_map(|&node| unknowns(node));
                Arc::new(work.on(driven.chain(free).collect()).of_loads_on(loaded.collect()))
            }
            QuantityKind::Displacement { set, component, relative_to } => {
                let component = measure(*component).map_err(fail)?;
                if relative_to.as_ref() == Some(set) {
                    let message = format!("`{set}` does not move relative to itself");
                    return constant(message, "name another set in `relative_to`");
                }
                let sets = [Some(set), relative_to.as_ref()];
                if sets.into_iter().flatten().all(|set| self.is_driven(set, component)) {
                    let message =
                        format!("the displacement of `{set}` is prescribed, so it does not depend on the design");
                    return constant(message, "name a set that can move");
                }
                let mean = Displacement::new(name, self.weighted(set), count, component).map_err(fail)?;
                Arc::new(match relative_to {
                    Some(other) => mean.relative_to(self.weighted(other), count).map_err(fail)?,
                    None => mean,
                })
            }
            QuantityKind::StrainEnergy { body } => Arc::new(StrainEnergy::new(name, self.elements(body.as_deref()))),
            QuantityKind::Stress { body, within, sharpness } => {
                let elements = self.elements_within(body.as_deref(), within, number, key)?;
                Arc::new(Stress::new(name, elements, *sharpness).map_err(fail)?)
            }
            QuantityKind::PlasticStrain { body, within, sharpness } => {
                let elements = self.elements_within(body.as_deref(), within, number, key)?;
                let memory = |e: &u32| self.has_memory(*e as usize);
                if !elements.iter().any(memory) {
                    let message = "no element here has a law with plastic strain, so it is always 0".into();
                    return constant(
                        message,
                        "give the body a `j2_linear` or `j2_voce` material, or omit the quantity",
                    );
                }
                Arc::new(PlasticStrain::new(name, elements, *sharpness).map_err(fail)?)
            }
            QuantityKind::Compliance {} => {
                if self.case.loads.is_empty() {
                    return constant("the case has no load, so its compliance is always 0".into(), "add a [[load]]");
                }
                Arc::new(Compliance::named(name))
            }
            QuantityKind::Volume { body } => Arc::new(self.volume(name, body.as_ref()).map_err(undesigned)?),
            QuantityKind::Mass { body, mass_density } => {
                Arc::new(self.volume(name, body.as_ref()).map_err(undesigned)?.mass(*mass_density))
            }
        })
    }

    /// The volume of a body, or of all; the error is its name if it is not designed.
    fn volume<'n>(&self, name: &str, body: Option<&'n String>) -> Result<Volume, &'n str> {
        let designed = |body: &String| self.case.design.as_ref().is_none_or(|design| design.bodies.contains(body));
        if let Some(body) = body.filter(|body| !designed(body)) {
            return Err(body);
        }
        let elements = self.elements(body.map(String::as_str));
        let volumes = self.mesh.element_volumes().into_iter().enumerate();
        let of = |(e, volume): (usize, f64)| if elements.contains(&e) { volume } else { 0.0 };
        Ok(Volume::new(name, volumes.map(of).collect()))
    }

    /// The slave nodes of a pair, or those of them in a set.
    fn patch(&self, number: usize, key: &str, slave: &str, within: Option<&str>) -> Result<Patch, BuildError> {
        let pair =
            self.case.contacts.iter().position(|Contact { slave: known, .. }| known == slave).unwrap_or(0) as u32;
        let Some(within) = within else { return Ok(Patch::whole(pair)) };
        let slaves = self.mesh.set_nodes(slave).unwrap_or_default();
        let region: BTreeSet<u32> = self.mesh.set_nodes(within).unwrap_or_default().iter().copied().collect();
        let nodes: Vec<u32> = slaves.iter().copied().filter(|node| region.contains(node)).collect();
        Patch::within(pair, nodes).map_err(|_| {
            let message = format!("no node of `{slave}` lies in `{within}`");
            BuildError::new(format!("quantity[{number}].{key}.within"), message, "name a set on the slave surface")
        })
    }

    /// The prescribed unknowns of a set: those that belong to its `[[dirichlet]]`, or else all of
    /// its nodes.
    fn prescribed(&self, set: &str) -> Vec<u32> {
        let prescribed = self.model.prescribed();
        if let Some((_, unknowns)) = prescribed.owned().into_iter().find(|(name, _)| *name == set) {
            return unknowns;
        }
        let nodes = self.mesh.set_nodes(set).unwrap_or_default();
        let unknowns = nodes.iter().flat_map(|node| (0..3).map(move |c| 3 * node + c));
        unknowns.filter(|&unknown| prescribed.fixed()[unknown as usize]).collect()
    }

    /// Whether the slave surface of a pair is its own master.
    fn is_with_itself(&self, slave: &str) -> bool {
        self.case.contacts.iter().any(|contact| contact.slave == slave && contact.master == slave)
    }

    /// The nodes of all surfaces on which loads act.
    fn loaded(&self) -> BTreeSet<u32> {
        let surfaces = self.case.loads.iter().filter_map(|load| self.mesh.set_nodes(&load.surface));
        surfaces.flat_map(|nodes| nodes.to_vec()).collect()
    }

    /// Whether nothing but motions and supports moves a set along a direction, or in any direction for a
    /// norm.
    fn is_driven(&self, set: &str, measure: VectorMeasure) -> bool {
        all_fixed(&self.mesh.set_nodes(set).unwrap_or_default(), measure, self.model.contact_fixed())
    }

    /// Whether no displacement of a set along a direction is solved for; that of rigid bodies never is.
    fn is_prescribed(&self, set: &str, measure: VectorMeasure) -> bool {
        self.are_prescribed(&self.mesh.set_nodes(set).unwrap_or_default(), measure)
    }

    fn are_prescribed(&self, nodes: &[u32], measure: VectorMeasure) -> bool {
        all_fixed(nodes, measure, self.model.prescribed().fixed())
    }

    /// The nodes of a surface with the reference areas around them, or those of a set with equal
    /// weights.
    fn weighted(&self, set: &str) -> Vec<(u32, f64)> {
        if let Some(surface) = self.mesh.surfaces.get(set) {
            let areas = surface.node_areas(&self.mesh.nodes);
            return areas.into_iter().filter(|(_, area)| *area > 0.0).collect();
        }
        self.mesh.set_nodes(set).unwrap_or_default().iter().map(|&node| (node, 1.0)).collect()
    }

    /// Elements of a body, or of all, whose centroid lies in one of the boxes, if there are any.
    fn elements_within(
        &self,
        body: Option<&str>,
        within: &[BoxRegion],
        number: usize,
        key: &str,
    ) -> Result<Vec<u32>, BuildError> {
        let centroids = self.mesh.centroids();
        let inside = |e: &usize| within.is_empty() || within.iter().any(|region| region.contains(centroids[*e]));
        let elements: Vec<u32> = self.elements(body).filter(inside).map(|e| e as u32).collect();
        if elements.is_empty() {
            let path = format!("quantity[{number}].{key}.within");
            let message = "no element has its centroid in these boxes";
            return Err(BuildError::new(path, message, "`slipstick check` shows the extent of the bodies"));
        }
        Ok(elements)
    }

    /// Whether the law of an element has memory.
    fn has_memory(&self, element: usize) -> bool {
        self.model.solid().material(element).kind().has_memory()
    }

    fn elements(&self, body: Option<&str>) -> std::ops::Range<usize> {
        let found = body.and_then(|name| self.mesh.bodies.iter().find(|body| body.name == name));
        found.map_or(0..self.mesh.elements.len(), |body| body.elements.clone())
    }

    fn objective(&self, quantities: &[Arc<dyn Quantity>]) -> Result<Option<Response>, BuildError> {
        let Some(objective) = &self.case.objective else { return Ok(None) };
        let fail = |error: QuantityError| {
            BuildError::new("objective", error, "choose steps of the load path, and add a [[contact]]")
        };
        let response = match &objective.kind {
            file::ObjectiveKind::Compliance { steps } => {
                self.check_steps(steps)?;
                Response::of(Arc::new(Compliance::default()), steps.clone(), 1.0)
            }
            file::ObjectiveKind::ContactForce { .. }
                if self.are_prescribed(&self.model.slave_nodes(), VectorMeasure::Norm) =>
            {
                let message = "the objective would always be 0: all components of all slave nodes are prescribed, \
                               and their forces do not count";
                let help = "exchange slave and master, or prescribe fewer components";
                return Err(BuildError::new("objective.contact_force", message, help));
            }
            file::ObjectiveKind::ContactForce { steps } => {
                self.check_steps(steps)?;
                let mut nodes = self.model.slave_nodes();
                nodes.dedup();
                let force = ContactForce::new(nodes, self.mesh.nodes.len(), 0.0).map_err(fail)?;
                Response::of(Arc::new(force.without_reactions(self.model.prescribed().fixed())), steps.clone(), -1.0)
            }
            file::ObjectiveKind::Minimise(combination) => self.combination(combination, quantities, 1.0)?,
            file::ObjectiveKind::Maximise(combination) => self.combination(combination, quantities, -1.0)?,
            file::ObjectiveKind::Follow(curve) => {
                if self.case.load_cases.len() > 1 {
                    let message = "a curve belongs to one load path, but the case has several load cases";
                    return Err(BuildError::new("objective.follow", message, "use a single load case"));
                }
                let moved = self.case.load_cases.iter().flat_map(|load_case| &load_case.bodies);
                if moved.into_iter().any(|body| body.offset.is_some() || body.rotation.is_some()) {
                    let message = "a curve starts at 0, but bodies are moved at the start of the load case";
                    return Err(BuildError::new("objective.follow", message, "move them with `place`"));
                }
                self.curve(curve, quantities)?
            }
        };
        if self.case.load_cases.is_empty() {
            return Ok(Some(response));
        }
        let weights = self.case.load_cases.iter().map(|load_case| load_case.weight).collect();
        Ok(Some(response.in_load_cases(weights).over_load_cases(objective.load_cases)))
    }

    fn check_steps(&self, steps: &ObservedSteps) -> Result<(), BuildError> {
        let help = "choose steps of the load path";
        steps.check(self.case.load_path.steps).map_err(|error| BuildError::new("objective", error, help))
    }

    fn combination(
        &self,
        combination: &Combination,
        quantities: &[Arc<dyn Quantity>],
        sign: f64,
    ) -> Result<Response, BuildError> {
        let Combination { sum, steps, worst } = combination;
        self.check_steps(steps)?;
        let term = |QuantityTerm { quantity, weight }: &QuantityTerm| Term {
            quantity: find(quantities, quantity),
            // a volume counts once, not at every step
            steps: if find(quantities, quantity).depends_on_state() { steps.clone() } else { ObservedSteps::Last },
            weight: sign * weight,
        };
        let names: Vec<&str> = sum.iter().map(|term| term.quantity.as_str()).collect();
        let reduction = if *worst { Reduction::Largest } else { Reduction::Sum };
        Ok(Response::new(names.join(" + "), sum.iter().map(term).collect(), reduction))
    }

    fn curve(
        &self,
        CurveToFollow { quantity, points }: &CurveToFollow,
        quantities: &[Arc<dyn Quantity>],
    ) -> Result<Response, BuildError> {
        let curve = Curve::new(points.iter().map(|point| (point[0], point[1])).collect());
        let curve = curve.map_err(|error| BuildError::new("objective.follow.points", error, "change the points"))?;
        let term = Term { quantity: find(quantities, quantity), steps: ObservedSteps::All, weight: 1.0 };
        Ok(Response::new(format!("distance of {quantity}"), vec![term], Reduction::Distance(curve)))
    }

    /// A constraint for every bound, every load step at which it holds, and every load case.
    fn constraints(&self, quantities: &[Arc<dyn Quantity>]) -> Result<Vec<Constraint>, BuildError> {
        let cases = self.case.load_case_names();
        let mut constraints: Vec<Constraint> = Vec::new();
        for NamedBound { name, constraint, quantity, bound, load_case, step, corrected } in self.case.bounds() {
            if constraints.iter().any(|known| known.response.name() == name) {
                let message = format!("two bounds have the name `{name}` in `history.csv`");
                let help = "join bounds on the same steps, or rename the quantity";
                return Err(BuildError::new(format!("constraint[{constraint}]"), message, help));
            }
            let (quantity, steps) = (find(quantities, &quantity), ObservedSteps::Only(vec![step]));
            let mut weights = vec![0.0; cases.len().max(1)];
            weights[load_case] = 1.0;
            let term = Term { quantity, steps, weight: 1.0 };
            let response = Response::new(name, vec![term], Reduction::Sum).in_load_cases(weights);
            constraints.push(Constraint { response, bound, corrected });
        }
        Ok(constraints)
    }
}

fn all_fixed(nodes: &[u32], measure: VectorMeasure, fixed: &[bool]) -> bool {
    let fixed = |node: u32| (0..3).filter(|&c| counts(measure, c)).all(|c| fixed[3 * node as usize + c]);
    !nodes.is_empty() && nodes.iter().all(|&node| fixed(node))
}

/// Whether a component of a vector counts in a measure of it.
fn counts(measure: VectorMeasure, component: usize) -> bool {
    match measure {
        VectorMeasure::Along(direction) => direction[component] != 0.0,
        VectorMeasure::Norm => true,
    }
}

/// A quantity of the case, whose reader has checked the name.
fn find(quantities: &[Arc<dyn Quantity>], name: &str) -> Arc<dyn Quantity> {
    quantities.iter().find(|quantity| quantity.name() == name).expect("the reader checks names").clone()
}

fn measure(component: VectorComponent) -> Result<VectorMeasure, QuantityError> {
    match component {
        VectorComponent::Direction(direction) => VectorMeasure::along(direction),
        VectorComponent::Word(VectorWord::X) => VectorMeasure::along([1.0, 0.0, 0.0]),
        VectorComponent::Word(VectorWord::Y) => VectorMeasure::along([0.0, 1.0, 0.0]),
        VectorComponent::Word(VectorWord::Z) => VectorMeasure::along([0.0, 0.0, 1.0]),
        VectorComponent::Word(VectorWord::Norm) => Ok(VectorMeasure::Norm),
    }
}
