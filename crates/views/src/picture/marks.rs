//! Symbols for what holds and moves the bodies of a case.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use slipstick_case::file::{Case, Dimension, Dirichlet, Load, LoadKind, RotationAxis, Units};
use slipstick_mesh::{Facet, Mesh, facet_area_vector};

use crate::render::{ARROW, Mark, diagonal};
use crate::vector::{cross, dot, scaled, sum, unit};

/// A point of a body's skin and the area around it. \[L\], \[L²\]
#[derive(Debug, Clone, Copy)]
struct Spot {
    at: [f64; 3],
    area: [f64; 3],
}

/// Where bodies are in a picture.
pub(super) struct Shape<'a> {
    pub mesh: &'a Mesh,
    /// Positions of the nodes. \[L\]
    pub points: Vec<[f64; 3]>,
    /// Whether each element is drawn.
    pub kept: Vec<bool>,
}

/// Distance between two supports, and between an arrow and the body, relative to the size of the bodies.
const APART: f64 = 0.075;
const GAP: f64 = 0.012;

/// Largest number of symbols for one support or pressure.
const MOST: usize = 24;

/// The symbols for the supports, motions, loads and planes of symmetry of a case.
pub(super) fn marks(case: &Case, shape: &Shape<'_>) -> Vec<Mark> {
    let drawn = Drawn { case, shape, size: diagonal(shape.shown().map(|(_, x)| x)) };
    let mut all: Vec<Mark> = case.symmetries.iter().filter_map(|s| drawn.plane(s.normal.index(), s.at)).collect();
    all.extend(case.dirichlet.iter().flat_map(|one| drawn.dirichlet(one)));
    all.extend(case.loads.iter().flat_map(|load| drawn.load(load)));
    all
}

/// The unit of a quantity of some dimension, with a space before it; empty if it has no name.
pub(crate) fn named(units: &Units, dimension: Dimension) -> String {
    let bracket = units.bracket(dimension);
    let name = bracket.trim().trim_matches(['[', ']']);
    let name = match name {
        "N/mm²" => "MPa",
        "N/m²" => "Pa",
        other => other,
    };
    if name.is_empty() { String::new() } else { format!(" {name}") }
}

/// A number with three significant digits.
fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-4 {
        return format!("{value:.1e}").replace('-', "−");
    }
    let digits = (2 - value.abs().max(1e-300).log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "−")
}

impl Shape<'_> {
    /// The nodes of elements that are drawn, and their positions.
    fn shown(&self) -> impl Iterator<Item = (u32, [f64; 3])> {
        let elements = self.mesh.elements.iter().zip(&self.kept).filter(|(_, kept)| **kept);
        elements.flat_map(|(element, _)| element.nodes()).map(|&node| (node, self.points[node as usize]))
    }

    fn spot(&self, facet: &Facet) -> Spot {
        let corners: Vec<[f64; 3]> = facet.nodes.iter().map(|&node| self.points[node as usize]).collect();
        let middle = std::array::from_fn(|c| corners.iter().map(|x| x[c]).sum::<f64>() / corners.len() as f64);
        Spot { at: middle, area: facet_area_vector(&facet.nodes.corners(&self.points)) }
    }

    /// The facets of a body that are drawn.
    fn skin(&self, body: usize) -> Vec<Facet> {
        let facets = self.mesh.boundary(body).facets;
        facets.into_iter().filter(|facet| self.kept[facet.element as usize]).collect()
    }

    /// The part of a surface, node set or rigid body that is drawn.
    fn spots(&self, case: &Case, name: &str) -> Vec<Spot> {
        if let Some(surface) = self.mesh.surfaces.get(name) {
            let drawn = surface.facets.iter().filter(|facet| self.kept[facet.element as usize]);
            return drawn.map(|facet| self.spot(facet)).collect();
        }
        let rigid = self.mesh.rigid.iter().map(|rigid| rigid.body).find(|&body| self.mesh.bodies[body].name == name);
        if let Some(body) = rigid {
            // what touches another body is not held from there
            let touching = case.contacts.iter().flat_map(|pair| [&pair.slave, &pair.master]);
            let touching = touching.filter_map(|name| self.mesh.surfaces.get(name));
            let touching: BTreeSet<_> =
                touching.flat_map(|surface| &surface.facets).map(|f| f.nodes.sorted()).collect();
            let (free, touched): (Vec<Facet>, Vec<Facet>) =
                self.skin(body).into_iter().partition(|facet| !touching.contains(&facet.nodes.sorted()));
            let all = if free.is_empty() { touched } else { free };
            return all.iter().map(|facet| self.spot(facet)).collect();
        }
        let Some(nodes) = self.mesh.set_nodes(name) else { return Vec::new() };
        let within = |body: &slipstick_mesh::Body| nodes.iter().any(|&node| body.nodes.contains(&(node as usize)));
        let bodies = (0..self.mesh.bodies.len()).filter(|&body| within(&self.mesh.bodies[body]));
        let mut areas: HashMap<u32, [f64; 3]> = HashMap::new();
        for facet in bodies.flat_map(|body| self.skin(body)) {
            let Spot { area, .. } = self.spot(&facet);
            for &node in facet.nodes.iter().filter(|node| nodes.binary_search(node).is_ok()) {
                let of = areas.entry(node).or_default();
                *of = sum(*of, scaled(1.0 / facet.nodes.len() as f64, area));
            }
        }
        let spot = |&node: &u32| Some(Spot { at: self.points[node as usize], area: *areas.get(&node)? });
        nodes.iter().filter_map(spot).collect()
    }
}

