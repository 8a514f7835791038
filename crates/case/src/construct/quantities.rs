//! From the quantities, the objective and the constraints of a case to those of the library.

use std::collections::BTreeSet;
use std::sync::Arc;

use slipstick_design::quantity::{Compliance, ContactForce, Quantity, QuantityError, VectorMeasure};
use slipstick_design::response::{Constraint, Curve, ObservedSteps, Reduction, Response, Term};
use slipstick_mesh::Mesh;
use slipstick_model::model::ContactModel;
use slipstick_model::optimize::{COLUMNS, SECONDS};
use slipstick_model::quantities::{FRICTION, PLACE, column_names};

use super::BuildError;
use crate::file::{self, Case, Combination, CurveToFollow, NamedBound, QuantityTerm};
use crate::quantity::{Building, all_fixed};

/// What a case asks for: its quantities, and what it minimizes and bounds.
pub(super) struct Requested {
    pub quantities: Vec<Arc<dyn Quantity>>,
    pub objective: Option<Response>,
    pub constraints: Vec<Constraint>,
}

pub(super) fn requested(case: &Case, mesh: &Mesh, model: &ContactModel) -> Result<Requested, BuildError> {
    let context = Context { case, mesh, model };
    // columns of tables that names of quantities would repeat
    let mut taken = column_names(mesh, model);
    taken.extend(PLACE.into_iter().chain(COLUMNS.map(|(name, _)| name)).chain([FRICTION, SECONDS]).map(str::to_owned));
    if let Some(number) = case.quantities.iter().position(|quantity| taken.contains(&quantity.name)) {
        let message = format!("`{}` is the name of a column that every run writes", case.quantities[number].name);
        return Err(BuildError::new(format!("quantity[{number}].name"), message, "choose another name"));
    }
    let of = |(number, file::Quantity { name, kind, .. }): (usize, &file::Quantity)| {
        let pairs = case.contacts.iter().map(|pair| [pair.slave.as_str(), pair.master.as_str()]).collect();
        let loaded = case.loads.iter().map(|load| load.surface.as_str()).collect();
        let designed = case.design.as_ref().map(|design| design.bodies.iter().map(String::as_str).collect());
        let path = format!("quantity[{number}].{}", kind.key());
        kind.build(name, &Building { mesh, model, pairs, loaded, designed, path })
    };
    let quantities = case.quantities.iter().enumerate().map(of).collect::<Result<Vec<_>, _>>()?;
    let objective = context.objective(&quantities)?;
    let constraints = context.constraints(&quantities)?;
    Ok(Requested { quantities, objective, constraints })
}

struct Context<'a> {
    case: &'a Case,
    mesh: &'a Mesh,
    model: &'a ContactModel,
}

impl Context<'_> {
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
                if all_fixed(&self.model.slave_nodes(), VectorMeasure::Norm, self.model.prescribed().fixed()) =>
            {
                let message = "the objective would always be 0: all components of all slave nodes are prescribed, \
                               and their forces do not count";
                let help = "exchange slave and master, or prescribe fewer components";
                return Err(BuildError::new("objective.contact_force", message, help));
            }
            file::ObjectiveKind::ContactForce { steps } => {
                self.check_steps(steps)?;
                let mut nodes = self.model.slave_nodes();
                // a node may be a slave in several pairs
                let mut seen = BTreeSet::new();
                nodes.retain(|node| seen.insert(*node));
                let force = ContactForce::new(nodes, self.mesh.nodes.len(), 0.0).map_err(fail)?;
                Response::of(
                    Arc::new(force.without_reactions(&self.model.prescribed().ever_supported())),
                    steps.clone(),
                    -1.0,
                )
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

/// A quantity of the case, whose reader has checked the name.
fn find(quantities: &[Arc<dyn Quantity>], name: &str) -> Arc<dyn Quantity> {
    quantities.iter().find(|quantity| quantity.name() == name).expect("the reader checks names").clone()
}
