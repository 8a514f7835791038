//! Sliding: Coulomb's law for a whole block, reversal, and drag over facets.

use crate::chapter::Chapter;
use crate::finding::Finding;
use crate::solved::{Scene, Solved, neo_hooke};
use slipstick_contact::ContactStatus;

pub fn chapters() -> [Chapter; 2] {
    [
        Chapter {
            key: "sliding",
            title: "Block on a rigid plane",
            about: "
A block (1.6 × 0.5 × 0.8, E = 1000, ν = 0.3, μ = 0.3) is pressed onto a fixed slab by 0.02 and
pulled along it. Once its whole face slips, Coulomb's law for the whole block is F_t = μ F_n,
exactly. In the second problem the top of the block moves back and forth by ±0.1. After each
reversal the face sticks, then slips; at the end of each stroke F_t = ±μ F_n; the second cycle must
repeat the first one.",
            remarks: "",
            quick: true,
            run: || Some(block()),
        },
        Chapter {
            key: "ironing",
            title: "Drag and oscillation of a sliding die",
            about: "
Plane strain: a half-ring (R = 0.6 … 1, E = 1000, driven at its ends) is pressed by 0.3 into a block
(9 × 3, E = 100, ν = 0.3) and slides by 2, from 1 left of the middle to 1 right of it, over N = 7 or
14 facets. Without friction, no net work is done along this slide, by symmetry: the mean of the
tangential force is zero. The ends of the block and the facets cause a tangential force, which must
stay below 0.01 F_n at every step of the slide, for any size of the load steps. A formulation with
normals frozen per load step gives 0.2 at 0.2 slide per step. With friction (μ = 0.2), normal and
tangential force should be constant along the slide: their span (largest − smallest) divided by the
mean, after a slide of 0.5, must stay below 0.05.",
            remarks: "
There is no drag: the force oscillates with the period of the facets, and the step size only
determines where the oscillation is sampled. With friction, the oscillation is at least halved when
the facets are halved. The oscillation of the tangential force exceeds the bound on the coarser
mesh, which has about five facets in contact, and is larger with dual shapes than with standard
ones.",
            quick: false,
            run: || Some(ironing()),
        },
    ]
}

const FRICTION: f64 = 0.3;

fn on_plane(shape: &str, motion: &str, steps: usize) -> Solved {
    let material = neo_hooke(1000.0, 0.3);
    Scene::from(format!(
        "[[body]]\nname = 'base'\nbox = {{ min = [0, 0, 0], max = [4, 1, 1], elements = [5, 1, 2] }}\n{material}\n\
         [[body]]\nname = 'block'\nbox = {{ min = [0.6, 1, 0.1], max = [2.2, 1.5, 0.9], elements = [4, 2, 3] }}\n{material}\n\
         [[set]]\nname = 'plane'\nboxes = [{{ min = [-1, -1, -1], max = [5, 0.5, 2] }}]\n\
         [[contact]]\nslave = 'block_ymin'\nmaster = 'base_ymax'\nfriction = {FRICTION}\nmultiplier_shape = '{shape}'\n\
         [[dirichlet]]\nset = 'plane'\n[[dirichlet]]\nset = 'base_ymax'\n\
         [[dirichlet]]\nset = 'block_ymax'\nmotion = {motion}\n\
         [load_path]\nsteps = {steps}\ntolerance = {{ relative = 1e-12 }}\n"
    ))
    .solve()
}

/// Tangential force divided by normal force of the driver's reaction.
fn ratio(solved: &Solved, set: &str, step: usize) -> f64 {
    let force = solved.reaction(set, step);
    force.x / -force.y
}

fn block() -> Vec<Finding> {
    let mut findings = Vec::new();
    for shape in ["standard", "dual"] {
        let mut solved = on_plane(shape, "[{ t = 0.2, u = [0, -0.02, 0] }, { t = 1.0, u = [0.8, -0.02, 0] }]", 20);
        let last = solved.steps();
        assert!(solved.contact(last).iter().all(|node| node.status != ContactStatus::Stick));
        let found = ratio(&solved, "block_ymax", last);
        findings.push(Finding::value(format!("F_t/F_n in full slip, {shape} shapes"), FRICTION, 1e-8, found));
    }
    let motion = "[{ t = 0.1, u = [0, -0.02, 0] }, { t = 0.3, u = [0.1, -0.02, 0] }, { t = 0.5, u = [-0.1, -0.02, 0] }, \
                  { t = 0.7, u = [0.1, -0.02, 0] }, { t = 0.9, u = [-0.1, -0.02, 0] }, { t = 1.0, u = [0, -0.02, 0] }]";
    let mut solved = on_plane("standard", motion, 100);
    for (step, expected) in [(30, FRICTION), (50, -FRICTION), (70, FRICTION), (90, -FRICTION)] {
        let found = ratio(&solved, "block_ymax", step);
        findings.push(Finding::value(format!("F_t/F_n at the end of stroke {}", step / 20), expected, 1e-6, found));
    }
    let stick = solved.contact(51).iter().filter(|node| node.status == ContactStatus::Stick).count();
    assert!(stick > 0, "nodes stick after a reversal");
    let force = |step: usize| solved.reaction("block_ymax", step).x;
    let largest = (50..70).map(|step| force(step).abs()).fold(0.0, f64::max);
    // both cycles begin with a reversal in full slip, at steps 50 and 90; ten steps of the second
    // one are available
    let differ = (50..=60).map(|step| (force(step) - force(step + 40)).abs()).fold(0.0, f64::max) / largest;
    findings.push(Finding::at_most("the stroke after 40 more steps, over the largest F_t", 1e-6, differ));
    let mirror = (30..=50).map(|step| (force(step) + force(step + 20)).abs()).fold(0.0, f64::max) / largest;
    findings.push(Finding::at_most("stroke back against stroke forth, over the largest F_t", 1e-6, mirror));
    findings
}

