//! Memory of runs: the prediction of `check`, the memory used, and cases that are refused.

use slipstick::mesh::{BoxShape, box_mesh};

use super::*;
use crate::abaqus::abaqus;
use crate::table::publish;

/// The elements of the bodies.
#[derive(Clone, Copy, PartialEq)]
enum Elements {
    Hexahedra,
    /// Two instead of each hexahedron.
    Wedges,
    /// Six instead of each hexahedron.
    Tetrahedra,
}

/// A run whose memory is predicted and measured: the case used in all tests, with other meshes.
struct Measured {
    name: &'static str,
    elements: Elements,
    /// Cells of the slab; the block has a third as many in each direction.
    cells: [usize; 3],
    enforcement: &'static str,
    /// Radius of the filter, or none. \[L\]
    filter: Option<f64>,
    /// Further tables of the case.
    more: &'static str,
}

const NOTHING_KEPT: &str = "[adjoint]\nmemory = \"0\"\n";
const DOUBLE: &str = "[adjoint]\nmemory = \"0\"\n[solver]\nlinear = \"multifrontal\"\n";
const ITERATIVE: &str = "[adjoint]\nmemory = \"0\"\n[solver]\nlinear = \"schwarz\"\n";
const LAGRANGE: &str = "{ lagrange = {} }";
const AUGMENTED: &str = "{ augmented = {} }";
const PENALTY: &str = "{ penalty = {} }";

/// A row of the table.
struct Row {
    name: &'static str,
    elements: u64,
    unknowns: u64,
    /// Without and with kept factors. \[MB\]
    predicted: [f64; 2],
    /// VmHWM. \[MB\]
    measured: f64,
}

impl Row {
    /// Ratio of measured to predicted memory. With kept factors, the prediction is a bound: steps
    /// share factors as long as the active set does not change.
    fn ratio(&self) -> f64 {
        let [least, most] = self.predicted;
        self.measured / self.measured.clamp(least, most)
    }

    fn line(&self) -> String {
        let Self { name, elements, unknowns, predicted: [least, most], measured } = self;
        let predicted = if most - least < 1.0 { format!("{most:.0}") } else { format!("{least:.0} … {most:.0}") };
        format!("| {name} | {elements} | {unknowns} | {predicted} | {measured:.0} | {:.2} |\n", self.ratio())
    }
}

impl Measured {
    fn place(&self) -> Place {
        let Self { elements, cells: [x, y, z], enforcement, filter, more, .. } = *self;
        let place = Place::new();
        let [slab, block] = [[x, y, z], [x, y, z].map(|n| n.div_ceil(3))];
        let mut case = CASE
            .replace("tolerance = { relative = 1e-11 }", "")
            .replace("steps = 4", "steps = 2")
            .replace("friction = 0.3", &format!("friction = 0.3\nenforcement = {enforcement}"));
        for (name, from, cells, min, max) in [
            ("slab", "[4, 2, 2]", slab, [0.0; 3], [4.0, 1.0, 2.0]),
            ("block", "[2, 1, 2]", block, [0.6, 1.0, 0.3], [2.0, 1.7, 1.6]),
        ] {
            let line = case.lines().find(|line| line.contains(from)).expect("the box").to_owned();
            let shape = BoxShape { min, max, elements: cells, grading: [1.0; 3] };
            let hexahedra = box_mesh(name, &shape).expect("a box");
            let mesh = match elements {
                Elements::Hexahedra => None,
                Elements::Wedges => Some(hexahedra.divided_into_wedges(|_| Some(1))),
                Elements::Tetrahedra => Some(hexahedra.divided(|_| true)),
            };
            let shape = match mesh {
                None => line.replace(from, &format!("{cells:?}")),
                Some(mesh) => {
                    place.write(&format!("{name}.inp"), &abaqus(&mesh));
                    format!("mesh = {{ file = \"{name}.inp\" }}")
                }
            };
            case = case.replace(&line, &shape);
        }
        let radius = filter.map_or(String::new(), |radius| format!("sensitivity_filter = {{ radius = {radius} }}"));
        case = case.replace("sensitivity_filter = { radius = 1.2 }", &radius);
        place.write("case.toml", &format!("{case}{more}"));
        place
    }

