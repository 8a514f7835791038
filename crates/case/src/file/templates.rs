//! Commented example cases.

/// A commented case file that works without changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Template {
    /// Its name.
    pub name: &'static str,
    /// A one-line description.
    pub about: &'static str,
    /// The case file.
    pub text: &'static str,
}

/// All templates.
pub const TEMPLATES: &[Template] = &[
    Template {
        name: "half-ball",
        about: "a half-ball pressed into a plate and slid over it; the plate is designed",
        text: include_str!("templates/half_ball.toml"),
    },
    Template {
        name: "ironing",
        about: "a stiff die drawn over a soft slab; the slab is designed",
        text: include_str!("templates/ironing.toml"),
    },
    Template {
        name: "clutch",
        about: "a hollow cylinder pressed onto another one and rotated; both are designed",
        text: include_str!("templates/clutch.toml"),
    },
    Template {
        name: "press-fit",
        about: "a hub pressed onto a shaft that turns; the hub is designed for the largest torque",
        text: include_str!("templates/press_fit.toml"),
    },
    Template {
        name: "gripper",
        about: "a finger of a gripper, designed for the strongest grip with bounded force and stress",
        text: include_str!("templates/gripper.toml"),
    },
    Template {
        name: "snap-fit",
        about: "an arm that snaps over a nose, designed for the largest force with bounded stress",
        text: include_str!("templates/snap_fit.toml"),
    },
    Template {
        name: "bracket",
        about: "a wall bracket under a roller, designed for the smallest deflection of its tip",
        text: include_str!("templates/bracket.toml"),
    },
    Template {
        name: "cube-on-cuboid",
        about: "five elements, for studying forces and gradients",
        text: include_str!("templates/cube_on_cuboid.toml"),
    },
];

/// The template with this name; `_` and `-` are equivalent.
pub fn template(name: &str) -> Option<&'static Template> {
    let name = name.replace('_', "-");
    TEMPLATES.iter().find(|template| template.name == name)
}
