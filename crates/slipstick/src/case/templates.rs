//! Commented cases to start from.

/// A commented case file that works as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Template {
    /// The name that asks for it.
    pub name: &'static str,
    /// One line about it.
    pub about: &'static str,
    /// The case file.
    pub text: &'static str,
}

/// All templates.
pub const TEMPLATES: &[Template] = &[
    Template {
        name: "half-ball",
        about: "a half ball pressed into a plate and slid over it; the plate is designed",
        text: include_str!("templates/half_ball.toml"),
    },
    Template {
        name: "ironing",
        about: "a stiff die drawn along a soft slab; the slab is designed",
        text: include_str!("templates/ironing.toml"),
    },
    Template {
        name: "clutch",
        about: "a hollow cylinder pressed and turned on another one; both are designed",
        text: include_str!("templates/clutch.toml"),
    },
    Template {
        name: "cube-on-cuboid",
        about: "five elements, to look at forces and gradients",
        text: include_str!("templates/cube_on_cuboid.toml"),
    },
];

/// The template of this name; `_` and `-` are the same.
pub fn template(name: &str) -> Option<&'static Template> {
    let name = name.replace('_', "-");
    TEMPLATES.iter().find(|template| template.name == name)
}
