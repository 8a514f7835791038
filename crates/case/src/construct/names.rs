//! Nodes as the files of a case number them.

use super::BuildError;
use crate::file::{Case, Shape};
use slipstick_mesh::Mesh;
use std::ops::Range;
use std::sync::Arc;

/// Names of the nodes that mesh files have.
pub(super) struct NodeNames(Vec<OfBody>);

struct OfBody {
    file: String,
    nodes: Range<usize>,
    numbers: Arc<[u64]>,
}

impl NodeNames {
    pub fn new(case: &Case, mesh: &Mesh) -> Self {
        let of = |(b, body): (usize, &crate::file::Body)| {
            let Shape::Mesh(file) = &body.shape else { return None };
            let nodes = mesh.bodies.get(b)?.nodes.clone();
            Some(OfBody { file: file.file.clone(), nodes, numbers: file.numbers.clone() })
        };
        Self(case.bodies.iter().enumerate().filter_map(of).collect())
    }

    /// The error with the numbers that files give to nodes, where it names nodes of files.
    pub fn in_files(&self, error: BuildError) -> BuildError {
        BuildError { message: self.renumbered(&error.message), ..error }
    }

    fn renumbered(&self, message: &str) -> String {
        const WORD: &str = "node ";
        let mut parts = message.split(WORD);
        let mut out = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let digits = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
            let own = part[..digits].parse().ok().and_then(|node| self.name(node));
            out += WORD;
            match own {
                Some((number, file)) => {
                    out += &format!("{number} of `{file}`");
                    out += &part[digits..];
                }
                None => out += part,
            }
        }
        out
    }

    fn name(&self, node: usize) -> Option<(u64, &str)> {
        let body = self.0.iter().find(|body| body.nodes.contains(&node))?;
        Some((*body.numbers.get(node - body.nodes.start)?, &body.file))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes 10 to 13 of a mesh, of which the file has the first three.
    #[test]
    fn nodes_have_the_numbers_of_their_file() {
        let names = NodeNames(vec![OfBody { file: "a.inp".into(), nodes: 10..14, numbers: [7, 50, 99].into() }]);
        let named = |message: &str| names.renumbered(message);
        assert_eq!(named("node 12 also belongs to `x`"), "node 99 of `a.inp` also belongs to `x`");
        assert_eq!(named("a node, node 9, node 13 and node 10"), "a node, node 9, node 13 and node 7 of `a.inp`");
    }
}
