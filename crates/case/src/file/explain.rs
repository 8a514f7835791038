//! General remedies for each kind of mistake in a case file; the help of a message is specific to
//! its place.

use super::CaseCode;

impl CaseCode {
    /// The remedy, in a few sentences for users who see the code for the first time.
    pub fn cure(self) -> &'static str {
        use CaseCode::*;
        match self {
            Syntax => {
                "Check the marked place: a quote, bracket or comma is missing, or a table appears twice. The format is \
                 TOML (https://toml.io); `slipstick new half-ball` writes an example."
            }
            UnknownKey => {
                "Use the suggestion, or look up the key in docs/case_file.md; it may belong in another table. Unknown \
                 keys are errors, so that misspelt keys are not silently ignored."
            }
            MissingKey => {
                "Add the key, which docs/case_file.md explains. A default would be a guess about your problem."
            }
            MissingSection => {
                "Add the section: `optimize` needs [design], [objective] and [optimizer]; every analysis needs \
                 [[dirichlet]]. `slipstick new half-ball` writes a case with all of them."
            }
            WrongType => {
                "Use the type that the message asks for: numbers without quotes, words in quotes, lists in [ ], tables \
                 in { }. Counts are whole numbers, without a decimal point."
            }
            ChooseOne => {
                "Give exactly one of the keys: a body has one shape and one material, a contact pair has one \
                 enforcement method."
            }
            UnknownWord => "Use one of the words that the message lists.",
            NotFinite => "Give a finite number. TOML accepts `inf` and `nan`, but they are not physical quantities.",
            OutOfRange => {
                "Give a value in the range that the message states. Very large or very small numbers often come from \
                 mixed units."
            }
            Empty => "Give at least one entry, or omit the key if it has a default.",
            BadName => "Use letters, digits, `_` and `-`: names of bodies become part of the names of their surfaces.",
            DuplicateName => {
                "Rename one of them, or remove the second entry. Surfaces and sets share one list of names."
            }
            UnknownBody => "Use the name of one of the bodies; the message lists them.",
            UnknownSet => {
                "Name a surface ({body}_{face}, for instance plate_ymax), a [[surface]] or a [[set]] that is defined \
                 earlier. `slipstick check` lists all of them with their numbers of nodes."
            }
            NotASurface => "Contact integrals are taken over facets, and a node set has none: name a surface.",
            BadShape => {
                "Order the bounds: the lower corner must be below the upper corner in every direction, and the inner \
                 radius must be smaller than the outer radius."
            }
            Elements => {
                "Give numbers of elements that are possible for this shape; the message states the smallest ones."
            }
            YoungsModulus => "Give a positive modulus, in the case's units of force over length squared.",
            PoissonRatio => {
                "Give a ratio above -1 and below 1/2. Above about 0.45 use `element = \"f_bar\"`, which does not lock."
            }
            MaterialConstants => {
                "Check units and signs; the message says which condition is violated: the shear modulus of the \
                 undeformed solid must be positive, lists must be equally long, and the stiffness of an orthotropic \
                 solid must be positive for every strain."
            }
            Friction => "Give Coulomb's coefficient, 0 or more; 0 is frictionless.",
            SameSurface => {
                "Name two different surfaces that face each other. A surface may touch itself with the penalty method: \
                 then both sides carry half of the traction, where two sets of multipliers would contradict each other."
            }
            SameBody => {
                "Name surfaces of two different bodies. Surfaces of one body may touch if its mesh comes from a file; \
                 a surface of any body may touch itself."
            }
            CellRule => "Use 1, 3, 6, 7 or 12 points. The default of 7 is accurate enough for bilinear facets.",
            MotionTime => {
                "The times of the waypoints must increase; the first is greater than 0, the last is at most 1. A support \
                 that begins (`from`) or ends (`until`) within the path has its waypoints after `from`."
            }
            Motion => {
                "Give each waypoint `u`, or `angle` together with a `rotation`; move only components that are \
                 prescribed."
            }
            ConflictingDirichlet => {
                "Each component of a node can follow only one motion: make the sets disjoint, or let only one table \
                 move the nodes that they share."
            }
            Steps => "Use at least one load step, and refer only to steps 1 to `load_path.steps`.",
            Simp => "Use p of at least 1, usually 3, and a small stiffness of the void, usually 1e-3.",
            Fraction => "Give a fraction greater than 0 and at most 1.",
            EmptyDesign => "Leave some elements to optimize: name a body, or make the passive regions smaller.",
            InfeasibleVolume => "Raise `volume_fraction`, or make the regions of `passive_solid` smaller.",
            ContradictoryPassive => {
                "Change the regions so that no element's centroid lies both in `passive_solid` and in `passive_void`."
            }
            AsymmetricMesh => {
                "Correct the plane, axis or step, design only bodies that have the symmetry, or mesh them \
                 symmetrically: with the boxes of a case file, or by copying the mesh of one part. Images of centroids \
                 must be within 10 % of an element size of a centroid; the message names the worst element."
            }
            InitialVolume => {
                "Start with a density of at most `volume_fraction`, or omit `initial`. Passive solid elements count \
                 too: with them, use the lower density that the message suggests. Otherwise the first designs violate \
                 the bound."
            }
            EmptyPassiveRegion => {
                "An element is passive if its centroid lies in one of the regions. Enlarge or move the region; it refers to \
                 coordinates after `place`."
            }
            FilteredGradients => {
                "Use `density_filter` instead of `sensitivity_filter`, or `method = \"mma\"`. GCMMA shortens an update \
                 until its approximations lie above the functions. With filtered gradients, it may use up all \
                 `inner_iterations` and accept the update as it is."
            }
            LateSchedule => {
                "Iterations count from 0, the start design; the last update follows iteration `iterations - 1`. Raise \
                 `optimizer.iterations`, or omit entries beyond it."
            }
            IdleFilter => {
                "The filter averages over elements whose centroids are closer than the radius. Use a radius of 1.5 to \
                 3 times the element size, or omit the filter."
            }
            StiffVoid => {
                "Lower `simp.min` to a hundredth of the ratio of the two Young's moduli. Void can otherwise carry the \
                 pressure of a much softer body, such as rubber, and the optimizer need not place material there."
            }
            HeatedCompliance => {
                "Bound or minimize a displacement instead, or take temperatures and loads to load cases of their own. \
                 The smallest work is otherwise that of a layout whose expansion opposes the loads, not of the stiffest \
                 one."
            }
            UnsupportedBody => {
                "Support the body with a [[dirichlet]] table, or make sure that contact holds it from the start. If \
                 nothing holds a body, the equations are singular."
            }
            CornerBetweenSteps => {
                "Choose `load_path.steps` so that every waypoint falls on a load step, or move the waypoint; between \
                 load steps, motions are linear. `from` and `until` of a support count as the ends of their load steps."
            }
            NoContact => {
                "Add a [[contact]] pair, or make sure that its surfaces come within the search distance of each other. \
                 Tied surfaces should lie on each other from the start, with the smaller one as the slave: nodes \
                 without a master opposite stay free."
            }
            NeverCloses => {
                "Move a body with its `place.translate`, make the motion longer or change its direction, or omit the \
                 pair. The distance is exact: it is only computed for bodies that move rigidly until they touch."
            }
            AveragedNormals => {
                "Refine the mesh where a curved slave surface is coarse; set `feature_angle` below the angle of an \
                 edge, so that each side of the edge has its own normals; or swap slave and master. Contact acts along \
                 these normals; ignore the warning if the surfaces never touch there."
            }
            CoarseSlave => {
                "Swap slave and master, or refine the slave: master nodes between its nodes can penetrate. If the \
                 program has swapped them, as is the default of `sides`, name the other surface as the slave, or keep \
                 the sides with `sides = \"as_given\"`."
            }
            HeldTwice => {
                "At a symmetry plane, use `[[symmetry]]` instead, which holds the nodes as well. Otherwise the tie can \
                 transmit any force along the normal of the plane, since neither side can move along it, and the \
                 supports react to it."
            }
            RigidSlave => {
                "Swap slave and master, or use the penalty method. The nodes of a rigid body cannot move relative to \
                 each other, so nothing determines the multipliers if the master has fewer nodes."
            }
            Mesh => {
                "Change the shape, its numbers of elements or its placement; the message describes the defect of the \
                 mesh."
            }
            Deck => {
                "Remove or change the keyword in the deck. Where the difference does not matter, `--ignore KEYWORD`, or \
                 `ignore` in the key `deck` of a case, leaves it out."
            }
            MeshFile => {
                "Check the file's name, format and groups; docs/case_file/meshes.md lists the supported formats and \
                 elements. With `first_order = true` in the body's `mesh`, second-order elements are read without their \
                 mid-side nodes."
            }
            PoorElements => {
                "Improve the mesh (in Gmsh: `Mesh.Optimize`, `Mesh.OptimizeNetgen`), or remove small edges and faces of \
                 the model; `slipstick check` names the worst element. Almost degenerate elements are too stiff, turn \
                 inside out early, and slow down iterative solvers."
            }
            StraightMiddles => {
                "Refine the mesh where the surface bends too much within an element, or let the mesher make quadratic \
                 elements; `slipstick check` names the first node. With `order = 2`, new nodes lie on the smooth \
                 surface of curved faces unless elements would fold."
            }
            Disconnected => {
                "Merge coincident nodes in the mesher. Join parts that lie apart in the geometry, or define each as a \
                 separate body. If they are pieces of an optimized design, export it with a lower `--threshold`, or optimize \
                 it with a sharper `projection`."
            }
            TooLarge => {
                "Use fewer elements or a machine with more memory; `slipstick check` predicts how much memory a run \
                 needs."
            }
            EmptySet => {
                "Enlarge or move the region; it refers to reference positions after `place`. `slipstick check` lists \
                 the other sets."
            }
            PenetratingStart => {
                "Move a body with its `place.translate` so that the surfaces just touch. Otherwise the first load step \
                 has to remove the penetration. Where the mean gap is open although a node lies below the other surface, \
                 refine both surfaces there, let the pointed or finer side be the slave, or use quadratic elements."
            }
            LooseTolerance => {
                "Use a smaller tolerance: the default of 1e-8 costs only a few more iterations. Gradients are exact \
                 only for converged states."
            }
            Locking => {
                "Give the body `element = \"f_bar\"`, so that hexahedra do not lock, or a Poisson's ratio below 0.45. \
                 Tetrahedra lock in any case; wedges lock in the plane of their triangles."
            }
            Unsupported => "Change one of the two settings in the message.",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cures are sentences without markup, and do not repeat the meaning.
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
