//! Design, objective and optimizer.

use super::super::CaseCode;
use super::super::document::Table;
use super::super::names::Names;
use super::super::reader::Reader;
use super::super::resolved::{
    Body, DensityFilter, Design, EnergyInterpolation, FilterBoundary, MmaParameters, Optimizer, OptimizerMethod,
    Projection, Region, SensitivityFilter, Shape, Simp,
};
use super::schedule::schedule;
use super::shaping;
use slipstick_design::{Method, Schedule};
use slipstick_solid::Interpolation;

pub(super) fn design(root: &Table<'_>, names: &Names, bodies: &[Body]) -> Option<Design> {
    let table = root.table("design")?;
    let design_bodies = design_bodies(&table, names, bodies);
    let fraction = |key| {
        let range = |&value: &f64| value > 0.0 && value <= 1.0;
        table.number(key).check(CaseCode::Fraction, range, "must lie in (0, 1]", "")
    };
    let volume_fraction = fraction("volume_fraction").optional();
    table.require_one_of(
        &["initial", "volume_fraction"],
        "[design] needs `initial`, the density at the start, or `volume_fraction`, which it then equals",
    );
    let initial = fraction("initial").or(volume_fraction.unwrap_or(1.0));
    let sensitivity_filter = table.table("sensitivity_filter").map(|filter| {
        let radius = radius(&filter);
        filter.finish();
        SensitivityFilter { radius }
    });
    let minimum_thickness = table.number("minimum_thickness").positive(CaseCode::OutOfRange).optional();
    let density_filter = table.table("density_filter").map(|filter| density_filter(filter, minimum_thickness));
    let density_filter = density_filter.or(minimum_thickness.map(DensityFilter::for_thickness));
    let projection = table.table("projection").map(|projection_table| projection(projection_table, minimum_thickness));
    let projection = projection.or(minimum_thickness.map(|_| Projection::DEFAULT));
    check_filters(&table);
    let (symmetry, pattern) = (shaping::symmetries(&table, &design_bodies), shaping::patterns(&table, &design_bodies));
    let design = Design {
        bodies: design_bodies,
        initial,
        volume_fraction,
        simp: simp(&table),
        void_poisson_ratio: table
            .number("void_poisson_ratio")
            .check(CaseCode::Simp, |&nu| -1.0 < nu && nu < 0.5, "must lie between -1 and 0.5", "0.3 is usual")
            .optional(),
        bulk_p: table
            .number("bulk_p")
            .check(CaseCode::Simp, |&p| p >= 1.0, "must be at least 1", "3 is usual")
            .or(Interpolation::BULK),
        yield_p: table
            .number("yield_p")
            .check(
                CaseCode::Simp,
                |&p| p >= 1.0,
                "must be at least 1",
                "2.5 is usual; omit it for that of the stiffness",
            )
            .optional(),
        mass_p: table
            .number("mass_p")
            .check(CaseCode::Simp, |&p| p >= 1.0, "must be at least 1", "1 is the mass of the material")
            .or(1.0),
        energy_interpolation: table.table("energy_interpolation").map(energy_interpolation),
        sensitivity_filter,
        density_filter,
        projection,
        minimum_thickness,
        overhang: shaping::overhang(&table),
        symmetry,
        extrude: shaping::extrude(&table),
        pattern,
        passive_solid: shaping::regions(&table, "passive_solid", names),
        passive_void: shaping::regions(&table, "passive_void", names),
    };
    let may_vanish = root.has("optimizer") || !design.passive_void.is_empty();
    if may_vanish && design.simp.minimum == 0.0 {
        table.reader.warning(
            "design.simp.min",
            CaseCode::Simp,
            "elements of density 0 have no stiffness: if they surround a node, the equations cannot be solved",
            "1e-3 is usual; use 0 only for a design without void elements",
        );
    }
    check_passive(table.reader, &design, names, bodies);
    check_yield_power(&table, &design, bodies);
    check_void_poisson_ratio(&table, &design, bodies);
    table.finish();
    Some(design)
}

fn radius(filter: &Table<'_>) -> f64 {
    let help = "in the unit of length, for instance 1.5 element sizes";
    filter.number("radius").positive(CaseCode::OutOfRange).required(1.0, help)
}

/// With a minimum thickness, the radius follows from it and may be omitted.
fn density_filter(table: Table<'_>, thickness: Option<f64>) -> DensityFilter {
    let radius = match thickness {
        Some(thickness) => {
            let follows = DensityFilter::for_thickness(thickness).radius;
            let same = |radius: &f64| *radius == follows;
            let radius = table.number("radius");
            radius.check(CaseCode::ChooseOne, same, "follows from `design.minimum_thickness`", "omit it").or(follows)
        }
        None => radius(&table),
    };
    let words = [("truncated", FilterBoundary::Truncated), ("void", FilterBoundary::Void)];
    let boundary = table.word("boundary", &words).or(FilterBoundary::Truncated);
    table.finish();
    DensityFilter { radius, boundary }
}

