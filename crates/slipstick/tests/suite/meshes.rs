//! Bodies from mesh files, and surfaces and node sets that a case selects.

use std::path::Path;

use slipstick::build::{BuildError, Problem, build, build_mesh};
use slipstick::case::{CaseCode, CaseErrors, Resolved, parse_case_with};
use slipstick::check::{NoticeKind, inspect};
use slipstick::run::{Run, RunPart, mesh_files};
use slipstick_mesh::Mesh;

/// A block on a slab, as in the files of `meshio/tests/data`; the shapes are inserted.
fn pair(slab: &str, block: &str, [slab_top, slab_bottom]: [&str; 2], [block_top, block_bottom]: [&str; 2]) -> String {
    let material = "material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }";
    format!(
        "[[body]]\nname = 'slab'\n{slab}\n{material}\n[[body]]\nname = 'block'\n{block}\n{material}\n\
         [[contact]]\nslave = '{block_bottom}'\nmaster = '{slab_top}'\nfriction = 0.3\n\
         [[dirichlet]]\nset = '{slab_bottom}'\n[[dirichlet]]\nset = '{block_top}'\n\
         motion = [{{ t = 0.5, u = [0, -0.1, 0] }}, {{ t = 1.0, u = [0.2, -0.1, 0.05] }}]\n\
         [load_path]\nsteps = 4\ntolerance = {{ relative = 1e-12 }}\n\
         [design]\nbodies = ['slab']\ninitial = 0.5\nvolume_fraction = 0.5\n[objective]\ncontact_force = {{}}\n"
    )
}

const SLAB: &str = "box = { min = [0, 0, 0], max = [4, 1, 2], elements = [4, 2, 2] }";
const BLOCK: &str = "box = { min = [0.6, 1.0, 0.3], max = [2.0, 1.7, 1.6], elements = [2, 1, 2] }";

/// The pair from one file with the parts `slab` and `block`.
fn from_file(file: &str) -> String {
    let mesh = |part: &str| format!("mesh = {{ file = '{file}', part = '{part}' }}");
    pair(&mesh("slab"), &mesh("block"), ["slab_top", "slab_bottom"], ["block_top", "block_bottom"])
}

fn read(text: &str) -> Result<Resolved, CaseErrors> {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../meshio/tests/data/case.toml");
    parse_case_with(text, "case.toml", &mesh_files(&case))
}

fn parsed(text: &str) -> Resolved {
    read(text).unwrap_or_else(|errors| panic!("{errors}\n{text}"))
}

