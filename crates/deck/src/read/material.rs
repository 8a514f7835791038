//! Materials.

use slipstick_meshio::abaqus::Card;

use super::Reader;

/// `*MATERIAL`, with the lines of its options.
#[derive(Debug, Default)]
pub struct Material {
    pub elastic: Option<(Elastic, usize)>,
    pub hyperelastic: Option<(Hyperelastic, usize)>,
    /// Yield stresses and plastic strains.
    pub plastic: Option<(Vec<[f64; 2]>, usize)>,
    pub density: Option<f64>,
    /// Coefficient of thermal expansion.
    pub expansion: Option<f64>,
    /// Constants that depend on temperature; those above are of the first row.
    pub tables: Vec<Tabled>,
    /// Whether an option is refused, which has its own message.
    pub refused: bool,
    pub line: usize,
}

/// Constants that depend on temperature.
#[derive(Debug)]
pub struct Tabled {
    pub of: TableOf,
    /// Ascending temperatures with the constants there.
    pub rows: Vec<(f64, Vec<f64>)>,
    pub line: usize,
}

/// Whose constants they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TableOf {
    Elastic,
    Density,
    /// With the temperature of no expansion.
    Expansion {
        zero: f64,
    },
}

impl Tabled {
    /// The constants at a temperature: linear in between, constant beyond the first and the last row.
    pub fn at(&self, temperature: f64) -> Vec<f64> {
        let next = self.rows.partition_point(|(at, _)| *at <= temperature);
        let (before, after) = (next.max(1) - 1, next.min(self.rows.len() - 1));
        let ((a, from), (b, to)) = (&self.rows[before], &self.rows[after]);
        let share = if a == b { 0.0 } else { (temperature - a) / (b - a) };
        from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect()
    }
}

/// Constants of `*ELASTIC`.
#[derive(Debug)]
pub enum Elastic {
    Isotropic {
        youngs_modulus: f64,
        poisson_ratio: f64,
    },
    /// E₁, E₂, E₃, ν₁₂, ν₁₃, ν₂₃, G₁₂, G₁₃, G₂₃.
    Orthotropic([f64; 9]),
}

/// Constants of `*HYPERELASTIC`; D is 2/K.
#[derive(Debug)]
pub enum Hyperelastic {
    NeoHooke { c10: f64, d1: f64 },
    MooneyRivlin { c10: f64, c01: f64, d1: f64 },
    Yeoh { c: [f64; 3], d1: f64 },
    Ogden { terms: Vec<[f64; 2]>, d1: f64 },
}

/// Options of a material that mean nothing without temperatures and inertia, and those.
const IDLE: &[(&str, &str)] = &[
    ("CONDUCTIVITY", "no temperature changes"),
    ("SPECIFIC HEAT", "no temperature changes"),
    ("DAMPING", "steps are static"),
];

const LAWS: &str = "write ELASTIC (isotropic, ORTHO or ENGINEERING CONSTANTS), HYPERELASTIC or PLASTIC";

/// Laws that are not translated.
const OTHER_LAWS: &[&str] = &[
    "CREEP",
    "CYCLIC HARDENING",
    "DEFORMATION PLASTICITY",
    "DEPVAR",
    "DRUCKER PRAGER",
    "HYPERFOAM",
    "MOHR COULOMB",
    "USER MATERIAL",
    "VISCOELASTIC",
];