/// With a minimum thickness, the threshold is 0.5.
fn projection(table: Table<'_>, thickness: Option<f64>) -> Projection {
    let Projection { sharpness, threshold } = Projection::DEFAULT;
    let sharpness = table.number("sharpness").positive(CaseCode::OutOfRange).or(sharpness);
    let in_range = |threshold: &f64| (0.0..=1.0).contains(threshold);
    let help = "usually 0.5";
    let threshold =
        table.number("threshold").check(CaseCode::OutOfRange, in_range, "must lie in [0, 1]", help).or(threshold);
    if thickness.is_some() && threshold != Projection::DEFAULT.threshold {
        let message = "`threshold` must be 0.5 with `design.minimum_thickness`";
        table.reader.error(&table.path_of("threshold"), CaseCode::ChooseOne, message, "omit it");
    }
    table.finish();
    Projection { sharpness, threshold }
}

/// A sensitivity filter replaces the gradient with respect to the densities; that with respect to
/// filtered or projected variables is exact.
fn check_filters(table: &Table<'_>) {
    if !table.has("sensitivity_filter") {
        return;
    }
    let cures = [
        ("density_filter", "keep one of the two; `density_filter` gives exact gradients, which `gcmma` needs"),
        ("projection", "replace `sensitivity_filter` by `density_filter`, or omit `projection`"),
        ("minimum_thickness", "omit `sensitivity_filter`: a density filter of this radius replaces it"),
        ("overhang", "replace `sensitivity_filter` by `density_filter`, or omit `overhang`"),
    ];
    if let Some((key, cure)) = cures.into_iter().find(|(key, _)| table.has(key)) {
        let message = format!("`{key}` cannot be combined with `sensitivity_filter`");
        table.reader.error(&table.path_of(key), CaseCode::Unsupported, message, cure);
    }
}

/// The power of the yield stress needs a law with memory, and a void with some stiffness.
fn check_yield_power(table: &Table<'_>, design: &Design, bodies: &[Body]) {
    let has_memory = |body: &Body| {
        design.bodies.contains(&body.name) && body.materials().any(|material| material.kind().has_memory())
    };
    if design.yield_p.is_some() && design.simp.minimum == 0.0 {
        let message =
            "`yield_p` needs a void with some stiffness: without it, stiffness and yield stress vanish together";
        table.reader.error(&table.path_of("yield_p"), CaseCode::Simp, message, "set simp.min, usually to 1e-3");
    }
    if !bodies.iter().any(has_memory) && design.yield_p.is_some() {
        let message = "no design body has a law with a yield stress";
        table.reader.error(&table.path_of("yield_p"), CaseCode::Unsupported, message, "omit it");
    }
}

/// The void's Poisson's ratio needs laws with a bulk modulus, all of them stiffer against a change of volume.
fn check_void_poisson_ratio(table: &Table<'_>, design: &Design, bodies: &[Body]) {
    let (reader, path) = (table.reader, table.path_of("void_poisson_ratio"));
    let Some(ratio) = design.void_poisson_ratio else {
        if table.has("bulk_p") {
            let message = "`bulk_p` has no effect without `void_poisson_ratio`";
            reader.error(&table.path_of("bulk_p"), CaseCode::Simp, message, "add void_poisson_ratio = 0.3, or omit it");
        }
        return;
    };
    for body in bodies.iter().filter(|body| design.bodies.contains(&body.name)) {
        for material in body.materials() {
            if material.with_poisson_ratio(ratio).is_none() {
                let law = material.kind().word();
                let message =
                    format!("the void of `{}` cannot have another Poisson's ratio with the law `{law}`", body.name);
                let help = "omit it, or choose an elastic, isotropic law such as neo_hooke";
                reader.error(&path, CaseCode::Unsupported, message, help);
            } else if ratio >= material.poisson_ratio() {
                let own = material.poisson_ratio();
                let message = format!("must be smaller than Poisson's ratio of `{}`, {own}", body.name);
                reader.error(
                    &path,
                    CaseCode::Simp,
                    message,
                    "0.3 is usual for a nearly incompressible body; for others, omit it",
                );
            }
        }
    }
}

