//! Writes load paths in CalculiX's format for results (FRD), which CGX draws.
//!
//! The file is text: nodes, elements, and for each state a block per field with a value at every node.
//! Format: the CGX manual, "Result Format (frd)". Values have six significant digits.
//!
//! | block | components | field ([`super::fields::of_state`]) |
//! |---|---|---|
//! | `DISP` | `D1`, `D2`, `D3` | `displacement` |
//! | `STRESS` | `SXX`, `SYY`, `SZZ`, `SXY`, `SYZ`, `SZX` | `cauchy_stress`, the mean over the elements of a node |
//! | `FORC` | `F1`, `F2`, `F3` | `reaction`; those at the centres of hexahedra of second order act on the other nodes, with the weights of the 20 shape functions |
//! | `CONTACT` | `COPEN`, `CPRESS` | `contact_gap`, `contact_pressure`; 0 away from contact surfaces; only with contact |
//! | `DENSITY` | `RHO` | `density`, the mean over the elements of a node; only if it is not 1 everywhere |

use std::collections::BTreeSet;
use std::io::{self, Write};

use slipstick_mesh::{Element, Mesh, SerendipityCentre};

use super::StoredField;

/// A load path that is being written.
pub struct Frd<'a> {
    mesh: &'a Mesh,
    writer: &'a mut dyn Write,
    /// The nodes of the mesh that the file has.
    nodes: Vec<u32>,
    /// The nodes that it leaves out, as combinations of others.
    centres: Vec<SerendipityCentre>,
    blocks: usize,
}

/// A block of nodal values: its name, the names of its components, and the kind of value: 1 a scalar,
/// 2 a vector, 4 a tensor.
struct Block {
    name: &'static str,
    components: &'static [&'static str],
    kind: u8,
}

const DISP: Block = Block { name: "DISP", components: &["D1", "D2", "D3"], kind: 2 };
const STRESS: Block = Block { name: "STRESS", components: &["SXX", "SYY", "SZZ", "SXY", "SYZ", "SZX"], kind: 4 };
const FORC: Block = Block { name: "FORC", components: &["F1", "F2", "F3"], kind: 2 };
const CONTACT: Block = Block { name: "CONTACT", components: &["COPEN", "CPRESS"], kind: 1 };
const DENSITY: Block = Block { name: "DENSITY", components: &["RHO"], kind: 1 };

impl<'a> Frd<'a> {
    /// Begins a file with the mesh: nodes and elements have their numbers plus one, and the body of an
    /// element is its group and its material. Hexahedra with 27 nodes are written with 20; a node that
    /// no element has is left out.
    ///
    /// # Errors
    /// If the writer fails.
    pub fn new(mesh: &'a Mesh, writer: &'a mut dyn Write) -> io::Result<Self> {
        let mut used = vec![false; mesh.nodes.len()];
        mesh.elements.iter().for_each(|element| nodes_of(element).1.iter().for_each(|&n| used[n as usize] = true));
        let nodes: Vec<u32> = (0..).zip(&used).filter(|(_, used)| **used).map(|(n, _)| n).collect();
        writeln!(writer, "    1C\n    1UPGM               slipstick")?;
        writeln!(writer, "    1UVERSION           {}", env!("CARGO_PKG_VERSION"))?;
        writeln!(writer, "    2C{:18}{:12}{:37}1", "", nodes.len(), "")?;
        for &n in &nodes {
            write!(writer, " -1{:10}", n + 1)?;
            row(writer, &mesh.nodes[n as usize])?;
        }
        writeln!(writer, " -3\n    3C{:18}{:12}{:37}1", "", mesh.elements.len(), "")?;
        let mut numbered = mesh.elements.iter().enumerate();
        for (body, of) in (1..).zip(&mesh.bodies) {
            for (e, element) in numbered.by_ref().take(of.elements.len()) {
                let (kind, nodes) = nodes_of(element);
                writeln!(writer, " -1{:10}{kind:5}{body:5}{body:5}", e + 1)?;
                for line in nodes.chunks(10) {
                    write!(writer, " -2")?;
                    line.iter().try_for_each(|n| write!(writer, "{:10}", n + 1))?;
                    writeln!(writer)?;
                }
            }
        }
        writeln!(writer, " -3")?;
        let centres = mesh.serendipity_centres(0..mesh.elements.len(), &BTreeSet::new());
        Ok(Self { mesh, writer, nodes, centres, blocks: 0 })
    }

