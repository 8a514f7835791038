//! Sets of one node, as Abaqus/CAE names reference nodes.

use std::collections::BTreeMap;

use slipstick_meshio::abaqus::Card;

use super::Reader;

/// The nodes of sets that have only one, by the sets' names in capitals.
pub(super) fn single(cards: &[Card<'_>]) -> BTreeMap<String, u64> {
    let mut found: BTreeMap<String, Option<u64>> = BTreeMap::new();
    for card in cards {
        let Some(set) = card.keyword.parameter("NSET").map(str::to_ascii_uppercase) else { continue };
        let nodes: Vec<Option<u64>> = match card.keyword.name.as_str() {
            "NODE" => card.data().map(|(_, fields)| fields[0].parse().ok()).collect(),
            "NSET" if !card.keyword.has("GENERATE") => {
                let of = |field: &str| field.parse().ok().or_else(|| *found.get(&field.to_ascii_uppercase())?);
                let fields = card.data().flat_map(|(_, fields)| fields);
                fields.filter(|field| !field.is_empty()).map(of).collect()
            }
            "NSET" => vec![None],
            _ => continue,
        };
        for node in nodes {
            let only = found.entry(set.clone()).or_insert(node);
            *only = only.filter(|_| *only == node);
        }
    }
    found.into_iter().filter_map(|(set, node)| Some((set, node?))).collect()
}

impl Reader<'_> {
    /// The number of a node that a parameter names, directly or as the only one of a set.
    pub(super) fn node_of(&self, card: &Card<'_>, parameter: &str) -> Option<u64> {
        let name = card.keyword.parameter(parameter)?;
        name.parse().ok().or_else(|| self.node_names.get(&name.to_ascii_uppercase()).copied())
    }
}
