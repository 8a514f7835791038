//! The search radius changes the cost of the search, not the result.

use super::solve;
use crate::solved::neo_hooke;

/// A rigid ball on a layer whose slave surface includes the side beyond the edge, with an entry of
/// the pair.
fn ball_on_layer(right: f64, place: [f64; 2], motion: &str, steps: usize, radius: Option<f64>) -> String {
    let radius = radius.map_or(String::new(), |radius| format!("search_radius = {radius:?}\n"));
    format!(
        "[[body]]\nname = 'layer'\nbox = {{ min = [-2, 0, -1], max = [{right:?}, 1, 1], elements = [12, 3, 6] }}\n{}\n\
         [[body]]\nname = 'ball'\nhalf_ball = {{ radius = 3.0, elements = [8, 4, 4] }}\n\
         place = {{ translate = [{:?}, {:?}, 0] }}\nrigid = {{}}\n\
         [[surface]]\nname = 'all'\nof = ['layer_ymax', 'layer_xmax']\n\
         [[contact]]\nslave = 'all'\nmaster = 'ball_dome'\nfriction = 0.0\nsurfaces = 'faceted'\n{radius}\
         [[dirichlet]]\nset = 'layer_ymin'\n[[dirichlet]]\nset = 'ball'\n{motion}\
         [load_path]\nsteps = {steps}\ntolerance = {{ relative = 1e-11 }}\n",
        neo_hooke(10.0, 0.3),
        place[0],
        place[1],
    )
}

/// Displacements after every step, and the vertical reaction of the layer's support at the end.
fn path(text: &str) -> (Vec<Vec<f64>>, f64) {
    let solved = solve(text, &[]);
    let displacements = 3 * solved.problem.mesh.nodes.len();
    let states = solved.forward.path.states.iter();
    let states = states.map(|at| at.state.unknowns[..displacements].to_vec()).collect();
    (states, solved.reaction("layer_ymin", solved.steps()).y)
}

/// Largest difference of any displacement in any step, which is that of two converged iterations if
/// the equations are the same.
fn apart(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    assert_eq!(a.len(), b.len(), "different numbers of steps");
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A ball dents the top of a layer next to its side. Parts of the ball lie behind the side, which
/// is outside the ball: all radii find the same contact. The force is that of a layer whose slave
/// surface is the top alone, as found with radii that do not reach from the side to the ball.
#[test]
fn the_far_side_of_a_ball_does_not_touch_the_side_of_a_layer() {
    let all: Vec<_> = [None, Some(0.2), Some(0.8), Some(3.0), Some(4.0)]
        .map(|r| path(&ball_on_layer(1.2, [0.2, 3.9], "", 1, r)))
        .into();
    assert!((all[0].1 - 1.022975).abs() < 1e-6, "{}", all[0].1);
    for other in &all[1..] {
        let apart = apart(&all[0].0, &other.0);
        assert!(apart < 1e-10, "the results depend on the search radius: {apart:e}");
    }
}

/// The ball slides over the edge of the layer.
#[test]
fn a_ball_slides_over_an_edge_with_any_search_radius() {
    let motion = "motion = [{ t = 0.25, u = [0, -0.1, 0] }, { t = 1, u = [2.5, -0.1, 0] }]\n";
    let [a, b] = [0.3, 6.0].map(|radius| path(&ball_on_layer(2.0, [0.0, 4.0], motion, 20, Some(radius))));
    let apart = apart(&a.0, &b.0);
    assert!(apart < 1e-10, "the results depend on the search radius: {apart:e}");
}

/// A block is dragged over another one with much friction, and its leading edge tucks under. The extrapolation of
/// the path into the step in which it does is a poor start: the iteration from it depends on which facets are paired
/// on the way. The force is that of twice as many load steps, which find it with any radius.
#[test]
fn a_block_that_tucks_under_is_the_same_with_any_search_radius() {
    let dragged = |radius: Option<f64>, steps: usize| {
        let radius = radius.map_or(String::new(), |radius| format!("search_radius = {radius:?}\n"));
        let text = format!(
            "[[body]]\nname = 'low'\nbox = {{ min = [0, 0, 0], max = [6, 1, 1], elements = [18, 3, 2] }}\n{material}\n\
             [[body]]\nname = 'up'\nbox = {{ min = [0.5, 1, 0], max = [2, 2.5, 1], elements = [6, 6, 2] }}\n{material}\n\
             [[surface]]\nname = 'bottom'\nof = ['up_ymin', 'up_xmin', 'up_xmax']\n\
             [[contact]]\nslave = 'bottom'\nmaster = 'low_ymax'\nfriction = 0.9\n{radius}\
             [[dirichlet]]\nset = 'low_ymin'\n\
             [[dirichlet]]\nset = 'up_ymax'\n\
             motion = [{{ t = 0.2, u = [0, -0.05, 0] }}, {{ t = 1, u = [1, -0.05, 0] }}]\n\
             [load_path]\nsteps = {steps}\n",
            material = neo_hooke(1000.0, 0.3),
        );
        let solved = solve(&text, &[]);
        solved.reaction("low_ymin", solved.steps())
    };
    let expected = dragged(None, 20);
    for radius in [None, Some(0.15), Some(0.2), Some(0.3), Some(1.5), Some(3.0)] {
        let found = dragged(radius, 10);
        println!("search_radius {radius:?}: {found:?}, {expected:?} with 20 steps");
        assert!((found - expected).norm() < 1e-3 * expected.norm(), "{radius:?}: {found:?}");
    }
}
