//! Draws the quantities of mortar contact: a slave facet above two master facets.
//!
//! The picture is a file of the crate, whose documentation shows it, and a figure of the book; the test `picture`
//! writes both with `UPDATE_PAGES=1`.

use nalgebra::Vector3;
use slipstick_contact::kinematics::clip::{Point, clip};
use slipstick_contact::kinematics::{CellRule, MultiplierShape, NodeKinematics};
use slipstick_contact::{ContactInterface, InterfaceError, InterfaceOptions};
use std::fmt::Write as _;

const SLAVE: [[f64; 3]; 4] = [[0.0, 0.0, 0.62], [0.0, 1.0, 0.62], [1.0, 1.0, 0.70], [1.0, 0.0, 0.70]];
const MASTER: [[f64; 3]; 6] =
    [[-0.45, -0.3, 0.06], [0.6, -0.3, 0.0], [1.4, -0.3, 0.1], [-0.45, 1.3, 0.06], [0.6, 1.3, 0.0], [1.4, 1.3, 0.1]];
const FACETS: [[u32; 4]; 2] = [[4, 5, 8, 7], [5, 6, 9, 8]];

fn main() -> Result<(), InterfaceError> {
    print!("{}", picture()?);
    Ok(())
}

/// The slave nodes, with normals and gaps.
fn nodes() -> Result<Vec<NodeKinematics>, InterfaceError> {
    let x: Vec<f64> = SLAVE.into_iter().chain(MASTER).flatten().collect();
    let options = InterfaceOptions {
        shape: MultiplierShape::Standard,
        rule: CellRule::Seven,
        reach: 2.0,
        feature_angle: std::f64::consts::FRAC_PI_4,
    };
    let interface = ContactInterface::new(vec![[0, 1, 2, 3].into()], FACETS.map(Into::into).to_vec(), &x, options)?;
    let mut rows = Vec::new();
    interface.evaluate(&x, false, &mut interface.workspace(|_| true), &mut rows)?;
    Ok(rows)
}

/// The parts of the slave facet that lie opposite to each master facet, in the plane of the slave facet.
fn segments() -> Vec<Vec<Vector3<f64>>> {
    let corner = |n: usize| Vector3::from(SLAVE[n]);
    let origin = 0.25 * (0..4).map(corner).sum::<Vector3<f64>>();
    let normal = (corner(2) - corner(0)).cross(&(corner(3) - corner(1))).normalize();
    let first = (corner(1) - corner(0)).normalize();
    let basis = [first, normal.cross(&first)];
    let flat = |x: [f64; 3]| -> Point { basis.map(|e| e.dot(&(Vector3::from(x) - origin))) };
    let segment = |facet: &[u32; 4]| {
        // seen along the slave's normal, the master runs clockwise
        let order = [3, 2, 1, 0];
        let master = order.map(|i| flat(MASTER[facet[i] as usize - 4]));
        let overlap = clip(&SLAVE.map(flat), &master, &order).expect("they overlap");
        let lift = |[a, b]: Point| origin + a * basis[0] + b * basis[1];
        overlap.vertices().iter().map(|vertex| lift(vertex.position)).collect()
    };
    FACETS.iter().map(segment).collect()
}

/// Where a point is drawn, in an oblique view from the front.
fn at(x: &Vector3<f64>) -> [f64; 2] {
    [165.0 + 235.0 * x[0] + 95.0 * x[1], 330.0 - 78.0 * x[1] - 255.0 * x[2]]
}

/// The picture, as SVG.
///
/// # Errors
/// Never: the surfaces are sound.
pub fn picture() -> Result<String, InterfaceError> {
    let mut out = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 40 640 345\" font-family=\"sans-serif\" font-size=\"14\" \
         role=\"img\">\n<title>A slave facet, the mortar segments on it, and two master facets</title>\n\
         <defs><marker id=\"tip\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" \
         orient=\"auto-start-reverse\"><path d=\"M0 0L8 4L0 8z\" fill=\"context-stroke\"/></marker></defs>\n\
         <rect y=\"40\" width=\"640\" height=\"345\" fill=\"white\"/>\n",
    );
    let mut polygon = |points: &[Vector3<f64>], style: &str| {
        let list: Vec<String> = points.iter().map(at).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(out, "<polygon points=\"{}\" {style}/>", list.join(" "));
    };
    for facet in FACETS {
        let corners = facet.map(|n| Vector3::from(MASTER[n as usize - 4]));
        polygon(&corners, "fill=\"#d9d9d9\" stroke=\"#555\" stroke-width=\"1.5\"");
    }
    for (segment, colour) in segments().iter().zip(["#9ecae1", "#fdd0a2"]) {
        polygon(segment, &format!("fill=\"{colour}\" fill-opacity=\"0.85\" stroke=\"none\""));
    }
    polygon(&SLAVE.map(Vector3::from), "fill=\"none\" stroke=\"#08519c\" stroke-width=\"2.5\"");
    let mut arrow = |from: &Vector3<f64>, to: &Vector3<f64>, style: &str| {
        let ([a, b], [c, d]) = (at(from), at(to));
        let _ = writeln!(out, "<path d=\"M{a:.1} {b:.1}L{c:.1} {d:.1}\" fill=\"none\" stroke-width=\"2\" {style}/>");
    };
    let rows = nodes()?;
    let tip = "marker-end=\"url(#tip)\"";
    for row in &rows {
        let corner = Vector3::from(SLAVE[row.node as usize]);
        arrow(&corner, &(corner + 0.22 * row.frame.vector(0)), &format!("stroke=\"#08519c\" {tip}"));
    }
    // the gap of the front right node, along its normal
    let corner = Vector3::from(SLAVE[3]) + Vector3::new(0.06, 0.0, 0.0);
    let gap = rows[3].gap() / rows[3].area;
    let foot = corner + gap * rows[3].frame.vector(0);
    arrow(
        &corner,
        &foot,
        "stroke=\"#333\" stroke-dasharray=\"5 3\" marker-end=\"url(#tip)\" marker-start=\"url(#tip)\"",
    );
    // the multiplier of the front left node: pressure along the normal, friction across it
    let corner = Vector3::from(SLAVE[0]);
    let multiplier = rows[0].frame.to_global(&Vector3::new(0.34, 0.0, 0.0)) - Vector3::new(0.2, 0.0, 0.0);
    arrow(&corner, &(corner + multiplier), &format!("stroke=\"#b2182b\" {tip}"));
    let mut text = |point: [f64; 2], colour: &str, text: &str| {
        let _ = writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\">{text}</text>", point[0], point[1]);
    };
    let label = |x: [f64; 3], right: f64, down: f64| {
        let [a, b] = at(&x.into());
        [a + right, b + down]
    };
    text(label(SLAVE[1], -60.0, -14.0), "#08519c", "slave facet (faces down)");
    text(label([0.16, 0.35, 0.63], 32.0, 2.0), "#08306b", "mortar");
    text(label([0.66, 0.45, 0.68], 0.0, 0.0), "#7f2704", "segments");
    text(label(MASTER[0], 26.0, -12.0), "#333", "master facets (face up)");
    text(label(SLAVE[2], 10.0, 40.0), "#08519c", "normal n");
    text(label([1.06, 0.0, 0.5], 10.0, 0.0), "#333", &format!("gap g = {gap:.2}"));
    text(label(SLAVE[0], -150.0, 40.0), "#b2182b", "multiplier z");
    out.push_str("</svg>\n");
    Ok(out)
}