fn design_bodies(table: &Table<'_>, names: &Names, all: &[Body]) -> Vec<String> {
    let reader = table.reader;
    let one = |value, path: String| {
        let name = reader.string(value, "the name of a body")?;
        names.check_body(reader, &path, &name);
        Some((name, path))
    };
    let help = "list the names of the bodies to be designed";
    let listed = table
        .list("bodies", one)
        .check(CaseCode::EmptyDesign, |list| !list.is_empty(), "is empty: there is nothing to design", help)
        .required(Vec::new(), help);
    let mut bodies: Vec<String> = Vec::new();
    for (name, path) in listed {
        if bodies.contains(&name) {
            let message = format!("`{name}` is listed twice");
            reader.error(&path, CaseCode::DuplicateName, message, "");
        } else if all.iter().any(|body| body.name == name && body.rigid.is_some()) {
            let message = format!("`{name}` is rigid: its density changes nothing");
            let help = "design other bodies, or give this one a material instead of `rigid`";
            reader.error(&path, CaseCode::Unsupported, message, help);
        } else {
            bodies.push(name);
        }
    }
    bodies
}

fn simp(table: &Table<'_>) -> Simp {
    let mut simp = Simp::default();
    if let Some(table) = table.table("simp") {
        let at_least_one = |&p: &f64| p >= 1.0;
        let p = table.number("p").check(CaseCode::Simp, at_least_one, "must be at least 1", "3 is usual");
        simp.penalization = p.or(simp.penalization);
        let help = "the ratio of the void's to the solid's stiffness, usually 1e-3";
        let fraction = |min: &f64| (0.0..1.0).contains(min);
        simp.minimum = table.number("min").check(CaseCode::Simp, fraction, "must lie in [0, 1)", help).or(simp.minimum);
        table.finish();
    }
    simp
}

fn energy_interpolation(table: Table<'_>) -> EnergyInterpolation {
    let EnergyInterpolation { threshold, sharpness } = EnergyInterpolation::PUBLISHED;
    let threshold = table
        .number("threshold")
        .check(
            CaseCode::OutOfRange,
            |&x| x > 0.0 && x < 1.0,
            "must lie between 0 and 1, bounds excluded",
            "a threshold on the density to the power p, usually 0.01",
        )
        .or(threshold);
    let sharpness = table.number("sharpness").positive(CaseCode::OutOfRange).or(sharpness);
    table.finish();
    EnergyInterpolation { threshold, sharpness }
}

/// Checks the volumes of passive elements if the case file alone determines them, that is, if all
/// design bodies are uniform, unrotated boxes, and regions do not refer to the mesh. Otherwise they
/// are checked once the mesh exists.
fn check_passive(reader: &Reader, design: &Design, names: &Names, bodies: &[Body]) {
    // a shape that cannot be read has a stand-in
    if design.passive_solid.is_empty() || design.bodies.iter().any(|body| names.is_shapeless(body)) {
        return;
    }
    let depends_on_mesh = |region: &Region| region.contains([0.0; 3]).is_none();
    if design.passive_solid.iter().chain(&design.passive_void).any(depends_on_mesh) {
        return;
    }
    let inside = |regions: &[Region], point| regions.iter().any(|region| region.contains(point) == Some(true));
    let (mut solid, mut total, mut both) = (0.0, 0.0, false);
    for body in bodies.iter().filter(|body| design.bodies.contains(&body.name)) {
        let Some((volume, centroids)) = uniform_elements(body) else {
            return;
        };
        for point in centroids {
            total += volume;
            if inside(&design.passive_solid, point) {
                solid += volume;
                both |= inside(&design.passive_void, point);
            }
        }
    }
    if both {
        reader.error(
            "design.passive_void",
            CaseCode::ContradictoryPassive,
            "some elements are both passive solid and passive void",
            "make the regions disjoint; an element belongs to a region that contains its centroid",
        );
    }
    if let Some(limit) = design.volume_fraction
        && solid > limit * total * (1.0 + 1e-12)
    {
        let fraction = solid / total;
        reader.error(
            "design.volume_fraction",
            CaseCode::InfeasibleVolume,
            format!("passive solid elements already fill {fraction:.4} of the volume of the design bodies"),
            "raise `volume_fraction` above that, or shrink `passive_solid`",
        );
    }
}

/// Element volume and centroids of a uniform, unrotated box of at most a million elements.
fn uniform_elements(body: &Body) -> Option<(f64, impl Iterator<Item = [f64; 3]>)> {
    let Shape::Box { min, max, elements, grading } = body.shape else {
        return None;
    };
    let count = body.shape.element_count().filter(|&count| count <= 1_000_000)?;
    if grading != [1.0; 3] || body.place.rotate.is_some() {
        return None;
    }
    let size: [f64; 3] = std::array::from_fn(|i| (max[i] - min[i]) / elements[i] as f64);
    let shift = body.place.translate;
    let centroid = move |number: usize| {
        let [nx, ny, _] = elements;
        let index = [number % nx, number / nx % ny, number / (nx * ny)];
        std::array::from_fn(|i| shift[i] + min[i] + (index[i] as f64 + 0.5) * size[i])
    };
    Some((size.iter().product(), (0..count).map(centroid)))
}

