//! probe
use slipstick::{build::build, case::parse_case};
use slipstick_path::*;
fn main() {
    let file = std::env::args().nth(1).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    for e in std::env::args().skip(2) {
        let t = text.replace("enforcement = { lagrange = {} }", &format!("enforcement = {e}"));
        let r = parse_case(&t, &file).unwrap_or_else(|e| panic!("{e}"));
        let mut p = build(&r.case).unwrap();
        let t0 = std::time::Instant::now();
        match p.analysis.forward(&p.initial_density.clone(), &mut Silent) {
            Ok(f) => println!("{e}: theta {:.10} newton {} uzawa {:?} states {} {:.1}s", f.value, f.path.newton_iterations(), f.path.states.iter().map(|s| s.report.uzawa).collect::<Vec<_>>(), f.path.states.len(), t0.elapsed().as_secs_f64()),
            Err(x) => println!("{e}: {x}"),
        }
    }
}
