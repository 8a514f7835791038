//! Vector registers of the dense kernels.
//!
//! The kernels know their instruction sets themselves, because products gain from AVX-512, for which
//! the other kernels would only take longer to compile.

use super::super::scalar::Scalar;

/// A register of numbers.
///
/// # Safety of the methods
/// The processor has the instruction set, and the addresses are those of as many numbers as named.
pub trait Register<T>: Copy {
    const LANES: usize;
    unsafe fn splat(x: T) -> Self;
    unsafe fn load(from: *const T) -> Self;
    unsafe fn store(self, to: *mut T);
    /// The first `count` numbers, and zeros.
    unsafe fn load_part(from: *const T, count: usize) -> Self;
    /// The first `count` numbers.
    unsafe fn store_part(self, to: *mut T, count: usize);
    unsafe fn times(self, b: Self) -> Self;
    unsafe fn minus(self, b: Self) -> Self;
    /// self + a b
    unsafe fn plus_product(self, a: Self, b: Self) -> Self;
    /// self − a b
    unsafe fn minus_product(self, a: Self, b: Self) -> Self;
}

/// A kernel for registers `R`; products treat `N` columns at a time, and `H` of the last ones.
pub trait Kernel<T: Scalar> {
    type Output;
    /// # Safety
    /// The processor has the instruction set of `R`.
    unsafe fn run<R: Register<T>, const N: usize, const H: usize>(self) -> Self::Output;
}

/// An instruction set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The best of this processor.
    #[inline]
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let fma = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            if fma && is_x86_feature_detected!("avx512f") {
                return Self::Avx512;
            } else if fma {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// Runs a kernel with this instruction set, which the processor must have.
    #[inline]
    fn run<T: Scalar, K: Kernel<T>>(self, kernel: K) -> K::Output {
        // SAFETY: only `best` and tests name levels, after a look at the processor.
        unsafe {
            match self {
                Self::Portable => kernel.run::<T::Narrow, 4, 2>(),
                #[cfg(target_arch = "x86_64")]
                Self::Avx2 => x86::avx2(kernel),
                #[cfg(target_arch = "x86_64")]
                Self::Avx512 => x86::avx512(kernel),
            }
        }
    }
}

/// Runs a kernel with the best instructions of this processor.
#[inline]
pub fn run<T: Scalar, K: Kernel<T>>(kernel: K) -> K::Output {
    #[cfg(test)]
    let level = super::tests::LEVEL.get().unwrap_or_else(Level::best);
    #[cfg(not(test))]
    let level = Level::best();
    level.run(kernel)
}

/// c + a b, rounded once where every processor of the architecture does that in one instruction.
macro_rules! plus_product {
    ($c:expr, $a:expr, $b:expr) => {
        if cfg!(target_arch = "aarch64") { $a.mul_add($b, $c) } else { $c + $a * $b }
    };
}

macro_rules! portable {
    ($t:ty, $lanes:literal) => {
        impl Register<$t> for [$t; $lanes] {
            const LANES: usize = $lanes;

            #[inline(always)]
            unsafe fn splat(x: $t) -> Self {
                [x; $lanes]
            }

            #[inline(always)]
            unsafe fn load(from: *const $t) -> Self {
                unsafe { from.cast::<Self>().read_unaligned() }
            }

            #[inline(always)]
            unsafe fn store(self, to: *mut $t) {
                unsafe { to.cast::<Self>().write_unaligned(self) }
            }

            #[inline(always)]
            unsafe fn load_part(from: *const $t, count: usize) -> Self {
                std::array::from_fn(|i| if i < count { unsafe { *from.add(i) } } else { 0.0 })
            }

            #[inline(always)]
            unsafe fn store_part(self, to: *mut $t, count: usize) {
                for i in 0..count {
                    unsafe { *to.add(i) = self[i] };
                }
            }

            #[inline(always)]
            unsafe fn times(self, b: Self) -> Self {
                std::array::from_fn(|i| self[i] * b[i])
            }

            #[inline(always)]
            unsafe fn minus(self, b: Self) -> Self {
                std::array::from_fn(|i| self[i] - b[i])
            }

            #[inline(always)]
            unsafe fn plus_product(self, a: Self, b: Self) -> Self {
                std::array::from_fn(|i| plus_product!(self[i], a[i], b[i]))
            }

            #[inline(always)]
            unsafe fn minus_product(self, a: Self, b: Self) -> Self {
                std::array::from_fn(|i| plus_product!(self[i], -a[i], b[i]))
            }
        }
    };
}

