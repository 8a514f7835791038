//! Collects nodes and cells by the file's own numbers while reading.

use crate::file_mesh::Cells;
use crate::{CellKind, FileMesh, MeshFileError};

/// Positions of items by their numbers in the file.
#[derive(Debug, Default)]
pub(crate) struct Numbers {
    /// Ascending.
    sorted: Vec<(u64, u32)>,
}

impl Numbers {
    /// Index of items in the order of the file; the error is a number that appears twice.
    pub fn new(numbers: &[u64]) -> Result<Self, u64> {
        let mut sorted: Vec<(u64, u32)> = numbers.iter().copied().zip(0..).collect();
        sorted.sort_unstable();
        match sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => Err(pair[0].0),
            None => Ok(Self { sorted }),
        }
    }

    /// The position of the item with this number.
    pub fn position(&self, number: u64) -> Option<u32> {
        // Most files number without gaps.
        let first = self.sorted.first()?.0;
        let guess = usize::try_from(number.checked_sub(first)?).ok();
        if let Some(&(found, position)) = guess.and_then(|guess| self.sorted.get(guess))
            && found == number
        {
            return Some(position);
        }
        let at = self.sorted.binary_search_by_key(&number, |&(number, _)| number).ok()?;
        Some(self.sorted[at].1)
    }

    /// Positions of all numbers from `first` to `last`, in ascending order of the numbers.
    pub fn range(&self, first: u64, last: u64) -> impl Iterator<Item = (u64, u32)> {
        let start = self.sorted.partition_point(|&(number, _)| number < first);
        self.sorted[start..].iter().copied().take_while(move |&(number, _)| number <= last)
    }
}

/// Collects nodes and cells.
#[derive(Debug, Default)]
pub(crate) struct Builder {
    pub points: Vec<[f64; 3]>,
    pub point_numbers: Vec<u64>,
    pub kinds: Vec<CellKind>,
    pub cell_numbers: Vec<u64>,
    /// Numbers of the cells' nodes, one cell after the other.
    pub nodes: Vec<u64>,
}

impl Builder {
    pub fn point(&mut self, number: u64, x: [f64; 3]) {
        self.points.push(x);
        self.point_numbers.push(number);
    }

    /// Begins a cell, whose nodes are then pushed to `nodes`; returns its position.
    pub fn cell(&mut self, kind: CellKind, number: u64) -> u32 {
        self.kinds.push(kind);
        self.cell_numbers.push(number);
        (self.kinds.len() - 1) as u32
    }

    /// The mesh without sets, and the index of its node numbers.
    ///
    /// # Errors
    /// If a node number appears twice, if a cell refers to a node that does not exist, or if there
    /// are more nodes or cells than 32 bits can count.
    pub fn finish(self) -> Result<(FileMesh, Numbers), MeshFileError> {
        if u32::try_from(self.points.len().max(self.kinds.len())).is_err() {
            let message = "there are more than 4,294,967,295 nodes or elements";
            return Err(MeshFileError::new("the file", message, "use a coarser mesh"));
        }
        let numbers = Numbers::new(&self.point_numbers).map_err(|number| {
            let message = "the node is defined twice";
            MeshFileError::new(format!("node {number}"), message, "give each node a unique number")
        })?;
        let mut cells = Cells { kinds: self.kinds, offsets: vec![0], nodes: vec![], numbers: self.cell_numbers };
        cells.offsets.reserve(cells.kinds.len());
        cells.nodes.reserve(self.nodes.len());
        for (kind, &number) in cells.kinds.iter().zip(&cells.numbers) {
            let start = cells.nodes.len();
            for &node in self.nodes.iter().skip(start).take(kind.node_count()) {
                let position = numbers.position(node).ok_or_else(|| {
                    let message = format!("node {node} of the {} is not in the file", kind.name());
                    MeshFileError::new(format!("element {number}"), message, "write the file with all its nodes")
                })?;
                cells.nodes.push(position);
            }
            cells.offsets.push(start + kind.node_count());
        }
        let Self { points, point_numbers, .. } = self;
        Ok((FileMesh { points, point_numbers, cells, ..FileMesh::default() }, numbers))
    }
}
