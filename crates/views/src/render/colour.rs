//! Colours, perceptually uniform colour maps, and scales from values to colours.

use super::RenderError;
use super::error::check_finite;

/// A colour in sRGB, red, green, blue from 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub [u8; 3]);

impl Colour {
    /// White, the background.
    pub const WHITE: Self = Self([255; 3]);
    /// Text and axes.
    pub const INK: Self = Self([34, 38, 46]);
    /// Context: boxes, grids.
    pub const GREY: Self = Self([138, 145, 156]);
    /// The material of a design.
    pub const MATERIAL: Self = Self([216, 206, 190]);
    /// A body that is only context.
    pub const GLASS: Self = Self([126, 142, 168]);

    /// Linear light intensities, 0 to 1.
    pub(super) fn linear(self) -> [f32; 3] {
        self.0.map(|v| to_linear(f64::from(v) / 255.0) as f32)
    }
}

/// The decoding of sRGB, IEC 61966-2-1.
fn to_linear(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The encoding of sRGB, IEC 61966-2-1, rounded to a byte.
pub(super) fn to_byte(light: f32) -> u8 {
    let v = f64::from(light).clamp(0.0, 1.0);
    let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

/// A colour map from [0, 1] to colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMap {
    /// Dark violet through green to yellow; perceptually uniform, also in print and for
    /// colour-blind readers. By N. Smith and S. van der Walt for matplotlib (CC0): every 15th of
    /// its 256 colours, linear between them.
    #[default]
    Viridis,
    /// Viridis reversed, from yellow to dark violet, so that high values stand out against a white
    /// background.
    ViridisReversed,
    /// Light grey at the lowest values, for magnitudes whose zero means that there is nothing, then as
    /// `ViridisReversed`.
    ViridisFromGrey,
    /// Blue through light grey to red, for values with a meaningful midpoint. K. Moreland,
    /// Diverging Color Maps for Scientific Visualization, ISVC 2009: his 33 published colours,
    /// linear between them.
    CoolWarm,
}

impl ColourMap {
    /// Names that [`named`](Self::named) accepts.
    pub const NAMES: [&'static str; 4] = ["viridis", "viridis_reversed", "viridis_from_grey", "cool_warm"];

    /// The map with a name from [`NAMES`](Self::NAMES).
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "viridis" => Some(Self::Viridis),
            "viridis_reversed" => Some(Self::ViridisReversed),
            "viridis_from_grey" => Some(Self::ViridisFromGrey),
            "cool_warm" => Some(Self::CoolWarm),
            _ => None,
        }
    }

    /// Whether the map has a distinct midpoint.
    pub fn is_diverging(self) -> bool {
        self == Self::CoolWarm
    }

    /// The colour at `t`; outside [0, 1], the colour of the nearer end.
    pub fn at(self, t: f64) -> Colour {
        let t = t.clamp(0.0, 1.0);
        let mixed = match self {
            Self::Viridis => mix(&VIRIDIS, t),
            Self::ViridisReversed => mix(&VIRIDIS, 1.0 - t),
            Self::ViridisFromGrey => {
                let grey = (1.0 - t / GREY_END).max(0.0);
                let of = mix(&VIRIDIS, 1.0 - t);
                std::array::from_fn(|c| grey * NOTHING + (1.0 - grey) * of[c])
            }
            Self::CoolWarm => mix(&COOL_WARM, t).map(|v| v / 255.0),
        };
        Colour(mixed.map(|v| (255.0 * v).round() as u8))
    }
}

/// The grey of zero, sRGB from 0 to 1, and the part of the scale over which it fades.
const NOTHING: f64 = 0.92;
const GREY_END: f64 = 0.12;

fn mix(table: &[[f64; 3]], t: f64) -> [f64; 3] {
    let at = t * (table.len() - 1) as f64;
    let i = (at as usize).min(table.len() - 2);
    let f = at - i as f64;
    std::array::from_fn(|c| (1.0 - f) * table[i][c] + f * table[i + 1][c])
}

/// The assignment of colours to values, with the title of the colour bar.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourScale {
    title: String,
    map: ColourMap,
    range: [f64; 2],
}

impl ColourScale {
    /// The scale whose colours run from `range[0]` to `range[1]`; values outside have the colour of
    /// the nearer end.
    ///
    /// # Errors
    /// [`RenderError::Range`] unless the range is finite and ascending.
    pub fn new(title: impl Into<String>, map: ColourMap, range: [f64; 2]) -> Result<Self, RenderError> {
        let title = title.into();
        let [low, high] = range;
        if !(low.is_finite() && high.is_finite() && low < high && (high - low).is_finite()) {
            return Err(RenderError::Range { title, low, high });
        }
        Ok(Self { title, map, range })
    }

