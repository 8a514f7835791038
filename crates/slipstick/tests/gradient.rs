//! probe
mod common;
use common::scene::*;
use common::*;

#[test]
fn probe() {
    for (name, e) in [("L", LAGRANGE.to_string()), ("P", penalty(2e4)), ("A", augmented(1e5, 1e-12))] {
      for shape in ["standard", "dual"] {
        let scene = Scene { enforcement: e.clone(), shape, ..Scene::default() };
        let mut p = problem(&scene.text());
        let rho = random_density(&p, 1);
        let t = std::time::Instant::now();
        let f = forward(&mut p, &rho);
        println!("{name} {shape} {:?} newton {} uz {:?} {:?}", t.elapsed(), f.path.newton_iterations(), f.path.states.iter().map(|s| s.report.uzawa).collect::<Vec<_>>(), status_path(&mut p, &f));
        let c = check_gradient(&mut p, &rho);
        println!("   error {:.2e} {:?}", c.error, t.elapsed());
      }
    }
}
