//! The contact law of one slave node in a step: the acting traction and the node's rows of C, by
//! the method of its pair.

use crate::equations::enforcement::UPDATE_STIFFNESS;
use crate::equations::node::NodeTraction;
use crate::equations::{Design, Method, Step};
use nalgebra::{Matrix3x2, Vector2, Vector3};
use slipstick_contact::ContactStatus;
use slipstick_contact::enforcement::bonded::{bond, bonded_traction};
use slipstick_contact::enforcement::lagrange::{Complementarity, complementarity};
use slipstick_contact::enforcement::regularised::{Traction, pressed_traction, soft_traction, traction};
use slipstick_contact::enforcement::{NodeMeasures, Stiffness};
use slipstick_contact::friction::Friction;
use slipstick_path::{Attempt, Held, Iteration, UzawaOptions};

/// Fraction of the facet size by which gap and slip are moved off the branch point at the start of
/// a step.
pub(in crate::equations) const NUDGE: f64 = 1e-9;

/// ε and c relative to the bodies' own stiffness in the attempts to rescue a step of the Lagrange
/// method.
const RESCUE_FACTORS: [f64; 3] = [UPDATE_STIFFNESS, 0.1 * UPDATE_STIFFNESS, 10.0 * UPDATE_STIFFNESS];

/// ε relative to the bodies' own stiffness in the stages of a growing penalty.
const STAGES: [f64; 3] = [0.1 * UPDATE_STIFFNESS, UPDATE_STIFFNESS, 10.0 * UPDATE_STIFFNESS];

/// Uzawa's iteration that rescues a step of the Lagrange method.
const RESCUE: UzawaOptions = UzawaOptions { tolerance: 1e-8, max_iterations: 64, memory: 8 };

/// How the laws interpret an [`Iteration`]. None of this changes a solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::equations) struct IterationSettings {
    /// Factor on c of the Lagrange method.
    variation: f64,
    /// Whether nodes that slid in the last step are assumed at the start to keep sliding (1) or to
    /// stick (−1).
    slide_sense: f64,
    /// While a step is rescued, ε and c of the Lagrange method relative to the bodies' own
    /// stiffness.
    rescue: Option<f64>,
    held: Held,
    at_start: bool,
}

impl IterationSettings {
    /// The multipliers that are held fixed.
    pub fn held(&self) -> Held {
        self.held
    }
}

/// The law of a node at a state: the one equation that its method has for it.
#[derive(Debug, Clone, Copy)]
pub(in crate::equations) enum NodeLaw {
    /// The multiplier ζ is an unknown, and C its equation.
    Multiplier {
        /// ζ. \[F/L²\]
        value: Vector3<f64>,
        /// C with its derivatives.
        equation: Complementarity,
    },
    /// The traction follows from gap and slip, around a history or a held multiplier.
    Regularised(Traction),
}

impl NodeLaw {
    /// Open, stick or slip.
    pub fn status(&self) -> ContactStatus {
        match self {
            Self::Multiplier { equation, .. } => equation.status,
            Self::Regularised(traction) => traction.status,
        }
    }

    /// The traction in R. \[F/L²\]
    pub fn value(&self) -> Vector3<f64> {
        match self {
            Self::Multiplier { value, .. } => *value,
            Self::Regularised(traction) => traction.value,
        }
    }

    /// The same traction with its dependence on the displacements.
    pub fn traction(&self) -> NodeTraction {
        match self {
            Self::Multiplier { value, equation } => NodeTraction {
                status: equation.status,
                value: *value,
                by_gap: Vector3::zeros(),
                by_slip: Matrix3x2::zeros(),
                by_area: Vector3::zeros(),
                by_load: Vector3::zeros(),
                by_direction: Matrix3x2::zeros(),
            },
            Self::Regularised(t) => NodeTraction {
                status: t.status,
                value: t.value,
                by_gap: t.by_gap,
                by_slip: t.by_slip,
                by_area: t.by_area,
                by_load: t.by_load,
                by_direction: t.by_direction,
            },
        }
    }

    /// Whether the node contributes to the tangent. An open node without multiplier does not:
    /// C = ζ = 0 and its force remain zero, and its adjoint has no effect.
    pub fn contributes(&self) -> bool {
        self.status() != ContactStatus::Inactive || self.value() != Vector3::zeros()
    }
}