/// Fewer spots, about evenly apart.
fn thinned(spots: &[Spot], apart: f64) -> Vec<Spot> {
    let mut apart = apart;
    loop {
        let mut cells: BTreeMap<[i64; 3], (f64, Spot)> = BTreeMap::new();
        for spot in spots {
            let cell = spot.at.map(|x| (x / apart).floor() as i64);
            let middle: [f64; 3] = std::array::from_fn(|c| spot.at[c] - apart * (cell[c] as f64 + 0.5));
            let distance = dot(middle, middle);
            let nearest = cells.entry(cell).or_insert((distance, *spot));
            if distance < nearest.0 {
                *nearest = (distance, *spot);
            }
        }
        if cells.len() <= MOST || !apart.is_finite() {
            return cells.into_values().map(|(_, spot)| spot).collect();
        }
        apart *= 1.3;
    }
}

/// A case and how its bodies are drawn.
struct Drawn<'a> {
    case: &'a Case,
    shape: &'a Shape<'a>,
    /// Diagonal of the box around the bodies. \[L\]
    size: f64,
}

impl Drawn<'_> {
    /// A little more than the part of a plane of symmetry in which there are bodies.
    fn plane(&self, normal: usize, at: f64) -> Option<Mark> {
        let near = self.shape.shown().map(|(_, x)| x).filter(|x| (x[normal] - at).abs() < 1e-6 * self.size);
        let start = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let [low, high] = near.fold(start, |[low, high], x| {
            [std::array::from_fn(|c| low[c].min(x[c])), std::array::from_fn(|c| high[c].max(x[c]))]
        });
        let (a, b) = ((normal + 1) % 3, (normal + 2) % 3);
        if !(low[a] < high[a] && low[b] < high[b]) {
            return None;
        }
        let beyond = 0.03 * self.size;
        let corner = |first: bool, second: bool| {
            let mut x = [at; 3];
            x[a] = if first { high[a] + beyond } else { low[a] - beyond };
            x[b] = if second { high[b] + beyond } else { low[b] - beyond };
            x
        };
        Some(Mark::Plane([corner(false, false), corner(true, false), corner(true, true), corner(false, true)]))
    }

    fn dirichlet(&self, one: &Dirichlet) -> Vec<Mark> {
        let spots = self.shape.spots(self.case, &one.set);
        if spots.is_empty() {
            return Vec::new();
        }
        let held = one.motion.iter().all(|way| way.angle == 0.0 && way.u == [0.0; 3]);
        if held {
            return self.supports(one, &spots);
        }
        let mut marks = Vec::new();
        let (mut last, mut done): ([f64; 3], Vec<[f64; 3]>) = ([0.0; 3], Vec::new());
        for way in &one.motion {
            let mut by: [f64; 3] = std::array::from_fn(|c| way.u[c] - last[c]);
            (0..3).filter(|&c| !one.components.iter().any(|known| known.index() == c)).for_each(|c| by[c] = 0.0);
            last = way.u;
            let (length, direction) = (dot(by, by).sqrt(), unit(by));
            // there and back is one arrow
            if length > 1e-9 * self.size && !done.iter().any(|other| dot(*other, direction).abs() > 0.95) {
                done.push(direction);
                let label = short(length) + &named(&self.case.units, Dimension::LENGTH);
                let label = self.of_load_case(label, one.load_case.as_ref());
                marks.push(Mark::Motion { path: self.straight(&spots, direction, done.len() > 1), label });
            }
        }
        let largest =
            one.motion.iter().fold(0.0f64, |most, way| if way.angle.abs() > most.abs() { way.angle } else { most });
        if let Some(axis) = one.rotation.filter(|_| largest != 0.0) {
            let label = self.of_load_case(format!("{}°", short(largest.abs())), one.load_case.as_ref());
            marks.push(Mark::Motion { path: self.around(&spots, axis, largest), label });
        }
        marks
    }

    fn of_load_case(&self, label: String, load_case: Option<&String>) -> String {
        load_case.map_or(label.clone(), |name| format!("{label} ({name})"))
    }

    /// Cones from where the body cannot move to. A body whose opposite faces are held in one direction, as in plane
    /// strain, would be full of them: it has none for this direction.
    fn supports(&self, one: &Dirichlet, spots: &[Spot]) -> Vec<Mark> {
        let normal = |spot: &Spot| unit(spot.area);
        if one.components.len() == 3 {
            let few = thinned(spots, APART * self.size);
            return few.iter().map(|spot| Mark::Support { at: spot.at, outward: normal(spot) }).collect();
        }
        let of = |component: usize| {
            let facing: Vec<Spot> = spots.iter().filter(|spot| normal(spot)[component].abs() > 0.5).copied().collect();
            if self.held_on_both_sides(component, spots) {
                return Vec::new();
            }
            let all = if facing.is_empty() { spots } else { &facing };
            let support = move |spot: &Spot| {
                let mut outward = [0.0; 3];
                outward[component] = if spot.area[component] < 0.0 { -1.0 } else { 1.0 };
                Mark::Support { at: spot.at, outward }
            };
            thinned(all, APART * self.size).iter().map(support).collect::<Vec<Mark>>()
        };
        one.components.iter().flat_map(|component| of(component.index())).collect()
    }

    /// Whether supports in this direction alone, or these spots, are on faces that look both ways.
    fn held_on_both_sides(&self, component: usize, spots: &[Spot]) -> bool {
        let alone = self.case.dirichlet.iter().filter(|one| {
            let only = one.components.iter().map(|known| known.index()).eq([component]);
            only && one.motion.is_empty() && one.rotations.is_empty()
        });
        let all: Vec<Spot> = alone.flat_map(|one| self.shape.spots(self.case, &one.set)).collect();
        let balanced = |spots: &[Spot]| {
            let areas = spots.iter().map(|spot| spot.area[component]);
            let (net, all) = areas.fold((0.0, 0.0), |(net, all): (f64, f64), area| (net + area, all + area.abs()));
            all > 0.0 && net.abs() < 0.5 * all
        };
        balanced(spots) || balanced(&all)
    }

    /// An arrow outside of the body: towards its surface if it pushes, away from it if it pulls, along it otherwise;
    /// without a common normal of the surface, behind the
    /// body. `next`: after another arrow, which ends at the middle of the surface.
    fn straight(&self, spots: &[Spot], direction: [f64; 3], next: bool) -> Vec<[f64; 3]> {
        let weight = |spot: &Spot| dot(spot.area, spot.area).sqrt();
        let total: f64 = spots.iter().map(weight).sum();
        let add = |of: &dyn Fn(&Spot) -> [f64; 3]| spots.iter().fold([0.0; 3], |all, spot| sum(all, of(spot)));
        let middle = scaled(1.0 / total, add(&|spot| scaled(weight(spot), spot.at)));
        let area = add(&|spot| spot.area);
        let along = |from: [f64; 3], by: f64, to: [f64; 3]| sum(from, scaled(by * self.size, to));
        let normal = unit(area);
        let facing = dot(normal, direction);
        let start = if dot(area, area).sqrt() < 0.5 * total {
            let back = spots.iter().map(|spot| dot(scaled(-1.0, direction), sum(spot.at, scaled(-1.0, middle))));
            let back = back.fold(0.0, f64::max) / self.size;
            along(middle, -(back + GAP + ARROW), direction)
        } else if facing < -0.3 {
            along(middle, -(GAP + ARROW), direction)
        } else if facing > 0.3 {
            along(middle, GAP, direction)
        } else {
            along(along(middle, 3.0 * GAP, normal), if next { GAP } else { -0.5 * ARROW }, direction)
        };
        vec![start, along(start, ARROW, direction)]
    }

    /// Two thirds of a circle about an axis, beyond the end of the body.
    fn around(&self, spots: &[Spot], RotationAxis { point, direction }: RotationAxis, angle: f64) -> Vec<[f64; 3]> {
        let axis = unit(direction);
        let arm = |spot: &Spot| sum(spot.at, scaled(-1.0, point));
        let high = spots.iter().map(|spot| dot(arm(spot), axis)).fold(f64::NEG_INFINITY, f64::max);
        let far = |spot: &Spot| (dot(arm(spot), arm(spot)) - dot(arm(spot), axis).powi(2)).max(0.0).sqrt();
        let radius = (0.7 * spots.iter().map(far).fold(0.0, f64::max)).clamp(0.06 * self.size, 0.2 * self.size);
        let least = (0..3).min_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs())).unwrap_or(0);
        let mut other = [0.0; 3];
        other[least] = 1.0;
        let across = unit(cross(axis, other));
        let upward = cross(axis, across);
        let centre = sum(point, scaled(high + 2.0 * GAP * self.size, axis));
        let at = |k: u32| {
            let turned = angle.signum() * f64::from(k) * 10f64.to_radians();
            let arm = sum(scaled(turned.cos(), across), scaled(turned.sin(), upward));
            sum(centre, scaled(radius, arm))
        };
        (0..=24).map(at).collect()
    }

    fn load(&self, load: &Load) -> Vec<Mark> {
        let spots = if load.acts_on_mass() { Vec::new() } else { self.shape.spots(self.case, &load.surface) };
        let factor = load.amplitude.iter().map(|point| point.factor);
        let factor = factor.fold(0.0f64, |most, f| if f.abs() > most.abs() { f } else { most });
        let label = |value: f64, dimension| {
            let text = short((factor * value).abs()) + &named(&self.case.units, dimension);
            self.of_load_case(text, load.load_case.as_ref())
        };
        let length = |v: [f64; 3]| dot(v, v).sqrt();
        match load.kind {
            _ if factor == 0.0 => Vec::new(),
            LoadKind::Gravity(g) => {
                let start = self
                    .shape
                    .shown()
                    .map(|(_, x)| x)
                    .fold([0.0, f64::NEG_INFINITY, 0.0], |high, x| if x[1] > high[1] { x } else { high });
                let beside = sum(start, [-0.15 * self.size, 0.0, 0.0]);
                let path = vec![beside, sum(beside, scaled(factor.signum() * ARROW * self.size, unit(g)))];
                vec![Mark::Force { path, label: self.of_load_case("gravity".into(), load.load_case.as_ref()) }]
            }
            _ if spots.is_empty() => Vec::new(),
            LoadKind::Force(v) | LoadKind::Traction(v) | LoadKind::NodalForce(v) => {
                let traction = matches!(load.kind, LoadKind::Traction(_));
                let dimension = if traction { Dimension::STRESS } else { Dimension::FORCE };
                let path = self.straight(&spots, scaled(factor.signum(), unit(v)), false);
                let each = if matches!(load.kind, LoadKind::NodalForce(_)) { " per node" } else { "" };
                vec![Mark::Force { path, label: label(length(v), dimension) + each }]
            }
            LoadKind::Pressure(p) => {
                let few = thinned(&spots, 1.4 * APART * self.size);
                let arrow = |(k, spot): (usize, &Spot)| {
                    let normal = unit(spot.area);
                    let [near, far] = [GAP, GAP + 0.6 * ARROW].map(|by| sum(spot.at, scaled(by * self.size, normal)));
                    let path = if factor * p > 0.0 { vec![far, near] } else { vec![near, far] };
                    let label = if k == 0 { label(p, Dimension::STRESS) } else { String::new() };
                    Mark::Force { path, label }
                };
                few.iter().enumerate().map(arrow).collect()
            }
            LoadKind::Moment(m) => {
                let middle =
                    spots.iter().fold([0.0; 3], |all, spot| sum(all, scaled(1.0 / spots.len() as f64, spot.at)));
                let path = self.around(&spots, RotationAxis { point: middle, direction: m }, factor);
                vec![Mark::Force { path, label: label(length(m), Dimension::WORK) }]
            }
            LoadKind::Centrifugal(_) => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_case::construct::build_mesh;
    use slipstick_case::file::parse_case;

    /// The symbols of a cube with side 1 whose lower face is held, with one table more.
    fn marks_of(table: &str) -> Vec<Mark> {
        let text = "units = { length = 'mm', force = 'N' }\n\
            [[body]]\nname = 'cube'\nbox = { min = [0, 0, 0], max = [1, 1, 1], elements = [2, 2, 2] }\n\
            material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }\n\
            [load_path]\nsteps = 1\n[[dirichlet]]\nset = 'cube_ymin'\n"
            .to_owned()
            + table;
        let case = parse_case(&text, "cube.toml").expect("a case").case;
        let mesh = build_mesh(&case).expect("a mesh");
        let (points, kept) = (mesh.nodes.clone(), vec![true; mesh.elements.len()]);
        marks(&case, &Shape { mesh: &mesh, points, kept })
    }

    #[test]
    fn supports_are_outside_of_the_body() {
        let held = marks_of("");
        assert!((4..=MOST).contains(&held.len()), "{held:?}");
        for mark in &held {
            assert!(matches!(mark, Mark::Support { at, outward } if at[1] == 0.0 && outward[1] == -1.0), "{mark:?}");
        }
        let rolling = marks_of("[[dirichlet]]\nset = 'cube_xmax'\ncomponents = ['x']\n");
        let to = |mark: &Mark, c: usize| matches!(mark, Mark::Support { outward, .. } if outward[c].abs() == 1.0);
        assert!(rolling.iter().any(|mark| to(mark, 0)));
        // plane strain
        let flat = marks_of("[[set]]\nname = 'all'\nbody = 'cube'\n[[dirichlet]]\nset = 'all'\ncomponents = ['z']\n");
        assert!(!flat.iter().any(|mark| to(mark, 2)), "{flat:?}");
        let side = |set: &str| format!("[[dirichlet]]\nset = '{set}'\ncomponents = ['z']\n");
        let both = marks_of(&(side("cube_zmin") + &side("cube_zmax")));
        assert!(!both.iter().any(|mark| to(mark, 2)), "{both:?}");
        assert!(marks_of(&side("cube_zmin")).iter().any(|mark| to(mark, 2)));
    }

    /// An arrow that pushes ends at the face, one that pulls begins there, one along it is beside it.
    #[test]
    fn arrows_push_pull_and_shear() {
        let arrow = |u: &str| {
            let all = marks_of(&format!("[[dirichlet]]\nset = 'cube_ymax'\nmotion = [{{ t = 1.0, u = {u} }}]\n"));
            let found = all.into_iter().find_map(|mark| match mark {
                Mark::Motion { path, label } => Some((path, label)),
                _ => None,
            });
            found.expect("an arrow")
        };
        let near =
            |x: [f64; 3], y: f64| (x[0] - 0.5).abs() < 1e-9 && (x[2] - 0.5).abs() < 1e-9 && (x[1] - y).abs() < 0.05;
        let (path, label) = arrow("[0.0, -0.25, 0.0]");
        assert!(near(path[1], 1.0) && path[0][1] > path[1][1] && label == "0.25 mm", "{path:?} {label}");
        let (path, _) = arrow("[0.0, 0.25, 0.0]");
        assert!(near(path[0], 1.0) && path[1][1] > path[0][1], "{path:?}");
        let (path, label) = arrow("[3.0, 0.0, 4.0]");
        assert!(path.iter().all(|x| x[1] > 1.0) && label == "5 mm", "{path:?} {label}");
    }

    #[test]
    fn loads_and_planes() {
        let force = marks_of("[[load]]\nsurface = 'cube_ymax'\nforce = [0.0, -200.0, 0.0]\n");
        assert!(force.iter().any(|mark| matches!(mark, Mark::Force { label, .. } if label == "200 N")), "{force:?}");
        let pressed = marks_of("[[load]]\nsurface = 'cube_ymax'\npressure = 0.5\n");
        let labels: Vec<&str> = pressed
            .iter()
            .filter_map(|mark| if let Mark::Force { label, .. } = mark { Some(label.as_str()) } else { None })
            .collect();
        assert!(labels.len() > 3 && labels[0] == "0.5 MPa" && labels[1..].iter().all(|label| label.is_empty()));
        let plane = marks_of("[[symmetry]]\nnormal = 'z'\n");
        let Some(Mark::Plane(corners)) = plane.first() else { panic!("{plane:?}") };
        assert!(corners.iter().all(|x| x[2] == 0.0) && corners[0][0] < 0.0 && corners[2][0] > 1.0, "{corners:?}");
        assert_eq!([1234.5, 0.2, -0.056789, 5.0].map(short), ["1234", "0.2", "−0.0568", "5"].map(str::to_owned));
    }
}
