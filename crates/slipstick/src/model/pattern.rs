//! Sparsity pattern of the tangent: element neighbours plus contact couplings, with slack for motion.

use slipstick_contact::ContactInterface;
use slipstick_linalg::BlockPattern;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Builds and keeps the pattern; it is rebuilt only when a coupling leaves it.
#[derive(Debug, Clone)]
pub struct ContactPattern {
    bulk: Vec<Vec<u32>>,
    /// Per slave node: every node that its mortar row may reach, ascending.
    reach: Vec<Vec<u32>>,
    multipliers: bool,
    pattern: Option<Arc<BlockPattern>>,
}

impl ContactPattern {
    /// `bulk`: node neighbours of the mesh; `slaves`: number of slave nodes; `multipliers`: whether each has a block row.
    pub fn new(bulk: Vec<Vec<u32>>, slaves: usize, multipliers: bool) -> Self {
        Self {
            bulk,
            reach: vec![Vec::new(); slaves],
            multipliers,
            pattern: None,
        }
    }

    /// Forgets all couplings, so that a march does not depend on what was solved before it.
    pub fn reset(&mut self) {
        self.reach.iter_mut().for_each(Vec::clear);
        self.pattern = None;
    }

    /// Number of block rows.
    pub fn rows(&self) -> usize {
        self.bulk.len()
            + if self.multipliers {
                self.reach.len()
            } else {
                0
            }
    }

    /// The pattern that holds these supports (one per slave node), and whether it is a new one.
    ///
    /// A support that is new takes the facets around its master nodes along, so that further sliding stays inside.
    pub fn covering<'a>(
        &mut self,
        supports: impl Iterator<Item = &'a [u32]>,
        interfaces: &[&ContactInterface],
    ) -> (Arc<BlockPattern>, bool) {
        let mut grown = self.pattern.is_none();
        let mut wanted = Vec::new();
        for (j, support) in supports.enumerate() {
            if support
                .iter()
                .any(|n| self.reach[j].binary_search(n).is_err())
            {
                wanted.push((j, support.to_vec()));
                grown = true;
            }
        }
        if !wanted.is_empty() {
            let around = master_neighbours(interfaces, self.bulk.len());
            for (j, support) in wanted {
                let mut all: BTreeSet<u32> = self.reach[j].iter().copied().collect();
                for node in support {
                    all.insert(node);
                    all.extend(&around[node as usize]);
                }
                self.reach[j] = all.into_iter().collect();
            }
        }
        if grown {
            self.pattern = Some(Arc::new(self.build()));
        }
        (self.pattern.clone().expect("built above"), grown)
    }

    fn build(&self) -> BlockPattern {
        let nodes = self.bulk.len();
        let mut rows: Vec<Vec<u32>> = self.bulk.clone();
        if self.multipliers {
            rows.resize(nodes + self.reach.len(), Vec::new());
        }
        for (j, reach) in self.reach.iter().enumerate() {
            for &s in reach {
                rows[s as usize].extend_from_slice(reach);
                if self.multipliers {
                    rows[s as usize].push((nodes + j) as u32);
                }
            }
            if self.multipliers {
                rows[nodes + j].extend_from_slice(reach);
                rows[nodes + j].push((nodes + j) as u32);
            }
        }
        for row in &mut rows {
            row.sort_unstable();
            row.dedup();
        }
        BlockPattern::from_rows(&rows)
    }
}

/// For each master node, the nodes of all master facets around it.
fn master_neighbours(interfaces: &[&ContactInterface], nodes: usize) -> Vec<Vec<u32>> {
    let mut around = vec![Vec::new(); nodes];
    for facet in interfaces.iter().flat_map(|i| i.master_facets()) {
        for &node in facet {
            around[node as usize].extend_from_slice(facet);
        }
    }
    around
}
