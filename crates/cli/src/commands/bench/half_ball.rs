//! The benchmark problem: a half-ball pressed into a plate and slid over it, in any size.

/// Elements of the plate and of the half-ball at the base size; other sizes are multiples of it.
const PLATE: [f64; 3] = [14.0, 3.0, 14.0];
const BALL: [f64; 3] = [10.0, 2.0, 1.0];

/// Number of steps of the whole path.
pub const STEPS: usize = 50;

/// Element counts of plate and ball for about `elements` in total: all edges are divided
/// proportionally.
fn counts(elements: usize) -> [[usize; 3]; 2] {
    let [n, h, m] = BALL;
    let base = PLATE.iter().product::<f64>() + n * n * h + m * (n * n + 4.0 * n * h);
    let scale = (elements as f64 / base).cbrt();
    [PLATE, BALL].map(|edges| edges.map(|count| ((scale * count).round() as usize).max(1)))
}

/// The case file. It has friction, multipliers, and a path on which nodes stick, slip, open and
/// close from the third step on.
pub fn case(elements: usize, memory: &str) -> String {
    let [plate, ball] = counts(elements);
    format!(
        r#"title = "Half-ball on a plate, for benchmarks"
[[body]]
name = "plate"
box = {{ min = [-1.5, -1.0, -1.5], max = [1.5, 0.0, 1.5], elements = {plate:?} }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "ball"
half_ball = {{ radius = 1.2, elements = {ball:?} }}
place = {{ translate = [-0.5, 1.2, -0.25] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[contact]]
slave = "ball_dome"
master = "plate_ymax"
friction = 0.3
[[dirichlet]]
set = "plate_ymin"
[[dirichlet]]
set = "ball_flat"
motion = [{{ t = 0.04, u = [0.0, -0.06, 0.0] }}, {{ t = 1.0, u = [0.5, -0.3, 0.25] }}]
[load_path]
steps = {STEPS}
[design]
bodies = ["plate"]
initial = 0.5
volume_fraction = 0.5
[objective]
contact_force = {{ steps = "last" }}
[adjoint]
memory = "{memory}"
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The case is valid and has the requested size, up to the rounding of its divisions.
    #[test]
    fn sizes_are_met() {
        for elements in [100, 1000, 3000, 9400, 90_000] {
            let case = slipstick::case::parse_case(&case(elements, "1 GiB"), "bench").expect("right").case;
            let count: usize = case.bodies.iter().filter_map(|b| b.shape.element_count()).sum();
            assert!((count as f64 / elements as f64 - 1.0).abs() < 0.25, "{elements}: {count}");
        }
    }
}