portable!(f64, 2);
portable!(f32, 4);

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Kernel, Register, Scalar};
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn avx2<T: Scalar, K: Kernel<T>>(kernel: K) -> K::Output {
        unsafe { kernel.run::<T::Middle, 4, 2>() }
    }

    #[target_feature(enable = "avx512f,avx2,fma")]
    pub unsafe fn avx512<T: Scalar, K: Kernel<T>>(kernel: K) -> K::Output {
        unsafe { kernel.run::<T::Wide, 8, 4>() }
    }

    /// The first `count` lanes of a register of 256 bits.
    #[inline(always)]
    unsafe fn lanes_64(count: usize) -> __m256i {
        const ENDS: [i64; 8] = [-1, -1, -1, -1, 0, 0, 0, 0];
        unsafe { _mm256_loadu_si256(ENDS.as_ptr().add(4 - count).cast()) }
    }

    #[inline(always)]
    unsafe fn lanes_32(count: usize) -> __m256i {
        const ENDS: [i32; 16] = [-1, -1, -1, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 0, 0, 0];
        unsafe { _mm256_loadu_si256(ENDS.as_ptr().add(8 - count).cast()) }
    }

    macro_rules! register {
        ($register:ty, $t:ty, $lanes:literal, $splat:ident, $load:ident, $store:ident, $part:expr, $put:expr,
         $mul:ident, $sub:ident, $fmadd:ident, $fnmadd:ident) => {
            impl Register<$t> for $register {
                const LANES: usize = $lanes;

                #[inline(always)]
                unsafe fn splat(x: $t) -> Self {
                    unsafe { $splat(x) }
                }

                #[inline(always)]
                unsafe fn load(from: *const $t) -> Self {
                    unsafe { $load(from) }
                }

                #[inline(always)]
                unsafe fn store(self, to: *mut $t) {
                    unsafe { $store(to, self) }
                }

                #[inline(always)]
                unsafe fn load_part(from: *const $t, count: usize) -> Self {
                    unsafe { $part(from, count) }
                }

                #[inline(always)]
                unsafe fn store_part(self, to: *mut $t, count: usize) {
                    unsafe { $put(self, to, count) }
                }

                #[inline(always)]
                unsafe fn times(self, b: Self) -> Self {
                    unsafe { $mul(self, b) }
                }

                #[inline(always)]
                unsafe fn minus(self, b: Self) -> Self {
                    unsafe { $sub(self, b) }
                }

                #[inline(always)]
                unsafe fn plus_product(self, a: Self, b: Self) -> Self {
                    unsafe { $fmadd(a, b, self) }
                }

                #[inline(always)]
                unsafe fn minus_product(self, a: Self, b: Self) -> Self {
                    unsafe { $fnmadd(a, b, self) }
                }
            }
        };
    }

    macro_rules! part {
        ($name:ident($from:ident: *const $t:ty, $count:ident) -> $register:ty { $load:expr }
         $put:ident($x:ident, $to:ident) { $store:expr }) => {
            #[inline(always)]
            unsafe fn $name($from: *const $t, $count: usize) -> $register {
                unsafe { $load }
            }

            #[inline(always)]
            unsafe fn $put($x: $register, $to: *mut $t, $count: usize) {
                unsafe { $store }
            }
        };
    }

    part!(load_4(from: *const f64, count) -> __m256d { _mm256_maskload_pd(from, lanes_64(count)) }
        store_4(x, to) { _mm256_maskstore_pd(to, lanes_64(count), x) });
    part!(load_8(from: *const f32, count) -> __m256 { _mm256_maskload_ps(from, lanes_32(count)) }
        store_8(x, to) { _mm256_maskstore_ps(to, lanes_32(count), x) });
    part!(load_8d(from: *const f64, count) -> __m512d { _mm512_maskz_loadu_pd(((1u16 << count) - 1) as u8, from) }
        store_8d(x, to) { _mm512_mask_storeu_pd(to, ((1u16 << count) - 1) as u8, x) });
    part!(load_16(from: *const f32, count) -> __m512 { _mm512_maskz_loadu_ps(((1u32 << count) - 1) as u16, from) }
        store_16(x, to) { _mm512_mask_storeu_ps(to, ((1u32 << count) - 1) as u16, x) });

    register!(
        __m256d,
        f64,
        4,
        _mm256_set1_pd,
        _mm256_loadu_pd,
        _mm256_storeu_pd,
        load_4,
        store_4,
        _mm256_mul_pd,
        _mm256_sub_pd,
        _mm256_fmadd_pd,
        _mm256_fnmadd_pd
    );
    register!(
        __m256,
        f32,
        8,
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        load_8,
        store_8,
        _mm256_mul_ps,
        _mm256_sub_ps,
        _mm256_fmadd_ps,
        _mm256_fnmadd_ps
    );
    register!(
        __m512d,
        f64,
        8,
        _mm512_set1_pd,
        _mm512_loadu_pd,
        _mm512_storeu_pd,
        load_8d,
        store_8d,
        _mm512_mul_pd,
        _mm512_sub_pd,
        _mm512_fmadd_pd,
        _mm512_fnmadd_pd
    );
    register!(
        __m512,
        f32,
        16,
        _mm512_set1_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        load_16,
        store_16,
        _mm512_mul_ps,
        _mm512_sub_ps,
        _mm512_fmadd_ps,
        _mm512_fnmadd_ps
    );
}
