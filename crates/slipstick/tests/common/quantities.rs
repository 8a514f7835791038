//! Quantities of all kinds, for problems with a block on a slab.

use slipstick::build::Problem;
use slipstick::design::VectorMeasure;
use slipstick::design::quantity::*;
use std::sync::Arc;

/// Every quantity, with numbers of the first pair, the support `slab_ymin` and the drive
/// `block_ymax`.
pub fn every_quantity(problem: &Problem) -> Vec<Arc<dyn Quantity>> {
    let mesh = &problem.mesh;
    let count = mesh.nodes.len();
    let nodes = |set: &str| mesh.set_nodes(set).expect("a set").to_vec();
    let unknowns = |set: &str| -> Vec<u32> { nodes(set).iter().flat_map(|n| (0..3).map(move |c| 3 * n + c)).collect() };
    let weighted = |set: &str| -> Vec<(u32, f64)> {
        nodes(set).into_iter().enumerate().map(|(i, node)| (node, 1.0 + i as f64)).collect()
    };
    let along = |e| VectorMeasure::along(e).expect("a direction");
    let whole = || Patch::whole(0);
    let mut slaves = problem.analysis.model().slave_nodes();
    // a node may be the slave of several pairs
    let mut known = std::collections::HashSet::new();
    slaves.retain(|node| known.insert(*node));
    let part = Patch::within(0, slaves[..2].to_vec()).expect("nodes");
    let force = |name: &str, part| -> Arc<dyn Quantity> { Arc::new(ContactResultant::new(name, whole(), part)) };
    let pressure = |name: &str, measure| -> Arc<dyn Quantity> {
        Arc::new(ContactPressure::new(name, whole(), measure).expect("right"))
    };
    let gap = |name: &str, m| -> Arc<dyn Quantity> { Arc::new(Gap::new(name, whole(), m).expect("right")) };
    let norms = ContactForce::new(slaves, count, 0.0).expect("right");
    let elements = &mesh.bodies[0].elements;
    let volumes =
        mesh.element_volumes().iter().enumerate().map(|(e, v)| if elements.contains(&e) { *v } else { 0.0 }).collect();
    let reaction = |name: &str, set, measure| -> Arc<dyn Quantity> {
        Arc::new(Reaction::new(name, unknowns(set), measure).expect("right"))
    };
    let moment = |name: &str, set| -> Arc<dyn Quantity> {
        let (point, axis) = ([0.3, 1.1, -0.2], [1.0, 2.0, -0.5]);
        Arc::new(Moment::new(name, &unknowns(set), &mesh.nodes, point, axis).expect("right"))
    };
    let moved = |measure| Displacement::new("displacement", weighted("slab_ymax"), count, measure).expect("right");
    let relative = moved(VectorMeasure::Norm).relative_to(weighted("block_ymin"), count).expect("right");
    vec![
        Arc::new(norms.without_reactions(&problem.analysis.model().prescribed().ever_supported())),
        reaction("reaction of the support", "slab_ymin", along([1.0, -2.0, 0.5])),
        reaction("reaction of the drive", "block_ymax", VectorMeasure::Norm),
        moment("moment of the support", "slab_ymin"),
        moment("moment of the drive", "block_ymax"),
        force("contact force along a direction", ForcePart::Resultant(along([0.3, 1.0, 0.4]))),
        force("norm of the contact force", ForcePart::Resultant(VectorMeasure::Norm)),
        force("normal force", ForcePart::Normal),
        force("friction force", ForcePart::Tangential),
        Arc::new(ContactResultant::new("normal force of a part", part, ForcePart::Normal)),
        pressure("peak pressure", PressureMeasure::Peak { p: 8.0 }),
        pressure("mean pressure", PressureMeasure::Mean),
        pressure("spread of pressure", PressureMeasure::Spread),
        pressure("least pressure", PressureMeasure::Minimum { k: 5.0, modulus: 100.0 }),
        Arc::new(ContactShare::new("share in contact", whole())),
        gap("mean gap", GapMeasure::Mean),
        gap("least gap", GapMeasure::Minimum { k: 20.0 }),
        Arc::new(FrictionWork::new("friction work", whole())),
        Arc::new(ExternalWork::new("external work")),
        Arc::new(ExternalWork::new("external work of the drive").on(unknowns("block_ymax"))),
        Arc::new(moved(along([0.0, 1.0, 0.3]))),
        Arc::new(relative),
        Arc::new(StrainEnergy::new("strain energy of the slab", elements.clone())),
        Arc::new(StrainEnergy::new("strain energy", 0..mesh.elements.len())),
        Arc::new(Stress::new("stress in the slab", elements.clone().map(|e| e as u32).collect(), 8.0).expect("right")),
        Arc::new(Compliance::default()),
        Arc::new(Volume::new("volume of the slab", volumes)),
    ]
}