impl Reader<'_> {
    /// Reads a material or one of its options.
    pub(super) fn of_material(&mut self, card: &Card<'_>) -> bool {
        let keyword = &card.keyword;
        let (name, line) = (keyword.name.as_str(), keyword.line);
        if name == "MATERIAL" {
            let material = keyword.parameter("NAME").unwrap_or_default().to_ascii_uppercase();
            if material.is_empty() {
                self.ledger.wrong(name, [line, line], "the material has no name", "add NAME=…");
            } else if self.deck.materials.contains_key(&material) {
                self.ledger.wrong(
                    name,
                    [line, line],
                    "the material is defined twice",
                    "give each material a name of its own",
                );
            }
            self.ledger.used(name, line);
            self.deck.materials.insert(material.clone(), Material { line, ..Material::default() });
            self.material = Some(material);
            return true;
        }
        if let Some((_, why)) = IDLE.iter().find(|(idle, _)| *idle == name) {
            self.ledger.ignored(name, line, *why);
            return true;
        }
        let before = self.ledger.count();
        match name {
            "ELASTIC" => self.elastic(card),
            "HYPERELASTIC" => self.hyperelastic(card),
            "PLASTIC" => self.plastic(card),
            "DENSITY" => self.density(card),
            "EXPANSION" => self.expansion(card),
            _ if OTHER_LAWS.contains(&name) => self.ledger.refuse(name, line, "this law is not supported", LAWS),
            _ => return false,
        }
        if self.ledger.count() > before {
            self.own(card).into_iter().for_each(|material| material.refused = true);
        }
        true
    }

    /// The material that an option belongs to.
    pub(super) fn own(&mut self, card: &Card<'_>) -> Option<&mut Material> {
        let material = self.material.as_ref().and_then(|name| self.deck.materials.get_mut(name));
        if material.is_none() {
            let line = card.keyword.line;
            self.ledger.wrong(
                &card.keyword.name,
                [line, line],
                "it belongs to no material",
                "write *MATERIAL before it",
            );
        }
        material
    }

    /// The only row of constants: one that depends on temperature has several.
    pub(super) fn constants(&mut self, card: &Card<'_>, count: usize) -> Option<Vec<f64>> {
        let (name, line) = (card.keyword.name.clone(), card.keyword.line);
        let rows = self.numbers(card);
        if rows.len() > 1 && rows[0].len() >= count {
            let why = "constants that depend on temperature are not supported";
            self.ledger.refuse(&name, line, why, "keep the row for the temperature of the analysis");
        }
        let mut all: Vec<f64> = if rows.first().is_some_and(|row| row.len() >= count) {
            rows.into_iter().next().unwrap_or_default()
        } else {
            rows.into_iter().flatten().collect()
        };
        if all.is_empty() {
            self.ledger.wrong(&name, [line, line], "it has no constants", "add a line of data");
            return None;
        }
        all.resize(all.len().max(count), 0.0);
        Some(all)
    }

    /// The first row of constants, each of which may be followed by a temperature; what follows from others is kept.
    pub(super) fn by_temperature(&mut self, card: &Card<'_>, count: usize, of: TableOf) -> Option<Vec<f64>> {
        let (name, line) = (card.keyword.name.clone(), card.keyword.line);
        let rows = self.numbers(card);
        if rows.len() < 2 || rows[0].len() < count {
            return self.constants(card, count);
        }
        let row = |row: &Vec<f64>| (row.get(count).copied().unwrap_or(0.0), row[..count.min(row.len())].to_vec());
        let rows: Vec<(f64, Vec<f64>)> = rows.iter().map(row).collect();
        let complete = rows.iter().all(|(_, constants)| constants.len() == count);
        if !complete || !rows.windows(2).all(|two| two[0].0 < two[1].0) {
            let why = "each row must have the constants and a temperature, and the temperatures must increase";
            self.ledger.wrong(&name, [line, line], why, super::DAMAGED);
            return None;
        }
        let first = rows[0].1.clone();
        if rows.iter().any(|(_, constants)| *constants != first) {
            self.own(card)?.tables.push(Tabled { of, rows, line });
        }
        Some(first)
    }

    fn elastic(&mut self, card: &Card<'_>) {
        self.allow(card, &["TYPE", "MODULI"]);
        let (line, of) =
            (card.keyword.line, card.keyword.parameter("TYPE").unwrap_or("ISOTROPIC").to_ascii_uppercase());
        let kind = match of.as_str() {
            "ISOTROPIC" | "ISO" => None,
            "ORTHO" | "ORTHOTROPIC" => Some(engineering as fn([f64; 9]) -> Option<[f64; 9]>),
            "ENGINEERING CONSTANTS" | "ENGINEERINGCONSTANTS" => Some(Some as fn([f64; 9]) -> Option<[f64; 9]>),
            _ => return self.ledger.refuse("ELASTIC", line, format!("TYPE={of} is not supported"), LAWS),
        };
        let elastic = match kind {
            None => {
                let Some(row) = self.by_temperature(card, 2, TableOf::Elastic) else { return };
                Elastic::Isotropic { youngs_modulus: row[0], poisson_ratio: row[1] }
            }
            Some(convert) => {
                let Some(values) = self.constants(card, 9) else { return };
                // the tenth is a temperature
                if values.len() > 10 {
                    let why = "constants that depend on temperature are not supported";
                    let cure = "keep the nine for the temperature of the analysis";
                    return self.ledger.refuse("ELASTIC", line, why, cure);
                }
                let Some(constants) = convert(std::array::from_fn(|i| values[i])) else {
                    let why = "this stiffness has no inverse";
                    return self.ledger.wrong("ELASTIC", [line, line + 1], why, "correct the constants");
                };
                Elastic::Orthotropic(constants)
            }
        };
        self.ledger.used("ELASTIC", line);
        if let Some(material) = self.own(card) {
            material.elastic = Some((elastic, line));
        }
    }

    fn density(&mut self, card: &Card<'_>) {
        let line = card.keyword.line;
        let Some(row) = self.by_temperature(card, 1, TableOf::Density) else { return };
        if row[0] < 0.0 {
            return self.ledger.wrong("DENSITY", [line, line], "the density is negative", "correct the line");
        }
        self.ledger.translated("DENSITY", line, "`mass_density`");
        if let Some(material) = self.own(card) {
            material.density = Some(row[0]).filter(|&density| density > 0.0);
        }
    }

    fn plastic(&mut self, card: &Card<'_>) {
        self.allow(card, &["HARDENING"]);
        let line = card.keyword.line;
        let hardening = card.keyword.parameter("HARDENING").unwrap_or("ISOTROPIC").to_ascii_uppercase();
        if hardening != "ISOTROPIC" {
            return self.ledger.refuse(
                "PLASTIC",
                line,
                format!("HARDENING={hardening} is not supported"),
                "use isotropic hardening",
            );
        }
        let rows = self.numbers(card);
        let table: Vec<[f64; 2]> = rows.iter().map(|row| [row[0], row.get(1).copied().unwrap_or(0.0)]).collect();
        let rises = table.windows(2).all(|rows| rows[0][1] < rows[1][1]);
        if table.first().is_none_or(|row| row[1] != 0.0) || !rises {
            let why = "plastic strains must start from 0 and rise, for one temperature";
            return self.ledger.wrong(
                "PLASTIC",
                [line, line],
                why,
                "keep the rows for the temperature of the analysis",
            );
        }
        self.ledger.translated("PLASTIC", line, "`j2_table`: J2 plasticity at finite strains, isotropic hardening");
        if let Some(material) = self.own(card) {
            material.plastic = Some((table, line));
        }
    }

    fn hyperelastic(&mut self, card: &Card<'_>) {
        let forms = ["NEO HOOKE", "MOONEY-RIVLIN", "YEOH", "OGDEN", "POLYNOMIAL", "REDUCED POLYNOMIAL"];
        self.allow(card, &[&forms[..], &["N", "MODULI"]].concat());
        let (keyword, line) = (&card.keyword, card.keyword.line);
        let terms = keyword.parameter("N").and_then(|n| n.parse().ok()).unwrap_or(1_usize);
        let reduced = keyword.has("REDUCED POLYNOMIAL");
        // without another form, the energy is a polynomial
        let polynomial = forms[..4].iter().all(|form| !keyword.has(form)) && !reduced;
        let law = if keyword.has("NEO HOOKE") || (reduced && terms == 1) {
            self.constants(card, 2).map(|c| Hyperelastic::NeoHooke { c10: c[0], d1: c[1] })
        } else if keyword.has("MOONEY-RIVLIN") || (polynomial && terms == 1) {
            self.constants(card, 3).map(|c| Hyperelastic::MooneyRivlin { c10: c[0], c01: c[1], d1: c[2] })
        } else if keyword.has("YEOH") || (reduced && terms == 3) {
            let constants = self.constants(card, 6);
            if constants.as_ref().is_some_and(|c| c[4] != 0.0 || c[5] != 0.0) {
                self.ledger.refuse("HYPERELASTIC", line, "D2 and D3 are not supported", "set them to 0");
            }
            constants.map(|c| Hyperelastic::Yeoh { c: [c[0], c[1], c[2]], d1: c[3] })
        } else if reduced && terms == 2 {
            let constants = self.constants(card, 4);
            if constants.as_ref().is_some_and(|c| c[3] != 0.0) {
                self.ledger.refuse("HYPERELASTIC", line, "D2 is not supported", "set it to 0");
            }
            constants.map(|c| Hyperelastic::Yeoh { c: [c[0], c[1], 0.0], d1: c[2] })
        } else if keyword.has("OGDEN") && (1..=4).contains(&terms) {
            let constants = self.constants(card, 3 * terms);
            if constants.as_ref().is_some_and(|c| c[2 * terms + 1..3 * terms].iter().any(|&d| d != 0.0)) {
                self.ledger.refuse("HYPERELASTIC", line, "only D1 is supported", "set the other D to 0");
            }
            constants.map(|c| Hyperelastic::Ogden {
                // the energy is 2μ/α² (λ₁^α + …) there and μ/α (λ₁^α + …) here
                terms: (0..terms).map(|i| [2.0 * c[2 * i] / c[2 * i + 1], c[2 * i + 1]]).collect(),
                d1: c[2 * terms],
            })
        } else {
            let cure = "use NEO HOOKE, MOONEY-RIVLIN, POLYNOMIAL with N=1, YEOH or OGDEN with N up to 4";
            self.ledger.refuse("HYPERELASTIC", line, "this form of the energy is not supported", cure);
            None
        };
        let Some(law) = law else { return };
        self.ledger.used("HYPERELASTIC", line);
        if let Some(material) = self.own(card) {
            material.hyperelastic = Some((law, line));
        }
    }
}

