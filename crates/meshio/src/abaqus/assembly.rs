//! Makes a model of parts and instances flat: one list of nodes, elements and sets.
//!
//! Numbers of an instance get an offset, so that the first instance keeps its own, and its names are
//! preceded by that of the instance: set `TOP` of `BOLT-1` becomes `BOLT-1_TOP`. References
//! `BOLT-1.TOP` and `BOLT-1.12` are replaced everywhere. Nodes are translated, then rotated.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::include::{Places, has_keyword, mark};
use super::kind;
use super::lines::{Keyword, Line, Lines, number};
use crate::cursor::shortened;
use crate::{CellKind, MeshFileError};

/// A keyword and its lines of data.
#[derive(Debug, Clone)]
pub struct Card<'a> {
    /// The keyword.
    pub keyword: Keyword<'a>,
    /// The text of its data and how many lines precede it.
    data: (&'a [u8], usize),
}

impl<'a> Card<'a> {
    /// Numbers and fields of its lines of data.
    pub fn data(&self) -> impl Iterator<Item = (usize, Vec<&'a str>)> + use<'a> {
        let mut lines = Lines::after(self.data.0, self.data.1);
        std::iter::from_fn(move || match lines.next() {
            Ok(Some(Line::Data { number, fields })) => Some((number, fields)),
            _ => None,
        })
    }

    /// The first line of its data, as written.
    pub fn first_line(&self) -> Option<&'a str> {
        let lines = self.data.0.split(|&byte| byte == b'\n').filter_map(|line| std::str::from_utf8(line).ok());
        lines.map(str::trim).find(|line| !line.is_empty() && !line.starts_with("**"))
    }
}

/// The keywords of a text, each with its data.
///
/// # Errors
/// If a line is not UTF-8, see [`decoded`](super::decoded).
pub fn cards(text: &[u8]) -> Result<Vec<Card<'_>>, MeshFileError> {
    let mut cards: Vec<Card<'_>> = Vec::new();
    let mut lines = Lines::new(text);
    let mut end = lines.rest();
    while let Some(line) = lines.next()? {
        if let Line::Keyword(keyword) = line {
            if let Some(last) = cards.last_mut() {
                last.data.0 = &last.data.0[..last.data.0.len() - end.0.len()];
            }
            cards.push(Card { keyword, data: lines.rest() });
        }
        end = lines.rest();
    }
    Ok(cards)
}

/// Where numbers and names are those of an instance.
struct Scope {
    /// Precedes names.
    prefix: String,
    node: u64,
    element: u64,
}

/// A part of a deck.
#[derive(Default)]
struct Part<'a> {
    cards: Vec<Card<'a>>,
    /// Largest numbers of nodes and elements.
    last: [u64; 2],
}

/// The model without parts and instances, in which comments keep the [`Places`] of its lines; unchanged
/// if it has none.
///
/// # Errors
/// If a part or its end is missing, or if an instance or a reference to it is wrong.
pub fn flat(text: &[u8]) -> Result<Cow<'_, [u8]>, MeshFileError> {
    if !has_keyword(text, "PART") && !has_keyword(text, "INSTANCE") && !has_keyword(text, "ASSEMBLY") {
        return Ok(Cow::Borrowed(text));
    }
    let (all, places) = (cards(text)?, Places::new(text));
    let (parts, rest) = parts(all)?;
    let mut scopes: BTreeMap<String, Scope> = BTreeMap::new();
    let mut offset = [0, 0];
    for card in rest.iter().filter(|card| card.keyword.name == "INSTANCE") {
        let (name, part) = (card.keyword.required("NAME")?, part_of(card, &parts)?);
        let last = part.map_or([0, 0], |part| part.last);
        let scope = Scope { prefix: name.clone(), node: offset[0], element: offset[1] };
        if scopes.insert(name.to_ascii_uppercase(), scope).is_some() {
            let message = format!("the instance `{}` is defined twice", shortened(&name));
            return Err(card.keyword.error(message, "give each instance a name of its own"));
        }
        offset = [0, 1].map(|kind| u64::saturating_add(offset[kind], last[kind]));
    }
    let mut writer = Writer { out: Vec::with_capacity(text.len()), scopes, places };
    let global = Scope { prefix: String::new(), node: offset[0], element: offset[1] };
    let mut at = 0;
    while at < rest.len() {
        let card = &rest[at];
        at += 1;
        match card.keyword.name.as_str() {
            "ASSEMBLY" | "END ASSEMBLY" => {}
            "INSTANCE" => {
                let placement = Placement::new(card)?;
                let own = rest[at..].iter().take_while(|card| card.keyword.name != "END INSTANCE").count();
                if at + own == rest.len() {
                    return Err(card.keyword.error("the instance has no end", "add *END INSTANCE"));
                }
                let name = card.keyword.required("NAME")?.to_ascii_uppercase();
                let cards = part_of(card, &parts)?.map_or(&[][..], |part| &part.cards);
                for card in cards.iter().chain(&rest[at..at + own]) {
                    writer.card(card, &name, &placement)?;
                }
                at += own + 1;
            }
            _ => match card.keyword.parameter("INSTANCE") {
                Some(instance) => {
                    let name = instance.to_ascii_uppercase();
                    if !writer.scopes.contains_key(&name) {
                        let message = format!("there is no instance `{}`", shortened(instance));
                        return Err(card.keyword.error(message, "name an *INSTANCE of the assembly"));
                    }
                    writer.members(card, &name, &Placement { shift: [0.0; 3], turn: None })?;
                }
                None => writer.outside(card, &global)?,
            },
        }
    }
    Ok(Cow::Owned(writer.out))
}

