//! Contact that CalculiX computes worse than the case.

use slipstick_case::file::{Contact, Pressure};
use slipstick_mesh::facet_area_vector;

use super::Writer;
use super::press::normals;
use crate::closest::ClosestPoint;
use crate::vector::{dot, norm, subtract};

/// Facets that deviate from the curved surface by less than this fraction of their size are flat.
const FLAT: f64 = 1e-4;
/// Smallest cosine between the normals of a facet and of its nodes; below it, the facet ends at an edge of the body.
const SMOOTH: f64 = 0.866;
/// Smallest cosine between the normal of a node and the direction to the other side; below it, the node lies beyond
/// the end of that side.
const FACES: f64 = 0.9;
/// Between sides of the same division, the gap varies by less than this fraction of the deviation of their facets.
const SAME: f64 = 0.1;
/// Where the gap varies by more than this multiple of the deviation, the surfaces do not fit.
const FITS: f64 = 1.5;

impl Writer<'_> {
    /// Warns of pressures that CalculiX 2.20 leaves out.
    pub(super) fn warn_of_soft_contact(&mut self, pressure: &Pressure, at: &dyn Fn(&str) -> String) {
        let (message, cure) = match pressure {
            Pressure::Table { .. } => (
                "CalculiX 2.20 ignores contact with a table of pressures between surfaces",
                "write TYPE=NODE TO SURFACE in the deck and delete CONTACT PRINT, or write linear contact with \
                 `--contact-stiffness`",
            ),
            Pressure::Exponential { .. } => (
                "CalculiX 2.20 has an exponential pressure only where surfaces overlap, and aborts where it would hold \
                 them apart",
                "choose load steps that end with an overlap, or write linear contact with `--contact-stiffness`",
            ),
        };
        self.warn(at("enforcement.penalty.pressure"), message, cure);
    }

    /// Warns of a curved fit of linear elements whose sides have different divisions.
    pub(super) fn warn_of_divisions(&mut self, contact: &Contact, at: &dyn Fn(&str) -> String) {
        let size = self.largest_facet(contact);
        let sides = [&contact.slave, &contact.master];
        let deviation: f64 = sides.iter().map(|name| self.deviation_of_facets(name)).sum();
        if self.is_curved(contact) || deviation <= FLAT * size {
            return;
        }
        let gaps = [self.gaps(sides[0], sides[1], size), self.gaps(sides[1], sides[0], size)].concat();
        let low = gaps.iter().copied().fold(f64::INFINITY, f64::min);
        let high = gaps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let varies = high - low;
        if varies > SAME * deviation && varies < FITS * deviation {
            let message = format!(
                "facets are flat in CalculiX: the gap of this curved fit varies by {varies:.2e}, as between sides of \
                 different divisions"
            );
            self.warn(at("master"), message, "give both sides the same division, or use second-order elements");
        }
    }

    /// The largest distance of the flat facets of a surface from the curved one that has their nodes and normals: for two
    /// nodes of a facet at the distance vector d, |Δn·d|/8, as for a chord of a circle. \[L\]
    fn deviation_of_facets(&self, surface: &str) -> f64 {
        let normals = normals(self.case, self.mesh, surface);
        let facets = self.mesh.surfaces.get(surface).map_or(&[][..], |of| &of.facets[..]);
        let mut largest = 0.0_f64;
        for facet in facets {
            let area = facet_area_vector(&self.mesh.facet_coordinates(facet));
            let smooth = |node: &&u32| dot(normals[*node], area) > SMOOTH * norm(area);
            let nodes: Vec<&u32> = facet.nodes.iter().filter(smooth).collect();
            for (k, a) in nodes.iter().enumerate() {
                for b in &nodes[..k] {
                    let chord = subtract(self.mesh.nodes[**b as usize], self.mesh.nodes[**a as usize]);
                    largest = largest.max(dot(subtract(normals[*b], normals[*a]), chord).abs() / 8.0);
                }
            }
        }
        largest
    }

    /// Gaps between the nodes of a surface and the flat facets of another that they face within a distance. \[L\]
    fn gaps(&self, from: &str, to: &str, reach: f64) -> Vec<f64> {
        let facets = self.mesh.surfaces.get(to).map_or(&[][..], |of| &of.facets[..]);
        let triangles = facets.iter().flat_map(|facet| {
            let x = facet.nodes;
            (2..x.len()).map(move |k| [x[0], x[k - 1], x[k]].map(|node| self.mesh.nodes[node as usize]))
        });
        let faces = ClosestPoint::of_triangles(triangles);
        let gap = |(node, normal): (u32, [f64; 3])| {
            let x = self.mesh.nodes[node as usize];
            let away = subtract(faces.nearest(x, reach)?, x);
            let gap = dot(away, normal);
            (gap.abs() >= FACES * norm(away)).then_some(gap)
        };
        normals(self.case, self.mesh, from).into_iter().filter_map(gap).collect()
    }
}