pub(super) fn warn_initial(reader: &Reader, design: &Design, optimizer: Option<&Optimizer>) {
    let first = optimizer.and_then(|optimizer| optimizer.schedule.volume_fraction.at(0));
    if let Some(limit) = first.or(design.volume_fraction)
        && design.initial > limit
    {
        reader.warning(
            "design.initial",
            CaseCode::InitialVolume,
            format!("the initial density ({}) violates the volume constraint ({limit})", design.initial),
            "the optimizer will first remove material; usually initial = volume_fraction",
        );
    }
}

pub(super) fn optimizer(root: &Table<'_>, design: Option<&Design>) -> Option<Optimizer> {
    let table = root.table("optimizer")?;
    let unbounded = design.is_some_and(|design| design.volume_fraction.is_none()) && !root.has("constraint");
    if unbounded && !table.reader.contains("design.volume_fraction") && !root.has_misspelt("constraint") {
        table.reader.error(
            "design",
            CaseCode::MissingKey,
            "an optimization needs the key `volume_fraction` in [design]",
            "the bound on the mean density, in (0, 1]; or bound quantities with [[constraint]]",
        );
    }
    let words = [("mma", OptimizerMethod::Mma), ("gcmma", OptimizerMethod::Gcmma)];
    let method = table.word("method", &words).or(OptimizerMethod::Mma);
    let conservative = method == OptimizerMethod::Gcmma;
    let filtered = design.is_some_and(|design| design.sensitivity_filter.is_some());
    let inner_iterations = table
        .integer("inner_iterations")
        .count(CaseCode::OutOfRange, 0)
        .check(
            CaseCode::Unsupported,
            |_| conservative,
            "requires `method = \"gcmma\"`",
            "omit it, or change the method",
        )
        .optional();
    let inner_iterations = conservative.then(|| inner_iterations.unwrap_or(Method::INNER_ITERATIONS));
    if conservative && filtered {
        table.reader.warning(
            "optimizer.method",
            CaseCode::FilteredGradients,
            "the sensitivity filter changes the gradients, so GCMMA cannot keep the objective from rising",
            "use `density_filter` for monotone progress, or `method = \"mma\"`, which needs fewer marches",
        );
    }
    let given = |name| table.table(name).is_some_and(|table| table.has("move_limit"));
    let limited = given("mma") || given("schedule");
    let adaptive = table
        .boolean("adaptive")
        .check(
            CaseCode::Unsupported,
            |&adaptive| !(adaptive && conservative),
            "requires `method = \"mma\"`",
            "omit it: GCMMA shortens updates by itself",
        )
        .or(!conservative && !limited && !filtered);
    let mma = table.table("mma").map_or(MmaParameters::for_densities(), mma);
    let iterations = table
        .integer("iterations")
        .count(CaseCode::OutOfRange, 1)
        .required(1, "the number of design iterations, for instance 100");
    let criterion = |key| table.number(key).positive(CaseCode::OutOfRange).optional();
    let (tolerance, optimality) = (criterion("tolerance"), criterion("optimality"));
    let share = |&value: &f64| value > 0.0 && value < 1.0;
    let discreteness = table
        .number("discreteness")
        .check(CaseCode::OutOfRange, share, "must lie between 0 and 1, bounds excluded", "for instance 0.05")
        .optional();
    let mut schedule = table.table("schedule").map_or(Schedule::default(), |table| schedule(table, design, iterations));
    let projected = design.is_some_and(|design| design.projection.is_some());
    if schedule.sharpness.is_empty() && projected && !table.reader.contains("design.projection.sharpness") {
        schedule.sharpness = Projection::continuation(iterations);
    }
    table.finish();
    Some(Optimizer {
        method,
        inner_iterations,
        mma,
        adaptive,
        iterations,
        tolerance,
        optimality,
        discreteness,
        schedule,
    })
}

fn mma(table: Table<'_>) -> MmaParameters {
    let mut parameters = MmaParameters::for_densities();
    let mut readable = true;
    for (name, value) in parameters.by_name() {
        let read = table.number(name).optional();
        readable &= read.is_some() || !table.has(name);
        *value = read.unwrap_or(*value);
    }
    for (name, value, range) in parameters.out_of_range().filter(|_| readable) {
        // the range of `asymin` depends on `asymax`, which may be the one that is given
        let given = if table.has(name) { name } else { "asymax" };
        let message = format!("`{name}` must be {range}, but is {value}");
        table.reader.error(&table.path_of(given), CaseCode::OutOfRange, message, "");
    }
    table.finish();
    parameters
}
