//! Checks whether passive regions and the filter of a design have any effect.

use super::{Notice, NoticeKind};
use crate::build::{Problem, Regions};
use crate::case::Case;
use slipstick_model::words::quantity;

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
    let of_filter = |key: &str, radius: f64| (format!("design.{key}.radius"), radius);
    let sensitivities = design.sensitivity_filter.map(|filter| of_filter("sensitivity_filter", filter.radius));
    let filter = design.density_filter.map(|filter| of_filter("density_filter", filter.radius)).or(sensitivities);
    let scheduled = case.optimizer.iter().flat_map(|optimizer| optimizer.schedule.filter_radius.entries());
    let scheduled = (0..).zip(scheduled).map(|(i, &(_, radius))| {
        let path = format!("optimizer.schedule.filter_radius[{i}]");
        (path, radius)
    });
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