    fn row(&self) -> Row {
        let place = self.place();
        let inspection = place.good("--json check case.toml --threads 1").event("result")["inspection"].clone();
        let number = |name: &str| inspection[name].as_f64().expect("a number") / 1e6;
        let result = place.good("--json optimize case.toml --iterations 1 --threads 1").event("result");
        let bodies = inspection["bodies"].as_array().expect("bodies");
        let row = Row {
            name: self.name,
            elements: bodies.iter().map(|body| body["elements"].as_u64().expect("a number")).sum(),
            unknowns: inspection["unknowns"].as_u64().expect("a number"),
            predicted: [number("peak_bytes") - number("kept_bytes"), number("peak_bytes")],
            measured: result["peak_bytes"].as_f64().expect("a number") / 1e6,
        };
        print!("{}", row.line());
        row
    }
}

/// Rows of all runs, in the given order, one run at a time; each prediction is within 25 % of the
/// measurement.
fn measure(runs: &[Measured], tolerance: f64) -> Vec<Row> {
    let rows: Vec<Row> = runs.iter().map(Measured::row).collect();
    let wrong: String = rows.iter().filter(|row| (row.ratio() - 1.0).abs() > tolerance).map(Row::line).collect();
    assert!(wrong.is_empty(), "predictions off by more than {tolerance}\n{wrong}");
    rows
}

/// Prediction and measurement (`VmHWM`) agree within 15 %, for all elements and methods.
#[test]
fn predicted_memory_is_that_of_runs() {
    let run = |name, elements, enforcement, more| {
        let (cells, radius) = match elements {
            Elements::Hexahedra => ([16, 8, 10], 1.2),
            Elements::Wedges => ([16, 8, 10], 0.6),
            Elements::Tetrahedra => ([12, 6, 8], 0.4),
        };
        Measured { name, elements, cells, enforcement, filter: Some(radius), more }
    };
    let (hexahedra, wedges, tetrahedra) = (Elements::Hexahedra, Elements::Wedges, Elements::Tetrahedra);
    let runs = [
        run("Lagrange", hexahedra, LAGRANGE, NOTHING_KEPT),
        run("penalty", hexahedra, PENALTY, NOTHING_KEPT),
        run("plain Uzawa", hexahedra, "{ augmented = { acceleration = 0, tolerance = 1e-2 } }", NOTHING_KEPT),
        run("double precision", hexahedra, PENALTY, DOUBLE),
        run("kept factors", hexahedra, LAGRANGE, ""),
        Measured { cells: [24, 12, 15], ..run("iterative solver", hexahedra, LAGRANGE, ITERATIVE) },
        run("Lagrange", wedges, LAGRANGE, NOTHING_KEPT),
        run("penalty", wedges, PENALTY, NOTHING_KEPT),
        run("Lagrange", tetrahedra, LAGRANGE, NOTHING_KEPT),
        run("augmented", tetrahedra, AUGMENTED, NOTHING_KEPT),
    ];
    measure(&runs, 0.15);
}

/// The same where contact takes a good part of the memory, and spreads: a dome above a plate, on two
/// meshes.
#[test]
fn predicted_memory_includes_contact() {
    let place = Place::new();
    place.good("new half-ball --out ball.toml");
    let case = place.read("ball.toml");
    let [plate, ball] = ["elements = [14, 3, 14]", "elements = [10, 2, 1]"];
    assert!(case.contains(plate) && case.contains(ball), "the template's meshes");
    place.write("finer.toml", &case.replace(plate, "elements = [20, 4, 20]").replace(ball, "elements = [14, 3, 2]"));
    let set = "--threads 1 --set load_path.steps=2 --set adjoint.memory='0'";
    for name in ["ball", "finer"] {
        let inspection = place.good(&format!("--json check {name}.toml {set}")).event("result")["inspection"].clone();
        let ran = place.good(&format!("--json optimize {name}.toml --iterations 1 {set}")).event("result");
        let [predicted, measured] =
            [&inspection["peak_bytes"], &ran["peak_bytes"]].map(|of| of.as_f64().expect("a number"));
        let ratio = measured / predicted;
        assert!((0.85..=1.15).contains(&ratio), "{name}: {measured} instead of {predicted}: {ratio:.3}");
    }
}

