//! The design variables of a case: designed and passive elements, and elements that share a variable.

use slipstick_design::{DesignError, DesignVariables, Motion, Places, TieError, Ties};
use slipstick_mesh::Mesh;
use slipstick_model::words::{counted, quantity};

use super::BuildError;
use super::regions::Regions;
use crate::file::{Case, CaseCode, Design, DesignSymmetry};

pub(super) fn build_variables(case: &Case, mesh: &Mesh) -> Result<Option<DesignVariables>, BuildError> {
    let Some(design) = &case.design else {
        return Ok(None);
    };
    let mut domain = Vec::new();
    for (i, name) in design.bodies.iter().enumerate() {
        let body = mesh.body(name).ok_or_else(|| {
            BuildError::new(format!("design.bodies[{i}]"), format!("there is no body `{name}`"), "name a [[body]]")
        })?;
        domain.extend(body.elements.clone().map(|e| e as u32));
    }
    let regions = Regions::new(mesh, &domain);
    let inside = |listed| -> Vec<u32> { regions.each(listed).concat() };
    let (solid, void) = (inside(&design.passive_solid), inside(&design.passive_void));
    let variables = DesignVariables::new(mesh.elements.len(), &domain, &solid, &void).map_err(|error| {
        let refused = BuildError::new("design", &error, "change bodies or passive regions");
        match error {
            DesignError::Empty { .. } => refused.with_code(CaseCode::EmptyDesign),
            _ => refused,
        }
    })?;
    let scheduled = case.optimizer.iter().flat_map(|optimizer| optimizer.schedule.volume_fraction.entries());
    let scheduled =
        (0..).zip(scheduled).map(|(i, &(_, limit))| (format!("optimizer.schedule.volume_fraction[{i}]"), limit));
    let given = design.volume_fraction.map(|limit| ("design.volume_fraction".to_owned(), limit));
    for (path, limit) in given.into_iter().chain(scheduled) {
        variables
            .check_limit(&mesh.element_volumes(), limit)
            .map_err(|e| BuildError::new(path, e, "raise the fraction or shrink the passive solid"))?;
    }
    let ties = ties(design, mesh, variables.domain())?;
    Ok(Some(match ties {
        Some(ties) => variables.tied(ties),
        None => variables,
    }))
}

/// Which elements of the design domain share a variable; `None` if the case ties none.
fn ties(design: &Design, mesh: &Mesh, domain: &[u32]) -> Result<Option<Ties>, BuildError> {
    if design.symmetry.is_empty() && design.pattern.is_empty() && design.extrude.is_none() {
        return Ok(None);
    }
    let centroids = mesh.centroids();
    let mut ties = Ties::new(domain.len());
    // ties the elements of one body or, without a name, of all
    let mut tie = |path: String, body: Option<&String>, tie: &dyn Fn(&mut Ties, &Places) -> Result<(), TieError>| {
        let own = body.map(|name| mesh.body(name).map_or(0..0, |body| body.elements.clone()));
        let member = |position: &u32| {
            let element = domain[*position as usize] as usize;
            own.as_ref().is_none_or(|own| own.contains(&element))
        };
        let members: Vec<u32> = (0..domain.len() as u32).filter(member).collect();
        let global = |position: usize| domain[members[position] as usize];
        let places = Places::new((0..members.len()).map(|position| centroids[global(position) as usize]).collect());
        let mut part = Ties::new(places.len());
        tie(&mut part, &places).map_err(|error| {
            let (message, help) = explained(&error, &|position| element(mesh, global(position), &centroids));
            BuildError::new(path, message, help)
        })?;
        ties.add(&members, part);
        Ok(())
    };
    for (i, symmetry) in design.symmetry.iter().enumerate() {
        let motion = motion(symmetry);
        tie(format!("design.symmetry[{i}]"), symmetry.body(), &|ties, places| ties.symmetric(places, &motion))?;
    }
    for (i, pattern) in design.pattern.iter().enumerate() {
        let repeat = |ties: &mut Ties, places: &Places| ties.repeated(places, pattern.step, pattern.count);
        tie(format!("design.pattern[{i}]"), pattern.body.as_ref(), &repeat)?;
    }
    if let Some(direction) = design.extrude {
        for name in &design.bodies {
            let extrude = |ties: &mut Ties, places: &Places| ties.extruded(places, direction.vector());
            tie("design.extrude".into(), Some(name), &extrude)?;
        }
    }
    Ok(Some(ties))
}

fn motion(symmetry: &DesignSymmetry) -> Motion {
    match *symmetry {
        DesignSymmetry::Plane { normal, at, .. } => {
            let normal: [f64; 3] = std::array::from_fn(|k| if k == normal.index() { 1.0 } else { 0.0 });
            Motion::Mirror { through: normal.map(|x| at * x), normal }
        }
        DesignSymmetry::InclinedPlane { normal, through, .. } => Motion::Mirror { through, normal },
        DesignSymmetry::Rotation { axis, through, folds, .. } => {
            Motion::Rotation { through, axis: axis.vector(), folds }
        }
    }
}

/// An element with its body and its place.
fn element(mesh: &Mesh, element: u32, centroids: &[[f64; 3]]) -> String {
    let body = mesh.bodies.iter().find(|body| body.elements.contains(&(element as usize)));
    let body = body.map_or("", |body| body.name.as_str());
    format!("element {element} ({body}, centroid {})", point(centroids[element as usize]))
}

fn point(x: [f64; 3]) -> String {
    format!("[{}]", x.map(quantity).join(", "))
}

/// What is wrong, and the cure.
fn explained(error: &TieError, element: &dyn Fn(usize) -> String) -> (String, &'static str) {
    match *error {
        TieError::NoImage { element: of, image, nearest, distance, ratio, count } => (
            format!(
                "the mesh of the design bodies is not symmetric: {} without an image; the image {} of {} is {} from \
                 the nearest centroid, that of {}: {} of the distance between neighbouring centroids",
                counted(count, "element"),
                point(image),
                element(of),
                quantity(distance),
                element(nearest),
                percent(ratio),
            ),
            "correct the plane or axis, design only bodies that have this symmetry, or mesh them symmetrically: an image \
             must be within 10 % of a centroid",
        ),
        TieError::Repetitions { element: of, found, count, ratio } => {
            let beyond = match found < count {
                true => format!(
                    ": the next image is {} of the distance between neighbouring centroids from the nearest centroid",
                    percent(ratio)
                ),
                false => String::new(),
            };
            (
                format!("{} begins a row of {}, not of {count}{beyond}", element(of), counted(found, "element")),
                "give the number of cells that fill the design bodies, and a step along which the mesh repeats: an \
                 image must be within 10 % of a centroid",
            )
        }
        TieError::Columns { first, second, distance, ratio } => (
            format!(
                "the mesh has no columns in this direction: seen along it, {} and {} are {} apart, {} of the distance \
                 between neighbouring centroids",
                element(first),
                element(second),
                quantity(distance),
                percent(ratio),
            ),
            "choose the direction in which the mesh was extruded: in a column, centroids are within 10 % of a line",
        ),
    }
}

fn percent(ratio: f64) -> String {
    format!("{} %", quantity((1e3 * ratio).round() / 10.0))
}