    /// The scale that covers the values: from the smallest to the largest, symmetric about 0 for a
    /// diverging map; if all values are equal or there are none, an interval around them.
    ///
    /// # Errors
    /// [`RenderError::NotFinite`].
    pub fn covering(
        title: impl Into<String>,
        map: ColourMap,
        values: impl IntoIterator<Item = f64>,
    ) -> Result<Self, RenderError> {
        let title = title.into();
        let values: Vec<f64> = values.into_iter().collect();
        check_finite(&title, values.iter().copied())?;
        let (mut low, mut high) = match values.split_first() {
            Some((first, rest)) => rest.iter().fold((*first, *first), |(a, b), v| (a.min(*v), b.max(*v))),
            None => (0.0, 0.0),
        };
        if map.is_diverging() {
            high = high.abs().max(low.abs());
            low = -high;
        }
        // Smaller differences are noise in the last digits and get no colours.
        let least = 1e-9 * low.abs().max(high.abs());
        if high - low <= least {
            let half = if low == 0.0 { 0.5 } else { 0.1 * low.abs() };
            (low, high) = (low - half, high + half);
        }
        Self::new(title, map, [low, high])
    }

    /// Title of the colour bar.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Values at the ends of the colours.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The colour of a value.
    pub fn colour(&self, value: f64) -> Colour {
        self.map.at((value - self.range[0]) / (self.range[1] - self.range[0]))
    }
}

/// A colour scale as a table of light intensities, for fast look-up.
#[derive(Debug, Clone)]
pub(super) struct Palette {
    low: f64,
    per_value: f64,
    table: Vec<[f32; 3]>,
}

impl Palette {
    const STEPS: usize = 512;

    pub fn scale(scale: &ColourScale) -> Self {
        let [low, high] = scale.range;
        let table = (0..=Self::STEPS).map(|i| scale.map.at(i as f64 / Self::STEPS as f64).linear()).collect();
        Self { low, per_value: Self::STEPS as f64 / (high - low), table }
    }

    /// One colour for all values.
    pub fn plain(colour: Colour) -> Self {
        Self { low: 0.0, per_value: 0.0, table: vec![colour.linear()] }
    }

    pub fn light(&self, value: f64) -> [f32; 3] {
        let at = ((value - self.low) * self.per_value).round();
        self.table[(at.max(0.0) as usize).min(self.table.len() - 1)]
    }
}

/// Every 15th colour of viridis, sRGB from 0 to 1.
const VIRIDIS: [[f64; 3]; 18] = [
    [0.267004, 0.004874, 0.329415],
    [0.281924, 0.089666, 0.412415],
    [0.280255, 0.165693, 0.476498],
    [0.263663, 0.237631, 0.518762],
    [0.237441, 0.305202, 0.541921],
    [0.208623, 0.367752, 0.552675],
    [0.182256, 0.426184, 0.557120],
    [0.159194, 0.482237, 0.558073],
    [0.137770, 0.537492, 0.554906],
    [0.121148, 0.592739, 0.544641],
    [0.128087, 0.647749, 0.523491],
    [0.180653, 0.701402, 0.488189],
    [0.274149, 0.751988, 0.436601],
    [0.395174, 0.797475, 0.367757],
    [0.535621, 0.835785, 0.281908],
    [0.688944, 0.865448, 0.182725],
    [0.845561, 0.887322, 0.099702],
    [0.993248, 0.906157, 0.143936],
];

/// Moreland's cool-warm map, sRGB from 0 to 255.
const COOL_WARM: [[f64; 3]; 33] = [
    [59.0, 76.0, 192.0],
    [68.0, 90.0, 204.0],
    [77.0, 104.0, 215.0],
    [87.0, 117.0, 225.0],
    [98.0, 130.0, 234.0],
    [108.0, 142.0, 241.0],
    [119.0, 154.0, 247.0],
    [130.0, 165.0, 251.0],
    [141.0, 176.0, 254.0],
    [152.0, 185.0, 255.0],
    [163.0, 194.0, 255.0],
    [174.0, 201.0, 253.0],
    [184.0, 208.0, 249.0],
    [194.0, 213.0, 244.0],
    [204.0, 217.0, 238.0],
    [213.0, 219.0, 230.0],
    [221.0, 221.0, 221.0],
    [229.0, 216.0, 209.0],
    [236.0, 211.0, 197.0],
    [241.0, 204.0, 185.0],
    [245.0, 196.0, 173.0],
    [247.0, 187.0, 160.0],
    [247.0, 177.0, 148.0],
    [247.0, 166.0, 135.0],
    [244.0, 154.0, 123.0],
    [241.0, 141.0, 111.0],
    [236.0, 127.0, 99.0],
    [229.0, 112.0, 88.0],
    [222.0, 96.0, 77.0],
    [213.0, 80.0, 66.0],
    [203.0, 62.0, 56.0],
    [192.0, 40.0, 47.0],
    [180.0, 4.0, 38.0],
];
