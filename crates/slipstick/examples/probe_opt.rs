//! probe
use slipstick::{build::build, case::parse_case, optimize::Optimization};
use slipstick_path::*;
use std::time::Instant;
struct Log;
impl MarchObserver for Log {
    fn on_event(&mut self, e: &MarchEvent<'_>) {
        if let MarchEvent::Retry { time, failure, cut_back, .. } = e {
            println!("  retry t {time:.3} cut {cut_back} {failure}")
        }
    }
}
fn main() {
    let file = std::env::args().nth(1).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let r = parse_case(&text, &file).unwrap();
    let p = build(&r.case).unwrap();
    let mut o = Optimization::new(&r.case, p).unwrap();
    while !o.finished() {
        let t = Instant::now();
        if let Err(e) = o.advance(&mut Log) {
            println!("{e}");
            break;
        }
        let h = o.state.history.last().unwrap();
        println!(
            "{:3} {:.6} vol {:.4} change {:?} newton {} status {:?} inc {} halv {} {:.1}s",
            h.iteration,
            h.objective,
            h.volume_fraction,
            h.change,
            h.newton_iterations,
            h.status,
            h.increments,
            h.halvings,
            t.elapsed().as_secs_f64()
        );
    }
    let mut out = String::new();
    for (e, d) in o.density().iter().enumerate() {
        let c = o.problem.mesh.centroid(e);
        out += &format!("{},{},{},{}\n", c[0], c[1], c[2], d);
    }
    std::fs::write("/tmp/density.csv", out).unwrap();
}
