//! Checks whether passive regions and the filter of a design have any effect.

use std::collections::BTreeSet;

use super::{Notice, NoticeKind};
use crate::construct::{Problem, Regions};
use crate::file::{Body, Case, Design, Load, ObjectiveKind, QuantityKind, Region};
use slipstick_model::words::{counted, quantity};

/// Notices for passive regions that contain no element, and for a filter that reaches no
/// neighbour.
pub(super) fn notices(case: &Case, problem: &Problem) -> Vec<Notice> {
    let (Some(design), Some(variables)) = (&case.design, problem.variables()) else {
        return Vec::new();
    };
    let centroids = problem.mesh.centroids();
    let domain = variables.domain();
    let passive = [("passive_solid", &design.passive_solid), ("passive_void", &design.passive_void)];
    let regions = Regions::new(&problem.mesh, domain);
    let found = passive.into_iter().flat_map(|(key, listed)| {
        regions.each(listed).into_iter().enumerate().map(move |(i, elements)| (key, i, elements))
    });
    let mut notices: Vec<Notice> = found
        .filter(|(_, _, elements)| elements.is_empty())
        .map(|(key, i, _)| Notice {
            kind: NoticeKind::EmptyPassiveRegion,
            path: format!("design.{key}[{i}]"),
            message: "the region has no effect: no element of the design bodies has its centroid in it".into(),
            help: "enlarge or move the region; it refers to coordinates after `place`".into(),
        })
        .collect();
    let all: BTreeSet<u32> = regions.each(&design.passive_solid).concat().into_iter().collect();
    for (i, region) in design.passive_solid.iter().enumerate() {
        notices.extend(partial_skin(&regions, region, &all, format!("design.passive_solid[{i}]")));
    }
    let of_filter = |key: &str, radius: f64| (format!("design.{key}.radius"), radius);
    let sensitivities = design.sensitivity_filter.map(|filter| of_filter("sensitivity_filter", filter.radius));
    let filter = design.density_filter.map(|filter| of_filter("density_filter", filter.radius)).or(sensitivities);
    let scheduled = case.optimizer.iter().flat_map(|optimizer| optimizer.schedule.filter_radius.entries());
    let scheduled = (0..).zip(scheduled).map(|(i, &(_, radius))| {
        let path = format!("optimizer.schedule.filter_radius[{i}]");
        (path, radius)
    });
    notices.extend(stiff_void(case, design, problem));
    notices.extend(heated_compliance(case));
    let Some(nearest) = nearest_centroids(problem, &centroids) else { return notices };
    for (path, _) in filter.into_iter().chain(scheduled).filter(|(_, radius)| *radius <= nearest) {
        notices.push(Notice {
            kind: NoticeKind::IdleFilter,
            path,
            message: format!(
                "the filter has no effect: the closest centroids of neighbouring elements are {} apart",
                quantity(nearest)
            ),
            help: "use a radius of 1.5 to 3 times the element size, or omit the filter".into(),
        });
    }
    notices
}

/// A notice if some elements with a facet on the surface of a region are not passive, unlike others.
fn partial_skin(regions: &Regions, region: &Region, passive: &BTreeSet<u32>, path: String) -> Option<Notice> {
    let Region::NearSurface { surface, within } = region else { return None };
    let at_surface = regions.at_surface(surface);
    let (solid, missing): (Vec<_>, Vec<_>) = at_surface.iter().partition(|(element, _)| passive.contains(element));
    let farthest = missing.iter().map(|(_, far)| *far).fold(0.0, f64::max);
    (!missing.is_empty() && !solid.is_empty()).then(|| Notice {
        kind: NoticeKind::EmptyPassiveRegion,
        path,
        message: format!(
            "the skin has gaps: of {} at `{surface}`, {} not in it; an element belongs to it if its centroid is no farther away than {}",
            counted(at_surface.len(), "element"),
            if missing.len() == 1 { "one is".into() } else { format!("{} are", missing.len()) },
            quantity(*within)
        ),
        // rounded up
        help: format!("a `within` of {} closes them", quantity(1.001 * farthest)),
    })
}

/// A softer body that touches a designed one should be this many times as stiff as the void.
const STIFFER_THAN_VOID: f64 = 100.0;

