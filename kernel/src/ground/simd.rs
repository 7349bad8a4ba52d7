//! Chooses the vector variant of a kernel at run time. No other code does.
//!
//! A kernel is an `#[inline(always)]` body of plain loops that the compiler vectorises. [`dispatch`] compiles it twice,
//! for the baseline and for AVX2, and picks one. Both give the same bits: no kernel fuses a product and a sum, and all
//! other operations they use (`+ - × ÷ √ floor`) are rounded exactly by IEEE 754.

use pulp::{Simd, WithSimd};

struct Op<F>(F);

impl<R, F: FnOnce() -> R> WithSimd for Op<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> R {
        (self.0)()
    }
}

/// Runs `body` with the widest instructions that this machine has. Write the closure as `#[inline(always)] || …`, or it
/// may be compiled separately and only for the baseline.
#[inline]
pub fn dispatch<R, F: FnOnce() -> R>(body: F) -> R {
    dispatch_op(Op(body))
}

/// The same for an operation in a type of its own: inner closures would not be inlined into the vector variant.
#[cfg(not(target_family = "wasm"))]
#[inline]
pub fn dispatch_op<O: WithSimd>(op: O) -> O::Output {
    pulp::Arch::new().dispatch(op)
}

/// The same for WebAssembly, which has one variant: `pulp` would add another with relaxed instructions. Engines that do not
/// know them refuse the whole module, and their bits may differ.
#[cfg(target_family = "wasm")]
#[inline]
pub fn dispatch_op<O: WithSimd>(op: O) -> O::Output {
    op.with_simd(pulp::Scalar::new())
}

/// A closure that is inlined into the kernel that calls it. Write `inlined(#[inline(always)] |x| …)`, because only
/// arguments can carry the attribute.
#[inline(always)]
pub fn inlined<F>(body: F) -> F {
    body
}
