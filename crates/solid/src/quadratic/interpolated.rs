//! Force and tangent of an element with interpolated energy (`hex8/interpolated.rs`).

use super::cell::{Cell, Corners, Table, scaled};
use super::kernel::{self, Scratch};
use super::tangent;
use crate::interpolation::ElementScaling;
use crate::law::{AnyLaw, Stress};
use crate::registers::once;
use crate::section::{Formulation, Section};
use pulp::{Simd, WithSimd};
use std::array::from_fn;

/// Force of an element with interpolated energy, or the product of its tangent with a direction;
/// `None` if the finite-strain part is inverted or the result is not finite.
#[inline(always)]
pub(super) fn interpolated<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    section: &Section,
    cell: &Cell<N, B, M>,
    ElementScaling { factor, gamma, .. }: ElementScaling,
    d: &Corners<N>,
    direction: Option<&Corners<N>>,
) -> Option<Corners<N>> {
    if gamma == 1.0 {
        return force(simd, table, scratch, section, cell, factor, d, direction);
    }
    let (linear, along) = (factor * (1.0 - gamma * gamma), direction.unwrap_or(d));
    let linear = force(simd, table, scratch, section, cell, linear, &[[0.0; 3]; N], Some(along))?;
    if gamma == 0.0 {
        return Some(linear);
    }
    let finite = if direction.is_some() { factor * gamma * gamma } else { factor * gamma };
    let finite = force(simd, table, scratch, section, cell, finite, &scaled(d, gamma), direction)?;
    Some(from_fn(|i| from_fn(|c| finite[i][c] + linear[i][c])))
}

/// Tangent of an element with interpolated energy. Calls `add` as [`kernel::tangent`] does, once
/// for each part of the energy. Returns `None`, without calling `add`, if the finite-strain part is
/// inverted.
#[inline(always)]
pub(super) fn tangent<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    section: &Section,
    cell: &Cell<N, B, M>,
    ElementScaling { factor, gamma, .. }: ElementScaling,
    d: &Corners<N>,
    add: &mut impl FnMut(usize, usize, [f64; 9]),
) -> Option<()> {
    let bar = section.formulation == Formulation::FBar;
    let mut part = |factor: f64, d: &Corners<N>| {
        let law = AnyLaw::new(&section.material);
        once(simd, Tangent { law, bar, table, scratch: &mut *scratch, cell, factor, d, add: &mut *add })
    };
    if gamma == 1.0 {
        return part(factor, d);
    }
    let square = gamma * gamma;
    if gamma != 0.0 {
        part(factor * square, &scaled(d, gamma))?;
    }
    part(factor * (1.0 - square), &[[0.0; 3]; N])
}

/// Force, or the product of the tangent with a direction, without interpolation.
#[inline(always)]
pub(super) fn force<S: Simd, const N: usize, const B: usize, const P: usize, const M: usize>(
    simd: S,
    table: &Table<N, B, P>,
    scratch: &mut Scratch<N, B, P>,
    section: &Section,
    cell: &Cell<N, B, M>,
    factor: f64,
    d: &Corners<N>,
    direction: Option<&Corners<N>>,
) -> Option<Corners<N>> {
    let bar = section.formulation == Formulation::FBar;
    let law = AnyLaw::new(&section.material);
    once(simd, Force { law, bar, table, scratch, cell, factor, d, direction })
}

struct Force<'a, const N: usize, const B: usize, const P: usize, const M: usize> {
    law: AnyLaw<'a>,
    bar: bool,
    table: &'a Table<N, B, P>,
    scratch: &'a mut Scratch<N, B, P>,
    cell: &'a Cell<N, B, M>,
    factor: f64,
    d: &'a Corners<N>,
    direction: Option<&'a Corners<N>>,
}

impl<const N: usize, const B: usize, const P: usize, const M: usize> WithSimd for Force<'_, N, B, P, M> {
    type Output = Option<Corners<N>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, bar, table, scratch, cell, factor, d, direction } = self;
        // the force of a small-strain law is K(0) d
        match direction.or(law.small_strains().then_some(d)) {
            None => kernel::internal_force(simd, table, scratch, law, bar, cell, factor, d),
            Some(v) => kernel::tangent_product(simd, table, scratch, law, bar, cell, factor, d, v),
        }
    }
}

struct Tangent<'a, A, const N: usize, const B: usize, const P: usize, const M: usize> {
    law: AnyLaw<'a>,
    bar: bool,
    table: &'a Table<N, B, P>,
    scratch: &'a mut Scratch<N, B, P>,
    cell: &'a Cell<N, B, M>,
    factor: f64,
    d: &'a Corners<N>,
    add: A,
}

impl<A, const N: usize, const B: usize, const P: usize, const M: usize> WithSimd for Tangent<'_, A, N, B, P, M>
where
    A: FnMut(usize, usize, [f64; 9]),
{
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { law, bar, table, scratch, cell, factor, d, add } = self;
        tangent::tangent(simd, table, scratch, law, bar, cell, factor, d, add)
    }
}
