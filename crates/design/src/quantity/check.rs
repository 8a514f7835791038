//! Compares a quantity's derivatives with finite differences of its values.

use super::{ContactDerivative, ContactNode, ElementData, PreviousView, Quantity, StateDerivative, StateView};

/// Largest error of a directional derivative, relative to the size of the derivatives along the
/// direction.
const TOLERANCE: f64 = 1e-6;

/// Steps of the differences, relative to the size of the varied argument: one of them must agree.
const STEPS: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-5];

/// Directions per argument.
const DIRECTIONS: u64 = 3;

/// A quantity whose derivative does not match its value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "quantity `{name}` at step {step}: its derivative with respect to the {argument} is {derivative:e} along a \
     direction in which differences of its value give {difference:e}; correct Quantity::pull_back, which adds the \
     weight times the derivative with respect to each field of the state, with the other fields fixed"
)]
pub struct WrongDerivative {
    /// The quantity's name.
    pub name: String,
    /// User load step, from 1.
    pub step: usize,
    /// The varied argument: "displacements", "internal forces", "gaps", …
    pub argument: &'static str,
    /// Derivative along the direction, from [`Quantity::pull_back`].
    pub derivative: f64,
    /// Derivative along the direction, from [`Quantity::value`]; the closest of several steps.
    pub difference: f64,
}

/// A field of the slave nodes: its number of components, and how to read and write them.
struct ContactField {
    name: &'static str,
    width: usize,
    get: fn(&ContactNode, usize) -> f64,
    set: fn(&mut ContactNode, usize, f64),
    slope: fn(&ContactDerivative, usize) -> f64,
}

const CONTACT: [ContactField; 5] = [
    ContactField {
        name: "multipliers",
        width: 3,
        get: |at, c| at.multiplier[c],
        set: |at, c, value| at.multiplier[c] = value,
        slope: |by, c| by.multiplier[c],
    },
    ContactField {
        name: "multiplier vectors",
        width: 3,
        get: |at, c| at.vector[c],
        set: |at, c, value| at.vector[c] = value,
        slope: |by, c| by.vector[c],
    },
    ContactField {
        name: "gaps",
        width: 1,
        get: |at, _| at.gap,
        set: |at, _, value| at.gap = value,
        slope: |by, _| by.gap,
    },
    ContactField {
        name: "slip increments",
        width: 2,
        get: |at, c| at.slip[c],
        set: |at, c, value| at.slip[c] = value,
        slope: |by, c| by.slip[c],
    },
    ContactField {
        name: "contact areas",
        width: 1,
        get: |at, _| at.area,
        set: |at, _, value| at.area = value,
        slope: |by, _| by.area,
    },
];

