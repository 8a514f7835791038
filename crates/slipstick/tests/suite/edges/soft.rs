//! A soft block that is dragged over a rigid plate: Coulomb's ratio up to the friction at which its leading edge
//! sticks, against an independent program.

use super::solve;
use crate::solved::neo_hooke;
use slipstick::quantities::quantities;

/// A block (1.5 × 1.5) in plane strain, pressed down by 0.05 and dragged by 1, bottom and both sides as the slave:
/// Fx/Fy, Fy, and the fraction of the work of the drive that friction takes.
fn dragged(friction: f64) -> [f64; 3] {
    let text = format!(
        "[[body]]\nname = 'low'\nbox = {{ min = [0, 0, 0], max = [6, 1, 1], elements = [18, 3, 2] }}\nrigid = {{}}\n\
         [[body]]\nname = 'up'\nbox = {{ min = [0.5, 1, 0], max = [2, 2.5, 1], elements = [6, 6, 2] }}\n{}\n\
         [[surface]]\nname = 'bottom'\nof = ['up_ymin', 'up_xmin', 'up_xmax']\n\
         [[contact]]\nslave = 'bottom'\nmaster = 'low_ymax'\nfriction = {friction:?}\n\
         [[dirichlet]]\nset = 'low'\n\
         [[dirichlet]]\nset = 'up_zmin'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'up_zmax'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'up_ymax'\n\
         motion = [{{ t = 0.2, u = [0, -0.05, 0] }}, {{ t = 1, u = [1, -0.05, 0] }}]\n\
         [[quantity]]\nname = 'fx'\nreaction = {{ set = 'up_ymax', component = 'x' }}\n\
         [[quantity]]\nname = 'fy'\nreaction = {{ set = 'up_ymax', component = 'y' }}\n\
         [load_path]\nsteps = 40\n",
        neo_hooke(1000.0, 0.3),
    );
    let solved = solve(&text, &[]);
    let found = quantities(&solved.problem, &solved.forward.path);
    let last = |name: &str| *found.get(name).expect(name).last().expect("a row");
    [-last("fx") / last("fy"), -last("fy"), last("friction_work") / last("external_work")]
}

/// Up to μ = 0.7 the block slides, and Fx/Fy = μ. With more friction, its leading edge sticks and tucks under.
/// Forces Fy of `docs/measure/edges/rigid_plane.py` with the same mesh; there, Fx/Fy = 0.62 in the last line, and 0.70
/// with elements half as large.
#[test]
fn a_soft_block_slides_with_coulombs_ratio_until_its_edge_tucks_under() {
    for (friction, expected) in [(0.1, None), (0.3, Some(58.96)), (0.5, Some(61.58)), (0.7, Some(70.04))] {
        let [ratio, normal, _] = dragged(friction);
        println!("friction {friction}: Fx/Fy {ratio:.4}, Fy {normal:.2}");
        assert!((ratio / friction - 1.0).abs() < 2e-3, "{friction}: {ratio}");
        assert!(expected.is_none_or(|force: f64| (normal / force - 1.0).abs() < 0.04), "{friction}: {normal}");
    }
    for friction in [0.8, 0.9, 1.3] {
        let [ratio, normal, dissipated] = dragged(friction);
        println!("friction {friction}: Fx/Fy {ratio:.4}, Fy {normal:.2}, friction takes {dissipated:.3} of the work");
        assert!((0.6..0.75).contains(&ratio) && (normal / 137.07 - 1.0).abs() < 0.15, "{friction}: {ratio} {normal}");
        assert!(dissipated < 0.05, "{friction}: {dissipated}");
    }
}
