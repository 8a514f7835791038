//! Cases with mesh files: the pair of bodies used in all these tests, as written by Gmsh.

use super::*;

/// The case with both bodies from `folder/pair.msh`.
pub fn meshed() -> Place {
    let place = Place::new();
    let mesh = |part: &str| format!("mesh = {{ file = \"meshes/pair.msh\", part = \"{part}\" }}");
    let text = CASE
        .replace("box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }", &mesh("slab"))
        .replace("box = { min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6], elements = [2, 1, 2] }", &mesh("block"))
        .replace("_ymin", "_bottom")
        .replace("_ymax", "_top");
    assert_eq!(text.matches("pair.msh").count(), 2);
    place.write("case.toml", &text);
    std::fs::create_dir(place.path("meshes")).expect("a folder");
    copy(&place, "gmsh_41_binary.msh", "meshes/pair.msh");
    place
}

pub fn copy(place: &Place, from: &str, to: &str) {
    let from = format!("{}/../meshio/tests/data/{from}", env!("CARGO_MANIFEST_DIR"));
    std::fs::copy(&from, place.path(to)).unwrap_or_else(|error| panic!("{from}: {error}"));
}

/// Forward analysis and gradient of the program, compared with those of the generated boxes.
#[test]
fn meshed_bodies_give_what_generated_ones_give() {
    let place = meshed();
    place.write("boxes.toml", CASE);
    let [meshed, boxes] = ["case", "boxes"].map(|case| {
        place.good(&format!("--json gradient {case}.toml")).event("result")["objective"].as_f64().expect("a number")
    });
    // Gmsh's nodes are off by 2e-12
    assert!(((meshed - boxes) / boxes).abs() < 1e-9, "{meshed} {boxes}");
    place.good("verify gradient case.toml");
    let shown = place.good("check case.toml").out;
    for name in ["slab_top", "block_bottom", "slab_edge", "slab_corner"] {
        assert!(shown.contains(name), "{shown}");
    }
    let resolved = place.good("check case.toml --resolved").out;
    assert!(resolved.contains("sha256 = \""), "{resolved}");
}

/// Numbers in a case written for people have only meaningful digits, not `1.8699999999999999`. The
/// mesh is moved so that sums of its coordinates are not round numbers.
#[test]
fn numbers_of_written_cases_are_short() {
    let folder = format!("{}/../meshio/tests/data", env!("CARGO_MANIFEST_DIR"));
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder).expect("there").map(|e| e.expect("read").path()).collect();
    files.retain(|file| file.extension().is_some_and(|end| ["msh", "inp", "vtu"].iter().any(|known| end == *known)));
    assert!(files.len() > 10);
    let place = Place::new();
    let moved =
        std::fs::read_to_string(format!("{folder}/meshio.inp")).expect("text").replace(", 1.7", ", 1.7000000000000002");
    place.write("moved.inp", &moved);
    files.push(place.path("moved.inp"));
    let digits = |word: &str| {
        let mantissa = word.split(['e', 'E']).next().unwrap_or_default();
        mantissa.bytes().filter(u8::is_ascii_digit).skip_while(|digit| *digit == b'0').count()
    };
    let mut numbers = 0;
    for file in files {
        let ran = place.run(&format!("new --mesh {} --out -", file.display()));
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        for word in ran.out.split(|c: char| !(c.is_ascii_digit() || ".eE+-".contains(c))) {
            if word.parse::<f64>().is_ok() {
                numbers += 1;
                assert!(digits(word) <= 10, "{name}: {word}");
            }
        }
    }
    assert!(numbers > 200, "{numbers}");
}

