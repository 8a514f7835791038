//! The warnings of `check` about averaged normals and sharp edges of slave surfaces.

use slipstick::build::build;
use slipstick::case::{CaseCode, TEMPLATES, parse_case_with};
use slipstick::check::{Inspection, NoticeKind, inspect};

use super::nose::nose;
use super::{even, grid};
use crate::common::abaqus::abaqus;

fn inspected(text: &str, angle: f64) -> Inspection {
    let read = |name: &str| {
        let mesh = match name {
            "block" => nose(angle, 0.0, 0.8, [3, 2, 2]),
            _ => grid("plate", [&even(-2.0, 2.0, 4), &even(0.0, 1.0, 1), &even(-0.5, 1.5, 2)]),
        };
        Ok(abaqus(&mesh).into_bytes())
    };
    let resolved = parse_case_with(text, "edges.toml", &read).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let mut problem = build(&resolved.case).unwrap_or_else(|e| panic!("{e}\n{text}"));
    inspect(&resolved.case, &mut problem).expect("a reference configuration")
}

/// A block with an edge of this interior angle, on a plate; `keys` are further keys of the pair.
fn on_plate(angle: f64, keys: &str) -> Inspection {
    let text = format!(
        "{}{}[[contact]]\nslave = 'block_nose'\nmaster = 'plate_ymax'\nfriction = 0.2\n{keys}\n\
         [[dirichlet]]\nset = 'plate_ymin'\n[[dirichlet]]\nset = 'block_ymax'\n\
         motion = [{{ t = 1, u = [0, -0.01, 0] }}]\n[load_path]\nsteps = 1\n",
        super::body("block", 1000.0),
        super::body("plate", 1000.0)
    );
    inspected(&text, angle)
}

fn warnings(inspection: &Inspection) -> Vec<String> {
    let averaged = inspection.notices.iter().filter(|notice| notice.kind == NoticeKind::AveragedNormals);
    averaged.map(|notice| format!("{}: {} ({})", notice.path, notice.message, notice.help)).collect()
}

/// By hand: at an interior angle of 140 degrees the faces differ by 40 degrees, and the mean normal
/// by 20 degrees from each. At two facets of width, three nodes lie on the edge, the first at
/// z = 0. At 168 degrees the deviation is 6, too much next to a plane; at 172 it is 4.
#[test]
fn averaged_normals_far_from_facets_are_told() {
    assert_eq!(
        warnings(&on_plate(140.0, "")),
        [
            "contact[0].slave: `block_nose`, the slave of `plate_ymax`, has 3 nodes whose averaged normal differs from a \
          facet's by up to 20°, at node 3, [0, 1, 0]: contact pushes in a wrong direction there, and the apparent \
          friction is tan(arctan μ ± that angle) (refine the mesh if the surface is curved there; set `feature_angle` \
          below 40 if there is an edge; or exchange slave and master)"
        ]
    );
    for good in [on_plate(172.0, ""), on_plate(90.0, ""), on_plate(140.0, "feature_angle = 39.0")] {
        assert_eq!(warnings(&good), [""; 0]);
    }
    let blunt = on_plate(90.0, "feature_angle = 91.0");
    assert!(warnings(&blunt)[0].contains("by up to 45°, at node 3"), "{:?}", warnings(&blunt));
    assert!(warnings(&on_plate(168.0, ""))[0].contains("by up to 6°"));
    assert_eq!(CaseCode::AveragedNormals.as_str(), "slipstick::case::averaged_normals", "a stable code");
}

/// Each node counts once, regardless of how many patches meet there: 4 × 3 nodes of the bottom and
/// 2 × 3 more of the face.
#[test]
fn nodes_on_sharp_edges_are_counted_once() {
    let [sharp, blunt] = [on_plate(90.0, ""), on_plate(140.0, "")].map(|inspection| inspection.contacts[0].clone());
    assert_eq!((sharp.slave_nodes, sharp.sharp_nodes), (18, 3));
    assert_eq!((blunt.slave_nodes, blunt.sharp_nodes), (18, 0));
    assert!(sharp.covered <= 18);
}

/// Cases without warnings: those that `slipstick new` writes and those of the folder `cases`.
#[test]
fn good_surfaces_are_not_complained_about() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases");
    let mut cases: Vec<(String, String)> =
        TEMPLATES.iter().map(|template| (template.name.to_owned(), template.text.to_owned())).collect();
    for name in ["bracket/case", "clutch/coarse", "cube_on_cuboid/case", "half_ball_on_plate/coarse", "ironing/case"] {
        let text = std::fs::read_to_string(folder.join(format!("{name}.toml")));
        cases.push((name.into(), text.unwrap_or_else(|e| panic!("{name}: {e}"))));
    }
    for (name, text) in cases {
        let read = |file: &str| std::fs::read(folder.join(&name).with_file_name(file));
        let resolved = parse_case_with(&text, &name, &read).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut problem = build(&resolved.case).unwrap_or_else(|e| panic!("{name}: {e}"));
        let found = inspect(&resolved.case, &mut problem).expect("a reference configuration");
        assert_eq!(warnings(&found), [""; 0], "{name}");
    }
}

/// Slave facets of 1 × 1 on master facets of 0.4 × 0.5 are reported; with slave and master
/// swapped, there is no warning.
#[test]
fn a_coarse_slave_is_told() {
    let exchanged = |slave: &str, master: &str| {
        let text = format!(
            "{}{}[[contact]]\nslave = '{slave}'\nmaster = '{master}'\nfriction = 0.0\n[[dirichlet]]\nset = 'plate_ymin'\n\
             [[dirichlet]]\nset = 'block_ymax'\nmotion = [{{ t = 1, u = [0, -0.01, 0] }}]\n[load_path]\nsteps = 1\n",
            super::body("block", 1000.0),
            super::body("plate", 1000.0)
        );
        let found = inspected(&text, 90.0).notices;
        let coarse = found.into_iter().filter(|notice| notice.kind == NoticeKind::CoarseSlave);
        coarse.map(|notice| (notice.path, notice.message)).collect::<Vec<_>>()
    };
    let found = exchanged("plate_ymax", "block_nose");
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].0, "contact[0].slave");
    assert!(found[0].1.contains("median size 1 and 0."), "{}", found[0].1);
    assert_eq!(exchanged("block_nose", "plate_ymax"), []);
}
