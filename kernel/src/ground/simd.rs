//! The one place where the vector variant of a kernel is chosen at run time.
//!
//! A kernel is an `#[inline(always)]` body of plain loops that the compiler vectorises. [`dispatch`] compiles it twice,
//! for the baseline and for AVX2, and picks one. Both give the same bits: no kernel fuses a product and a sum, and
//! everything else they use (`+ - × ÷ √ floor`) is rounded exactly by IEEE 754.

use pulp::{Arch, Simd, WithSimd};

struct Op<F>(F);

impl<R, F: FnOnce() -> R> WithSimd for Op<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> R {
        (self.0)()
    }
}

/// Runs `body` with the widest instructions this machine has. Write the closure as `#[inline(always)] || …`, or it may
/// be compiled apart and for the baseline only.
#[inline]
pub fn dispatch<R, F: FnOnce() -> R>(body: F) -> R {
    Arch::new().dispatch(Op(body))
}

/// A closure that is compiled into the kernel that calls it: written `inlined(#[inline(always)] |x| …)`, since only
/// arguments can be marked so.
#[inline(always)]
pub fn inlined<F>(body: F) -> F {
    body
}