/// Derivatives of λᵀF + ηᵀG, or of a quantity, through the law of one node.
pub(in crate::equations) struct LawWeights {
    /// With respect to the slip increment ũ_τ.
    pub by_slip: Vector2<f64>,
    /// With respect to the acting coefficient of friction.
    pub by_friction: f64,
    /// With respect to the logarithm of the stiffness that belongs to the model: of a partly
    /// covered node, or the penalty method's.
    pub by_stiffness: f64,
    /// With respect to the tangential history, if the method has one.
    pub by_history: Option<Vector2<f64>>,
}

impl LawWeights {
    /// For weights of the node's conditions C, where its multiplier is an unknown, and of its
    /// traction ζ, where this follows from gap and slip.
    pub fn of(law: &NodeLaw, by_condition: Vector3<f64>, by_traction: Vector3<f64>) -> Self {
        match law {
            NodeLaw::Multiplier { equation: c, .. } => Self {
                by_slip: c.by_slip.tr_mul(&by_condition),
                by_friction: c.by_friction.dot(&by_condition),
                by_stiffness: c.by_edge_stiffness.dot(&by_condition),
                by_history: None,
            },
            NodeLaw::Regularised(t) => Self {
                by_slip: t.by_slip.tr_mul(&by_traction),
                by_friction: t.by_friction.dot(&by_traction),
                by_stiffness: t.by_stiffness.dot(&by_traction),
                by_history: Some(t.by_multiplier.tr_mul(&by_traction).fixed_rows::<2>(1).into()),
            },
        }
    }
}

impl Design {
    /// The settings of attempt `attempt` at a step; `None` if there is no such attempt.
    fn settings(&self, attempt: Attempt) -> Option<IterationSettings> {
        let model = &*self.model;
        let lagrange = model.has(Method::Lagrange);
        let others = model.has(Method::Penalty) || model.has(Method::Augmented);
        let own =
            IterationSettings { variation: 1.0, slide_sense: 1.0, rescue: None, held: Held::None, at_start: false };
        match attempt {
            Attempt::Setting(0) => Some(own),
            // a smaller c ends most cycles; beside other methods, nodes that slip also start by sticking
            Attempt::Setting(1) => (lagrange || others).then_some(IterationSettings {
                variation: match (lagrange, others) {
                    (true, true) => 10.0,
                    (true, false) => 0.1,
                    (false, _) => 1.0,
                },
                slide_sense: if others { -1.0 } else { 1.0 },
                ..own
            }),
            Attempt::Setting(2) => {
                lagrange.then_some(IterationSettings { variation: if others { 0.1 } else { 10.0 }, ..own })
            }
            Attempt::Setting(_) => None,
            Attempt::Penalty(stage) => {
                let factor = STAGES.get(stage).filter(|_| lagrange);
                factor.map(|&factor| IterationSettings { rescue: Some(factor), ..own })
            }
            Attempt::Rescue(number) => {
                let factor = RESCUE_FACTORS.get(number).filter(|_| lagrange);
                factor.map(|&factor| IterationSettings { rescue: Some(factor), ..own })
            }
        }
    }

    /// The method that solves a step in attempt `attempt`.
    pub(in crate::equations) fn solution(&self, attempt: Attempt) -> Option<slipstick_path::Method> {
        use slipstick_path::Method as Solution;
        let IterationSettings { rescue, .. } = self.settings(attempt)?;
        let uzawa = self.model.uzawa.map(|uzawa| uzawa.options);
        if matches!(attempt, Attempt::Penalty(_)) {
            return Some(Solution::Newton);
        }
        let options = if rescue.is_some() { Some(RESCUE) } else { uzawa };
        Some(options.map_or(Solution::Newton, Solution::Uzawa))
    }

    pub(in crate::equations) fn iteration_settings(&self, iteration: Iteration) -> IterationSettings {
        let Iteration { attempt, held, at_start } = iteration;
        let own = self.settings(attempt).or_else(|| self.settings(Attempt::Setting(0)));
        IterationSettings { held, at_start, ..own.expect("a problem has its own settings") }
    }