/// The parts by their names in capitals, and all other cards.
fn parts(all: Vec<Card<'_>>) -> Result<(BTreeMap<String, Part<'_>>, Vec<Card<'_>>), MeshFileError> {
    let (mut parts, mut rest) = (BTreeMap::<String, Part<'_>>::new(), Vec::new());
    let mut open: Option<(Keyword<'_>, Part<'_>)> = None;
    for card in all {
        match (card.keyword.name.as_str(), &mut open) {
            ("PART", None) => open = Some((card.keyword, Part::default())),
            ("END PART", Some(_)) => {
                let Some((keyword, part)) = open.take() else { continue };
                let name = keyword.required("NAME")?;
                if parts.insert(name.to_ascii_uppercase(), part).is_some() {
                    let message = format!("the part `{}` is defined twice", shortened(&name));
                    return Err(keyword.error(message, "give each part a name of its own"));
                }
            }
            ("PART" | "ASSEMBLY" | "STEP", Some((keyword, _))) => {
                return Err(keyword.error("the part has no end", "add *END PART"));
            }
            (_, Some((_, part))) => {
                let kind = match card.keyword.name.as_str() {
                    "NODE" => Some(0),
                    "ELEMENT" => Some(1),
                    _ => None,
                };
                if let Some(kind) = kind {
                    let numbers = card.data().filter_map(|(_, fields)| fields[0].parse::<u64>().ok());
                    part.last[kind] = numbers.fold(part.last[kind], u64::max);
                }
                part.cards.push(card);
            }
            (_, None) => rest.push(card),
        }
    }
    match open {
        Some((keyword, _)) => Err(keyword.error("the part has no end", "add *END PART")),
        None => Ok((parts, rest)),
    }
}

/// The part of an instance; `None` if the instance has nodes and elements of its own.
fn part_of<'p, 'a>(
    card: &Card<'_>,
    parts: &'p BTreeMap<String, Part<'a>>,
) -> Result<Option<&'p Part<'a>>, MeshFileError> {
    let Some(name) = card.keyword.parameter("PART") else { return Ok(None) };
    let part = parts.get(&name.to_ascii_uppercase());
    part.map(Some).ok_or_else(|| {
        let message = format!("there is no part `{}`", shortened(name));
        card.keyword.error(message, "define it with *PART before the assembly")
    })
}

/// Translation, then rotation about an axis.
struct Placement {
    shift: [f64; 3],
    /// A point of the axis and the matrix.
    turn: Option<([f64; 3], [[f64; 3]; 3])>,
}

impl Placement {
    fn new(card: &Card<'_>) -> Result<Self, MeshFileError> {
        let mut rows = Vec::new();
        for (line, fields) in card.data() {
            let numbers: Option<Vec<f64>> = fields.iter().map(|field| real(field)).collect();
            let help = "three numbers for the translation, then two points of the axis and an angle in degrees";
            let found =
                numbers.ok_or_else(|| MeshFileError::new(format!("line {line}"), "this is not a placement", help))?;
            if (rows.is_empty() && found.len() < 3) || (rows.len() == 1 && found.len() < 7) || rows.len() == 2 {
                return Err(MeshFileError::new(format!("line {line}"), "this is not a placement", help));
            }
            rows.push((line, found));
        }
        let shift = rows.first().map_or([0.0; 3], |(_, row)| [row[0], row[1], row[2]]);
        let Some((line, row)) = rows.get(1) else { return Ok(Self { shift, turn: None }) };
        let (a, angle) = ([row[0], row[1], row[2]], row[6].to_radians());
        let axis: [f64; 3] = std::array::from_fn(|c| row[3 + c] - a[c]);
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(length > 0.0) {
            let cure = "give two different points of the axis";
            return Err(MeshFileError::new(format!("line {line}"), "the axis of the rotation has no direction", cure));
        }
        let [x, y, z] = axis.map(|x| x / length);
        let (s, c) = angle.sin_cos();
        let v = 1.0 - c;
        let matrix = [
            [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
            [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
            [z * x * v - y * s, z * y * v + x * s, c + z * z * v],
        ];
        Ok(Self { shift, turn: Some((a, matrix)) })
    }

    fn moves(&self) -> bool {
        self.turn.is_some() || self.shift != [0.0; 3]
    }

    fn of(&self, x: [f64; 3]) -> [f64; 3] {
        let x: [f64; 3] = std::array::from_fn(|c| x[c] + self.shift[c]);
        let Some((a, matrix)) = &self.turn else { return x };
        std::array::from_fn(|c| a[c] + (0..3).map(|k| matrix[c][k] * (x[k] - a[k])).sum::<f64>())
    }
}

/// A number with Fortran's or C's exponent.
fn real(field: &str) -> Option<f64> {
    if field.is_empty() {
        return Some(0.0);
    }
    field.replace(['d', 'D'], "e").parse().ok().filter(|x: &f64| x.is_finite())
}

/// Parameters that name a set or surface.
const NAMES: [&str; 4] = ["NSET", "ELSET", "SURFACE", "NAME"];

/// Parameters that name a node by number or by a set.
const NODES: [&str; 3] = ["REF NODE", "ROT NODE", "NODE"];

struct Writer {
    out: Vec<u8>,
    /// By the names of instances in capitals.
    scopes: BTreeMap<String, Scope>,
    places: Places,
}

impl Writer {
    fn mark(&mut self, line: usize) {
        let (file, line) = self.places.of(line);
        let mark = mark(line, file);
        self.out.extend(mark.bytes());
    }

    /// A keyword whose names are changed.
    fn keyword(&mut self, keyword: &Keyword<'_>, names: impl Fn(&str, &str) -> String) {
        self.mark(keyword.line);
        let mut text = format!("*{}", keyword.name);
        for (name, value) in keyword.parameters.iter().filter(|(name, _)| name != "INSTANCE") {
            let _ = match value {
                Some(value) => write!(text, ", {name}=\"{}\"", names(name, value)),
                None => write!(text, ", {name}"),
            };
        }
        text.push('\n');
        self.out.extend(text.bytes());
    }

    fn line(&mut self, line: usize, fields: impl Iterator<Item = String>, last: &mut usize) {
        if line != *last + 1 {
            self.mark(line);
        }
        *last = line;
        let text = fields.collect::<Vec<_>>().join(", ");
        self.out.extend(text.bytes());
        self.out.push(b'\n');
    }

    /// A card of a part, for one of its instances.
    fn card(&mut self, card: &Card<'_>, instance: &str, placement: &Placement) -> Result<(), MeshFileError> {
        let name = card.keyword.name.as_str();
        if name != "NODE" && name != "ELEMENT" {
            return self.members(card, instance, placement);
        }
        let Scope { prefix, node, element } = &self.scopes[instance];
        let (prefix, node, element) = (prefix.clone(), *node, *element);
        self.keyword(&card.keyword, |name, value| match name {
            "NSET" | "ELSET" => format!("{prefix}_{value}"),
            _ => value.to_owned(),
        });
        let nodes =
            card.keyword.parameter("TYPE").and_then(|of| kind(&of.to_ascii_uppercase())).map(CellKind::node_count);
        let (mut last, mut wanted) = (card.keyword.line, 0);
        for (line, fields) in card.data() {
            let first = number(fields[0], line)?;
            if name == "NODE" {
                if !placement.moves() {
                    let rest = fields[1..].iter().map(|field| (*field).to_owned());
                    self.line(line, std::iter::once(first.saturating_add(node).to_string()).chain(rest), &mut last);
                    continue;
                }
                let mut x = [0.0; 3];
                for (x, field) in x.iter_mut().zip(&fields[1..]) {
                    *x = real(field).ok_or_else(|| {
                        let message = format!("`{}` is not a coordinate", shortened(field));
                        MeshFileError::new(format!("line {line}"), message, "give three finite numbers")
                    })?;
                }
                let moved = placement.of(x).map(|x| format!("{x:?}"));
                self.line(line, std::iter::once(first.saturating_add(node).to_string()).chain(moved), &mut last);
                continue;
            }
            let mut numbers = Vec::with_capacity(fields.len());
            for (at, field) in fields.iter().enumerate().filter(|(_, field)| !field.is_empty()) {
                let begins = at == 0 && wanted == 0;
                wanted = if begins { nodes.unwrap_or(0) } else { wanted.saturating_sub(1) };
                numbers.push(number(field, line)?.saturating_add(if begins { element } else { node }).to_string());
            }
            self.line(line, numbers.into_iter(), &mut last);
        }
        Ok(())
    }

    /// A card whose numbers and names are those of an instance.
    fn members(&mut self, card: &Card<'_>, instance: &str, placement: &Placement) -> Result<(), MeshFileError> {
        let Scope { prefix, node, element } = &self.scopes[instance];
        let (prefix, node, element) = (prefix.clone(), *node, *element);
        let keyword = &card.keyword;
        // a set of the assembly keeps its name
        let own = keyword.parameter("INSTANCE").is_none();
        let offset = match keyword.name.as_str() {
            "NSET" => node,
            "SURFACE" if keyword.parameter("TYPE").is_some_and(|of| of.eq_ignore_ascii_case("NODE")) => node,
            "ELSET" | "SURFACE" => element,
            _ => {
                let axes = keyword.name == "ORIENTATION";
                self.keyword(keyword, |name, value| match (name, value.parse::<u64>()) {
                    (name, Ok(number)) if NODES.contains(&name) => number.saturating_add(node).to_string(),
                    (name, _) if NODES.contains(&name) => format!("{prefix}_{value}"),
                    ("NSET" | "TIE NSET" | "PIN NSET" | "ELSET" | "SURFACE" | "ORIENTATION", _) => {
                        format!("{prefix}_{value}")
                    }
                    ("NAME", _) if axes => format!("{prefix}_{value}"),
                    _ => value.to_owned(),
                });
                let mut last = keyword.line;
                for (row, (line, fields)) in card.data().enumerate() {
                    // the axes of a material turn with the part
                    if let Some(points) = points(&fields).filter(|_| axes && row == 0 && placement.moves()) {
                        let moved = points.map(|x| placement.of(x)).concat();
                        self.line(line, moved.into_iter().map(|x| format!("{x:?}")), &mut last);
                        continue;
                    }
                    let own =
                        fields.iter().enumerate().map(|(at, field)| match (named(keyword, &fields, at), *field) {
                            (None, field) | (_, field @ "") => field.to_owned(),
                            (Some(Named::Node), field) => {
                                shifted(field, node).unwrap_or_else(|| prefixed(&prefix, field))
                            }
                            (Some(Named::Element), field) => {
                                shifted(field, element).unwrap_or_else(|| prefixed(&prefix, field))
                            }
                        });
                    self.line(line, own, &mut last);
                }
                return Ok(());
            }
        };
        let defines = |name: &str| {
            matches!((keyword.name.as_str(), name), ("NSET", "NSET") | ("ELSET", "ELSET") | ("SURFACE", "NAME"))
        };
        self.keyword(keyword, |name, value| match NAMES.contains(&name) && (own || !defines(name)) {
            true => format!("{prefix}_{value}"),
            false => value.to_owned(),
        });
        let (mut last, generate) = (keyword.line, keyword.has("GENERATE"));
        for (line, fields) in card.data() {
            let field = |(at, field): (usize, &&str)| match field.parse::<u64>() {
                Ok(number) if !(generate && at == 2) => number.saturating_add(offset).to_string(),
                _ if field.is_empty() || generate || (keyword.name == "SURFACE" && at > 0) => (*field).to_owned(),
                _ => format!("{prefix}_{}", field.trim_matches('"')),
            };
            self.line(line, fields.iter().enumerate().map(field), &mut last);
        }
        Ok(())
    }

    /// A card of the assembly or after it.
    fn outside(&mut self, card: &Card<'_>, global: &Scope) -> Result<(), MeshFileError> {
        let keyword = &card.keyword;
        let scopes = std::mem::take(&mut self.scopes);
        self.keyword(keyword, |name, value| match value.parse::<u64>() {
            Ok(number) if NODES.contains(&name) => number.saturating_add(global.node).to_string(),
            _ => replaced(&scopes, keyword, value).unwrap_or_else(|| value.to_owned()),
        });
        let mut last = keyword.line;
        let offset = match keyword.name.as_str() {
            "NODE" | "NSET" => global.node,
            "SURFACE" if keyword.parameter("TYPE").is_some_and(|of| of.eq_ignore_ascii_case("NODE")) => global.node,
            "ELSET" | "SURFACE" | "ELEMENT" => global.element,
            _ => 0,
        };
        let generate = keyword.has("GENERATE");
        for (line, fields) in card.data() {
            let field = |(at, field): (usize, &&str)| match field.parse::<u64>() {
                Ok(number) if keyword.name == "ELEMENT" && at > 0 => number.saturating_add(global.node).to_string(),
                Ok(number) if offset > 0 && !(at == 2 && generate) && (at == 0 || keyword.name != "NODE") => {
                    number.saturating_add(offset).to_string()
                }
                _ => {
                    let own = named(keyword, &fields, at).and_then(|of| match of {
                        Named::Node => shifted(field, global.node),
                        Named::Element => shifted(field, global.element),
                    });
                    own.or_else(|| replaced(&scopes, keyword, field)).unwrap_or_else(|| (*field).to_owned())
                }
            };
            self.line(line, fields.iter().enumerate().map(field), &mut last);
        }
        self.scopes = scopes;
        Ok(())
    }
}

/// What a field of a line of data names, by number or by a set.
enum Named {
    Node,
    Element,
}

/// What a field names in the data of keywords other than those of meshes and sets.
fn named(keyword: &Keyword<'_>, fields: &[&str], at: usize) -> Option<Named> {
    match keyword.name.as_str() {
        // a line with one number has that of the terms
        "EQUATION" => {
            (at.is_multiple_of(3) && fields.iter().filter(|field| !field.is_empty()).count() > 1).then_some(Named::Node)
        }
        // a line begins with the kind, or goes on with 0
        "MPC" => (at > 0).then_some(Named::Node),
        "BOUNDARY" | "CLOAD" | "INITIAL CONDITIONS" | "TEMPERATURE" => (at == 0).then_some(Named::Node),
        "DLOAD" => (at == 0).then_some(Named::Element),
        _ => None,
    }
}

/// A number with its offset; `None` for a name.
fn shifted(field: &str, offset: u64) -> Option<String> {
    field.parse::<u64>().ok().map(|number| number.saturating_add(offset).to_string())
}

fn prefixed(prefix: &str, name: &str) -> String {
    format!("{prefix}_{}", name.trim_matches('"'))
}

/// Two points and an origin, by default that of the coordinates; `None` if there are other fields.
fn points(fields: &[&str]) -> Option<[[f64; 3]; 3]> {
    let x: Vec<f64> = fields.iter().map(|field| real(field)).collect::<Option<_>>()?;
    match x[..] {
        [a, b, c, d, e, f] => Some([[a, b, c], [d, e, f], [0.0; 3]]),
        [a, b, c, d, e, f, x, y, z] => Some([[a, b, c], [d, e, f], [x, y, z]]),
        _ => None,
    }
}

/// A reference to a node, element or name of an instance.
fn replaced(scopes: &BTreeMap<String, Scope>, keyword: &Keyword<'_>, field: &str) -> Option<String> {
    let (instance, name) = field.trim_matches('"').split_once('.')?;
    let scope = scopes.get(&instance.to_ascii_uppercase())?;
    let elements = matches!(keyword.name.as_str(), "ELSET" | "SURFACE" | "DLOAD");
    Some(match name.parse::<u64>() {
        Ok(number) => number.saturating_add(if elements { scope.element } else { scope.node }).to_string(),
        Err(_) => format!("{}_{name}", scope.prefix),
    })
}
