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
    let text = std::fs::read_to_string(&file).unwrap();
    let r = parse_case(&text, &file).unwrap();
    let mut p = build(&r.case).unwrap();
    println!(
        "elements {} nodes {} slaves {}",
        p.mesh.hexes.len(),
        p.mesh.nodes.len(),
        p.analysis.model.slave_nodes().len()
    );
    let t = Instant::now();
    let f = match p.analysis.forward(&p.initial_density.clone(), &mut Log) {
        Ok(f) => f,
        Err(e) => {
            println!("{e}");
            return;
        }
    };
    println!("theta {} in {:.2}s, newton {}", f.value, t.elapsed().as_secs_f64(), f.path.newton_iterations());
    for s in f.path.states.iter().skip(1) {
        for i in &s.report.iterations {
            print!(" {:.0e}/{:.0e}/{:.0e}/{:.0e}", i.residual, i.contact, i.displacement, i.multiplier)
        }
        println!()
    }
    let t = Instant::now();
    let g = p.analysis.gradient(&f).unwrap();
    println!("gradient {:.2}s  norm {:.3e}", t.elapsed().as_secs_f64(), g.iter().map(|x| x * x).sum::<f64>().sqrt());
}