/// The table in `docs/measurements/robustness.md`: 5,000 to 40,000 unknowns, with hexahedra, wedges and
/// tetrahedra.
#[test]
#[ignore = "takes minutes: docs/measure/robustness/measure.sh memory"]
fn table_of_memory() {
    let mut rows = String::from(
        "| | elements | unknowns | predicted [MB] | measured [MB] | measured / predicted |\n|---|---|---|---|---|---|\n",
    );
    for (kind, elements) in
        [("hexahedra", Elements::Hexahedra), ("wedges", Elements::Wedges), ("tetrahedra", Elements::Tetrahedra)]
    {
        rows += &format!("| **{kind}** | | | | | |\n");
        for (cells, radius) in [([16, 8, 10], 0.6), ([24, 12, 15], 0.4), ([33, 17, 21], 0.3)] {
            let run = |name, enforcement, filter, more| Measured { name, elements, cells, enforcement, filter, more };
            let mut runs = vec![run("Lagrange, filter", LAGRANGE, Some(radius), NOTHING_KEPT)];
            if cells[0] < 30 {
                runs.push(run("Lagrange, no filter", LAGRANGE, None, NOTHING_KEPT));
                runs.push(run("augmented, filter", AUGMENTED, Some(radius), NOTHING_KEPT));
                runs.push(run("Lagrange, filter, kept factors", LAGRANGE, Some(radius), ""));
            }
            rows += &measure(&runs, 0.15).iter().map(Row::line).collect::<String>();
        }
    }
    publish("memory", &rows);
}

/// A run that would exceed the memory available to the process is refused before it begins, with
/// the cure: less memory for kept factors if that is enough, otherwise fewer elements. `check`
/// reports the same and shows the rest.
#[test]
fn runs_larger_than_the_memory() {
    let place = Place::new();
    let case = CASE.replace("elements = [4, 2, 2]", "elements = [12, 8, 8]").replace("steps = 4", "steps = 40");
    place.write("case.toml", &case);
    let limited = |line: &str, megabytes: f64| {
        let mut command = Command::new("sh");
        command.current_dir(place.folder.path()).env("MALLOC_ARENA_MAX", "1").arg("-c");
        command.arg(format!("ulimit -v {:.0}; exec \"$0\" --threads 1 \"$@\"", 1e6 * megabytes / 1024.0));
        command.arg(env!("CARGO_BIN_EXE_slipstick")).args(line.split_whitespace());
        Ran::new(line, command.output().expect("sh"))
    };
    let inspection = place.good("--json check case.toml --threads 1").event("result")["inspection"].clone();
    let number = |name: &str| inspection[name].as_f64().expect("a number") / 1e6;
    let (peak, kept) = (number("peak_bytes"), number("kept_bytes"));
    assert!(kept > 0.5 * peak, "{kept} of {peak}");
    // The program's code and stacks also use address space, so a little less than the limit is
    // left.
    for (megabytes, help) in [(peak, "memory = \""), (peak - kept, "use fewer elements")] {
        let ran = limited("gradient case.toml", megabytes);
        assert_eq!(ran.code, Some(2), "{}", ran.err);
        for part in ["a run needs about", "too_large", help] {
            assert!(ran.err.contains(part), "no `{part}` in {}", ran.err);
        }
        let checked = limited("check case.toml", megabytes);
        assert_eq!(checked.code, Some(0), "{}", checked.err);
        assert!(checked.err.contains("warning: a run needs about"), "{}", checked.err);
    }
    assert!(!place.path("case_gradient").exists(), "nothing began");
}
