//! probe
use slipstick::{build::build, case::parse_case};
use slipstick_path::*;
use std::time::Instant;
fn main() {
    let file = std::env::args().nth(1).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let r = parse_case(&text, &file).unwrap();
    let mut p = build(&r.case).unwrap();
    let a = &mut p.analysis;
    let t = Instant::now();
    let f = a.forward(&p.initial_density.clone(), &mut Silent).unwrap();
    println!("{:?}", a.linear.counts());
    println!("forward {:.2}s, newton {}", t.elapsed().as_secs_f64(), f.path.newton_iterations());
    let n = f.path.states.len();
    let (s0, s1) = (&f.path.states[n - 2].state, &f.path.states[n - 1].state);
    let mut best = [f64::MAX; 7];
    for _ in 0..5 {
        let t = Instant::now();
        a.model.begin_step(s0, false).unwrap();
        best[0] = best[0].min(t.elapsed().as_secs_f64());
        let mut out = vec![0.0; a.model.unknowns()];
        let t = Instant::now();
        a.model.residual(&s1.unknowns, &mut out).unwrap();
        best[1] = best[1].min(t.elapsed().as_secs_f64());
        let (fixed, groups) = (a.model.fixed().to_vec(), a.model.groups().to_vec());
        let t = Instant::now();
        let m = a.model.tangent(&s1.unknowns).unwrap();
        best[2] = best[2].min(t.elapsed().as_secs_f64());
        let t = Instant::now();
        let fac = a.linear.factorize(m, &fixed, &groups).unwrap();
        best[3] = best[3].min(t.elapsed().as_secs_f64());
        let rhs: Vec<f64> = (0..out.len()).map(|i| (i as f64).sin()).collect();
        let t = Instant::now();
        fac.solve(&rhs, false, 1e-10).unwrap();
        best[4] = best[4].min(t.elapsed().as_secs_f64());
        let t = Instant::now();
        fac.solve(&rhs, true, 1e-10).unwrap();
        best[5] = best[5].min(t.elapsed().as_secs_f64());
    }
    {
        use slipstick_linalg::*;
        let (fixed, groups) = (a.model.fixed().to_vec(), a.model.groups().to_vec());
        let m = a.model.tangent(&s1.unknowns).unwrap();
        let t = Instant::now();
        let red = Reduction::new(m.pattern(), &fixed, &groups);
        println!("reduction {:.4}", t.elapsed().as_secs_f64());
        let t = Instant::now();
        let csr = red.reduce(m);
        println!("reduce {:.4} n {} nnz {}", t.elapsed().as_secs_f64(), csr.n(), csr.values.len());
        for prec in [Precision::F64, Precision::F32] {
            let mut mf = MultifrontalSolver::new(prec);
            let t = Instant::now();
            mf.analyse(&csr.pattern).unwrap();
            println!("analyse {:.4}", t.elapsed().as_secs_f64());
            for _ in 0..3 {
                let t = Instant::now();
                let f = mf.factorize_matrix(&csr).unwrap();
                println!("factor {:.4} {:?}", t.elapsed().as_secs_f64(), f.statistics());
            }
        }
        let mut rs = RobustSolver::new(SolverChoice::Auto);
        for _ in 0..3 {
            let t = Instant::now();
            rs.factorize(&csr).unwrap();
            println!("robust {:.4} {:?}", t.elapsed().as_secs_f64(), rs.used());
        }
    }
    println!(
        "begin {:.4} residual {:.4} tangent {:.4} factor {:.4} solve {:.4} solveT {:.4}",
        best[0], best[1], best[2], best[3], best[4], best[5]
    );
}
