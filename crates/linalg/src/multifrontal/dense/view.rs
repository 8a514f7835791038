//! Views of dense matrices.
//!
//! Blocks of rows of a column-major matrix interleave in memory, so slices cannot separate them.
//! The views below hold a pointer instead; they can only be divided into disjoint parts.

use std::marker::PhantomData;

/// Matrix that is read: entry (i, j) is i · `row_stride` + j · `column_stride` numbers away from the first.
pub struct View<'a, T> {
    data: *const T,
    rows: usize,
    columns: usize,
    row_stride: usize,
    column_stride: usize,
    lifetime: PhantomData<&'a [T]>,
}

/// Column-major matrix that is written: columns are `stride` numbers apart.
pub struct ViewMut<'a, T> {
    data: *mut T,
    rows: usize,
    columns: usize,
    stride: usize,
    lifetime: PhantomData<&'a mut [T]>,
}

// SAFETY: these are borrows of slices, of which each entry belongs to one mutable view only.
unsafe impl<T: Sync> Send for View<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for View<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for ViewMut<'_, T> {}

impl<T> Clone for View<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for View<'_, T> {}

impl<'a, T: Copy> View<'a, T> {
    /// A column-major matrix.
    pub fn new(values: &'a [T], rows: usize, columns: usize) -> Self {
        assert_eq!(values.len(), rows * columns);
        let data = values.as_ptr();
        Self { data, rows, columns, row_stride: 1, column_stride: rows, lifetime: PhantomData }
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn columns(&self) -> usize {
        self.columns
    }

    pub fn row_stride(&self) -> usize {
        self.row_stride
    }

    pub fn column_stride(&self) -> usize {
        self.column_stride
    }

    pub fn transpose(self) -> Self {
        let (rows, columns) = (self.columns, self.rows);
        Self { rows, columns, row_stride: self.column_stride, column_stride: self.row_stride, ..self }
    }

    /// `rows` rows and `columns` columns from row `i` and column `j` on.
    pub fn block(self, i: usize, j: usize, rows: usize, columns: usize) -> Self {
        assert!(i + rows <= self.rows && j + columns <= self.columns);
        // an empty block has no address; its offset could lie outside the slice
        let offset = if rows == 0 || columns == 0 { 0 } else { i * self.row_stride + j * self.column_stride };
        Self { data: self.data.wrapping_add(offset), rows, columns, ..self }
    }

    pub fn row_range(self, first: usize, count: usize) -> Self {
        self.block(first, 0, count, self.columns)
    }

    /// Address of the first entry.
    pub fn pointer(&self) -> *const T {
        self.data
    }

    #[inline(always)]
    pub fn get(&self, i: usize, j: usize) -> T {
        assert!(i < self.rows && j < self.columns);
        // SAFETY: within the bounds.
        unsafe { *self.data.add(i * self.row_stride + j * self.column_stride) }
    }
}

impl<'a, T: Copy> ViewMut<'a, T> {
    /// A column-major matrix.
    pub fn new(values: &'a mut [T], rows: usize, columns: usize) -> Self {
        assert_eq!(values.len(), rows * columns);
        Self { data: values.as_mut_ptr(), rows, columns, stride: rows, lifetime: PhantomData }
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn columns(&self) -> usize {
        self.columns
    }

    pub fn stride(&self) -> usize {
        self.stride
    }

    /// The same matrix for a shorter time.
    pub fn borrow(&mut self) -> ViewMut<'_, T> {
        ViewMut { lifetime: PhantomData, ..*self }
    }

    /// To read.
    pub fn read(&self) -> View<'_, T> {
        let (rows, columns) = (self.rows, self.columns);
        View { data: self.data, rows, columns, row_stride: 1, column_stride: self.stride, lifetime: PhantomData }
    }

    fn part(&self, i: usize, j: usize, rows: usize, columns: usize) -> Self {
        let offset = if rows == 0 || columns == 0 { 0 } else { i + j * self.stride };
        Self { data: self.data.wrapping_add(offset), rows, columns, ..*self }
    }

    /// The rows before `row`, and the others.
    pub fn split_rows(self, row: usize) -> (Self, Self) {
        assert!(row <= self.rows);
        (self.part(0, 0, row, self.columns), self.part(row, 0, self.rows - row, self.columns))
    }

    /// The columns before `column`, and the others.
    pub fn split_columns(self, column: usize) -> (Self, Self) {
        assert!(column <= self.columns);
        (self.part(0, 0, self.rows, column), self.part(0, column, self.rows, self.columns - column))
    }

    /// Blocks of `count` rows; the last may have fewer.
    pub fn row_blocks(self, count: usize) -> Vec<Self> {
        let blocks = (0..self.rows).step_by(count);
        blocks.map(|i| self.part(i, 0, count.min(self.rows - i), self.columns)).collect()
    }

    /// Blocks of `count` columns; the last may have fewer.
    pub fn column_blocks(self, count: usize) -> Vec<Self> {
        let blocks = (0..self.columns).step_by(count);
        blocks.map(|j| self.part(0, j, self.rows, count.min(self.columns - j))).collect()
    }

    /// Address of the first entry.
    pub fn pointer(&mut self) -> *mut T {
        self.data
    }

    pub fn column(&mut self, j: usize) -> &mut [T] {
        assert!(j < self.columns);
        if self.rows == 0 {
            return &mut [];
        }
        // SAFETY: a column is contiguous, and the view owns it.
        unsafe { std::slice::from_raw_parts_mut(self.data.add(j * self.stride), self.rows) }
    }

    /// Two columns, `i` before `j`.
    pub fn two_columns(&mut self, i: usize, j: usize) -> (&mut [T], &mut [T]) {
        assert!(i < j && j < self.columns);
        if self.rows == 0 {
            return (&mut [], &mut []);
        }
        // SAFETY: columns are contiguous, disjoint, and the view owns both.
        unsafe {
            let slice = |k: usize| std::slice::from_raw_parts_mut(self.data.add(k * self.stride), self.rows);
            (slice(i), slice(j))
        }
    }
}
