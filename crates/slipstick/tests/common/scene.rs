//! Scenes of a few elements, as case texts.

use slipstick::case::LawKind;

/// Lagrange multipliers.
pub const LAGRANGE: &str = "{ lagrange = {} }";

/// A block on a slab with non-matching meshes; y is up, the slab's top and the block's bottom lie
/// at y = 1.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Elements of slab (4 × 1 × 1) and block (0.8³), corner of the block.
    pub slab: [usize; 3],
    /// Elements of the block.
    pub block: [usize; 3],
    /// Lowest corner of the block.
    pub corner: [f64; 3],
    /// Coefficient of friction.
    pub friction: f64,
    /// Value of `enforcement`.
    pub enforcement: String,
    /// "standard" or "dual".
    pub shape: &'static str,
    /// Value of `motion` of the block's top.
    pub motion: String,
    /// Further keys of the block's top, such as `rotation`.
    pub drive: String,
    /// Number of load steps.
    pub steps: usize,
    /// Further keys of `[load_path]`, including the tolerance.
    pub load_path: String,
    /// Further keys of `[design]`.
    pub design: String,
    /// Value of `contact_force.steps`.
    pub observed: &'static str,
    /// Unit of length, as a factor on all lengths.
    pub length: f64,
    /// Young's modulus.
    pub modulus: f64,
    /// Value of `place` of both bodies.
    pub place: String,
    /// Further tables.
    pub more: String,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            slab: [4, 1, 1],
            block: [1, 1, 1],
            corner: [0.6, 1.0, 0.1],
            friction: 0.4,
            enforcement: LAGRANGE.into(),
            shape: "standard",
            motion: "[{ t = 0.5, u = [0, -0.1, 0] }, { t = 1.0, u = [0.1, -0.1, 0.03] }]".into(),
            drive: String::new(),
            steps: 10,
            load_path: "tolerance = { relative = 1e-12 }".into(),
            design: String::new(),
            observed: "\"last\"",
            length: 1.0,
            modulus: 1000.0,
            place: "{}".into(),
            more: String::new(),
        }
    }
}

/// A case text with another law in place of compressible neo-Hooke, with the same E and ν.
pub fn of_law(text: &str, law: LawKind) -> String {
    let mut parts = text.split("{ neo_hooke = { youngs_modulus = ");
    let mut out = parts.next().expect("a text").to_owned();
    for part in parts {
        let (modulus, rest) = part.split_once(", poisson_ratio = ").expect("a ratio");
        let (ratio, rest) = rest.split_once(" } }").expect("the end of the material");
        let [modulus, ratio] = [modulus, ratio].map(|number| number.parse().expect("a number"));
        out += &law.like(modulus, ratio).expect("constants").to_string();
        out += rest;
    }
    out
}

impl Scene {
    /// The case's text.
    pub fn text(&self) -> String {
        let Self {
            slab,
            block,
            friction,
            enforcement,
            shape,
            motion,
            drive,
            steps,
            load_path,
            design,
            observed,
            place,
            more,
            ..
        } = self;
        let l = self.length;
        let min = self.corner.map(|c| c * l);
        let max = self.corner.map(|c| (c + 0.8) * l);
        let material =
            format!("material = {{ neo_hooke = {{ youngs_modulus = {:?}, poisson_ratio = 0.3 }} }}", self.modulus);
        format!(
            r#"
[[body]]
name = "slab"
box = {{ min = [0, 0, 0], max = [{:?}, {l:?}, {l:?}], elements = {slab:?} }}
place = {place}
{material}
[[body]]
name = "block"
box = {{ min = {min:?}, max = {max:?}, elements = {block:?} }}
place = {place}
{material}
[[contact]]
slave = "block_ymin"
master = "slab_ymax"
friction = {friction:?}
multiplier_shape = "{shape}"
enforcement = {enforcement}
[[dirichlet]]
set = "slab_ymin"
[[dirichlet]]
set = "block_ymax"
motion = {motion}
{drive}
[load_path]
steps = {steps}
{load_path}
[design]
bodies = ["slab", "block"]
initial = 0.5
simp = {{ p = 3, min = 1e-3 }}
{design}
[objective]
contact_force = {{ steps = {observed} }}
{more}
"#,
            4.0 * l,
        )
    }
}

/// Penalty with the given stiffness over area.
pub fn penalty(stiffness: f64) -> String {
    format!("{{ penalty = {{ stiffness = {stiffness:?} }} }}")
}

/// Augmented Lagrangian with the given stiffness over area and relative tolerance.
pub fn augmented(stiffness: f64, tolerance: f64) -> String {
    format!("{{ augmented = {{ stiffness = {stiffness:?}, tolerance = {tolerance:?}, max_uzawa = 400 }} }}")
}

/// Three bodies, two contact pairs: a cube held only by contact, between a slab and a stamp;
/// enforcement of the pairs below and above it.
pub fn three_bodies(below: &str, above: &str) -> String {
    format!(
        r#"
[[body]]
name = "slab"
box = {{ min = [0, 0, 0], max = [3, 1, 1], elements = [3, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1000.0, poisson_ratio = 0.3 }} }}
[[body]]
name = "cube"
box = {{ min = [0.7, 0.998, 0.15], max = [1.4, 1.7, 0.85], elements = [1, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 700.0, poisson_ratio = 0.2 }} }}
[[body]]
name = "stamp"
box = {{ min = [0.55, 1.698, 0.05], max = [1.6, 2.2, 1.0], elements = [1, 1, 1] }}
material = {{ neo_hooke = {{ youngs_modulus = 1500.0, poisson_ratio = 0.3 }} }}
[[contact]]
slave = "cube_ymin"
master = "slab_ymax"
friction = 0.25
enforcement = {below}
[[contact]]
slave = "cube_ymax"
master = "stamp_ymin"
friction = 0.6
multiplier_shape = "dual"
enforcement = {above}
[[dirichlet]]
set = "slab_ymin"
[[dirichlet]]
set = "stamp_ymax"
motion = [{{ t = 0.4, u = [0, -0.1, 0] }}, {{ t = 1.0, u = [0.25, -0.1, 0.06] }}]
[load_path]
steps = 10
tolerance = {{ relative = 1e-12 }}
[design]
bodies = ["slab", "cube", "stamp"]
initial = 0.5
simp = {{ p = 3, min = 1e-3 }}
[objective]
contact_force = {{ steps = [6, 10] }}
"#
    )
}