    /// Adds the state at the end of a load step, from 1, at a pseudo-time. Fields that it does not have
    /// are left out.
    ///
    /// # Errors
    /// If the writer fails.
    pub fn state(&mut self, step: usize, time: f64, fields: &[StoredField]) -> io::Result<()> {
        let (nodes, elements) = (self.mesh.nodes.len(), self.mesh.elements.len());
        let find = |name: &str, length: usize| {
            fields
                .iter()
                .find(|field| field.name == name && field.values.len() == length)
                .map(|field| &field.values[..])
        };
        if let Some(values) = find("displacement", 3 * nodes) {
            self.block(step, time, &DISP, values)?;
        }
        if let Some(values) = find("cauchy_stress", 6 * elements) {
            self.block(step, time, &STRESS, &self.nodal_means(values, 6))?;
        }
        if let Some(values) = find("reaction", 3 * nodes) {
            let mut forces = values.to_vec();
            for SerendipityCentre { node, terms } in &self.centres {
                for &(other, weight) in terms {
                    (0..3).for_each(|c| forces[3 * other as usize + c] += weight * values[3 * *node as usize + c]);
                }
            }
            self.block(step, time, &FORC, &forces)?;
        }
        let slaves = find("contact_status", nodes).is_some_and(|status| status.iter().any(|status| *status >= 0.0));
        let contact = (find("contact_gap", nodes), find("contact_pressure", nodes));
        if let ((Some(gap), Some(pressure)), true) = (contact, slaves) {
            let both: Vec<f64> = gap.iter().zip(pressure).flat_map(|(gap, pressure)| [*gap, *pressure]).collect();
            self.block(step, time, &CONTACT, &both)?;
        }
        match find("density", elements) {
            Some(values) if values.iter().any(|value| *value != 1.0) => {
                self.block(step, time, &DENSITY, &self.nodal_means(values, 1))
            }
            _ => Ok(()),
        }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// If the writer fails.
    pub fn end(self) -> io::Result<()> {
        writeln!(self.writer, " 9999")
    }

    /// Means over the elements that have a node.
    fn nodal_means(&self, values: &[f64], components: usize) -> Vec<f64> {
        let mut sums = vec![0.0; components * self.mesh.nodes.len()];
        let mut counts = vec![0.0; self.mesh.nodes.len()];
        for (element, own) in self.mesh.elements.iter().zip(values.chunks(components)) {
            for n in element.nodes().iter().map(|&n| n as usize) {
                counts[n] += 1.0;
                (0..components).for_each(|c| sums[components * n + c] += own[c]);
            }
        }
        let count = |k: usize| f64::max(counts[k / components], 1.0);
        sums.iter().enumerate().map(|(k, sum)| sum / count(k)).collect()
    }

    fn block(&mut self, step: usize, time: f64, block: &Block, values: &[f64]) -> io::Result<()> {
        let Self { writer, nodes, blocks, .. } = self;
        *blocks += 1;
        let Block { name, components, kind } = block;
        writeln!(writer, "    1PSTEP{blocks:26}{:12}{step:12}          ", 1)?;
        let time = &format!("{time:12.9}")[..12];
        writeln!(writer, "  100CL{:5}{time}{:12}{:21}0{step:5}{:12}", 100 + step, nodes.len(), "", 1)?;
        // a vector has its size as a further component, which the reader computes
        let all = usize::from(*kind == 2);
        writeln!(writer, " -4  {name:<8}{:5}    1", components.len() + all)?;
        for (k, component) in components.iter().enumerate() {
            let (row, column) =
                if *kind == 4 { [(1, 1), (2, 2), (3, 3), (1, 2), (2, 3), (3, 1)][k] } else { (k + 1, 0) };
            writeln!(writer, " -5  {component:<8}{:5}{kind:5}{row:5}{column:5}", 1)?;
        }
        if all == 1 {
            writeln!(writer, " -5  ALL         1    2    0    0    1ALL")?;
        }
        for &n in nodes.iter() {
            write!(writer, " -1{:10}", n + 1)?;
            let at = components.len() * n as usize;
            row(*writer, &values[at..at + components.len()])?;
        }
        writeln!(writer, " -3")
    }
}

/// The type of an element in the file, and its nodes in the order of the file.
fn nodes_of(element: &Element) -> (u8, Vec<u32>) {
    let nodes = element.nodes();
    match element {
        Element::Hex8(_) => (1, nodes.to_vec()),
        Element::Wedge6(_) => (2, nodes.to_vec()),
        Element::Tet4(_) => (3, nodes.to_vec()),
        // the edges between bottom and top before those of the top
        Element::Hex27(_) => (4, [&nodes[..12], &nodes[16..20], &nodes[12..16]].concat()),
        Element::Wedge18(_) => (5, [&nodes[..9], &nodes[12..15], &nodes[9..12]].concat()),
        Element::Tet10(_) => (6, nodes.to_vec()),
    }
}

/// Values of twelve characters each, and the end of the line.
fn row(writer: &mut dyn Write, values: &[f64]) -> io::Result<()> {
    for &value in values {
        let text = format!("{value:.5e}");
        let Some((digits, exponent)) = text.split_once('e') else {
            // not a number
            write!(writer, "{text:>12}")?;
            continue;
        };
        match exponent.parse::<i32>().unwrap_or(0) {
            // nothing but round-off is as small
            exponent if exponent < -99 => write!(writer, "{:>12}", "0.00000E+00")?,
            exponent => {
                let sign = if exponent < 0 { '-' } else { '+' };
                write!(writer, "{:>12}", format!("{digits}E{sign}{:02}", exponent.abs()))?;
            }
        }
    }
    writeln!(writer)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines of CalculiX 2.20 for the same values; no element has the last node.
    #[test]
    fn lines_are_those_of_calculix() {
        let mut mesh = Mesh {
            nodes: vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5], [9.0; 3]],
            elements: vec![Element::Tet4([0, 1, 2, 3])],
            ..Mesh::default()
        };
        mesh.bodies.push(slipstick_mesh::Body { name: "a".into(), nodes: 0..4, elements: 0..1 });
        let mut bytes = Vec::new();
        let mut file = Frd::new(&mesh, &mut bytes).expect("memory");
        let field = |name: &str, on_points, components, values: Vec<f64>| StoredField {
            name: name.into(),
            on_points,
            components,
            values,
        };
        let mut displacement = vec![0.0; 15];
        displacement[9..12].copy_from_slice(&[-1.923_71e-3, -1.239_87e-4, -5.444_13e-118]);
        let stress = vec![-1.150_77, -0.493_204, -0.493_204, -9.987_31e-2, 6.115_12e-10, -9.987_31e-2];
        let fields = [field("displacement", true, 3, displacement), field("cauchy_stress", false, 6, stress)];
        file.state(2, 1.0, &fields).expect("memory");
        file.end().expect("memory");
        let text = String::from_utf8(bytes).expect("text");
        for line in [
            "    2C                             4                                     1",
            " -1         2 2.00000E+00 0.00000E+00 0.00000E+00",
            "    3C                             1                                     1",
            " -1         1    3    1    1",
            " -2         1         2         3         4",
            "    1PSTEP                         1           1           2          ",
            "  100CL  102 1.000000000           4                     0    2           1",
            " -4  DISP        4    1",
            " -5  D3          1    2    3    0",
            " -5  ALL         1    2    0    0    1ALL",
            " -1         4-1.92371E-03-1.23987E-04 0.00000E+00",
            " -4  STRESS      6    1",
            " -5  SZX         1    4    3    1",
            " -1         1-1.15077E+00-4.93204E-01-4.93204E-01-9.98731E-02 6.11512E-10-9.98731E-02",
            " 9999",
        ] {
            assert!(text.lines().any(|other| other == line), "`{line}` is missing in\n{text}");
        }
        assert!(!text.contains("9.00000E+00") && !text.contains("FORC"), "{text}");
    }

    /// The order of CalculiX's file for its C3D20 with these 20 nodes.
    #[test]
    fn edges_of_hexahedra_are_in_the_order_of_the_format() {
        let nodes: [u32; 27] = std::array::from_fn(|n| n as u32 + 1);
        let expected = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 17, 18, 19, 20, 13, 14, 15, 16];
        assert_eq!(nodes_of(&Element::Hex27(nodes)), (4, expected.to_vec()));
    }

    /// The order of CalculiX's file for its C3D15 with these 15 nodes.
    #[test]
    fn edges_of_wedges_are_in_the_order_of_the_format() {
        let nodes: [u32; 18] = std::array::from_fn(|n| n as u32 + 1);
        let expected = [1, 2, 3, 4, 5, 6, 7, 8, 9, 13, 14, 15, 10, 11, 12];
        assert_eq!(nodes_of(&Element::Wedge18(nodes)), (5, expected.to_vec()));
    }
}
