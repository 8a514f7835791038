//! probe
#[path = "gallery.rs"]
#[allow(dead_code)]
mod gallery;
use slipstick::{build::build, case::parse_case, optimize::IterationRecord, render::*};
use slipstick_path::Silent;
fn main() {
    let file = std::env::args().nth(1).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let r = parse_case(&text, &file).unwrap();
    let mut p = build(&r.case).unwrap();
    let rho: Vec<f64> = std::fs::read_to_string("/tmp/density.csv").unwrap().lines().map(|l| l.rsplit(',').next().unwrap().parse().unwrap()).collect();
    let cache = "/tmp/render_state.json";
    let n = 3 * p.mesh.nodes.len();
    let (d, contact) = match std::fs::read_to_string(cache) {
        Ok(t) => {
            let (d, c): (Vec<f64>, Vec<(u32, f64)>) = serde_json::from_str(&t).unwrap();
            (d, c)
        }
        Err(_) => {
            let t = std::time::Instant::now();
            let f = p.analysis.forward(&rho, &mut Silent).unwrap();
            println!("forward {:?}", t.elapsed());
            let s = &f.path.states;
            let c = p.analysis.model.contact_results(&s[s.len() - 2].state, &s[s.len() - 1].state).unwrap();
            let c: Vec<(u32, f64)> = c.iter().map(|c| (c.node, c.traction[0])).collect();
            let d = s[s.len() - 1].state.unknowns[..n].to_vec();
            std::fs::write(cache, serde_json::to_string(&(&d, &c)).unwrap()).unwrap();
            (d, c)
        }
    };
    let contact: Vec<_> = contact.iter().map(|&(node, p)| slipstick::analysis::NodalContact { node, status: slipstick_contact::friction::Status::Slip, traction: [p, 0., 0.], global_traction: [0.; 3], gap: None, weighted_gap: 0., weighted_slip: [0.; 2], slip: [0.; 2], area: 0. }).collect();
    let t = std::time::Instant::now();
    let pic = gallery::figure(&gallery::Result_ { mesh: &p.mesh, density: &rho, displacement: &d, contact: &contact }).unwrap();
    println!("draw {:?}", t.elapsed());
    let t = std::time::Instant::now();
    pic.save_png(std::path::Path::new("/tmp/fig.png")).unwrap();
    println!("png {:?} {}", t.elapsed(), std::fs::metadata("/tmp/fig.png").unwrap().len());
    let h: Vec<IterationRecord> = (0..31).map(|i| IterationRecord { iteration: i, objective: -300.0 + 200.0 * (-0.3 * i as f64).exp(), volume_fraction: 0.25 + 0.01 * (i as f64 * 0.7).sin() * (-0.1 * i as f64).exp(), ..Default::default() }).collect();
    history_picture(&h, Some(0.25), &Canvas { width: 900, height: 600, supersampling: 3 }).unwrap().save_png(std::path::Path::new("/tmp/hist.png")).unwrap();
}
