//! Rigid surfaces without solid elements (`R3D3`, `R3D4`): they become rigid solids behind their facets.

use std::collections::HashSet;

use slipstick_meshio::FileMesh;

use crate::bodies::find;
use crate::ledger::Ledger;
use crate::read::Deck;

const CURE: &str = "mesh the tool with solid elements and name it in *RIGID BODY";

impl Deck {
    /// Adds solids behind the facets of rigid bodies that have no solids, on the side away from the contact surfaces
    /// that name their sets; refuses other elements of rigid surfaces.
    pub(crate) fn thicken_rigid_surfaces(&mut self, mesh: &mut FileMesh, ledger: &mut Ledger) {
        let mut thickened: HashSet<u32> = HashSet::new();
        for rigid in &self.rigids {
            let Some(set) = rigid.elements.as_ref().and_then(|set| find(&mesh.cell_sets, set)).map(str::to_owned)
            else {
                continue;
            };
            let facets = mesh.cell_sets[&set].clone();
            let solid = |&cell: &u32| mesh.cells.kind(cell as usize).dimension() == 3;
            if facets.is_empty() || facets.iter().any(solid) || facets.iter().any(|cell| thickened.contains(cell)) {
                continue;
            }
            let on = |name: &str| match name.parse::<u64>() {
                Ok(number) => facets.iter().any(|&cell| mesh.cells.number(cell as usize) == number),
                Err(_) => find(&mesh.cell_sets, name)
                    .is_some_and(|set| mesh.cell_sets[set].iter().any(|cell| facets.binary_search(cell).is_ok())),
            };
            let [outward, inward] =
                [true, false].map(|side| self.shell_sides.iter().any(|(set, positive)| *positive == side && on(set)));
            thickened.extend(&facets);
            if outward && inward {
                let why = "a rigid surface that touches on both of its sides is not supported";
                ledger.refuse("RIGID BODY", rigid.line, why, CURE);
                continue;
            }
            let Some(new) = mesh.thicken(&facets, !inward) else {
                let why = "the facets of this rigid surface fold onto each other, or are neither triangles nor quadrilaterals";
                ledger.refuse("RIGID BODY", rigid.line, why, CURE);
                continue;
            };
            mesh.cell_sets.entry(set).or_default().extend(&new);
            self.thickened.extend(new);
        }
        let numbers: HashSet<u64> = thickened.iter().map(|&cell| mesh.cells.number(cell as usize)).collect();
        for of in self.element_types.iter().filter(|of| of.name.starts_with("R3D")) {
            let cells = of.set.as_ref().and_then(|set| Some(&mesh.cell_sets[find(&mesh.cell_sets, set)?]));
            let solids = self.thickened.first().copied().unwrap_or(u32::MAX);
            let known = |cell: &u32| *cell >= solids || thickened.contains(cell);
            if cells.is_none_or(|cells| cells.iter().all(known))
                && of.facets.iter().all(|facet| numbers.contains(facet))
            {
                continue;
            }
            let why = format!("{}: a rigid surface that no *RIGID BODY names with ELSET is not supported", of.name);
            ledger.refuse("ELEMENT", of.line, why, CURE);
        }
    }
}
