//! Conclusions from difference quotients about a derivative.

use serde::Serialize;

/// One difference quotient.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quotient {
    /// Step h.
    pub step: f64,
    /// Central difference, or the one-sided one at a bound.
    pub difference: f64,
    /// |difference − adjoint| / max(|adjoint|, noise-free size of the gradient in this direction).
    pub relative_error: f64,
    /// Estimated round-off of the difference, relative to the same scale as the error.
    pub round_off: f64,
    /// |θ(φ+hv) − θ(φ) − h dθ/dφ·v|.
    pub remainder: f64,
    /// log₂ of the ratio of the remainder at twice the step to this remainder: 2 if θ is smooth.
    pub order: Option<f64>,
    /// Slave nodes that change status between the densities of the difference, as (user step,
    /// global node), if θ's one-sided differences disagree too; empty: no kink.
    pub kink: Vec<(usize, u32)>,
    /// Whether θ's one-sided differences stay apart as the step is halved: a kink, due to a change
    /// of status or of the overlap of two facets.
    pub kinked: bool,
    /// Whether the three paths are cut back differently and θ's one-sided differences disagree:
    /// then they are values of different functions.
    pub cut_back: bool,
}

impl Quotient {
    /// Whether θ is a smooth function between the three densities.
    pub(super) fn is_smooth(&self) -> bool {
        self.kink.is_empty() && !self.kinked && !self.cut_back
    }
}

/// The conclusion from a direction about the gradient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// A difference agrees to within the tolerance, and exceeds round-off.
    Right,
    /// The differences agree to within their round-off, which is larger than the tolerance.
    NotResolvable,
    /// No difference agrees.
    Off,
    /// θ has a kink at every step.
    Kink,
    /// At every step the paths are cut back differently, or have a kink.
    CutBack,
}

/// Whether θ is smooth there and the difference exceeds round-off.
fn is_conclusive(quotient: &Quotient) -> bool {
    quotient.is_smooth() && quotient.round_off < 1.0
}

/// Smallest error among the meaningful differences; if there are none, among all smooth ones.
pub(super) fn best(quotients: &[Quotient]) -> Option<f64> {
    let least = |counts: fn(&Quotient) -> bool| {
        quotients.iter().filter(|q| counts(q)).map(|q| q.relative_error).reduce(f64::min)
    };
    least(is_conclusive).or_else(|| least(Quotient::is_smooth))
}

/// The conclusion from the quotients of a direction.
pub(super) fn verdict(quotients: &[Quotient], best: Option<f64>, tolerance: f64) -> Verdict {
    match best {
        None if quotients.iter().any(|q| q.cut_back) => Verdict::CutBack,
        None => Verdict::Kink,
        Some(best) if best <= tolerance && quotients.iter().any(is_conclusive) => Verdict::Right,
        // A wrong gradient disagrees at steps with small round-off, whatever the smallest steps
        // suggest.
        Some(_) if agree_to_round_off(quotients) => Verdict::NotResolvable,
        Some(_) => Verdict::Off,
    }
}

/// Whether a difference agrees with the adjoint to within its round-off, or the one at half the
/// smallest step would, and none is off by more than its round-off plus its truncation error. The
/// neighbouring step gives the truncation error, which is proportional to the square of the step.
fn agree_to_round_off(quotients: &[Quotient]) -> bool {
    let smooth: Vec<&Quotient> = quotients.iter().filter(|q| q.is_smooth()).collect();
    let agrees = |q: &&Quotient| q.relative_error <= q.round_off;
    let soon = matches!(smooth[..], [.., before, last] if agrees_at_half(before, last));
    let explained = |i: usize| {
        let q = smooth[i];
        let apart = |other: &Quotient| (q.relative_error - other.relative_error).abs();
        let truncation = match (i.checked_sub(1).map(|i| smooth[i]), smooth.get(i + 1)) {
            (_, Some(next)) => {
                let ratio = (q.step / next.step).powi(2);
                (apart(next) + next.round_off) * ratio / (ratio - 1.0)
            }
            (Some(before), None) => (apart(before) + q.round_off) / ((before.step / q.step).powi(2) - 1.0),
            (None, None) => 0.0,
        };
        q.relative_error <= q.round_off + truncation
    };
    (soon || smooth.iter().any(agrees)) && (0..smooth.len()).all(explained)
}