/// The engineering constants for the stiffness D₁₁₁₁, D₁₁₂₂, D₂₂₂₂, D₁₁₃₃, D₂₂₃₃, D₃₃₃₃, D₁₂₁₂, D₁₃₁₃, D₂₃₂₃: the
/// compliance, its inverse, has 1/E_i on the diagonal and −ν_ij/E_i beside it. `None` without an inverse.
fn engineering([d11, d12, d22, d13, d23, d33, g12, g13, g23]: [f64; 9]) -> Option<[f64; 9]> {
    let cofactors = [
        d22 * d33 - d23 * d23,
        d11 * d33 - d13 * d13,
        d11 * d22 - d12 * d12,
        d13 * d23 - d12 * d33,
        d12 * d23 - d13 * d22,
        d12 * d13 - d11 * d23,
    ];
    let determinant = d11 * cofactors[0] + d12 * cofactors[3] + d13 * cofactors[4];
    if determinant.abs() <= 1e-12 * (d11 * d22 * d33).abs() {
        return None;
    }
    let [s11, s22, s33, s12, s13, s23] = cofactors.map(|cofactor| cofactor / determinant);
    let all = [1.0 / s11, 1.0 / s22, 1.0 / s33, -s12 / s11, -s13 / s11, -s23 / s22, g12, g13, g23];
    all.iter().all(|constant| constant.is_finite()).then_some(all)
}
