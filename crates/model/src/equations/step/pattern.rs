//! Sparsity pattern of the tangent: element neighbours plus the couplings of slave nodes in or near
//! contact.

use slipstick_linalg::BlockPattern;
use std::sync::Arc;

/// The data from which patterns are built.
#[derive(Debug, Clone)]
pub struct ContactPattern {
    bulk: Vec<Vec<u32>>,
    /// Per node: nodes that share a master facet with it; empty away from masters.
    ring: Vec<Vec<u32>>,
    /// Whether slave nodes have block rows of multipliers, and which of them this rank has.
    multipliers: bool,
    own: Vec<bool>,
}

/// The pattern in use; it is rebuilt only when a coupling leaves it.
///
/// A rebuild includes all nodes near contact, not only those in contact, and all nodes of the
/// master facets around the nodes that they couple with, so that sliding does not leave the pattern
/// at once. The first rebuild of a step drops couplings that slid away, later ones only add, so
/// that a step cannot alternate between two patterns.
#[derive(Debug, Clone, Default)]
pub struct PatternInUse {
    /// Per slave node: every node that its mortar row may reach, ascending; empty for nodes away
    /// from contact.
    reach: Vec<Vec<u32>>,
    /// Whether the next rebuild is the first one of a step.
    first: bool,
    /// Further nodes that couple with each other.
    cliques: Vec<Vec<u32>>,
    pattern: Option<Arc<BlockPattern>>,
}

impl PatternInUse {
    /// Marks the beginning of a new step.
    pub fn begin_step(&mut self) {
        self.first = true;
    }
}

/// The couplings that a slave node needs from the pattern.
#[derive(Debug, Clone, Copy)]
pub struct Coupling<'a> {
    /// Nodes that its mortar rows reach.
    pub support: &'a [u32],
    /// Whether it contributes to the tangent now.
    pub needed: bool,
    /// Whether it may contribute soon.
    pub near: bool,
}

impl ContactPattern {
    /// `bulk`: node neighbours in the mesh; `masters`: nodes that each facet of all master surfaces
    /// depends on; `own`: for
    /// every slave node, whether this rank evaluates it; `multipliers`: whether each has a block
    /// row.
    pub fn new(
        bulk: Vec<Vec<u32>>,
        masters: impl Iterator<Item = Vec<u32>>,
        own: Vec<bool>,
        multipliers: bool,
    ) -> Self {
        let mut ring = vec![Vec::new(); bulk.len()];
        for facet in masters {
            facet.iter().for_each(|&n| ring[n as usize].extend_from_slice(&facet));
        }
        for around in &mut ring {
            around.sort_unstable();
            around.dedup();
        }
        Self { bulk, ring, multipliers, own }
    }

    /// Number of block rows.
    pub fn rows(&self) -> usize {
        self.bulk.len() + if self.multipliers { self.own.len() } else { 0 }
    }

    /// The pattern that holds the needed couplings (one per slave node), and `cliques` of nodes, and whether it is new.
    pub fn covering<'a>(
        &self,
        couplings: impl Iterator<Item = Coupling<'a>> + Clone,
        cliques: &[&[u32]],
        in_use: &mut PatternInUse,
    ) -> (Arc<BlockPattern>, bool) {
        in_use.reach.resize(self.own.len(), Vec::new());
        let inside = |reach: &[u32], c: &Coupling<'_>| c.support.iter().all(|n| reach.binary_search(n).is_ok());
        let fits = couplings.clone().zip(&in_use.reach).all(|(c, reach)| !c.needed || inside(reach, &c));
        let coupled = cliques.iter().all(|clique| in_use.cliques.iter().any(|known| known == clique));
        if let (true, Some(pattern)) = (fits && coupled, &in_use.pattern) {
            return (pattern.clone(), false);
        }
        if !coupled {
            in_use.cliques = cliques.iter().map(|clique| clique.to_vec()).collect();
        }
        if std::mem::take(&mut in_use.first) {
            in_use.reach.iter_mut().for_each(Vec::clear);
        }
        for (c, reach) in couplings.zip(&mut in_use.reach) {
            if c.needed || c.near {
                for &n in c.support {
                    reach.push(n);
                    reach.extend_from_slice(&self.ring[n as usize]);
                }
                reach.sort_unstable();
                reach.dedup();
            }
        }
        let pattern = Arc::new(self.build(&in_use.reach, &in_use.cliques));
        in_use.pattern = Some(pattern.clone());
        (pattern, true)
    }

    fn build(&self, reach: &[Vec<u32>], cliques: &[Vec<u32>]) -> BlockPattern {
        let nodes = self.bulk.len();
        let mut rows: Vec<Vec<u32>> = self.bulk.clone();
        for clique in cliques {
            clique.iter().for_each(|&node| rows[node as usize].extend_from_slice(clique));
        }
        if self.multipliers {
            rows.resize(nodes + reach.len(), Vec::new());
        }
        for (j, reach) in reach.iter().enumerate() {
            for &s in reach {
                rows[s as usize].extend_from_slice(reach);
                if self.multipliers {
                    rows[s as usize].push((nodes + j) as u32);
                }
            }
            if self.multipliers && self.own[j] {
                rows[nodes + j].extend_from_slice(reach);
                rows[nodes + j].push((nodes + j) as u32);
            }
        }
        BlockPattern::from_rows(&rows)
    }
}
