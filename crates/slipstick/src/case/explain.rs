//! What mends each kind of mistake in a case file, in general; a message says it for its place.

use super::CaseCode;

impl CaseCode {
    /// What mends it, in a few sentences for whoever meets the code for the first time.
    pub fn cure(self) -> &'static str {
        use CaseCode::*;
        match self {
            Syntax => {
                "Look at the marked place: a quote, bracket or comma is missing, or a table stands twice. The \
                 format is TOML (https://toml.io); `slipstick new half-ball` writes an example."
            }
            UnknownKey => {
                "Keys that nobody reads are errors, so that misspelt ones are not ignored. Take the suggestion, \
                 or look the key up in docs/case_file.md; it may belong to another table."
            }
            MissingKey => {
                "Add the key; it has no default because any would be a guess about your problem. \
                 docs/case_file.md says what it means."
            }
            MissingSection => {
                "Add the section: `optimize` needs [design], [objective] and [optimizer], every analysis \
                 [[dirichlet]]. `slipstick new half-ball` writes a case that has all."
            }
            WrongType => {
                "Write the value as the message says: numbers without quotes, words in quotes, lists in [ ], \
                 tables in { }. Counts are whole numbers without a decimal point."
            }
            ChooseOne => {
                "Keep one of the keys: a body has one shape and one material, a contact pair one enforcement \
                 method."
            }
            UnknownWord => "Take one of the words that the message lists.",
            NotFinite => "Give a finite number; `inf` and `nan` are numbers of TOML, but of no mechanical quantity.",
            OutOfRange => {
                "Give a value in the range that the message names. Very large or small numbers often mean mixed \
                 units."
            }
            Empty => "Give at least one entry, or leave the key out where it has a default.",
            BadName => "Use letters, digits, `_` and `-`: names become parts of the names of surfaces.",
            DuplicateName => {
                "Rename one of them, or remove the second entry. Names of bodies, sets and surfaces share one \
                 list."
            }
            UnknownBody => "Name a body of the case; the message lists them.",
            UnknownSet => {
                "Name a surface ({body}_{face}, as in plate_ymax), a [[surface]] or a [[set]] that stands before. \
                 `slipstick check` lists all with their nodes."
            }
            NotASurface => "Contact integrates over facets, and a node set has none: name a surface.",
            BadShape => {
                "Order the bounds: the lower corner lies below the upper one in every direction, the inner radius \
                 is smaller than the outer."
            }
            Elements => {
                "Give element counts that the shape can be divided into, at least those that the message names."
            }
            YoungsModulus => "Give a positive modulus, in the case's units of force over length squared.",
            PoissonRatio => {
                "Give a ratio above -1 and below 1/2. Above about 0.45 take `element = \"f_bar\"`, which does not \
                 lock."
            }
            Friction => "Give Coulomb's coefficient, 0 or more; 0 is frictionless.",
            SameSurface => "Name two surfaces that look at each other; a surface cannot touch itself here.",
            SameBody => "Name surfaces of two bodies; contact of a body with itself is not supported.",
            CellRule => "Take 1, 3, 6, 7 or 12 points; 7 is the default and exact enough for bilinear facets.",
            MotionTime => "Let the way points' times increase, from above 0 to at most 1.",
            Motion => "Give way points `u`, or `angle` with a `rotation`, and only components that are prescribed.",
            ConflictingDirichlet => {
                "A component of a node can follow one motion only: make the sets disjoint, or let one table move \
                 the nodes that both have."
            }
            Steps => "Give at least one load step, and only steps from 1 to `load_path.steps`.",
            Simp => "Take p of at least 1, usually 3, and a small stiffness of voids, usually 1e-3.",
            Fraction => "Give a fraction above 0 and at most 1.",
            EmptyDesign => "Leave some elements to be designed: name a body, or make the passive boxes smaller.",
            InfeasibleVolume => "Raise `volume_fraction`, or make the boxes of `passive_solid` smaller.",
            ContradictoryPassive => "Let the boxes of `passive_solid` and `passive_void` share no element's centroid.",
            InitialVolume => {
                "Start with a density of at most `volume_fraction`, or leave `initial` out. Passive solid elements count \
                 too: with them, start lower, as the message says. The optimizer will reach the bound, but its first \
                 designs violate it."
            }
            EmptyPassiveRegion => {
                "An element is passive if its centroid lies in one of the boxes. Enlarge or move the box; it refers to \
                 coordinates after `place`."
            }
            IdleFilter => {
                "The filter averages over elements whose centroids are closer than the radius. Give a radius of 1.5 to 3 times \
                 the element size, or leave the filter out."
            }
            UnsupportedBody => {
                "Hold the body with a [[dirichlet]] table, or be sure that contact holds it from the start. A \
                 body that nothing holds makes the equations singular."
            }
            CornerBetweenSteps => {
                "Choose `load_path.steps` so that every way point falls on a step, or move the way point; between \
                 steps motions are straight."
            }
            NoContact => {
                "Add a [[contact]] pair, or see that its surfaces come within the search distance of each other."
            }
            NeverCloses => {
                "Move a body in its `place.translate`, make the motion longer or change its direction, or leave the pair \
                 out. The distance is exact where bodies move rigidly until they touch; of loaded, free or otherwise \
                 deformed bodies nothing is foreseen."
            }
            AveragedNormals => {
                "Contact acts along the normal of each slave node, the mean over the facets around it. Refine the mesh \
                 where a curved slave surface is coarse; let `feature_angle` be smaller than the angle of an edge, so that \
                 each side of it has normals of its own; or exchange slave and master. Nothing is lost where the surfaces \
                 never touch at these nodes."
            }
            CoarseSlave => {
                "Contact conditions hold at slave nodes. Where master nodes lie between them, those can penetrate. Exchange \
                 slave and master, or refine the slave; the finer side should be the slave."
            }
            Mesh => "Change the shape, its element counts or placement; the message names the defect of the mesh.",
            MeshFile => {
                "Check the file's name, format and groups; docs/case_file.md says which formats and elements are \
                 read. Elements of second order are read with `first_order = true` in the body's `mesh`, by their corners."
            }
            Disconnected => {
                "Merge nodes that lie on each other in the program that made the mesh, or make a body of each \
                 part."
            }
            TooLarge => {
                "Take fewer elements or a machine with more memory; `slipstick check` predicts what a run needs."
            }
            EmptySet => {
                "Widen or move the region: it holds reference positions, after placement. `slipstick check` shows \
                 the other sets."
            }
            PenetratingStart => {
                "Move a body with its `place.translate`, so that surfaces just touch. Otherwise the first load \
                 step has to push the penetration out."
            }
            LooseTolerance => {
                "Take a smaller tolerance: 1e-8 is the default and costs few iterations more. Gradients are exact \
                 for converged states only."
            }
            Locking => {
                "Give the body `element = \"f_bar\"`, with which hexahedra do not lock, or a Poisson's ratio below 0.45. \
                 Tetrahedra lock in any case, wedges in the plane of their triangles."
            }
            Unsupported => "Change one of the two settings that the message names.",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sentences, without remains of markup, and not the meaning again.
    #[test]
    fn every_code_is_explained() {
        for &code in CaseCode::ALL {
            let (about, cure) = (code.about(), code.cure());
            for text in [about, cure] {
                assert!(text.len() > 15 && text.ends_with('.') && text == text.trim(), "{code}: {text}");
            }
            assert_ne!(about, cure);
        }
    }
}
