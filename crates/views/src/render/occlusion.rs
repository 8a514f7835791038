//! How much surfaces shade each other, from their depths in the picture.
//!
//! Horizon-based ambient occlusion (Bavoil and Sainz, 2008): along several directions in the picture, the
//! surface that rises highest above the tangent plane of a pixel hides a part of the sky. It makes holes, inner
//! corners and undersides legible.

use rayon::prelude::*;

/// Depth of the nearest face at every pixel, row by row; infinite where there is none. \[pixels\]
pub(super) struct Depths {
    pub columns: usize,
    pub depth: Vec<f32>,
}

/// Directions in which the horizon is searched.
const DIRECTIONS: usize = 16;

/// Distances in each direction.
const STEPS: usize = 8;

/// Sine of the elevation below which nothing hides the sky: faces of a curved surface are not shaded by their
/// neighbours.
const FLAT: f32 = 0.08;

/// Part of the light that a pixel without sky loses.
const STRENGTH: f32 = 0.75;

/// Part of the light that reaches every pixel, 1 where no surface within `radius` hides the sky. \[pixels\]
pub(super) fn openness(depths: &Depths, radius: f64) -> Vec<f32> {
    let rays: Vec<Vec<(isize, isize)>> = (0..DIRECTIONS).map(|k| ray(k, radius)).collect();
    let rows = depths.depth.len() / depths.columns.max(1);
    let pixels = (0..rows * depths.columns).into_par_iter();
    pixels.map(|i| 1.0 - STRENGTH * depths.hidden(i, &rays, radius as f32)).collect()
}

/// Offsets of the pixels along a direction, denser near the start.
fn ray(direction: usize, radius: f64) -> Vec<(isize, isize)> {
    let (y, x) = (std::f64::consts::TAU * direction as f64 / DIRECTIONS as f64).sin_cos();
    let at = |step: usize| {
        let r = radius * (step as f64 / STEPS as f64).powf(1.5);
        ((r * x).round() as isize, (r * y).round() as isize)
    };
    let mut offsets: Vec<(isize, isize)> = (1..=STEPS).map(at).filter(|offset| *offset != (0, 0)).collect();
    offsets.dedup();
    offsets
}

impl Depths {
    /// The depth at an offset from a pixel; infinite outside the picture.
    fn at(&self, i: usize, (dx, dy): (isize, isize)) -> f32 {
        let (x, y) = ((i % self.columns) as isize + dx, (i / self.columns) as isize + dy);
        if x < 0 || x >= self.columns as isize || y < 0 {
            return f32::INFINITY;
        }
        self.depth.get(y as usize * self.columns + x as usize).copied().unwrap_or(f32::INFINITY)
    }

    /// Slope of the depth along a direction: of the side that is flatter, so that contours do not count.
    fn slope(&self, i: usize, (dx, dy): (isize, isize)) -> f32 {
        let here = self.depth[i];
        let (forward, backward) = (self.at(i, (dx, dy)) - here, here - self.at(i, (-dx, -dy)));
        let slope = if forward.abs() < backward.abs() { forward } else { backward };
        if slope.is_finite() { slope } else { 0.0 }
    }

    /// Part of the sky that is hidden at a pixel.
    fn hidden(&self, i: usize, rays: &[Vec<(isize, isize)>], radius: f32) -> f32 {
        let here = self.depth[i];
        if !here.is_finite() {
            return 0.0;
        }
        let (gx, gy) = (self.slope(i, (1, 0)), self.slope(i, (0, 1)));
        let length = (1.0 + gx * gx + gy * gy).sqrt();
        let rise = |&(dx, dy): &(isize, isize)| {
            let there = self.at(i, (dx, dy));
            if !there.is_finite() {
                return 0.0;
            }
            let (x, y, z) = (dx as f32, dy as f32, there - here);
            let (height, distance) = ((gx * x + gy * y - z) / length, (x * x + y * y + z * z).sqrt());
            let near = (1.0 - (distance / radius).powi(2)).max(0.0);
            near * ((height / distance - FLAT) / (1.0 - FLAT)).max(0.0)
        };
        rays.iter().map(|ray| ray.iter().map(rise).fold(0.0, f32::max)).sum::<f32>() / rays.len() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An inclined plane hides no sky; the foot of a step loses what the step hides, and its upper edge loses
    /// none.
    #[test]
    fn planes_are_open_and_the_feet_of_steps_are_not() {
        let columns = 81;
        let of = |depth: &dyn Fn(usize) -> f32| {
            let depth = (0..columns * columns).map(|i| depth(i % columns)).collect();
            openness(&Depths { columns, depth }, 20.0)
        };
        let middle = |open: &[f32], x: usize| open[40 * columns + x];
        assert_eq!(middle(&of(&|x| 0.7 * x as f32), 40), 1.0);
        let step = of(&|x| if x < 40 { 100.0 } else { 90.0 });
        assert!(middle(&step, 39) < 0.85 && middle(&step, 20) > 0.99, "{} {}", middle(&step, 39), middle(&step, 20));
        assert_eq!(middle(&step, 41), 1.0);
    }
}
