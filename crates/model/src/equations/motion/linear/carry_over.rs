//! The tangent of the independent unknowns, Tᵀ K T.

use super::{LinearEquations, NONE};
use slipstick_linalg::{BlockMatrix, BlockPattern};

type Terms = [(u32, f64)];

/// A node with dependent unknowns.
enum Node<'a> {
    /// The same combination of nodes along each axis: blocks of the matrix as wholes.
    Alike(Vec<(u32, f64)>),
    /// The unknowns on which each of its three depends.
    Each([Option<&'a Terms>; 3]),
}

impl LinearEquations {
    /// Transforms a matrix ∂R/∂y, in which all d_i are independent. The rows of dependent unknowns remain, and
    /// their columns become zero.
    pub fn carry_over(&self, matrix: &mut BlockMatrix) {
        if self.is_empty() {
            return;
        }
        let pattern = matrix.pattern().clone();
        let (numbers, nodes) = self.nodes(pattern.rows());
        let of = |node: u32| nodes.get(numbers[node as usize] as usize);
        let mut places = vec![NONE; pattern.rows()];
        for row in 0..pattern.rows() {
            let start = pattern.row_range(row).start;
            if pattern.row(row).iter().all(|&column| of(column).is_none()) {
                continue;
            }
            pattern.row(row).iter().zip(0..).for_each(|(&column, at)| places[column as usize] = at);
            // places of other rows remain in the list
            let find = |column: u32| {
                let at = places[column as usize] as usize;
                let found = pattern.row(row).get(at) == Some(&column);
                if found { start + at } else { outside(row, column) }
            };
            for (position, &column) in pattern.row_range(row).zip(pattern.row(row)) {
                let Some(node) = of(column) else { continue };
                carry_column(node, position, matrix.values_mut(), find);
            }
        }
        for (row, number) in numbers.iter().enumerate() {
            match nodes.get(*number as usize) {
                None => {}
                Some(Node::Alike(terms)) => {
                    terms.iter().for_each(|&(other, c)| add_row(&pattern, matrix.values_mut(), row, other as usize, c));
                }
                Some(Node::Each(each)) => {
                    for (a, terms) in each.iter().enumerate().filter_map(|(a, terms)| Some((a, (*terms)?))) {
                        carry_row(&pattern, matrix, row, a, terms);
                    }
                }
            }
        }
    }

    /// The nodes with dependent unknowns, and the position of each node of the mesh among them.
    fn nodes(&self, count: usize) -> (Vec<u32>, Vec<Node<'_>>) {
        let (mut numbers, mut nodes) = (vec![NONE; count], Vec::new());
        for (unknown, _) in &self.rows {
            let node = (unknown / 3) as usize;
            if numbers[node] == NONE {
                numbers[node] = nodes.len() as u32;
                nodes.push(self.node(node));
            }
        }
        (numbers, nodes)
    }

    fn node(&self, node: usize) -> Node<'_> {
        let each = [0, 1, 2].map(|c| self.row(3 * node + c));
        let [Some(first), second, third] = each else { return Node::Each(each) };
        let as_first = |terms: Option<&Terms>, c: u32| {
            terms.is_some_and(|terms| {
                let same = |(of, to): (&(u32, f64), &(u32, f64))| of.0 == to.0 + c && of.1 == to.1;
                terms.len() == first.len() && terms.iter().zip(first).all(same)
            })
        };
        match first.iter().all(|(unknown, _)| unknown % 3 == 0) && as_first(second, 1) && as_first(third, 2) {
            true => Node::Alike(first.iter().map(|&(unknown, c)| (unknown / 3, c)).collect()),
            false => Node::Each(each),
        }
    }
}

/// Adds the columns of a block to those of the unknowns on which its own depend; `find` has the position of a
/// block in the same row.
fn carry_column(node: &Node<'_>, position: usize, values: &mut [[f64; 9]], find: impl Fn(u32) -> usize) {
    match node {
        Node::Alike(terms) => {
            let block = std::mem::take(&mut values[position]);
            if block != [0.0; 9] {
                terms.iter().for_each(|&(other, c)| add(&mut values[find(other)], c, &block));
            }
        }
        Node::Each(each) => {
            for (b, terms) in each.iter().enumerate().filter_map(|(b, terms)| Some((b, (*terms)?))) {
                let entries = [0, 1, 2].map(|a| std::mem::take(&mut values[position][3 * a + b]));
                for &(i, c) in terms.iter().filter(|_| entries != [0.0; 3]) {
                    let block = &mut values[find(i / 3)];
                    (0..3).for_each(|a| block[3 * a + i as usize % 3] += c * entries[a]);
                }
            }
        }
    }
}

/// Adds a multiple of a row of blocks to another.
fn add_row(pattern: &BlockPattern, values: &mut [[f64; 9]], row: usize, to: usize, factor: f64) {
    let mut into = pattern.row_range(to).zip(pattern.row(to));
    for (position, &column) in pattern.row_range(row).zip(pattern.row(row)) {
        let block = values[position];
        if block != [0.0; 9] {
            match into.find(|(_, other)| **other == column) {
                Some((at, _)) => add(&mut values[at], factor, &block),
                None => _ = outside(to, column),
            }
        }
    }
}

/// Adds the row of one unknown of a node to those on which it depends.
fn carry_row(pattern: &BlockPattern, matrix: &mut BlockMatrix, row: usize, a: usize, terms: &Terms) {
    for (position, &column) in pattern.row_range(row).zip(pattern.row(row)) {
        let block = matrix.values()[position];
        let entries = [block[3 * a], block[3 * a + 1], block[3 * a + 2]];
        for &(i, c) in terms.iter().filter(|_| entries != [0.0; 3]) {
            let mut added = [0.0; 9];
            (0..3).for_each(|b| added[3 * (i as usize % 3) + b] = c * entries[b]);
            matrix.add(i as usize / 3, column as usize, &added);
        }
    }
}

fn add(block: &mut [f64; 9], factor: f64, other: &[f64; 9]) {
    block.iter_mut().zip(other).for_each(|(to, x)| *to += factor * x);
}

fn outside(row: usize, column: u32) -> usize {
    panic!("block ({row}, {column}) is outside the sparsity pattern: `couple` lists it")
}
