//! Designs as surfaces.

use super::*;

/// Triangles of a binary STL file by the bits of their corners (80 bytes, a count, 50 bytes each:
/// normal, three corners).
fn triangles(bytes: &[u8]) -> Vec<[[u32; 3]; 3]> {
    let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let corner = |t: usize, c: usize| std::array::from_fn(|k| word(84 + 50 * t + 12 + 12 * c + 4 * k));
    assert_eq!(bytes.len(), 84 + 50 * word(80) as usize);
    (0..word(80) as usize).map(|t| std::array::from_fn(|c| corner(t, c))).collect()
}

/// The surface as a program that reads STL sees it: points are equal if their bits are equal, and
/// every edge occurs once in each direction. The volume is that of the design's table.
#[test]
fn the_design_as_a_closed_surface() {
    let place = Place::new();
    // Densities that differ strongly between neighbours, as at the end of an optimization.
    let rows: Vec<String> = (0..20).map(|e| format!("{e},{}", [1.0, 0.9, 0.02, 0.1, 1.0][e % 5])).collect();
    place.write("start.csv", &format!("element,density\n{}\n", rows.join("\n")));
    place.good("optimize case.toml --design start.csv --iterations 1 -q");
    let ran = place.good("export case --json").event("result");
    assert_eq!(ran["files"][0], "case/design.stl");
    let bytes = std::fs::read(place.path("case/design.stl")).expect("written");
    let triangles = triangles(&bytes);
    assert_eq!(ran["triangles"], triangles.len());
    let mut edges = std::collections::HashSet::new();
    for t in &triangles {
        for k in 0..3 {
            assert!(edges.insert((t[k], t[(k + 1) % 3])), "an edge twice in one direction");
        }
    }
    assert!(edges.iter().all(|(a, b)| edges.contains(&(*b, *a))), "an edge without its other side");
    // Elements of the slab measure 1 × 1/2 × 1.
    let table = place.table("case/design.csv");
    let sum: f64 = table[1..17].iter().map(|row| 0.5 * number(&row[2])).sum();
    let volume = |name: &str| ran[name].as_f64().expect("a number");
    assert!((volume("density_volume") / sum - 1.0).abs() < 1e-12);
    assert!((volume("volume") / sum - 1.0).abs() < 0.05, "{ran}");

    // A new run removes the surface of the old one; other files are not touched unless requested.
    place.good("export case --obj a.obj --vtu a.vtu --threshold 0.3 --smooth 0 --iteration 0 --body slab");
    assert!(place.read("a.obj").starts_with("# slipstick") && place.path("a.vtu").exists());
    place.good("export case --3mf a.3mf");
    let archive = std::fs::read(place.path("a.3mf")).expect("written");
    assert!(archive.starts_with(b"PK\x03\x04") && archive.len() > 1000);
    place.good("export case");
    place.bad("export case --obj a.obj", 2, &["a.obj already exists", "--force"]);
    place.good("export case --obj a.obj --force --keep-surfaces false");
    place.good("optimize case.toml -q --force --iterations 1");
    assert!(!place.path("case/design.stl").exists());
}

#[test]
fn what_cannot_be_exported() {
    let place = Place::new();
    place.good("optimize case.toml --iterations 1 -q");
    place.bad("export case --threshold 1", 2, &["no density is above 1", "threshold below"]);
    place.bad("export case --iteration 0", 2, &["no threshold preserves the volume", "--threshold"]);
    place.bad("export case --iteration 7", 2, &["design_0007.vtu", "was not written", "available iterations: 0 to 1"]);
    place.bad("export case --body plate", 2, &["no body `plate`", "slab, block"]);
    place.bad("export case --threshold 2", 2, &["auto or a number from 0 to 1"]);
    place.bad("export case --stl design.obj", 2, &["design.obj does not end in .stl"]);
    let case = place.read("case/case.toml").replacen("[[body]]", "[units]\nlength = \"furlong\"\n[[body]]", 1);
    place.write("miles.toml", &case);
    place.good("optimize miles.toml --iterations 1 -q");
    place.bad("export miles --threshold 0.4 --3mf a.3mf", 2, &["3MF has no unit `furlong`", "[units] length"]);
    place.bad("export nowhere", 2, &["there is no run.json in nowhere"]);
    std::fs::remove_file(place.path("case/design.csv")).expect("there");
    place.bad("export case", 2, &["there is no design.csv in case"]);
}