fn built(text: &str) -> Problem {
    build(&parsed(text).case).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Values of the elements, sorted by their centroids.
fn by_place(mesh: &Mesh, values: &[f64]) -> Vec<([i64; 3], f64)> {
    let place = |e: usize| mesh.centroid(e).map(|x| (x * 1e6).round() as i64);
    let mut found: Vec<_> = values.iter().enumerate().map(|(e, &value)| (place(e), value)).collect();
    found.sort_by_key(|&(place, _)| place);
    found
}

/// A slab of tetrahedra under a block of hexahedra, by Gmsh: sizes and groups as drawn in
/// `make.py`. Contact with friction gives the force of the hexahedral slab, up to the excess
/// stiffness of such coarse tetrahedra. F̄ has no effect, which a warning reports.
#[test]
fn tetrahedra_from_gmsh_are_solved() {
    let text = from_file("gmsh_tetrahedra.msh");
    let resolved = parsed(&text);
    assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
    let mut problem = built(&text);
    let [slab, block] = &problem.mesh.bodies[..] else { panic!("two bodies") };
    let volume =
        |body: &slipstick_mesh::Body| body.elements.clone().map(|e| problem.mesh.element_volume(e)).sum::<f64>();
    assert!((volume(slab) - 8.0).abs() < 1e-10 && (volume(block) - 1.4 * 0.7 * 1.3).abs() < 1e-10);
    assert!((problem.mesh.surface_area(&problem.mesh.surfaces["slab_top"]) - 8.0).abs() < 1e-10);
    assert_eq!(problem.mesh.boundary(0).nodes().len(), problem.mesh.boundary(0).facets.len() / 2 + 2, "Euler");
    let run = |problem: &mut Problem| {
        let density = problem.initial_density().clone();
        crate::common::forward(problem, &density).value
    };
    let (found, hexahedra) = (run(&mut problem), run(&mut built(&from_file("gmsh_41_ascii.msh"))));
    println!("contact force {found:.6}, {hexahedra:.6} with hexahedra");
    assert!(found / hexahedra > 1.0 && found / hexahedra < 1.25, "{found} {hexahedra}");
    let bar = text.replacen("[[body]]", "[[body]]\nelement = 'f_bar'", 1);
    let warnings = parsed(&bar).warnings;
    assert!(warnings.len() == 1 && warnings[0].to_string().contains("tetrahedra"), "{warnings:?}");
    assert_eq!(run(&mut built(&bar)), found);
}

/// A slab and a block of wedges, by Gmsh: sizes as drawn in `make.py`, contact with friction.
/// Conforming meshes are too stiff, so refined hexahedra carry the smallest force; wedges are
/// stiffer than hexahedra of their size, and softer than tetrahedra.
#[test]
fn wedges_from_gmsh_are_solved() {
    let text = from_file("gmsh_wedges.msh");
    let resolved = parsed(&text);
    assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
    let mut problem = built(&text);
    assert!(problem.mesh.elements.iter().all(|element| matches!(element, slipstick_mesh::Element::Wedge6(_))));
    let volumes = problem.mesh.element_volumes();
    let volume = |body: usize| volumes[problem.mesh.bodies[body].elements.clone()].iter().sum::<f64>();
    assert!((volume(0) - 8.0).abs() < 1e-10 && (volume(1) - 1.4 * 0.7 * 1.3).abs() < 1e-10, "{volumes:?}");
    let force = |problem: &mut Problem| {
        let density = problem.initial_density().clone();
        crate::common::forward(problem, &density).value
    };
    let wedges = force(&mut problem);
    let [hexahedra, tetrahedra] =
        ["gmsh_41_ascii.msh", "gmsh_tetrahedra.msh"].map(|f| force(&mut built(&from_file(f))));
    let faces = |body: &str| [format!("{body}_ymax"), format!("{body}_ymin")];
    let (slab, block) = (faces("slab"), faces("block"));
    let (fine_slab, fine_block) = (SLAB.replace("[4, 2, 2]", "[8, 4, 4]"), BLOCK.replace("[2, 1, 2]", "[4, 2, 4]"));
    let fine = pair(&fine_slab, &fine_block, [&slab[0], &slab[1]], [&block[0], &block[1]]);
    let fine = force(&mut built(&fine));
    println!(
        "contact force {fine:.3} (refined hexahedra), {hexahedra:.3}, {wedges:.3} (wedges), {tetrahedra:.3} (tetrahedra)"
    );
    let order = [fine, hexahedra, wedges, tetrahedra].map(|force| -force);
    assert!(order.is_sorted(), "{order:?}");
    assert!(wedges / hexahedra < 1.1, "{wedges} {hexahedra}");
    // a Poisson's ratio at which their triangles lock, even with F̄
    let locking =
        text.replace("poisson_ratio = 0.3", "poisson_ratio = 0.49").replace("[[body]]", "[[body]]\nelement = 'f_bar'");
    let warnings = parsed(&locking).warnings;
    let of_wedges =
        |w: &slipstick::case::CaseDiagnostic| w.code() == CaseCode::Locking && w.message().contains("wedges lock");
    assert!(warnings.len() == 2 && warnings.iter().all(of_wedges), "{warnings:?}");
}

/// The slab of wedges between smooth walls, pressed down by a tenth: uniaxial strain, which every
/// mesh represents exactly.
#[test]
fn wedges_from_gmsh_are_strained_uniformly() {
    let wall = |name: &str, axis: &str, at: f64, normal: [f64; 3]| {
        let point = normal.map(|n| n * at);
        format!(
            "[[set]]\nname = '{name}'\nplane = {{ point = {point:?}, normal = {normal:?} }}\n\
             [[dirichlet]]\nset = '{name}'\ncomponents = ['{axis}']\n"
        )
    };
    let walls = [
        wall("left", "x", 0.0, [1.0, 0.0, 0.0]),
        wall("right", "x", 4.0, [1.0, 0.0, 0.0]),
        wall("back", "z", 0.0, [0.0, 0.0, 1.0]),
        wall("front", "z", 2.0, [0.0, 0.0, 1.0]),
    ];
    let text = format!(
        "[[body]]\nname = 'slab'\nmesh = {{ file = 'gmsh_wedges.msh', part = 'slab' }}\n\
         material.neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }}\n\
         [[dirichlet]]\nset = 'slab_bottom'\ncomponents = ['y']\n\
         [[dirichlet]]\nset = 'slab_top'\ncomponents = ['y']\nmotion = [{{ t = 1.0, u = [0, -0.1, 0] }}]\n{}\
         [load_path]\nsteps = 2\ntolerance = {{ relative = 1e-13 }}\n",
        walls.concat()
    );
    let mut problem = built(&text);
    let density = problem.initial_density().clone();
    let run = crate::common::forward(&mut problem, &density);
    let last = &run.path.states.last().expect("a state").state;
    let mut worst = 0.0_f64;
    for (x, u) in problem.mesh.nodes.iter().zip(last.unknowns.as_chunks::<3>().0) {
        let exact = [0.0, -0.1 * x[1], 0.0];
        worst = (0..3).fold(worst, |worst, c| worst.max((u[c] - exact[c]).abs()));
    }
    // Gmsh's nodes are off by 2e-12
    assert!(worst < 1e-11, "{worst:e}");
}

/// The edges of second-order elements follow circles and spheres: the volumes of round shapes deviate
/// from the analytic ones by less than a thirtieth of the deviation with linear elements.
#[test]
fn second_order_shapes_are_round() {
    use std::f64::consts::PI;
    let volume = |shape: &str, order: u8| -> f64 {
        let text = format!(
            "[[body]]\nname = 'b'\n{shape}\norder = {order}\n\
             material = {{ neo_hooke = {{ youngs_modulus = 1.0, poisson_ratio = 0.3 }} }}\n\
             [[dirichlet]]\nset = 'b_side'\n[load_path]\nsteps = 1\n"
        );
        built(&text).mesh.element_volumes().iter().sum()
    };
    for (shape, expected) in [
        ("ball = { radius = 2, elements = [6, 3, 3] }", 4.0 / 3.0 * PI * 8.0),
        ("cone = { bottom_radius = 1, top_radius = 2, height = 3, elements = [4, 2, 2] }", 7.0 * PI),
        ("torus = { radius = 3, tube_radius = 1, elements = [4, 2, 16] }", 6.0 * PI * PI),
    ] {
        let [linear, quadratic] = [1, 2].map(|order| (volume(shape, order) / expected - 1.0).abs());
        assert!(quadratic < linear / 30.0, "{shape}: {quadratic:e} {linear:e}");
    }
}

/// With `first_order`, second-order meshes give the same result as first-order ones by the same
/// program.
#[test]
fn second_order_is_read_by_its_corners() {
    let second = |file: &str| from_file(file).replace("part =", "first_order = true, part =");
    let value = |text: &str| {
        let resolved = parsed(text);
        assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
        let mut problem = build(&resolved.case).expect("a problem");
        let density = problem.initial_density().clone();
        (crate::common::forward(&mut problem, &density).value, problem.mesh.nodes.len())
    };
    let ((found, nodes), (expected, first)) =
        (value(&second("gmsh_41_second_order.msh")), value(&from_file("gmsh_41_ascii.msh")));
    assert_eq!(nodes, first);
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    // `check --resolved` writes the key, and the case stays the same
    let case = parsed(&second("gmsh_41_second_order.msh")).case;
    let written = toml::to_string(&case).expect("writable");
    assert_eq!(written.matches("first_order = true").count(), 2, "{written}");
    assert_eq!(parsed(&written).case, case);
}

/// Contact with friction of two bodies from each kind of file, against the same bodies from the
/// generator. Gmsh's nodes are off by 2e-12, so results agree to that times the stiffness of
/// contact, not to round-off.
#[test]
fn a_meshed_pair_is_the_generated_one() {
    let faces = |body: &str| [format!("{body}_ymax"), format!("{body}_ymin")];
    let (slab, block) = (faces("slab"), faces("block"));
    let generated = pair(SLAB, BLOCK, [&slab[0], &slab[1]], [&block[0], &block[1]]);
    let run = |text: &str| {
        let mut problem = built(text);
        let density = problem.initial_density().clone();
        let forward = crate::common::forward(&mut problem, &density);
        let gradient = problem.analysis.gradient(&forward).expect("a gradient");
        (forward.value, by_place(&problem.mesh, &gradient))
    };
    let (value, gradient) = run(&generated);
    let vtu = "mesh = { file = 'vtk_raw_zlib.vtu', part = 'group=";
    let groups = |body: &str, top: u8, bottom: u8| [format!("{body}_group={top}"), format!("{body}_group={bottom}")];
    let (slab, block) = (groups("slab", 3, 2), groups("block", 8, 7));
    let from_vtu = pair(&format!("{vtu}1' }}"), &format!("{vtu}6' }}"), [&slab[0], &slab[1]], [&block[0], &block[1]]);
    for text in [from_file("gmsh_22_binary.msh"), from_file("gmsh_41_ascii.msh"), from_file("gmsh.inp"), from_vtu] {
        let (found, found_gradient) = run(&text);
        assert!(((found - value) / value).abs() < 1e-9, "{found} instead of {value}\n{text}");
        let size = gradient.iter().map(|(_, g)| g * g).sum::<f64>().sqrt();
        for ((place, expected), (found_place, found)) in gradient.iter().zip(&found_gradient) {
            assert_eq!(place, found_place);
            assert!((found - expected).abs() < 1e-8 * size, "{place:?}: {found} instead of {expected}");
        }
    }
}

/// The gradient of the pair from mesh files, compared with central differences.
#[test]
fn gradient_on_a_mesh_from_a_file_matches_differences() {
    let mut problem = built(&from_file("gmsh_41_binary.msh"));
    let density = crate::common::random_density(&problem, 7);
    let check = crate::common::check_gradient(&mut problem, &density);
    assert!(check.error < 1e-7, "{:.2e}", check.error);
    assert_eq!(crate::common::designed(&problem).len(), 16);
}

/// The location of the files depends only on the arguments of the reader: the case itself does not
/// read files.
#[test]
fn files_come_through_the_caller() {
    let text = from_file("gmsh_41_ascii.msh");
    let errors = slipstick::case::parse_case(&text, "case.toml").expect_err("no folder");
    assert_eq!(errors.diagnostics()[0].code(), CaseCode::MeshFile);
    assert!(errors.to_string().contains("read without its folder"), "{errors}");
    // written out, the case contains the name of the file, not its contents
    let case = parsed(&text.replace("part = 'slab'", "part = 'slab', scale = 1.5")).case;
    let written = toml::to_string(&case).expect("writable");
    assert!(written.contains("scale = 1.5") && !written.contains("nodes"), "{written}");
    assert_eq!(parsed(&written).case, case);
}

/// Every error in a mesh body is at its key, with a way to fix it.
#[test]
fn errors_in_mesh_files_point_at_the_case() {
    let text = from_file("gmsh_41_ascii.msh");
    let cases = [
        ("file = 'gmsh_41_ascii.msh', part = 'slab'", "file = 'no.msh'", CaseCode::MeshFile, "'no.msh'", "folder"),
        ("part = 'slab'", "part = 'slap'", CaseCode::MeshFile, "'slap'", "sets of solid elements: block, slab"),
        ("gmsh_41_ascii.msh', part = 'slab'", "make.py'", CaseCode::MeshFile, "'make.py'", "mesh files are Gmsh's"),
        ("part = 'slab'", "scale = 0", CaseCode::OutOfRange, "0", ""),
        ("part = 'slab'", "sha256 = '00ff'", CaseCode::MeshFile, "'00ff'", "restore the original file"),
        ("part = 'slab'", "prt = 'slab'", CaseCode::UnknownKey, "prt", "did you mean `part`?"),
        ("file = 'gmsh_41_ascii.msh', part = 'slab'", "", CaseCode::MissingKey, "{  }", "relative to the case file"),
        ("master = 'slab_top'", "master = 'slab_tip'", CaseCode::UnknownSet, "'slab_tip'", "did you mean `slab_top`?"),
        ("master = 'slab_top'", "master = 'slab_edge'", CaseCode::NotASurface, "'slab_edge'", "surfaces: slab_bottom"),
    ];
    for (from, to, code, at, help) in cases {
        let text = text.replacen(from, to, 1);
        let errors = read(&text).expect_err("wrong");
        let first = &errors.diagnostics()[0];
        assert_eq!((first.code(), &text[first.span()]), (code, at), "{errors}");
        assert!(first.help().contains(help), "{errors}");
    }
}

/// Two boxes of 1 × 1 × 1 elements, from one file whose parts share no nodes: as one body, it is
/// disconnected. What helps depends on whether they touch, and whether they are pieces of a design.
#[test]
fn unmerged_nodes_are_told() {
    let cube = |first: usize, x: f64| {
        let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
        let line = |(n, c): (usize, &[i32; 3])| format!("{}, {}, {}, {}\n", first + n, x + f64::from(c[0]), c[1], c[2]);
        corners.iter().enumerate().map(line).collect::<String>()
    };
    let deck = |second: f64| {
        format!(
            "*NODE\n{}{}*ELEMENT, TYPE=C3D8R\n1, 1,2,3,4,5,6,7,8\n2, 9,10,11,12,13,14,15,16\n*SURFACE, NAME=under\n1, S3\n",
            cube(1, 0.0),
            cube(9, second)
        )
    };
    let inp = deck(1.0);
    let text = "[[body]]\nname = 'a'\nmesh.file = 'two.inp'\n\
                material.neo_hooke = { youngs_modulus = 1, poisson_ratio = 0 }\n\
                [[dirichlet]]\nset = 'a_under'\n[load_path]\nsteps = 1\n";
    let files = |_: &str| Ok(inp.clone().into_bytes());
    let resolved = parse_case_with(text, "case.toml", &files).unwrap_or_else(|errors| panic!("{errors}"));
    let [warning] = &resolved.warnings[..] else { panic!("{:?}", resolved.warnings) };
    assert_eq!(warning.code(), CaseCode::MeshFile);
    assert!(warning.message().contains("C3D8R are read as C3D8"), "{warning}");
    let mut problem = build(&resolved.case).expect("a problem");
    let notices = inspect(&resolved.case, &mut problem).expect("inspected").notices;
    let told: Vec<_> = notices.iter().filter(|n| n.kind == NoticeKind::Disconnected).map(|n| &n.message).collect();
    assert_eq!(
        told,
        [
            "body `a` consists of 2 parts that share no nodes; supports do not hold 1 of them, for instance the one at \
             (1.0000, 0.0000, 0.0000); contact, ties or springs may",
            "body `a` has 4 pairs of coincident nodes, for instance 1 and 8 at (1.0000, 0.0000, 0.0000): elements are not \
             connected there"
        ]
    );
    let help = |second: f64, more: &str| {
        let files = |_: &str| Ok(deck(second).into_bytes());
        let case = parse_case_with(&format!("{text}{more}"), "case.toml", &files).expect("a case").case;
        let notices = inspect(&case, &mut build(&case).expect("a problem")).expect("inspected").notices;
        notices.into_iter().find(|n| n.kind == NoticeKind::Disconnected).expect("a notice").help
    };
    assert!(help(1.0, "").starts_with("merge the coincident nodes"));
    assert!(help(2.0, "").starts_with("the parts lie apart"));
    let promise = "[[promise]]\nquantity = 'strain_energy'\nvalues = [1.0]\n";
    assert!(help(2.0, promise).starts_with("the design consists of these pieces"));
}

/// The slab of 4 × 2 × 2 elements with selections by the given tables.
fn selected(tables: &str) -> Result<Mesh, BuildError> {
    let text = format!(
        "[[body]]\nname = 'slab'\n{SLAB}\nmaterial.neo_hooke = {{ youngs_modulus = 1, poisson_ratio = 0 }}\n{tables}\n\
         [[body]]\nname = 'ball'\nhalf_ball = {{ radius = 1.0, elements = [4, 2, 2] }}\nplace.translate = [0, 9, 0]\n\
         material.neo_hooke = {{ youngs_modulus = 1, poisson_ratio = 0 }}\n\
         [[dirichlet]]\nset = 'slab_ymin'\n[load_path]\nsteps = 1\n"
    );
    build_mesh(&parsed(&text).case)
}

/// Counts by hand on a grid of 5 × 3 × 3 nodes at x = 0 … 4, y = 0, ½, 1, z = 0, 1, 2.
#[test]
fn nodes_are_selected_by_place() {
    let nodes = |conditions: &str| {
        let mesh = selected(&format!("[[set]]\nname = 's'\n{conditions}")).unwrap_or_else(|error| panic!("{error}"));
        mesh.node_sets["s"].iter().map(|&n| mesh.nodes[n as usize]).collect::<Vec<_>>()
    };
    let plane = nodes("plane = { point = [3, 0, 0], normal = [2, 0, 0] }");
    assert_eq!(plane.len(), 9);
    assert!(plane.iter().all(|x| x[0] == 3.0));
    assert_eq!(
        nodes("plane = { point = [3, 0, 0], normal = [1, 0, 0], tolerance = 1.0 }\nwithin = 'slab_ymax'").len(),
        9
    );
    assert_eq!(nodes("cylinder = { start = [2, -1, 1], end = [2, 2, 1], radius = 1.01 }").len(), 15);
    let disc = "cylinder = { start = [2, -1, 1], end = [2, 2, 1], radius = 1.01 }\n\
                plane = { point = [0, 1, 0], normal = [0, 1, 0] }";
    assert_eq!(nodes(disc).len(), 5);
    assert_eq!(nodes(&format!("{disc}\nboxes = [{{ min = [2, 0, 0], max = [9, 9, 9] }}]")).len(), 4);
    assert_eq!(nodes("nearest = [2.2, 0.6, 0.9]"), [[2.0, 0.5, 1.0]]);
    assert_eq!(nodes("nearest = [2.2, 0.6, 0.9]\nwithin = 'slab_ymax'"), [[2.0, 1.0, 1.0]]);
}

/// A box's faces by their normals; of a ball's dome, by angle, only the lowest facets.
#[test]
fn facets_are_selected_by_place_and_normal() {
    let facets = |tables: &str| {
        let mesh = selected(tables).unwrap_or_else(|error| panic!("{error}"));
        let all = &mesh.surfaces["s"].facets;
        all.iter().map(|f| slipstick_mesh::facet_area_vector(&mesh.facet_coordinates(f))).collect::<Vec<_>>()
    };
    let up = facets("[[surface]]\nname = 's'\nbody = 'slab'\nnormal = { direction = [0, 3, 0] }");
    assert!(up.len() == 8 && up.iter().all(|n| n[1] > 0.0), "{up:?}");
    let boxes = "[[surface]]\nname = 's'\nbody = 'slab'\nboxes = [{ min = [0, 0.9, 0], max = [2, 1, 2] }]";
    assert_eq!(facets(boxes).len(), 4);
    let corner = "[[surface]]\nname = 's'\nbody = 'slab'\nboxes = [{ min = [0, 0, 0], max = [1, 1, 2] }]";
    // 2·2 on the end, 2 above, 2 below, 2 on either side
    assert_eq!(facets(corner).len(), 12);
    assert_eq!(facets(&format!("{corner}\nnormal = {{ direction = [-1, 0, 0], degrees = 10 }}")).len(), 4);
    let low =
        "[[surface]]\nname = 's'\nbody = 'ball'\nwithin = 'ball_dome'\nnormal = { direction = [0, -1, 0], degrees = ";
    let (some, more) = (facets(&format!("{low}30 }}")), facets(&format!("{low}60 }}")));
    assert!(!some.is_empty() && some.len() < more.len(), "{} {}", some.len(), more.len());
    let cosine = |n: &[f64; 3]| -n[1] / n.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!(some.iter().all(|n| cosine(n) > 30f64.to_radians().cos() - 1e-12));
}

/// Cylinders, spheres and smooth faces select the faces that the generators of the shapes know by
/// name, and only them.
#[test]
fn facets_are_selected_by_cylinder_sphere_and_smooth_face() {
    let shapes = "[[body]]\nname = 'tube'\nhollow_cylinder = { inner_radius = 2, outer_radius = 3, height = 4, \
        elements = [2, 16, 4] }\nplace.translate = [20, 0, 0]\n\
        material.neo_hooke = { youngs_modulus = 1, poisson_ratio = 0 }\n\
        [[body]]\nname = 'pin'\ncone = { bottom_radius = 1, top_radius = 1, height = 4, elements = [4, 1, 4] }\n\
        place.translate = [20, 0, 0]\nmaterial.neo_hooke = { youngs_modulus = 1, poisson_ratio = 0 }\n";
    let check = |body: &str, conditions: &str, expected: &str| {
        let tables = format!("{shapes}[[surface]]\nname = 's'\nbody = '{body}'\n{conditions}");
        let mesh = selected(&tables).unwrap_or_else(|error| panic!("{error}"));
        let facets = |name: &str| {
            let mut facets: Vec<_> = mesh.surfaces[name].facets.iter().map(|facet| facet.nodes.sorted()).collect();
            facets.sort_unstable();
            facets
        };
        assert!(!facets("s").is_empty());
        assert_eq!(facets("s"), facets(expected), "{body} {conditions}");
    };
    let bore = "start = [20, 0, 0], end = [20, 4, 0], radius";
    // the solid cylinder around the bore has no other facets of the tube
    check("tube", "cylinder = { start = [20, -1, 0], end = [20, 5, 0], radius = 2.01 }", "tube_inner");
    check("tube", &format!("cylinder = {{ {bore} = 2, tolerance = 1e-6 }}"), "tube_inner");
    check("tube", &format!("cylinder = {{ {bore} = 3, tolerance = 1e-6 }}"), "tube_outer");
    // all nodes of its end faces that lie on the mantle belong to facets with inner nodes too
    check("pin", &format!("cylinder = {{ {bore} = 1, tolerance = 1e-6 }}"), "pin_side");
    check("ball", "sphere = { centre = [0, 9, 0], radius = 1, tolerance = 1e-6 }", "ball_dome");
    check("ball", "sphere = { centre = [0, 9, 0], radius = 1.01 }\nnormal = { direction = [0, 1, 0] }", "ball_flat");
    // the points lie nearest to the bore, the mantle and an end
    check("tube", "connected = { to = [21.9, 2, 0] }", "tube_inner");
    check("tube", "connected = { to = [23.5, 2, 0] }", "tube_outer");
    check("tube", "connected = { to = [22.5, 9, 0] }", "tube_top");
    // facets of the tube are 22.5° apart: a smaller angle stops at the next edge along the axis
    let strip = "[[surface]]\nname = 's'\nbody = 'tube'\nconnected = { to = [23.1, 2, 0.1], degrees = 20 }";
    assert_eq!(selected(&format!("{shapes}{strip}")).expect("built").surfaces["s"].facets.len(), 4);
}

/// The mantle of a cylinder does not contain facets of an end face whose corners all lie on the rim.
#[test]
fn ends_of_coarse_cylinders_are_not_on_the_mantle() {
    let cylinder = "cylinder = { start = [2, 0, 1], end = [2, 1, 1], radius = 2.2360679774997896, tolerance = 1e-9 }";
    let brick = "[[body]]\nname = 'brick'\nbox = { min = [0, 0, 0], max = [4, 1, 2], elements = [1, 1, 1] }\n\
                 material.neo_hooke = { youngs_modulus = 1, poisson_ratio = 0 }\n";
    let mesh = selected(&format!("{brick}[[surface]]\nname = 's'\nbody = 'brick'\n{cylinder}")).expect("built");
    assert_eq!(mesh.surfaces["s"].facets.len(), 4, "of 6 faces with all nodes on the rims");
}

/// Nodes of one of two bodies that fill the same space.
#[test]
fn a_set_of_a_body_has_no_nodes_of_others() {
    let twin =
        format!("[[body]]\nname = 'twin'\n{SLAB}\nmaterial.neo_hooke = {{ youngs_modulus = 1, poisson_ratio = 0 }}\n");
    let of = |conditions: &str| {
        let mesh = selected(&format!("{twin}[[set]]\nname = 's'\n{conditions}")).expect("built");
        let twin = mesh.body("twin").expect("a body").nodes.clone();
        let set = &mesh.node_sets["s"];
        (set.len(), set.iter().filter(|&&node| twin.contains(&(node as usize))).count())
    };
    let plane = "plane = { point = [4, 0, 0], normal = [1, 0, 0] }";
    assert_eq!(of(plane), (18, 9));
    assert_eq!(of(&format!("body = 'twin'\n{plane}")), (9, 9));
    assert_eq!(of(&format!("body = 'slab'\n{plane}")), (9, 0));
    assert_eq!(of("body = 'twin'"), (45, 45));
    let text = format!("{}[[set]]\nname = 's'\nbody = 'slab'\nwithin = 'block_top'\n", from_file("gmsh_41_ascii.msh"));
    let error = read(&text).expect_err("of another body").to_string();
    assert!(error.contains("`block_top` is not a set of `slab`"), "{error}");
}

#[test]
fn empty_selections_are_errors_at_their_place() {
    let error = |tables: &str| selected(tables).expect_err("empty");
    let set = "[[set]]\nname = 's'\n";
    let far = error(&format!(
        "{set}plane = {{ point = [9, 0, 0], normal = [1, 0, 0], tolerance = 0.5 }}\nwithin = 'slab_xmax'"
    ));
    assert_eq!(
        (far.path.as_str(), far.message.as_str()),
        ("set[0].plane", "no node lies within 5.000e-1 of the plane of set `s`")
    );
    let far = error(&format!("{set}cylinder = {{ start = [9, 0, 0], end = [9, 1, 0], radius = 1 }}"));
    assert_eq!(far.path, "set[0].cylinder");
    let far =
        error("[[surface]]\nname = 's'\nbody = 'slab'\nwithin = 'slab_ymax'\nnormal = { direction = [0, -1, 0] }");
    assert_eq!(far.path, "surface[0]");
    assert!(far.message.contains("no facet of `slab` fits surface `s`"), "{far}");
}

/// A mesh that exists only in memory is kept in the directory of a run like a file.
#[test]
fn a_run_keeps_a_mesh_that_is_no_file() {
    let bytes = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../meshio/tests/data/gmsh_41_ascii.msh"));
    let bytes = bytes.expect("the file");
    let in_memory = |name: &str| match name {
        "memory.msh" => Ok(bytes.clone()),
        _ => Err(std::io::Error::other("not in memory")),
    };
    let text = from_file("memory.msh");
    let resolved = parse_case_with(&text, "case.toml", &in_memory).expect("the mesh is read");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run");
    let part = RunPart::starting(vec!["test".into()], 1);
    let run = Run::start(&path, &resolved, Path::new("nowhere/case.toml"), &in_memory, part, false);
    drop(run.expect("started"));
    assert_eq!(std::fs::read(path.join("mesh_0001.msh")).expect("a copy"), bytes);
    // from now on, the run reads its copy
    let again = parse_case_with(&text, "case.toml", &mesh_files(&path.join("case.toml"))).expect("read again");
    assert_eq!(again.case, resolved.case);
}
