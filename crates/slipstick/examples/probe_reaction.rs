//! probe
use slipstick::{build::build, case::parse_case};
use slipstick_path::*;
use std::time::Instant;
struct Log;
impl MarchObserver for Log {
    fn on_event(&mut self, e: &MarchEvent<'_>) {
        match e {
            MarchEvent::Accepted(s) => {
                let l = s.report.iterations.last().unwrap();
                println!(
                    "  t {:.3} newton {} status {:?} res {:.1e}",
                    s.time,
                    s.report.iterations.len(),
                    l.status,
                    l.residual
                )
            }
            MarchEvent::Retry { time, failure, cut_back, .. } => {
                println!("  retry t {time:.3} cut {cut_back} {failure}")
            }
        }
    }
}
fn main() {
    let file = std::env::args().nth(1).unwrap();
    let set = std::env::args().nth(2).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let r = parse_case(&text, &file).unwrap_or_else(|e| panic!("{e}"));
    let mut p = build(&r.case).unwrap();
    let t = Instant::now();
    let f = match p.analysis.forward(&p.initial_density.clone(), &mut Log) {
        Ok(f) => f,
        Err(e) => {
            println!("{e}");
            return;
        }
    };
    println!("{:.2}s, newton {}", t.elapsed().as_secs_f64(), f.path.newton_iterations());
    let nodes = p.mesh.set_nodes(&set).unwrap();
    for (n, s) in f.path.completed() {
        let mut force = vec![0.0; 3 * p.mesh.nodes.len()];
        p.analysis.model.internal_force(&s.state.unknowns[..3 * p.mesh.nodes.len()], &mut force).unwrap();
        let mut sum = [0.0; 3];
        for &k in nodes.iter() {
            for c in 0..3 {
                sum[c] += force[3 * k as usize + c]
            }
        }
        println!("{n} {:.4} {:.4} {:.4}", sum[0], sum[1], sum[2]);
    }
}