/// A run continues with its own copy of the mesh, whatever happens to the original, and not with a
/// different mesh.
#[test]
fn a_run_keeps_its_meshes_and_notices_changed_ones() {
    let place = meshed();
    place.good("optimize case.toml --out whole --iterations 2");
    place.good("optimize case.toml --out parts --iterations 1");
    let record = place.json("parts/run.json");
    let inputs = record["inputs"].as_array().expect("inputs");
    assert_eq!(inputs.len(), 1, "one file of two bodies");
    assert_eq!((&inputs[0]["name"], &inputs[0]["stored"]), (&"meshes/pair.msh".into(), &"mesh_0001.msh".into()));
    assert_eq!(inputs[0]["sha256"], record["case"]["body"][0]["mesh"]["sha256"]);

    copy(&place, "gmsh_22_ascii.msh", "meshes/pair.msh");
    place.good("resume parts --iterations 2");
    assert_eq!(place.read("whole/design.csv"), place.read("parts/design.csv"), "with the old mesh");
    place.good("render parts");

    copy(&place, "gmsh_22_ascii.msh", "parts/mesh_0001.msh");
    let expected =
        ["case.toml:", "is not the mesh that this run was started with", "SHA-256", "[slipstick::case::mesh_file]"];
    place.bad("resume parts --iterations 3", 2, &expected);
    place.bad("render parts", 2, &expected);

    // files of the old run are removed with it, and only those
    place.write("parts/mesh_of_mine.msh", "x");
    place.good("solve case.toml --out parts --force");
    assert!(place.path("parts/mesh_0001.msh").exists() && place.path("parts/mesh_of_mine.msh").exists());
    assert_eq!(place.json("parts/run.json")["inputs"].as_array().map(Vec::len), Some(1));
}

#[test]
fn missing_and_wrong_mesh_files_are_said_at_their_place() {
    let place = meshed();
    copy(&place, "gmsh_41_second_order.msh", "meshes/pair.msh");
    place.good("check case.toml");
    place.good("check case.toml --set body[0].mesh.first_order=true --set body[1].mesh.first_order=true");
    std::fs::remove_file(place.path("meshes/pair.msh")).expect("removed");
    place.bad("check case.toml", 2, &["case.toml:4:17: error: cannot read the mesh file meshes/pair.msh", "folder"]);
}