    /// The measures that determine the branches of the contact law for a node with the given
    /// tangential traction.
    ///
    /// At the start of a step they are ambiguous: a node that slid before lies exactly on the
    /// friction cone, a touching one has no gap, and round-off would choose the branch of Newton's
    /// first tangent. They are therefore shifted slightly towards touching and continued sliding,
    /// which is what most nodes do, so that the iteration does not depend on round-off; in a retry
    /// they are shifted towards sticking, which suits a reversal.
    fn deciding(
        &self,
        j: usize,
        measures: &NodeMeasures,
        tangential: Vector2<f64>,
        settings: &IterationSettings,
    ) -> NodeMeasures {
        let mut at = *measures;
        if settings.at_start {
            let nudge = NUDGE * self.model.slaves[j].size * at.area;
            at.gap -= nudge;
            let size = tangential.norm();
            if size > 0.0 {
                at.slip += tangential * (settings.slide_sense * nudge / size);
            }
        }
        at
    }

    /// The law of friction at node j in a step.
    fn friction(&self, step: &Step, j: usize) -> Friction {
        self.model.pair(&self.model.slaves[j]).law(step.time)
    }

    /// The law of node j at `y`.
    pub(in crate::equations) fn law(
        &self,
        step: &Step,
        j: usize,
        measures: &NodeMeasures,
        y: &[f64],
        settings: &IterationSettings,
    ) -> NodeLaw {
        let around = match self.model.method_of(j) {
            Method::Penalty => step.previous_traction(j),
            Method::Lagrange | Method::Augmented if self.is_held(j, settings.held) => self.model.multiplier(y, j),
            Method::Lagrange | Method::Augmented => {
                let value = self.model.multiplier(y, j);
                return NodeLaw::Multiplier {
                    value,
                    equation: self.complementarity(step, j, measures, value, settings),
                };
            }
        };
        NodeLaw::Regularised(self.regularised(step, j, measures, around, settings))
    }

    /// C of node j for multiplier ζ. The augmented Lagrangian needs it when its multipliers are
    /// free, in the second-order update and in the adjoint; its ε can have any size and would be a
    /// poor choice of c there.
    fn complementarity(
        &self,
        step: &Step,
        j: usize,
        measures: &NodeMeasures,
        zeta: Vector3<f64>,
        settings: &IterationSettings,
    ) -> Complementarity {
        let at = self.deciding(j, measures, zeta.fixed_rows::<2>(1).into(), settings);
        let c = match self.model.method_of(j) {
            Method::Lagrange if settings.rescue.is_some() => self.augmentation(j, settings),
            Method::Augmented => self.own_stiffness(j, UPDATE_STIFFNESS),
            Method::Lagrange | Method::Penalty => self.stiffness[j].times(settings.variation),
        };
        match self.model.pair(&self.model.slaves[j]).is_bonded() {
            true => bond(zeta, measures, &c),
            false => complementarity(zeta, &at, self.friction(step, j), &c),
        }
    }

    /// Regularized traction of node j around the multiplier ẑ.
    pub(in crate::equations) fn regularised(
        &self,
        step: &Step,
        j: usize,
        measures: &NodeMeasures,
        around: Vector3<f64>,
        settings: &IterationSettings,
    ) -> Traction {
        let epsilon = self.augmentation(j, settings);
        if self.model.pair(&self.model.slaves[j]).is_bonded() {
            return bonded_traction(around, measures, &epsilon);
        }
        let at = self.deciding(j, measures, around.fixed_rows::<2>(1).into(), settings);
        let friction = self.friction(step, j);
        let pair = self.model.pair(&self.model.slaves[j]);
        if pair.at_points {
            let load = at.load.expect("the kinematics were evaluated with the pressure at the points");
            return pressed_traction(around, &at, friction, &epsilon, (load, pair.pressure.is_none()));
        }
        match &pair.pressure {
            Some(law) => soft_traction(around, &at, friction, &epsilon, law),
            None => traction(around, &at, friction, &epsilon),
        }
    }

    /// ε of the traction of node j around its multiplier. The Lagrange method has one only while a
    /// step is rescued.
    pub(in crate::equations) fn augmentation(&self, j: usize, settings: &IterationSettings) -> Stiffness {
        match self.model.method_of(j) {
            Method::Lagrange => self.own_stiffness(j, settings.rescue.unwrap_or(UPDATE_STIFFNESS)),
            Method::Penalty | Method::Augmented => self.stiffness[j],
        }
    }

    /// Whether the multiplier of node j is held fixed, for Uzawa's iteration to update it.
    pub(in crate::equations) fn is_held(&self, j: usize, held: Held) -> bool {
        match (held, self.model.method_of(j)) {
            (Held::None, _) | (_, Method::Penalty) | (Held::Augmented, Method::Lagrange) => false,
            (Held::Augmented | Held::All, _) => true,
        }
    }
}