/// Compares [`Quantity::pull_back`] at a state with central differences (of order 4) of
/// [`Quantity::value`], with respect to every field of the view that is not zero, along a few
/// random directions.
///
/// The state should be a general one: if all displacements or forces are zero, a quantity may have
/// a kink, and there is no scale for the steps.
///
/// # Errors
/// [`WrongDerivative`] for the first direction that no step size makes agree to 1e-6.
pub fn check_derivatives(quantity: &dyn Quantity, state: &StateView) -> Result<(), WrongDerivative> {
    let mut by = StateDerivative::zero(state);
    quantity.pull_back(state, 1.0, &mut by);
    let wrong = |argument| {
        move |(derivative, difference)| WrongDerivative {
            name: quantity.name().into(),
            step: state.step,
            argument,
            derivative,
            difference,
        }
    };
    let nodal = [
        (Field::Displacements, state.displacement, &by.displacement),
        (Field::InternalForces, state.internal_force, &by.internal_force),
        (Field::ExternalForces, state.external_force, &by.external_force),
        (Field::Reactions, state.reaction, &by.reaction),
        (Field::Densities, state.density, &by.density),
        (Field::PreviousDisplacements, state.previous.displacement, &by.previous.displacement),
        (Field::PreviousExternalForces, state.previous.external_force, &by.previous.external_force),
        (Field::PreviousReactions, state.previous.reaction, &by.previous.reaction),
    ];
    let elements = state.elements.each().into_iter().zip(by.elements.each()).enumerate();
    let of_elements = elements.map(|(kind, (values, slopes))| (Field::OfElements(kind), *values, slopes));
    for (field, at, slopes) in nodal.into_iter().chain(of_elements) {
        if at.iter().any(|&value| value != 0.0) {
            compare(at, slopes, |at| quantity.value(&field.replaced(*state, at))).map_err(wrong(field.name()))?;
        }
    }
    for field in &CONTACT {
        let entries = || state.contact.iter().flat_map(|at| (0..field.width).map(|c| (field.get)(at, c)));
        let at: Vec<f64> = entries().collect();
        let slopes: Vec<f64> =
            by.contact.iter().flat_map(|by| (0..field.width).map(|c| (field.slope)(by, c))).collect();
        if at.iter().any(|&value| value != 0.0) {
            let value = |at: &[f64]| {
                let mut contact = state.contact.to_vec();
                for (node, values) in contact.iter_mut().zip(at.chunks_exact(field.width)) {
                    values.iter().enumerate().for_each(|(c, &value)| (field.set)(node, c, value));
                }
                quantity.value(&StateView { contact: &contact, ..*state })
            };
            compare(&at, &slopes, value).map_err(wrong(field.name))?;
        }
    }
    let before = state.previous.multiplier.as_flattened();
    let value = |at: &[f64]| {
        let multiplier: Vec<[f64; 3]> = at.as_chunks().0.to_vec();
        quantity.value(&StateView { previous: PreviousView { multiplier: &multiplier, ..state.previous }, ..*state })
    };
    compare(before, by.previous.multiplier.as_flattened(), value).map_err(wrong("multipliers at the previous state"))
}

/// A field of the view with one number per node component or element.
#[derive(Clone, Copy)]
enum Field {
    Displacements,
    InternalForces,
    ExternalForces,
    Reactions,
    Densities,
    /// In the list [`ElementData::LISTS`].
    OfElements(usize),
    PreviousDisplacements,
    PreviousExternalForces,
    PreviousReactions,
}

impl Field {
    fn name(self) -> &'static str {
        match self {
            Self::Displacements => "displacements",
            Self::InternalForces => "internal forces",
            Self::ExternalForces => "forces of loads",
            Self::Reactions => "reactions",
            Self::Densities => "densities",
            Self::OfElements(kind) => ElementData::<f64>::LISTS[kind].words,
            Self::PreviousDisplacements => "displacements at the previous state",
            Self::PreviousExternalForces => "forces of loads at the previous state",
            Self::PreviousReactions => "reactions at the previous state",
        }
    }

    fn replaced<'a>(self, view: StateView<'a>, values: &'a [f64]) -> StateView<'a> {
        let previous = view.previous;
        match self {
            Self::Displacements => StateView { displacement: values, ..view },
            Self::InternalForces => StateView { internal_force: values, ..view },
            Self::ExternalForces => StateView { external_force: values, ..view },
            Self::Reactions => StateView { reaction: values, ..view },
            Self::Densities => StateView { density: values, ..view },
            Self::OfElements(kind) => {
                let mut elements = view.elements;
                *elements.each_mut()[kind] = values;
                StateView { elements, ..view }
            }
            Self::PreviousDisplacements => {
                StateView { previous: PreviousView { displacement: values, ..previous }, ..view }
            }
            Self::PreviousExternalForces => {
                StateView { previous: PreviousView { external_force: values, ..previous }, ..view }
            }
            Self::PreviousReactions => StateView { previous: PreviousView { reaction: values, ..previous }, ..view },
        }
    }
}

