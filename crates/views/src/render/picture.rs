//! A finished picture.

use std::io::Write;
use std::path::Path;

use super::RenderError;
use super::raster::Drawing;
use slipstick_results::output::write_atomically;

/// An RGB picture of 8 bits per channel (sRGB), on a white background.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<u8>,
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Picture({} x {})", self.width, self.height)
    }
}

impl Picture {
    pub(super) fn draw(drawing: &Drawing) -> Self {
        Self { width: drawing.width as u32, height: drawing.height as u32, pixels: drawing.pixels() }
    }

    /// \[pixels\]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// \[pixels\]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Red, green and blue of the pixel in column `x` and row `y` from the upper left corner;
    /// `None` outside.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let at = 3 * (y as usize * self.width as usize + x as usize);
        Some([self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]])
    }

    /// Red, green and blue of all pixels, row by row from the upper left corner.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Pictures side by side, from left to right, centred on the height of the tallest one.
    ///
    /// # Errors
    /// [`RenderError::Size`] if there are no pictures, or if their total width is too large.
    pub fn beside(pictures: &[Self]) -> Result<Self, RenderError> {
        let width = pictures.iter().fold(0u32, |sum, p| sum.saturating_add(p.width));
        let height = pictures.iter().map(|p| p.height).max().unwrap_or(0);
        check_size(width, height)?;
        let mut pixels = vec![255; 3 * width as usize * height as usize];
        let mut left = 0;
        for picture in pictures {
            let top = (height - picture.height) as usize / 2;
            let row_length = 3 * picture.width as usize;
            for (y, row) in picture.pixels.chunks_exact(row_length).enumerate() {
                let at = 3 * ((top + y) * width as usize + left);
                pixels[at..at + row_length].copy_from_slice(row);
            }
            left += picture.width as usize;
        }
        Ok(Self { width, height, pixels })
    }

    /// Pictures of the same size in rows of `columns`, from the upper left; the last row may be shorter.
    ///
    /// # Errors
    /// [`RenderError::Size`] if there are no pictures, or if the whole is too large.
    pub fn grid(pictures: &[Self], columns: usize) -> Result<Self, RenderError> {
        let (columns, side) =
            (columns.max(1) as u32, |of: fn(&Self) -> u32| pictures.iter().map(of).max().unwrap_or(0));
        let (width, height) = (side(|p| p.width), side(|p| p.height));
        let rows = (pictures.len() as u32).div_ceil(columns);
        let (whole, total) = (width.saturating_mul(columns), height.saturating_mul(rows));
        check_size(whole, total)?;
        let mut pixels = vec![255; 3 * whole as usize * total as usize];
        for (number, picture) in pictures.iter().enumerate() {
            let (left, top) = (number as u32 % columns * width, number as u32 / columns * height);
            for (y, row) in picture.pixels.chunks_exact(3 * picture.width as usize).enumerate() {
                let at = 3 * ((top as usize + y) * whole as usize + left as usize);
                pixels[at..at + row.len()].copy_from_slice(row);
            }
        }
        Ok(Self { width: whole, height: total, pixels })
    }

    /// The picture as a PNG file's bytes: the same picture gives the same bytes.
    ///
    /// # Errors
    /// [`RenderError::Encode`].
    pub fn png(&self) -> Result<Vec<u8>, RenderError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Writes the picture as a PNG file, atomically.
    ///
    /// # Errors
    /// [`RenderError::Encode`], [`RenderError::Output`].
    pub fn save_png(&self, path: &Path) -> Result<(), RenderError> {
        let bytes = self.png()?;
        Ok(write_atomically(path, |writer: &mut dyn Write| writer.write_all(&bytes))?)
    }
}

/// Maximum number of pixels in either direction.
const LIMIT: u32 = 16_384;

pub(super) fn check_size(width: u32, height: u32) -> Result<(), RenderError> {
    if (1..=LIMIT).contains(&width) && (1..=LIMIT).contains(&height) {
        Ok(())
    } else {
        Err(RenderError::Size { width, height, limit: LIMIT })
    }
}

/// Maximum number of samples per pixel and direction.
const MOST_SAMPLES: u32 = 8;

/// Size and smoothness of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Canvas {
    /// \[pixels\]
    pub width: u32,
    /// \[pixels\]
    pub height: u32,
    /// Samples per pixel and direction, 1 to 8: a higher number gives smoother edges; the time
    /// grows with its square.
    pub supersampling: u32,
}

impl Default for Canvas {
    /// 900 × 720 pixels of 3 × 3 samples.
    fn default() -> Self {
        Self { width: 900, height: 720, supersampling: 3 }
    }
}

impl Canvas {
    pub(super) fn check(&self) -> Result<(), RenderError> {
        check_size(self.width, self.height)?;
        if (1..=MOST_SAMPLES).contains(&self.supersampling) {
            Ok(())
        } else {
            Err(RenderError::Supersampling { found: self.supersampling, limit: MOST_SAMPLES })
        }
    }

    /// An empty drawing of this size.
    pub(super) fn drawing(&self) -> Drawing {
        Drawing {
            width: self.width as usize,
            height: self.height as usize,
            samples: self.supersampling as usize,
            sheets: Vec::new(),
            lift: 0.0,
            occlusion: 0.0,
            inks: Vec::new(),
        }
    }

    /// Suitable size of text for this picture, as one seventh of the height of capitals. \[pixels\]
    pub(super) fn unit(&self) -> f64 {
        (f64::from(self.height.min(self.width)) / 380.0).clamp(1.1, 8.0)
    }
}
