//! Connectors that are springs.

use std::collections::BTreeMap;

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader, SpringSection};

/// Connectors, until all of their keywords are read.
#[derive(Debug, Default)]
pub struct Connectors {
    sections: Vec<Section>,
    /// Components from 1 with their stiffness, by the names of behaviors in capitals.
    behaviors: BTreeMap<String, Vec<(u8, f64)>>,
    /// The behavior to which `*CONNECTOR ELASTICITY` belongs.
    open: Option<String>,
}

/// `*CONNECTOR SECTION`.
#[derive(Debug)]
struct Section {
    set: String,
    behavior: String,
    /// Along the line between the nodes, instead of axes.
    axial: bool,
    /// The `*ORIENTATION` of the axes, in capitals.
    orientation: Option<String>,
    line: usize,
}

impl Reader<'_> {
    pub(super) fn connector_section(&mut self, card: &Card<'_>) {
        self.allow(card, &["ELSET", "BEHAVIOR"]);
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let value = |name: &str| keyword.parameter(name).map(str::to_ascii_uppercase);
        let (Some(set), Some(behavior)) = (value("ELSET"), value("BEHAVIOR")) else {
            let why = "the connectors need ELSET=… and BEHAVIOR=…";
            return self.ledger.wrong(&keyword.name, [line; 2], why, "add the parameter");
        };
        self.spring_sets.push(set.clone());
        let rows: Vec<Vec<&str>> = card.data().map(|(_, fields)| fields).collect();
        let kind = rows.first().map_or(String::new(), |fields| fields.concat().to_ascii_uppercase());
        if !["AXIAL", "CARTESIAN"].contains(&kind.as_str()) {
            let why = format!("connectors of the kind `{kind}` are not supported");
            let cure = "use AXIAL or CARTESIAN with *CONNECTOR ELASTICITY, *COUPLING, *MPC or *EQUATION";
            return self.ledger.refuse(&keyword.name, line, why, cure);
        }
        // the orientations at the first and the second node; without the second, the first is for both
        let named: Vec<String> =
            rows.iter().skip(1).flatten().filter(|f| !f.is_empty()).map(|f| f.to_ascii_uppercase()).collect();
        if kind == "CARTESIAN" && named.iter().any(|name| *name != named[0]) {
            let why = "CARTESIAN connectors with different axes at their nodes are not supported";
            return self.ledger.refuse(&keyword.name, line, why, "name one orientation, or use AXIAL");
        }
        let orientation = named.into_iter().next().filter(|_| kind == "CARTESIAN");
        self.ledger.translated(&keyword.name, line, "`[[spring]]`, with `nodal_stiffness`");
        let axial = kind == "AXIAL";
        self.connectors.sections.push(Section { set, behavior, axial, orientation, line });
    }

    pub(super) fn connector_behavior(&mut self, card: &Card<'_>) {
        self.allow(card, &["NAME"]);
        let (name, line) = (&card.keyword.name, card.keyword.line);
        let Some(own) = card.keyword.parameter("NAME").map(str::to_ascii_uppercase) else {
            return self.ledger.wrong(name, [line; 2], "the behavior has no name", "add NAME=…");
        };
        self.ledger.used(name, line);
        self.connectors.behaviors.entry(own.clone()).or_default();
        self.connectors.open = Some(own);
    }

    pub(super) fn connector_elasticity(&mut self, card: &Card<'_>) {
        self.allow(card, &["COMPONENT"]);
        let (name, line) = (&card.keyword.name, card.keyword.line);
        let Some(behavior) = self.connectors.open.clone() else {
            let cure = "write *CONNECTOR BEHAVIOR before it";
            return self.ledger.wrong(name, [line; 2], "it belongs to no behavior", cure);
        };
        let component: Option<u8> = card.keyword.parameter("COMPONENT").and_then(|number| number.parse().ok());
        let Some(component) = component.filter(|c| (1..=3).contains(c)) else {
            let why = "only a stiffness of one of the components 1 to 3 is supported";
            return self.ledger.refuse(name, line, why, "write COMPONENT=1, 2 or 3");
        };
        let rows = self.numbers(card);
        if rows.len() > 1 {
            let why = "a stiffness that depends on temperature is not supported";
            return self.ledger.refuse(name, line, why, "keep the row for the temperature of the analysis");
        }
        let Some(stiffness) = rows.first().and_then(|row| row.first().copied()).filter(|&k| k > 0.0) else {
            return self.ledger.wrong(name, [line; 2], "it needs a line with a stiffness > 0", DAMAGED);
        };
        self.ledger.translated(name, line, "`nodal_stiffness`");
        self.connectors.behaviors.entry(behavior).or_default().push((component, stiffness));
    }

    /// Makes springs of all connectors.
    pub(super) fn connector_springs(&mut self) {
        let Connectors { sections, behaviors, .. } = std::mem::take(&mut self.connectors);
        for section in sections {
            let (line, keyword) = (section.line, "CONNECTOR SECTION");
            let Some(behavior) = behaviors.get(&section.behavior).filter(|components| !components.is_empty()) else {
                let why = format!("the behavior `{}` has no *CONNECTOR ELASTICITY", section.behavior);
                self.ledger.wrong(keyword, [line; 2], why, "name a *CONNECTOR BEHAVIOR with a stiffness");
                continue;
            };
            for &(component, stiffness) in behavior {
                if section.axial && component != 1 {
                    let why = format!("AXIAL connectors have no component {component}");
                    self.ledger.wrong(keyword, [line; 2], why, "give the stiffness of COMPONENT=1");
                    continue;
                }
                let components = if section.axial { vec![] } else { vec![component - 1; 2] };
                let (set, orientation) = (section.set.clone(), section.orientation.clone());
                self.deck.springs.push(SpringSection { keyword, set, components, orientation, stiffness, line });
            }
        }
    }
}