/// Derivative and closest difference of the first direction that disagrees.
fn compare(at: &[f64], gradient: &[f64], value: impl Fn(&[f64]) -> f64) -> Result<(), (f64, f64)> {
    let largest = at.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let size = if largest > 0.0 { largest } else { 1.0 };
    for seed in 0..DIRECTIONS {
        let direction = direction(at.len(), seed);
        let derivative: f64 = gradient.iter().zip(&direction).map(|(g, v)| g * v).sum();
        let scale: f64 = gradient.iter().zip(&direction).map(|(g, v)| (g * v).abs()).sum();
        let along = |step: f64| {
            let moved: Vec<f64> = at.iter().zip(&direction).map(|(x, v)| x + step * v).collect();
            value(&moved)
        };
        let (mut nearest, mut error) = (f64::NAN, f64::INFINITY);
        for h in STEPS.map(|step| step * size) {
            let difference = (8.0 * (along(h) - along(-h)) - (along(2.0 * h) - along(-2.0 * h))) / (12.0 * h);
            // below the resolution of differences of values of this size
            let round_off = 10.0 * f64::EPSILON * along(0.0).abs() / h;
            let beyond = (difference - derivative).abs() - round_off;
            // NaN stays NaN
            let off = if beyond <= 0.0 { 0.0 } else { beyond / scale.max(f64::MIN_POSITIVE) };
            if nearest.is_nan() || off < error {
                (nearest, error) = (difference, off);
            }
        }
        if !(error <= TOLERANCE) {
            return Err((derivative, nearest));
        }
    }
    Ok(())
}

