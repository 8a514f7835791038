//! Solids as a STEP file (ISO 10303-21, AP214): one product per body.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::brep::{Brep, Edge, Face};
use super::curve::Curve;
use super::seams::Frame;
use super::surface::{Surface, V, across};

/// The unit of length of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unit {
    /// A metre with this prefix.
    Metre(&'static str),
    /// A name, and its length. \[m\]
    Other(&'static str, f64),
}

/// A solid with the names of its regions and their frames.
pub(super) struct Named {
    pub brep: Brep,
    pub names: Vec<String>,
    pub frames: Vec<Frame>,
    /// Length below which coordinates need no digits. \[L\]
    pub quantum: f64,
}

/// Digits of directions after the point, of faces other than facets.
const OF_SURFACES: usize = 14;

/// The text of a file. Each body has a name and its solids.
pub(super) fn text(bodies: &[(String, Vec<Named>)], unit: Unit) -> String {
    let mut file = File::default();
    file.text.push_str(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','slipstick','');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n",
    );
    let application = file.add("APPLICATION_CONTEXT('automotive design')");
    file.add(&format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})"
    ));
    let of_product = file.add(&format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
    let of_definition = file.add(&format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"));
    let quantum = bodies.iter().flat_map(|(_, solids)| solids).map(|solid| solid.quantum).fold(f64::INFINITY, f64::min);
    let context = file.context(unit, quantum);
    for (name, solids) in bodies {
        let name = quoted(name);
        let origin = file.add("CARTESIAN_POINT('',(0.,0.,0.))");
        let frame = file.placement(origin, &V::z(), &V::x(), OF_SURFACES);
        let mut items = vec![frame];
        items.extend(solids.iter().map(|solid| file.solid(solid, &name)));
        let representation =
            file.add(&format!("ADVANCED_BREP_SHAPE_REPRESENTATION({name},{},#{context})", list(&items)));
        let product = file.add(&format!("PRODUCT({name},{name},'',(#{of_product}))"));
        file.add(&format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))"));
        let formation = file.add(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let definition = file.add(&format!("PRODUCT_DEFINITION('design','',#{formation},#{of_definition})"));
        let shape = file.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
        file.add(&format!("SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"));
    }
    file.text.push_str("ENDSEC;\nEND-ISO-10303-21;\n");
    file.text
}

/// A string of the file: other characters than those of ASCII are written as four or eight hexadecimal digits.
fn quoted(text: &str) -> String {
    let mut out = String::from("'");
    for c in text.chars() {
        match c {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            _ if (c as u32) < 0x1_0000 => _ = write!(out, "\\X2\\{:04X}\\X0\\", c as u32),
            _ => _ = write!(out, "\\X4\\{:08X}\\X0\\", c as u32),
        }
    }
    out + "'"
}

fn list(items: &[usize]) -> String {
    let items: Vec<String> = items.iter().map(|item| format!("#{item}")).collect();
    format!("({})", items.join(","))
}

/// A number with at most so many digits after the point.
fn real(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = if digits > 0 { text.trim_end_matches('0') } else { &text };
    match text {
        "-0." | "0." => "0.".into(),
        _ if text.contains('.') => text.into(),
        _ => format!("{text}."),
    }
}

#[derive(Default)]
struct File {
    text: String,
    last: usize,
    /// Digits of coordinates after the point.
    digits: usize,
    /// What may occur several times: points, directions.
    shared: HashMap<String, usize>,
}

impl File {
    fn add(&mut self, entity: &str) -> usize {
        self.last += 1;
        let _ = writeln!(self.text, "#{}={entity};", self.last);
        self.last
    }

    fn once(&mut self, entity: String) -> usize {
        if let Some(&known) = self.shared.get(&entity) {
            return known;
        }
        let number = self.add(&entity);
        self.shared.insert(entity, number);
        number
    }

    fn point(&mut self, x: &V) -> usize {
        let [x, y, z] = [x.x, x.y, x.z].map(|c| real(c, self.digits));
        self.once(format!("CARTESIAN_POINT('',({x},{y},{z}))"))
    }

    fn direction(&mut self, v: &V, digits: usize) -> usize {
        let [x, y, z] = [v.x, v.y, v.z].map(|c| real(c, digits));
        self.once(format!("DIRECTION('',({x},{y},{z}))"))
    }

    /// Digits after the point of a direction that is followed over a length, so that points are as exact as coordinates.
    fn over(&self, length: f64) -> usize {
        (self.digits as f64 + length.max(f64::MIN_POSITIVE).log10()).ceil().clamp(4.0, OF_SURFACES as f64) as usize
    }

    fn placement(&mut self, origin: usize, axis: &V, reference: &V, digits: usize) -> usize {
        let (axis, reference) = (self.direction(axis, digits), self.direction(reference, digits));
        self.add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{axis},#{reference})"))
    }

    /// Units and accuracy.
    fn context(&mut self, unit: Unit, quantum: f64) -> usize {
        self.digits = (-quantum.log10()).ceil().clamp(0.0, 15.0) as usize;
        let length = match unit {
            Unit::Metre(prefix) => self.add(&format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))")),
            Unit::Other(name, length) => {
                let metre = self.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))");
                let dimensions = self.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
                let measure = real(length, 12);
                let factor = self.add(&format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({measure}),#{metre})"));
                self.add(&format!("(CONVERSION_BASED_UNIT('{name}',#{factor})LENGTH_UNIT()NAMED_UNIT(#{dimensions}))"))
            }
        };
        let angle = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
        let solid = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
        let accuracy = self.add(
            &format!(
                "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({:E}),#{length},'distance_accuracy_value','')",
                10f64.powi(3 - self.digits as i32)
            )
            .replace("1E", "1.E"),
        );
        self.add(&format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{accuracy}))\
             GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))REPRESENTATION_CONTEXT('',''))"
        ))
    }

    /// A solid, with voids if it has cavities.
    fn solid(&mut self, solid: &Named, name: &str) -> usize {
        let brep = &solid.brep;
        let points: Vec<usize> = brep.vertices.iter().map(|x| self.point(x)).collect();
        let vertices: Vec<usize> = points.iter().map(|point| self.add(&format!("VERTEX_POINT('',#{point})"))).collect();
        let edges: Vec<usize> = brep.edges.iter().map(|edge| self.edge(edge, brep, &points, &vertices)).collect();
        let mut surfaces: HashMap<usize, usize> = HashMap::new();
        let faces: Vec<usize> =
            brep.faces.iter().map(|face| self.face(face, solid, &points, &edges, &mut surfaces)).collect();
        let shells: Vec<usize> = brep
            .shells
            .iter()
            .map(|shell| {
                let faces: Vec<usize> = shell.iter().map(|&face| faces[face]).collect();
                self.add(&format!("CLOSED_SHELL('',{})", list(&faces)))
            })
            .collect();
        match shells[..] {
            [shell] => self.add(&format!("MANIFOLD_SOLID_BREP({name},#{shell})")),
            _ => {
                let voids: Vec<usize> = shells[1..]
                    .iter()
                    .map(|shell| self.add(&format!("ORIENTED_CLOSED_SHELL('',*,#{shell},.T.)")))
                    .collect();
                self.add(&format!("BREP_WITH_VOIDS({name},#{},{})", shells[0], list(&voids)))
            }
        }
    }

    fn edge(&mut self, edge: &Edge, brep: &Brep, points: &[usize], vertices: &[usize]) -> usize {
        let [from, to] = edge.ends;
        let curve = match &edge.curve {
            Curve::Line => {
                let along = brep.vertices[to] - brep.vertices[from];
                let direction = along.try_normalize(0.0).unwrap_or_else(V::x);
                let direction = self.direction(&direction, self.over(along.norm()));
                let vector = self.once(format!("VECTOR('',#{direction},1.)"));
                self.add(&format!("LINE('',#{},#{vector})", points[from]))
            }
            Curve::Conic { centre, normal, major, semi } => {
                let centre = self.point(centre);
                let frame = self.placement(centre, normal, major, OF_SURFACES);
                let [a, b] = semi.map(|semi| real(semi, self.digits));
                match a == b {
                    true => self.add(&format!("CIRCLE('',#{frame},{a})")),
                    false => self.add(&format!("ELLIPSE('',#{frame},{a},{b})")),
                }
            }
            Curve::Spline { points, tangents } => self.spline(points, tangents),
        };
        self.add(&format!("EDGE_CURVE('',#{},#{},#{curve},.T.)", vertices[from], vertices[to]))
    }

    /// A cubic B-spline with double knots.
    fn spline(&mut self, points: &[V], tangents: &[V]) -> usize {
        let last = points.len() - 1;
        let (mut poles, mut knots) = (vec![points[0]], vec![0.0]);
        for k in 0..last {
            let chord = (points[k + 1] - points[k]).norm();
            poles.push(points[k] + tangents[k] * (chord / 3.0));
            poles.push(points[k + 1] - tangents[k + 1] * (chord / 3.0));
            knots.push(knots[k] + chord);
        }
        poles.push(points[last]);
        let poles: Vec<usize> = poles.iter().map(|x| self.point(x)).collect();
        let inner = ",2".repeat(last - 1);
        let knots: Vec<String> = knots.iter().map(|&knot| real(knot, self.digits)).collect();
        self.add(&format!(
            "B_SPLINE_CURVE_WITH_KNOTS('',3,{},.UNSPECIFIED.,.F.,.F.,(4{inner},4),({}),.UNSPECIFIED.)",
            list(&poles),
            knots.join(",")
        ))
    }

    fn face(
        &mut self,
        face: &Face,
        solid: &Named,
        points: &[usize],
        edges: &[usize],
        surfaces: &mut HashMap<usize, usize>,
    ) -> usize {
        let known = face.region.and_then(|region| surfaces.get(&region).copied());
        let surface = known.unwrap_or_else(|| {
            let frame = face.region.and_then(|region| solid.frames[region]);
            let number = self.surface(face, frame, solid, points);
            face.region.map(|region| surfaces.insert(region, number));
            number
        });
        let mut bounds = Vec::with_capacity(face.loops.len());
        for (k, ring) in face.loops.iter().enumerate() {
            let oriented: Vec<usize> = ring
                .iter()
                .map(|&(edge, forward)| {
                    let sense = if forward { ".T." } else { ".F." };
                    self.add(&format!("ORIENTED_EDGE('',*,*,#{},{sense})", edges[edge]))
                })
                .collect();
            let ring = self.add(&format!("EDGE_LOOP('',{})", list(&oriented)));
            let kind = if k == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            bounds.push(self.add(&format!("{kind}('',#{ring},.T.)")));
        }
        let sense = if face.outward { ".T." } else { ".F." };
        let name = face.region.map_or_else(|| "''".to_owned(), |region| quoted(&solid.names[region]));
        self.add(&format!("ADVANCED_FACE({name},{},#{surface},{sense})", list(&bounds)))
    }

    fn surface(&mut self, face: &Face, frame: Frame, solid: &Named, points: &[usize]) -> usize {
        let [axis, reference] = frame.unwrap_or([V::z(), V::x()]);
        match &face.surface {
            Surface::Plane { origin, normal } => {
                let origin = match face.loops[0].first() {
                    // a vertex of the facet
                    Some(&(edge, _)) if face.region.is_none() => points[solid.brep.edges[edge].ends[0]],
                    _ => self.point(origin),
                };
                let placement = match face.region {
                    Some(_) => self.placement(origin, normal, &across(normal), OF_SURFACES),
                    None => {
                        let vertices = face.loops.iter().flatten().flat_map(|&(edge, _)| solid.brep.edges[edge].ends);
                        let far = |vertex: usize| (solid.brep.vertices[vertex] - vertex_of(face, solid)).norm();
                        let normal = self.direction(normal, self.over(vertices.map(far).fold(0.0, f64::max)));
                        self.add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{normal},$)"))
                    }
                };
                self.add(&format!("PLANE('',#{placement})"))
            }
            Surface::Bilinear { corners } => {
                let [a, b, c, d] = corners.map(|x| self.point(&x));
                self.add(&format!(
                    "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#{a},#{d}),(#{b},#{c})),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),\
                     (0.,1.),(0.,1.),.UNSPECIFIED.)"
                ))
            }
            Surface::Sphere { centre, radius } => {
                let centre = self.point(centre);
                let placement = self.placement(centre, &axis, &reference, OF_SURFACES);
                let radius = real(*radius, self.digits);
                self.add(&format!("SPHERICAL_SURFACE('',#{placement},{radius})"))
            }
            Surface::Torus { centre, axis, radius, tube } => {
                let centre = self.point(centre);
                let placement = self.placement(centre, axis, &reference, OF_SURFACES);
                let (radius, tube) = (real(*radius, self.digits), real(*tube, self.digits));
                self.add(&format!("TOROIDAL_SURFACE('',#{placement},{radius},{tube})"))
            }
            Surface::Cone { point, axis, radius, slope } => {
                let point = self.point(point);
                let placement = self.placement(point, axis, &reference, OF_SURFACES);
                let radius = real(*radius, self.digits);
                match *slope == 0.0 {
                    true => self.add(&format!("CYLINDRICAL_SURFACE('',#{placement},{radius})")),
                    false => {
                        let angle = real(slope.atan(), OF_SURFACES);
                        self.add(&format!("CONICAL_SURFACE('',#{placement},{radius},{angle})"))
                    }
                }
            }
        }
    }
}

/// The first vertex of a face.
fn vertex_of(face: &Face, solid: &Named) -> V {
    face.loops[0].first().map_or_else(V::zeros, |&(edge, _)| solid.brep.vertices[solid.brep.edges[edge].ends[0]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_strings_are_those_of_the_format() {
        assert_eq!(real(0.0, 3), "0.");
        assert_eq!(real(-0.0001, 3), "0.");
        assert_eq!(real(-2.5, 9), "-2.5");
        assert_eq!(real(120.0, 9), "120.");
        assert_eq!(real(1200.0, 0), "1200.");
        assert_eq!(quoted("Müller's \\"), "'M\\X2\\00FC\\X0\\ller''s \\\\'");
    }
}