/// Whether the error falls like truncation from one step to its half, and would be within round-off
/// at a quarter.
fn agrees_at_half(before: &Quotient, last: &Quotient) -> bool {
    let halved = before.step == 2.0 * last.step && 3.0 * last.relative_error <= before.relative_error;
    halved && last.relative_error / 4.0 <= 2.0 * last.round_off
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quotients at halved steps with these relative errors and, at the first, this round-off.
    fn quotients(errors: &[f64], round_off: f64) -> Vec<Quotient> {
        let quotient = |(k, &relative_error): (usize, &f64)| Quotient {
            step: 0.5f64.powi(k as i32),
            difference: 0.0,
            relative_error,
            round_off: round_off * 2f64.powi(k as i32),
            remainder: 0.0,
            order: None,
            kink: Vec::new(),
            kinked: false,
            cut_back: false,
        };
        errors.iter().enumerate().map(quotient).collect()
    }

    fn of(quotients: &[Quotient]) -> Verdict {
        verdict(quotients, best(quotients), 1e-5)
    }

    /// The expected conclusions follow from the behaviour of errors under halving: truncation falls
    /// by a factor of 4, round-off doubles, the error of a wrong gradient stays.
    #[test]
    fn errors_are_told_from_round_off() {
        assert_eq!(of(&quotients(&[1.6e-4, 4e-5, 1e-5, 2.5e-6], 1e-8)), Verdict::Right, "truncation, then right");
        assert_eq!(of(&quotients(&[1.6e-2, 4e-3, 1e-3, 2.5e-4], 1e-8)), Verdict::Off, "truncation only");
        assert_eq!(of(&quotients(&[5e-5, 3e-5, 9e-5, 4e-4], 1e-4)), Verdict::NotResolvable, "round-off only");
        assert_eq!(of(&quotients(&[1.6e-2, 4e-3, 1.05e-3, 2.2e-4], 1e-4)), Verdict::NotResolvable, "down to round-off");
        assert_eq!(of(&quotients(&[2.6e-3, 5.2e-4], 1.5e-4)), Verdict::NotResolvable, "almost down to round-off");
        assert_eq!(of(&quotients(&[2.6e-3, 2.2e-3], 1.5e-4)), Verdict::Off, "it does not fall like truncation");
        assert_eq!(of(&quotients(&[0.5, 0.5, 1e-7], 0.25)), Verdict::NotResolvable, "right within round-off: no proof");
        assert_eq!(of(&quotients(&[1e-9, 1e-9], 1.0)), Verdict::NotResolvable, "nothing but round-off");
        assert_eq!(of(&quotients(&[0.5, 0.5, 0.5, 0.5], 1e-4)), Verdict::Off, "wrong");
        // The last difference agrees by chance, with a round-off larger than itself.
        assert_eq!(of(&quotients(&[0.5, 0.5, 0.51, 0.1], 0.05)), Verdict::Off, "wrong, as the large steps show");
        assert_eq!(of(&quotients(&[f64::NAN], 1.0)), Verdict::Off, "NaN is not right");
    }

    #[test]
    fn what_cannot_be_compared_is_named() {
        let mut kinks = quotients(&[0.1, 0.1], 1e-9);
        kinks[0].kink = vec![(2, 7)];
        kinks[1].cut_back = true;
        assert_eq!(of(&kinks), Verdict::CutBack);
        kinks[1] = kinks[0].clone();
        assert_eq!(of(&kinks), Verdict::Kink);
        assert_eq!(of(&[kinks[0].clone(), quotients(&[1e-7], 1e-9)[0].clone()]), Verdict::Right);
    }
}