/// Entries between −1 and 1, the same on every machine (Knuth's linear congruential generator).
fn direction(length: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..length).map(|_| next()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ContactStatus;
    use crate::quantity::{
        Compliance, ContactForce, ContactPressure, ContactResultant, ContactShare, Dimension, Displacement,
        ExternalWork, ForcePart, FrictionWork, Gap, GapMeasure, Moment, Patch, PressureMeasure, Reaction, StrainEnergy,
        Stress, VectorMeasure, Volume,
    };

    /// θ = ½ Σ (d·f)², with a factor by which its derivatives are wrong.
    struct Work {
        by_displacement: f64,
        by_force: f64,
    }

    impl Quantity for Work {
        fn name(&self) -> &str {
            "work"
        }

        fn dimension(&self) -> Dimension {
            Dimension::WORK
        }

        fn value(&self, state: &StateView) -> f64 {
            state.displacement.iter().zip(state.internal_force).map(|(d, f)| 0.5 * (d * f) * (d * f)).sum()
        }

        fn pull_back(&self, state: &StateView, weight: f64, to: &mut StateDerivative) {
            for (i, (d, f)) in state.displacement.iter().zip(state.internal_force).enumerate() {
                to.displacement[i] += weight * self.by_displacement * d * f * f;
                to.internal_force[i] += weight * self.by_force * f * d * d;
            }
        }
    }

    const D: [f64; 6] = [1e-3, -2e-3, 5e-4, 0.0, 1e-3, -1e-4];
    const F: [f64; 6] = [30.0, -20.0, 7.0, 1.0, 11.0, -4.0];
    const LOADS: [f64; 6] = [0.0, 4.0, 1.0, 0.0, -2.0, 0.0];
    const NODE: ContactNode = ContactNode {
        node: 0,
        pair: 0,
        status: ContactStatus::Slip,
        multiplier: [40.0, 3.0, -4.0],
        vector: [5.0, -39.0, 7.0],
        gap: 1e-3,
        slip: [2e-3, -1e-3],
        area: 0.5,
        reference_area: 0.6,
        follows_pressure: true,
        friction_ratio: 1.0,
    };
    const CONTACT: [ContactNode; 4] = [
        NODE,
        ContactNode { node: 1, multiplier: [25.0, -6.0, 8.0], vector: [1.0, -30.0, 2.0], area: 0.25, ..NODE },
        ContactNode { node: 2, multiplier: [10.0, 1.0, 1.0], gap: 2e-3, slip: [-1e-3, 4e-3], area: 0.3, ..NODE },
        ContactNode { node: 0, pair: 1, multiplier: [90.0, 1.0, 1.0], ..NODE },
    ];
    const STRESS: [f64; 24] = [
        7.0, 1.0, 2.0, 1.0, 3.0, 1.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 8.0, 1.0, 6.0, 1.0, 1.0, 1.0,
        1.0, 1.0,
    ];
    const STATE: StateView = StateView {
        step: 2,
        steps: 3,
        time: 0.6,
        displacement: &D,
        internal_force: &F,
        external_force: &LOADS,
        reaction: &[0.0, 5.0, -3.0, 2.0, -8.0, 1.0],
        contact: &CONTACT,
        density: &[0.5, 1.0, 0.25],
        elements: ElementData {
            energy: &[1.0, 2.0, 5.0],
            stress: &STRESS,
            plastic_work: &[0.5, 0.0, 2.0],
            plastic_strain: &STRESS,
        },
        previous: PreviousView {
            displacement: &[5e-4, -1e-3, 2e-3, 1e-3, 4e-3, 0.0],
            external_force: &[1.0, 3.0, -2.0, 0.0, 6.0, -1.0],
            reaction: &[0.0, 2.0, 1.0, -4.0, 3.0, 2.0],
            multiplier: &[[20.0, 1.0, -2.0], [5.0, 0.5, 0.5], [15.0, -2.0, 1.5], [9.0, 2.0, -1.0]],
        },
    };

    fn pair(part: ForcePart) -> Box<dyn Quantity> {
        Box::new(ContactResultant::new("force", Patch::whole(0), part))
    }

    fn pressure(measure: PressureMeasure) -> Box<dyn Quantity> {
        Box::new(ContactPressure::new("pressure", Patch::whole(0), measure).unwrap())
    }

    fn gap(measure: GapMeasure) -> Box<dyn Quantity> {
        Box::new(Gap::new("gap", Patch::whole(0), measure).unwrap())
    }

    fn check(quantity: &dyn Quantity, expected: f64) {
        let found = quantity.value(&STATE);
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{}: {found} for {expected}", quantity.name());
        check_derivatives(quantity, &STATE).unwrap();
    }

    #[test]
    fn right_derivatives_pass() {
        check_derivatives(&Work { by_displacement: 1.0, by_force: 1.0 }, &STATE).unwrap();
        check_derivatives(&ContactForce::new(vec![0, 1], 2, 0.0).unwrap(), &STATE).unwrap();
        check_derivatives(&Compliance::default(), &STATE).unwrap();
    }

    /// By hand, for the first three slave nodes; derivatives by differences.
    #[test]
    fn pair_quantities_by_hand() {
        let along = |direction| ForcePart::Resultant(VectorMeasure::along(direction).unwrap());
        check(&*pair(along([0.0, 2.0, 0.0])), 0.5 * 39.0 + 0.25 * 30.0 + 0.3 * 39.0);
        let force: [f64; 3] = [2.5 + 0.25 + 1.5, -19.5 - 7.5 - 11.7, 3.5 + 0.5 + 2.1];
        let size = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        check(&*pair(ForcePart::Resultant(VectorMeasure::Norm)), size);
        check(&*pair(ForcePart::Normal), 20.0 + 6.25 + 3.0);
        check(&*pair(ForcePart::Tangential), 2.5 + 2.5 + 0.3 * 2.0f64.sqrt());
        let (whole, mean) = (1.05, 29.25 / 1.05);
        check(&*pressure(PressureMeasure::Mean), mean);
        let variance: f64 =
            [(0.5, 40.0), (0.25, 25.0), (0.3, 10.0)].iter().map(|(a, p): &(f64, f64)| a * (p - mean).powi(2)).sum();
        check(&*pressure(PressureMeasure::Spread), (variance / whole).sqrt() / mean);
        check(&*pressure(PressureMeasure::Peak { p: 2.0 }), 2325.0f64.sqrt());
        let least: f64 = [(0.5, 40.0), (0.25, 25.0), (0.3, 10.0)]
            .iter()
            .map(|(a, p): &(f64, f64)| a * (-20.0 * p / mean).exp())
            .sum();
        check(&*pressure(PressureMeasure::Minimum { k: 20.0, modulus: 1e3 }), -mean / 20.0 * (least / whole).ln());
        // the third node opens by 1.5e-3
        let mut opened = CONTACT;
        opened[2] =
            ContactNode { status: ContactStatus::Inactive, multiplier: [1e-12, 0.0, 0.0], gap: 4.5e-4, ..opened[2] };
        let open_state = StateView { contact: &opened, ..STATE };
        let (mean, size) = (26.25 / 1.05, 0.6f64.sqrt());
        let least: f64 = [(0.5, 40.0 / mean), (0.25, 25.0 / mean), (0.3, -(1.0 + 1e3 * 1.5e-3 / (size * mean)).ln())]
            .iter()
            .map(|(a, x): &(f64, f64)| a * (-20.0 * x).exp())
            .sum();
        let minimum = pressure(PressureMeasure::Minimum { k: 20.0, modulus: 1e3 });
        let (expected, found) = (-mean / 20.0 * (least / whole).ln(), minimum.value(&open_state));
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} for {expected}");
        check_derivatives(&*minimum, &open_state).unwrap();
        assert_eq!(minimum.extreme().map(|extreme| extreme.value(&open_state)), Some(0.0));
        let square = 0.5 * 1600.0 + 0.25 * 625.0 + 0.3 * 100.0;
        check(&ContactShare::new("share", Patch::whole(0)), 29.25 * 29.25 / (whole * square));
        check(&*gap(GapMeasure::Mean), 4e-3 / whole);
        let size = 0.6f64.sqrt();
        let sum: f64 = [2e-3, 4e-3, 2e-3 / 0.3].iter().map(|g| (-50.0 * g / size).exp()).sum();
        check(&*gap(GapMeasure::Minimum { k: 50.0 }), -size / 50.0 * sum.ln());
        // the extremes for which smooth measures stand
        let extreme =
            |of: &dyn Quantity| of.extreme().map(|extreme| (extreme.name().to_owned(), extreme.value(&STATE)));
        let value = |of: &dyn Quantity| extreme(of).map(|found| found.1);
        assert_eq!(value(&*pressure(PressureMeasure::Peak { p: 2.0 })), Some(40.0));
        assert_eq!(value(&*pressure(PressureMeasure::Minimum { k: 20.0, modulus: 1e3 })), Some(10.0));
        assert_eq!(value(&*gap(GapMeasure::Minimum { k: 50.0 })), Some(2e-3));
        assert_eq!(value(&*gap(GapMeasure::Mean)).or(value(&*pressure(PressureMeasure::Spread))), None);
        let name = pressure(PressureMeasure::Mean).name().to_owned() + "_extreme";
        assert_eq!(extreme(&*pressure(PressureMeasure::Peak { p: 2.0 })).map(|found| found.0), Some(name));
        let work = FrictionWork::new("work", Patch::whole(0));
        let [first, second, third] = [6e-3 + 4e-3, -12e-3 - 8e-3, -1e-3 + 4e-3];
        check(&work, 0.75 * first + 0.6 * second + 1.25 * third);
        // the third opens; the traction of the first may be at its limit
        let mut other = CONTACT;
        other[2].status = ContactStatus::Inactive;
        other[0].follows_pressure = false;
        let other = StateView { contact: &other, ..STATE };
        let expected = first + 0.6 * second;
        assert!((work.value(&other) - expected).abs() < 1e-15, "{} for {expected}", work.value(&other));
        check_derivatives(&work, &other).unwrap();
        // the coefficient of the second doubles; the pressure of the third falls to less than a third
        let mut other = CONTACT;
        other[1].friction_ratio = 0.5;
        other[2].multiplier[0] = 4.0;
        let other = StateView { contact: &other, ..STATE };
        let expected = 0.75 * first + 0.55 * second + 2.0 * third;
        assert!((work.value(&other) - expected).abs() < 1e-15, "{} for {expected}", work.value(&other));
        check_derivatives(&work, &other).unwrap();
        let region = Patch::within(0, vec![2, 0]).unwrap();
        check(&ContactResultant::new("region", region, ForcePart::Normal), 23.0);
    }

    /// By hand; derivatives by differences.
    #[test]
    fn resultants_and_means_by_hand() {
        let along = |direction| VectorMeasure::along(direction).unwrap();
        check(&Reaction::new("r", vec![1, 4], along([0.0, 1.0, 0.0])).unwrap(), -3.0);
        check(&Reaction::new("r", vec![1, 4, 3], VectorMeasure::Norm).unwrap(), 13.0f64.sqrt());
        let positions = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let moment = Moment::new("m", &[1, 2, 3, 4], &positions, [0.0, 0.0, 1.0], [0.0, 0.0, 3.0]).unwrap();
        // Σ x r_y − y r_x with x = X + d; the third component of the second node does not count
        check(&moment, 1.001 * 5.0 + 0.0 * -8.0 - 2.001 * 2.0);
        let mean = |nodes: Vec<(u32, f64)>, measure| Displacement::new("u", nodes, 2, measure).unwrap();
        check(&mean(vec![(0, 3.0), (1, 1.0)], along([0.0, 1.0, 0.0])), 0.75 * -2e-3 + 0.25 * 1e-3);
        let relative = mean(vec![(0, 1.0)], VectorMeasure::Norm).relative_to(vec![(1, 5.0)], 2).unwrap();
        check(&relative, (1e-6 + 9e-6 + 3.6e-7f64).sqrt());
        check(&StrainEnergy::new("e", 1..3), 7.0);
        // φ = 1 with 3, and φ = 1/4, √φ = 1/2, with 8, 6 and six times 1
        let sum = 81.0 + (4096.0 + 1296.0 + 6.0) / 16.0f64;
        check(&Stress::new("s", vec![1, 2], 4.0).unwrap(), sum.sqrt().sqrt());
        check(&Volume::new("v", vec![4.0, 0.0, 8.0]), 4.0);
        check(&Volume::new("m", vec![4.0, 0.0, 8.0]).mass(2.5), 10.0);
        check(&Compliance::default(), 4.0 * -2e-3 + 5e-4 - 2.0 * 1e-3);
    }

    /// Half of Σ (loads + reactions, now and before) times (1, −2, −3, −2, −6, −0.2) · 5e-4, by
    /// hand; derivatives by differences.
    #[test]
    fn external_work_by_hand() {
        check(&ExternalWork::new("w"), 0.5 * (1.0 * 0.5 - 14.0 + 3.0 * 1.5 + 2.0 + 3.0 - 2.0 * 0.1) * 1e-3);
        check(&ExternalWork::new("w").on(vec![1, 4]), 0.5 * (-14.0 + 3.0) * 1e-3);
    }

    /// A wrong sign, a forgotten part, and a part in 10⁵.
    #[test]
    fn wrong_derivatives_are_named() {
        for (by_displacement, by_force, argument) in [
            (-1.0, 1.0, "displacements"),
            (0.0, 1.0, "displacements"),
            (1.0 + 1e-5, 1.0, "displacements"),
            (1.0, -1.0, "internal forces"),
            (1.0, 0.0, "internal forces"),
        ] {
            let found = check_derivatives(&Work { by_displacement, by_force }, &STATE).unwrap_err();
            assert_eq!((found.argument, found.step, found.name.as_str()), (argument, 2, "work"));
            let factor = found.derivative / found.difference;
            let expected = if argument == "displacements" { by_displacement } else { by_force };
            assert!((factor - expected).abs() < 1e-8, "{factor} instead of {expected}");
        }
    }

    /// Computed by hand: differences of sin 10³ d with steps beyond its period are meaningless. One
    /// step that agrees is enough, and for a wrong slope the closest difference is reported.
    #[test]
    fn one_step_that_agrees_is_enough() {
        let at: [f64; 3] = [0.3, -1.0, 0.2];
        let wave = |x: &[f64]| x.iter().map(|x| (1e3 * x).sin()).sum::<f64>();
        let slope = at.map(|x: f64| 1e3 * (1e3 * x).cos());
        assert_eq!(compare(&at, &slope, wave), Ok(()));
        let (derivative, difference) = compare(&at, &slope.map(|s| 1.001 * s), wave).unwrap_err();
        assert!((derivative / difference - 1.001).abs() < 1e-4, "{derivative} {difference}");
    }

    /// NaN is never right.
    #[test]
    fn derivatives_that_are_not_finite_are_wrong() {
        let found = check_derivatives(&Work { by_displacement: f64::NAN, by_force: 1.0 }, &STATE);
        assert_eq!(found.unwrap_err().argument, "displacements");
    }
}