/// A notice if the void of a designed body is stiffer than the softest body that touches it: void
/// then carries more than that body, and a bound on its contact means little.
fn stiff_void(case: &Case, design: &Design, problem: &Problem) -> Option<Notice> {
    let body_of = |node: u32| problem.mesh.bodies.iter().position(|body| body.nodes.contains(&(node as usize)));
    let deformable = |body: &usize| case.bodies.get(*body).is_some_and(|body| body.rigid.is_none());
    let moduli = |body: usize| case.bodies[body].materials().map(|material| material.youngs_modulus());
    let stiffest = |body: usize| moduli(body).fold(0.0, f64::max);
    let softest_of = |body: usize| moduli(body).fold(f64::INFINITY, f64::min);
    let is_designed = |body: usize| design.bodies.contains(&case.bodies[body].name);
    let mut softest: Option<(usize, usize, f64)> = None;
    for interface in problem.analysis.model().interfaces().iter().map(|of| &of.interface) {
        let bodies = |facets: &[slipstick_mesh::FacetNodes]| -> Vec<usize> {
            let mut found: Vec<usize> =
                facets.iter().filter_map(|facet| body_of(facet[0])).filter(deformable).collect();
            found.dedup();
            found
        };
        let [slaves, masters] = [interface.slave_facets(), interface.master_facets()].map(bodies);
        let pairs = slaves.iter().flat_map(|&a| masters.iter().flat_map(move |&b| [(a, b), (b, a)]));
        for (designed, other) in pairs.filter(|&(designed, other)| is_designed(designed) && !is_designed(other)) {
            let ratio = softest_of(other) / stiffest(designed);
            if softest.is_none_or(|(.., known)| ratio < known) {
                softest = Some((designed, other, ratio));
            }
        }
    }
    let (designed, other, ratio) = softest.filter(|(.., ratio)| design.simp.minimum > *ratio)?;
    Some(Notice {
        kind: NoticeKind::StiffVoid,
        path: "design.simp.min".into(),
        message: format!(
            "the void of body `{}` (Young's modulus {}) is stiffer than body `{}` that touches it ({})",
            case.bodies[designed].name,
            quantity(design.simp.minimum * stiffest(designed)),
            case.bodies[other].name,
            quantity(softest_of(other))
        ),
        help: format!(
            "set `min` in `simp` to {:.0e} or less, a hundredth of the ratio of the two moduli",
            ratio / STIFFER_THAN_VOID
        ),
    })
}

/// A notice if the work of the loads is an objective of bodies that expand with temperature in the same load
/// case.
fn heated_compliance(case: &Case) -> Option<Notice> {
    let together = case.temperatures.iter().any(|heat| {
        let meets =
            |load: &Load| heat.load_case.is_none() || load.load_case.is_none() || heat.load_case == load.load_case;
        case.loads.iter().any(meets)
    });
    if !together || !case.bodies.iter().any(Body::expands) {
        return None;
    }
    let is_work = |name: &String| {
        let kind = case.quantities.iter().find(|quantity| quantity.name == *name).map(|quantity| &quantity.kind);
        matches!(kind, Some(QuantityKind::Compliance(_)))
    };
    let objective = case.objective.as_ref()?;
    let path = match &objective.kind {
        ObjectiveKind::Compliance { .. } => "objective.compliance",
        ObjectiveKind::Minimise(of) if of.sum.iter().any(|term| is_work(&term.quantity)) => "objective.minimise",
        _ => return None,
    };
    Some(Notice {
        kind: NoticeKind::HeatedCompliance,
        path: path.into(),
        message: "the work of the loads contains that of displacements by temperature: its smallest value is not \
                  that of the stiffest design"
            .into(),
        help: "minimise or bound a displacement instead, or take temperatures and loads to load cases of their own"
            .into(),
    })
}

/// Smallest distance between the centroids of two elements of the design that share a node; `None`
/// for a single element. \[L\]
fn nearest_centroids(problem: &Problem, centroids: &[[f64; 3]]) -> Option<f64> {
    let variables = problem.variables()?;
    let around = problem.mesh.node_elements();
    let squared = |a: u32, b: u32| -> f64 {
        let (a, b) = (centroids[a as usize], centroids[b as usize]);
        (0..3).map(|c| (a[c] - b[c]).powi(2)).sum()
    };
    let own = variables.domain();
    let of_element = |&e: &u32| {
        let nodes = problem.mesh.elements[e as usize].nodes();
        let others = nodes.iter().flat_map(|&node| around.of(node as usize)).filter(|&&other| other != e);
        let others = others.filter(|other| own.binary_search(other).is_ok());
        others.map(|&other| squared(e, other)).fold(f64::INFINITY, f64::min)
    };
    let nearest = own.iter().map(of_element).fold(f64::INFINITY, f64::min).sqrt();
    nearest.is_finite().then_some(nearest)
}
