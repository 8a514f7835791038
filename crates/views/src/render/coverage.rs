//! The part of each pixel that lies within an outline.

/// Pixels around an outline and how much of each it covers.
pub(super) struct Coverage {
    /// Column of the first pixel.
    pub left: i64,
    /// Row of the first pixel.
    pub top: i64,
    /// Pixels in a row.
    pub columns: usize,
    /// 0 to 1, row by row.
    pub cover: Vec<f32>,
}

impl Coverage {
    /// The coverage by closed polygons, of which inner ones run against outer ones. Exact: each edge adds the signed
    /// area to its right, pixel by pixel, and a sum along each row completes it. \[pixels\]
    pub fn of(contours: &[Vec<[f64; 2]>]) -> Self {
        let points = || contours.iter().flatten();
        let [left, top] = [0, 1].map(|c| points().fold(f64::INFINITY, |low, p| low.min(p[c])).floor());
        let [right, bottom] = [0, 1].map(|c| points().fold(f64::NEG_INFINITY, |high, p| high.max(p[c])).ceil());
        if !(left < right && top < bottom && right - left < 1e4 && bottom - top < 1e4) {
            return Self { left: 0, top: 0, columns: 1, cover: Vec::new() };
        }
        // one more column than pixels, for the area to the right of the last one
        let (columns, rows) = ((right - left) as usize, (bottom - top) as usize);
        let mut edges = Edges { stride: columns + 2, area: vec![0.0; (columns + 2) * rows] };
        for contour in contours {
            for (k, a) in contour.iter().enumerate() {
                let b = contour[(k + 1) % contour.len()];
                edges.add([a[0] - left, a[1] - top], [b[0] - left, b[1] - top]);
            }
        }
        let mut cover = Vec::with_capacity(columns * rows);
        for row in edges.area.chunks(columns + 2) {
            let mut sum = 0.0;
            cover.extend(row[..columns].iter().map(|area| {
                sum += area;
                sum.abs().min(1.0) as f32
            }));
        }
        Self { left: left as i64, top: top as i64, columns, cover }
    }
}

/// Changes of the covered area from one pixel to the next.
struct Edges {
    stride: usize,
    area: Vec<f64>,
}

impl Edges {
    fn add(&mut self, a: [f64; 2], b: [f64; 2]) {
        let (sign, from, to) = if a[1] < b[1] { (1.0, a, b) } else { (-1.0, b, a) };
        if from[1] == to[1] {
            return;
        }
        let slope = (to[0] - from[0]) / (to[1] - from[1]);
        let rows = self.area.len() / self.stride;
        for row in (from[1] as usize)..(to[1].ceil() as usize).min(rows) {
            let (start, end) = (from[1].max(row as f64), to[1].min(row as f64 + 1.0));
            let at = |y: f64| from[0] + (y - from[1]) * slope;
            let (left, right) = (at(start).min(at(end)), at(start).max(at(end)));
            self.part(row, sign * (end - start), left, right);
        }
    }

    /// Adds a piece of an edge within a row, which runs from `left` to `right` and is `height` high.
    fn part(&mut self, row: usize, height: f64, left: f64, right: f64) {
        let (first, last) = (left.max(0.0) as usize, right.max(0.0) as usize);
        let mut before = 0.0;
        for column in first..=last.min(self.stride - 2) {
            // the mean over the piece of the part of this column and those before it that lie to the right
            let (low, high) = (left.max(column as f64), right.min(column as f64 + 1.0));
            let through = if right > left { (high - low) / (right - left) } else { 1.0 };
            let done = if right > left { (low - left) / (right - left) } else { 0.0 };
            let covered = done + through * (column as f64 + 1.0 - 0.5 * (low + high));
            self.area[row * self.stride + column] += height * (covered - before);
            before = covered;
        }
        self.area[row * self.stride + last.min(self.stride - 2) + 1] += height * (1.0 - before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed by hand: a rectangle that covers parts of pixels, one with a hole, and a triangle.
    #[test]
    fn pixels_are_covered_by_their_parts() {
        let rectangle = |[x, y]: [f64; 2], [w, h]: [f64; 2]| vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
        let found = Coverage::of(&[rectangle([10.25, -3.0], [2.0, 1.5])]);
        assert_eq!((found.left, found.top, found.columns), (10, -3, 3));
        assert_eq!(found.cover, [0.75, 1.0, 0.25, 0.375, 0.5, 0.125]);
        let mut hole = rectangle([1.0, 1.0], [1.0, 1.0]);
        hole.reverse();
        let found = Coverage::of(&[rectangle([0.0, 0.0], [3.0, 3.0]), hole]);
        assert_eq!(found.cover, [1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        let found = Coverage::of(&[vec![[0.0, 0.0], [4.0, 2.0], [0.0, 2.0]]]);
        assert_eq!(found.cover, [0.75, 0.25, 0.0, 0.0, 1.0, 1.0, 0.75, 0.25]);
        assert!(Coverage::of(&[]).cover.is_empty());
    }

    /// The sum over the pixels is the area of the outline, wherever it lies.
    #[test]
    fn areas_are_kept() {
        for shift in [0.0, 0.3, 0.77] {
            let circle = (0..40).map(|k| (f64::from(k) * std::f64::consts::TAU / 40.0).sin_cos());
            let circle: Vec<[f64; 2]> = circle.map(|(y, x)| [5.0 * x + shift, 5.0 * y - 0.5 * shift]).collect();
            let sum: f32 = Coverage::of(&[circle]).cover.iter().sum();
            let area = 0.5 * 25.0 * 40.0 * (std::f64::consts::TAU / 40.0).sin();
            assert!((f64::from(sum) - area).abs() < 1e-4, "{sum} instead of {area}");
        }
    }
}
