//! Slave nodes of a contact pair, or of a part of it.

use super::{ContactNode, QuantityError};

/// The slave nodes of a contact pair, or those of them that lie in a region.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    pair: u32,
    /// Ascending; `None`: all nodes of the pair.
    region: Option<Vec<u32>>,
}

impl Patch {
    /// All slave nodes of a pair, from 0.
    pub fn whole(pair: u32) -> Self {
        Self { pair, region: None }
    }

    /// The slave nodes of a pair that are among these nodes.
    ///
    /// # Errors
    /// Without nodes.
    pub fn within(pair: u32, mut nodes: Vec<u32>) -> Result<Self, QuantityError> {
        nodes.sort_unstable();
        nodes.dedup();
        if nodes.is_empty() { Err(QuantityError::NoNodes) } else { Ok(Self { pair, region: Some(nodes) }) }
    }

    /// The number of the pair.
    pub fn pair(&self) -> usize {
        self.pair as usize
    }

    /// Whether a slave node of the pair belongs to it.
    pub fn contains(&self, node: u32) -> bool {
        self.region.as_ref().is_none_or(|nodes| nodes.binary_search(&node).is_ok())
    }

    /// The nodes of the patch, each with its position in the list.
    pub(super) fn of<'a>(&self, contact: &'a [ContactNode]) -> impl Iterator<Item = (usize, &'a ContactNode)> {
        contact.iter().enumerate().filter(|(_, at)| at.pair == self.pair && self.contains(at.node))
    }
}