/// Two cubes, one on the other, with the face between them as a surface, and a set whose name colours a terminal.
const COLUMN: &str = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
    9,0,0,2\n10,1,0,2\n11,1,1,2\n12,0,1,2\n*ELEMENT, TYPE=C3D8, ELSET=ALL\n1,1,2,3,4,5,6,7,8\n\
    2,5,6,7,8,9,10,11,12\n*SURFACE, NAME=CUT\n1, S2\n*SURFACE, NAME=HEAD\n2, S2\n*NSET, NSET=FOOT\n1,2,3,4\n\
    *NSET, NSET=a\u{1b}[31m\u{202e}b\n1,2\n";

fn column() -> Place {
    let place = Place::new();
    place.write("column.inp", COLUMN);
    let text = "[[body]]\nname = 'c'\nmesh = { file = 'column.inp' }\n\
        material = { linear_elastic = { youngs_modulus = 1.0, poisson_ratio = 0.0 } }\n\
        [[dirichlet]]\nset = 'c_FOOT'\n[[load]]\nsurface = 'c_HEAD'\nforce = [0, 0, 0.1]\n[load_path]\nsteps = 1\n";
    place.write("case.toml", text);
    place
}

#[test]
fn an_unused_inner_surface_is_no_error() {
    let place = column();
    place.good("check case.toml");
    let expected = ["column.inp: surface `CUT`, facet at (0.5000, 0.5000, 1.0000)", "lies between two elements"];
    place.bad("check case.toml --set load[0].surface=c_CUT", 2, &expected);
}

#[test]
fn names_do_not_reach_the_terminal_raw() {
    let shown = column().good("check case.toml").out;
    assert!(shown.contains("c_a\\u{1b}[31m\\u{202e}b"), "{shown}");
    assert!(!shown.contains(['\u{1b}', '\u{202e}']), "{shown}");
    let events = column().good("check case.toml --json").out;
    assert!(events.contains("\\u202e") && !events.contains('\u{202e}'), "{events}");
}

/// A cube that is inside out under two tetrahedra: neither warning displaces the other.
#[test]
fn repairs_are_told_beside_warnings_of_the_check() {
    let place = column();
    let wedges = COLUMN
        .replace("1,1,2,3,4,5,6,7,8", "1,5,6,7,8,1,2,3,4")
        .replace("2,5,6,7,8,9,10,11,12\n", "*ELEMENT, TYPE=C3D4, ELSET=ALL\n2,5,6,7,9\n3,5,7,8,9\n");
    place.write("column.inp", &wedges);
    let ran = place.good("check case.toml");
    for warning in ["1 hexahedra are numbered inside out", "that meet two triangles"] {
        assert!(ran.err.contains(warning), "{warning}\n{}", ran.err);
    }
}

/// A pipe that nobody writes to would be read forever.
#[cfg(unix)]
#[test]
fn a_pipe_is_not_read_as_a_mesh() {
    let place = column();
    std::fs::remove_file(place.path("column.inp")).expect("removed");
    let made = Command::new("mkfifo").arg(place.path("column.inp")).status().expect("mkfifo");
    assert!(made.success());
    place.bad("check case.toml", 2, &["column.inp: it is not a regular file but a folder, pipe or device"]);
}

/// A slab of tetrahedra under a block of hexahedra, through every command that deals with elements.
#[test]
fn tetrahedra_go_through_all_commands() {
    go_through_all_commands("gmsh_tetrahedra.msh", 100);
}

/// The same with hexahedra of 27 nodes in both bodies.
#[test]
fn quadratic_hexahedra_go_through_all_commands() {
    go_through_all_commands("gmsh_41_second_order.msh", 16);
}

/// The same with wedges, designed above and below.
#[test]
fn wedges_go_through_all_commands() {
    go_through_all_commands("gmsh_wedges.msh", 44);
}

fn go_through_all_commands(mesh: &str, least: usize) {
    let place = meshed();
    copy(&place, mesh, "meshes/pair.msh");
    let checked = place.good("check case.toml").out;
    assert!(checked.contains("slab_top"), "{checked}");
    place.good("verify gradient case.toml");
    place.good("optimize case.toml --out run --iterations 2");
    let designed = place.read("run/design.csv").lines().count();
    place.good("resume run --iterations 3");
    place.good("evaluate case.toml --design run --friction 0,0.1");
    assert!(place.read("run/design.csv").lines().count() == designed && designed > least, "{designed}");
    place.good("render run");
    place.good("report run");
    assert!(place.read("run/report.html").contains("slab"));
    let result = place.good("export run --json").event("result");
    let triangles = result["triangles"].as_u64().expect("a number");
    assert!(triangles > 100 && result["crossings"] == 0, "{result}");
    // only linear tetrahedra are too stiff; quadratic ones are a key away
    let said = place.good("export run --case part --threshold 0.3").err;
    let expected = "`slab` of the design consists of linear tetrahedra, which are too stiff in bending";
    assert_eq!(said.contains(expected), mesh == "gmsh_tetrahedra.msh", "{said}");
    if mesh == "gmsh_tetrahedra.msh" {
        assert!(
            said.contains("`slipstick solve run/case.toml --design run/design.csv --set 'body[0].order=2'`"),
            "{said}"
        );
        place.good("solve run/case.toml --design run/design.csv --set body[0].order=2 --out quadratic");
    }
    // a heading of 84 bytes, and 50 for each triangle
    assert_eq!(std::fs::metadata(place.path("run/design.stl")).expect("a surface").len(), 84 + 50 * triangles);
}

/// `new my-mesh` finds or makes names for bodies and surfaces of files of all formats, and `check`
/// accepts the case that it writes.
#[test]
fn a_case_for_a_mesh_of_ones_own_is_accepted() {
    let place = Place::new();
    for (mesh, expected) in [
        ("gmsh_41_binary.msh", ["slave = \"block_bottom\"", "master = \"slab_top\"", "set = \"slab_bottom\""]),
        // triangles are smaller than the block's quadrilaterals
        ("gmsh_tetrahedra.msh", ["slave = \"slab_top\"", "master = \"block_bottom\"", "set = \"slab_bottom\""]),
        ("gmsh_wedges.msh", ["slave = \"slab_top\"", "master = \"block_bottom\"", "set = \"slab_bottom\""]),
        ("gmsh_wedges_second_order.msh", ["slave = \"tool_ymin\"", "master = \"block_top\"", "part = \"block\" }"]),
        ("gmsh_41_second_order.msh", ["part = \"slab\" }", "slave = \"block_bottom\"", "master = \"slab_top\""]),
        // groups have sets beside those of the geometry's volumes and surfaces
        ("gmsh.inp", ["slave = \"block_bottom\"", "master = \"slab_top\"", "set = \"slab_bottom\""]),
        // parts and surfaces defined by values of a field
        ("meshio_ascii.vtu", ["slave = \"group_6_group=7\"", "master = \"group_1_group=3\"", "part = \"group=6\""]),
    ] {
        copy(&place, mesh, mesh);
        let said = place.good(&format!("new my-mesh --mesh {mesh} --out mine.toml --force")).err;
        assert!(!said.contains("first_order"), "{said}");
        let text = place.read("mine.toml");
        for expected in expected {
            assert!(text.contains(expected), "{mesh}: {expected}\n{text}");
        }
        let checked = place.good("check mine.toml").out;
        assert!(checked.contains("no warnings"), "{mesh}\n{checked}\n{text}");
    }
    // the path closes contact and then slides
    let text = place.read("mine.toml").replace("steps = 10", "steps = 2").replace("iterations = 40", "iterations = 1");
    place.write("mine.toml", &text);
    let history = place.good("optimize mine.toml --json").event("result");
    assert!(history["objective"].as_f64().expect("a number") < -1.0, "{history}");
}

/// Two columns of three cubes, one above the other, as preprocessors write them: helper sets of
/// faces are smaller than the sets with sections.
fn deck() -> String {
    let mut deck = String::from("*NODE\n");
    for (first, low) in [(1, 0.0), (101, 3.0)] {
        for level in 0..4 {
            for (corner, [x, z]) in [[0, 0], [1, 0], [1, 1], [0, 1]].into_iter().enumerate() {
                deck += &format!("{}, {x}, {}, {}\n", first + 4 * level + corner, low + level as f64, -z);
            }
        }
    }
    for (set, first) in [("LOW", 1), ("HIGH", 101)] {
        deck += &format!("*ELEMENT, TYPE=C3D8, ELSET={set}\n");
        for level in 0..3 {
            let nodes: Vec<String> = (0..8).map(|n| (first + 4 * level + n).to_string()).collect();
            deck += &format!("{}, {}\n", first + level, nodes.join(", "));
        }
    }
    deck + "*ELSET, ELSET=_top_S2\n3\n*ELSET, ELSET=_foot_S1\n101\n*ELSET, ELSET=_all\n1, 2, 3\n\
            *SURFACE, NAME=TOP\n_top_S2, S2\n*SURFACE, NAME=FOOT\n_foot_S1, S1\n"
}

/// The bodies of a written case are those with sections; without sections, sets that only define
/// surfaces do not count, and sets that together are the whole file precede parts of it.
#[test]
fn bodies_are_made_from_sections_and_not_from_sets_of_faces() {
    let place = Place::new();
    let sections = "*SOLID SECTION, ELSET=Low, MATERIAL=M\n*SOLID SECTION, ELSET=HIGH, MATERIAL=M\n";
    let slice = "*ELSET, ELSET=slice\n2\n";
    for (name, further) in [("sections", sections), ("faces", ""), ("slices", slice)] {
        place.write(&format!("{name}.inp"), &(deck() + further));
        let said = place.good(&format!("new --mesh {name}.inp --out {name}.toml")).err;
        assert_eq!(said, "", "{name}");
        let text = place.read(&format!("{name}.toml"));
        let parts: Vec<&str> = text.lines().filter(|line| line.starts_with("mesh = ")).collect();
        assert!(parts.len() == 2 && !text.contains("part = \"_") && !text.contains("slice\" }"), "{name}\n{text}");
        let checked = place.good(&format!("check {name}.toml"));
        assert!(
            checked.err.is_empty() && checked.out.contains("no warnings"),
            "{name}\n{}{}",
            checked.err,
            checked.out
        );
        let contact = text.lines().filter(|line| line.starts_with("slave") || line.starts_with("master")).count();
        assert!(contact == 2 && text.contains("_FOOT\"") && text.contains("_TOP\""), "{text}");
    }
    // only the lower column has a section
    place.write("half.inp", &(deck() + "*SOLID SECTION, ELSET=LOW, MATERIAL=M\n"));
    let said = place.good("new --mesh half.inp --out half.toml").err;
    assert!(said.contains("3 solid elements of the file are in no body: bodies are made from LOW"), "{said}");
    let said = place.good("check half.toml").err;
    let expected = "half.toml:17:17: warning: 3 of the 6 solid elements of half.inp are in no body";
    assert!(said.contains(expected) && said.contains("the deck has sections for `LOW`"), "{said}");
    // the designed bodies of a part have files of their own, so the deck's elements are rightly in no body
    let part = place.read("half.toml") + "[[promise]]\nquantity = \"strain_energy\"\nvalues = [1.0]\n";
    place.write("part.toml", &part);
    let said = place.good("check part.toml").err;
    assert!(!said.contains("in no body"), "{said}");
    // generated sets lie on one body, also where bodies touch
    place.write("flat.inp", &deck().replace("*SURFACE, NAME=TOP\n_top_S2, S2\n", ""));
    place.good("new --mesh flat.inp --out flat.toml");
    let text = place.read("flat.toml");
    let sets: Vec<&str> = text.split("\n[[").filter(|table| table.starts_with("set]]")).collect();
    assert!(!sets.is_empty() && sets.iter().all(|set| set.contains("\nbody = ")), "{text}");
}

/// A mesh without names: the error says where they would come from.
#[test]
fn a_mesh_without_names_says_so() {
    let place = Place::new();
    let bare = COLUMN.split("*SURFACE").next().expect("elements");
    place.write("column.inp", bare);
    place.write("case.toml", &column().read("case.toml"));
    let expected =
        ["no surface or set called `c_FOOT`", "the mesh file of `c` names neither surfaces nor sets", "[[surface]]"];
    place.bad("check case.toml", 2, &expected);
}

/// `check` lists surfaces with body, area and normal.
#[test]
fn check_lists_surfaces() {
    let place = Place::new();
    place.write("deck.inp", &deck());
    place.good("new --mesh deck.inp --out deck.toml");
    let checked = place.good("check deck.toml").out;
    let row = |name: &str| -> Vec<String> {
        let line = checked.lines().find(|line| line.trim_start().starts_with(name)).expect("a row");
        line.split_whitespace().map(str::to_owned).collect()
    };
    assert_eq!(row("HIGH_FOOT")[1..], ["HIGH", "1", "4", "1.000000", "(0,", "-1,", "0)"]);
    assert_eq!(row("LOW_TOP")[1..], ["LOW", "1", "4", "1.000000", "(0,", "1,", "0)"]);
    let told = place.good("check deck.toml --json").event("result");
    let foot = &told["inspection"]["surfaces"][0];
    assert_eq!((&foot["name"], &foot["normal"][1]), (&"HIGH_FOOT".into(), &(-1.0).into()), "{told}");
}

/// `check --picture` draws all surfaces: two pictures of all, and one of each of the twelve of two boxes, in rows of
/// five.
#[test]
fn check_draws_surfaces() {
    let place = Place::new();
    let out = place.good("check case.toml --picture surfaces.png").out;
    assert!(out.contains("12 surfaces in surfaces.png"), "{out}");
    let size = || {
        let file = std::fs::File::open(place.path("surfaces.png")).expect("a file");
        let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a picture");
        (reader.info().width, reader.info().height)
    };
    assert_eq!(size(), (5 * 480, 3 * 400));
    place.good("check case.toml --picture surfaces.png -q");
    place.bad("check case.toml --picture surfaces.jpg", 2, &["does not end in .png", "--picture"]);
    place.write("notes.png", "my notes");
    place.bad("check case.toml --picture notes.png", 2, &["notes.png exists and is not a picture", "--picture"]);
    place.bad("check case.toml --picture nowhere/surfaces.png", 2, &["nowhere"]);
    place.bad("check case.toml --resolved --picture surfaces.png", 2, &["--resolved", "--picture"]);
    // 64 surfaces are too many: those that the case uses are drawn
    let more: String = (0..52)
        .map(|n| {
            format!(
                "[[surface]]\nname = \"part_{n}\"\nbody = \"slab\"\nboxes = [{{ min = [-1, 0.9, -1], max = [9, 2, 9] }}]\n"
            )
        })
        .collect();
    place.write("case.toml", &CASE.replace("[[contact]]", &(more + "[[contact]]")));
    let out = place.good("check case.toml --picture surfaces.png").out;
    assert!(out.contains("4 surfaces of 64: those that the case uses in surfaces.png"), "{out}");
}

/// A mesh with one body gets a block; the mesh file is not in the folder of the case.
#[test]
fn a_body_alone_gets_a_block() {
    let place = Place::new();
    std::fs::create_dir(place.path("cases")).expect("a folder");
    let both = include_str!("../../../meshio/tests/data/gmsh_22_ascii.msh");
    // elements of the physical groups 1 to 5 are the slab's; the third word after an element's
    // number is its group
    let keep = |surfaces: bool| {
        let of_slab = |line: &&str| match line.split(' ').collect::<Vec<_>>()[..] {
            [_, kind, "2", group, ..] => {
                group.parse::<u32>().is_ok_and(|group| group <= 5) && (surfaces || kind == "5")
            }
            _ => true,
        };
        let lines: Vec<&str> = both.lines().filter(of_slab).collect();
        let elements = lines.iter().position(|line| *line == "$Elements").expect("elements");
        let count = (lines.len() - elements - 3).to_string();
        let line = |(i, line)| if i == elements + 1 { count.as_str() } else { line };
        lines.iter().copied().enumerate().map(line).collect::<Vec<&str>>().join("\n") + "\n"
    };
    for (surfaces, expected) in [(true, "set = \"slab_bottom\""), (false, "set = \"slab_far\"")] {
        place.write("one.msh", &keep(surfaces));
        place.good("new --mesh one.msh --out cases/one.toml --force");
        let text = place.read("cases/one.toml");
        let master = if surfaces { "master = \"slab_top\"" } else { "master = \"slab_ymax\"" };
        for expected in ["name = \"block\"", master, expected] {
            assert!(text.contains(expected), "{expected}\n{text}");
        }
        assert!(text.contains("/one.msh\""), "an absolute path: the mesh does not lie below the case\n{text}");
        let checked = place.good("check cases/one.toml").out;
        assert!(checked.contains("no warnings"), "{checked}\n{text}");
    }
}

/// On an L-shaped body with a wall and a low seat, the block stands on the seat, not above the
/// whole body, and the wall is held.
#[test]
fn the_block_stands_on_the_surface_that_it_touches() {
    let place = Place::new();
    let corners = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, 2], [1, 2]];
    let mut mesh = String::from("*NODE\n");
    for z in 0..2 {
        for (i, [x, y]) in corners.iter().enumerate() {
            mesh += &format!("{}, {x}, {y}, {z}\n", 8 * z + i + 1);
        }
    }
    mesh += "*ELEMENT, TYPE=C3D8, ELSET=bracket\n";
    for (number, [a, b, c, d]) in [[1, 2, 5, 4], [2, 3, 6, 5], [4, 5, 8, 7]].into_iter().enumerate() {
        let upper = [a + 8, b + 8, c + 8, d + 8].map(|node| node.to_string()).join(", ");
        mesh += &format!("{}, {a}, {b}, {c}, {d}, {upper}\n", number + 1);
    }
    // S5 is the side of an element facing +y, S6 the side facing −x
    mesh += "*SURFACE, NAME=seat, TYPE=ELEMENT\n2, S5\n*SURFACE, NAME=wall, TYPE=ELEMENT\n1, S6\n3, S6\n";
    place.write("l.inp", &mesh);
    place.good("new --mesh l.inp --out l.toml");
    let text = place.read("l.toml");
    let block = "box = { min = [1.3, 1.0, 0.3], max = [1.7, 1.2, 0.7]";
    for expected in ["set = \"bracket_wall\"", "master = \"bracket_seat\"", block] {
        assert!(text.contains(expected), "no `{expected}` in\n{text}");
    }
    let checked = place.good("check l.toml").out;
    assert!(checked.contains("no warnings"), "{checked}\n{text}");
}