/// The plane problem with meshes `fine` times as fine; reactions (normal, tangential) at slide
/// 2·k/`slides`, k from 0.
pub fn plane_ironing(friction: f64, shape: &str, fine: usize, slides: usize) -> Vec<[f64; 2]> {
    // one element across, of about the facets' length
    let width = 0.3 / fine as f64;
    let press = slides.max(4);
    let solved = Scene::from(format!(
        "[[body]]\nname = 'block'\nbox = {{ min = [0, -3, 0], max = [9, 0, {width:?}], elements = [{}, {}, 1] }}\n{}\n\
         [[body]]\nname = 'die'\nhalf_ring = {{ inner_radius = 0.6, outer_radius = 1, width = {width:?}, elements = [{}, {}, 1] }}\n\
         place = {{ translate = [3.5, 1, {:?}] }}\n{}\n\
         [[set]]\nname = 'all'\nboxes = [{{ min = [-10, -10, -10], max = [10, 10, 10] }}]\n\
         [[contact]]\nslave = 'die_outer'\nmaster = 'block_ymax'\nfriction = {friction:?}\nmultiplier_shape = '{shape}'\nenforcement = {{ augmented = {{}} }}\n\
         [[dirichlet]]\nset = 'all'\ncomponents = ['z']\n\
         [[dirichlet]]\nset = 'block_ymin'\ncomponents = ['x', 'y']\n\
         [[dirichlet]]\nset = 'die_ends'\ncomponents = ['x', 'y']\n\
         motion = [{{ t = {:?}, u = [0, -0.3, 0] }}, {{ t = 1.0, u = [2, -0.3, 0] }}]\n\
         [load_path]\nsteps = {}\n",
        30 * fine,
        8 * fine,
        neo_hooke(100.0, 0.3),
        16 * fine,
        3 * fine,
        0.5 * width,
        neo_hooke(1000.0, 0.3),
        press as f64 / (press + slides) as f64,
        press + slides
    ))
    .solve();
    let reaction = |step: usize| {
        let force = solved.reaction("die_ends", step) / width;
        [-force.y, force.x]
    };
    (press..=press + slides).map(reaction).collect()
}

/// (largest − smallest)/mean.
fn span(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let (count, sum) = values.clone().fold((0, 0.0), |(n, s), v| (n + 1, s + v));
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    (high - low) * f64::from(count) / sum
}

fn ironing() -> Vec<Finding> {
    let mut findings = Vec::new();
    for (fine, slides) in [(1, 2), (1, 5), (1, 10), (1, 40), (2, 40)] {
        let forces = plane_ironing(0.0, "standard", fine, slides);
        let ratios = forces[1..].iter().map(|[normal, tangential]| tangential / normal);
        let largest = ratios.clone().fold(0.0f64, |a, b| a.max(b.abs()));
        let name = format!("frictionless, N = {}, slide {:?} per step", 7 * fine, 2.0 / slides as f64);
        findings.push(Finding::at_most(format!("{name}: largest F_t/F_n"), 0.01, largest));
        if slides == 40 {
            // work of the force along the slide, by the trapezoidal rule, over F_n and the sliding
            // distance
            let work = |pair: &[[f64; 2]]| 0.5 * (pair[0][1] / pair[0][0] + pair[1][1] / pair[1][0]);
            let mean = forces.windows(2).map(work).sum::<f64>() / slides as f64;
            findings.push(Finding::at_most(format!("{name}: mean F_t/F_n"), 1e-3, mean));
        }
    }
    for (fine, shape) in [(1, "standard"), (2, "standard"), (1, "dual"), (2, "dual")] {
        let slides = 20 * fine;
        let forces = plane_ironing(0.2, shape, fine, slides);
        let steady = forces[slides / 4..].iter();
        for (name, which) in [("F_n", 0), ("F_t", 1)] {
            let what = format!("μ = 0.2, N = {}, {shape} shapes: span of {name}", 7 * fine);
            let finding = Finding::at_most(what, 0.05, span(steady.clone().map(|force| force[which])));
            findings.push(if (fine, name) == (1, "F_t") { finding.known() } else { finding });
        }
    }
    findings
}
