//! The inner loops of [`super::springs_patch`] in the instructions of AVX2, for `f32` and where the machine has them: the
//! compiler does not find out by itself how to fetch pairs from anywhere into wide registers. They round as the plain
//! loops do, which all else takes: the bits are the same.

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{pull, take};

#[cfg(not(target_arch = "x86_64"))]
pub(super) use plain::{pull, take};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::springs::{Motion, Real};
    use super::super::springs_patch::{LOCAL, Scratch, Slots, Span};
    use super::super::springs_step::{self, size};
    use pulp::x86::V3;
    use std::any::Any;
    use std::arch::x86_64::__m256;

    /// Puts the pulls of a span whose first slot is `at` into their slots and adds them at its points. None if it cannot,
    /// false if some break: then nothing has been added.
    #[inline(always)]
    pub(in super::super) fn pull<T: Real>(
        slots: &Slots<T>,
        span: Span,
        at: usize,
        motion: &Motion<T>,
        scratch: &mut Scratch<T>,
    ) -> Option<bool> {
        let v3 = V3::try_new()?;
        let slots = (slots as &dyn Any).downcast_ref::<Slots<f32>>()?;
        let scratch = (scratch as &mut dyn Any).downcast_mut::<Scratch<f32>>()?;
        let sign = motion.push_sign();
        let sign = *(&sign as &dyn Any).downcast_ref::<f32>()?;
        Some(match (slots.threshold.is_empty(), span.offsets.is_none()) {
            (true, true) => pull_span::<false, false>(v3, slots, span, at, sign, scratch),
            (true, false) => pull_span::<false, true>(v3, slots, span, at, sign, scratch),
            (false, true) => pull_span::<true, false>(v3, slots, span, at, sign, scratch),
            (false, false) => pull_span::<true, true>(v3, slots, span, at, sign, scratch),
        })
    }

    #[inline(always)]
    fn pull_span<const BREAKS: bool, const OFFSETS: bool>(
        v3: V3,
        slots: &Slots<f32>,
        span: Span,
        at: usize,
        sign: f32,
        scratch: &mut Scratch<f32>,
    ) -> bool {
        let (first, n) = (usize::from(span.first), usize::from(span.count));
        let (far, far_rest) = slots.far[at..at + n].as_chunks::<8>();
        let (stiffness, stiffness_rest) = slots.stiffness[at..at + n].as_chunks::<8>();
        let (length, length_rest) = slots.rest[at..at + n].as_chunks::<8>();
        let limits = if BREAKS { &slots.threshold[at..at + n] } else { &[] };
        let (limit, limit_rest) = limits.as_chunks::<8>();
        let offsets = if OFFSETS { &slots.offsets[span.offsets.unwrap_or_default() as usize..][..n] } else { &[] };
        let (offset, offset_rest) = offsets.as_chunks::<8>();
        let (near, near_rest) = scratch.position[first..first + n].as_chunks::<8>();
        let (out, out_rest) = scratch.pulls[at..at + n].as_chunks_mut::<8>();
        let (force, force_rest) = scratch.force[first..first + n].as_chunks_mut::<8>();
        let (position, avx) = (&scratch.position, v3.avx);
        let (one, zero) = (avx._mm256_set1_ps(1.0), avx._mm256_setzero_ps());
        let sign_wide = avx._mm256_set1_ps(sign);
        // Differences come in the order 0 1 4 5 2 3 6 7, which the way back puts right.
        let load = |v: &[f32; 8]| -> __m256 { pulp::cast(v3.avx2._mm256_permute4x64_pd::<0xD8>(pulp::cast(*v))) };
        let mut broke = zero;
        let rows = far.iter().zip(near).zip(stiffness).zip(length).zip(out.iter_mut()).zip(force.iter_mut());
        for (i, (((((far, near), k), rest), out), force)) in rows.enumerate() {
            let [near_low, near_high]: [__m256; 2] = pulp::cast(*near);
            let mut low = avx._mm256_sub_ps(four(position, [far[0], far[1], far[2], far[3]]), near_low);
            let mut high = avx._mm256_sub_ps(four(position, [far[4], far[5], far[6], far[7]]), near_high);
            if OFFSETS {
                let [offset_low, offset_high]: [__m256; 2] = pulp::cast(offset[i]);
                low = avx._mm256_add_ps(low, offset_low);
                high = avx._mm256_add_ps(high, offset_high);
            }
            let dx = avx._mm256_shuffle_ps::<0x88>(low, high);
            let dy = avx._mm256_shuffle_ps::<0xDD>(low, high);
            let square = avx._mm256_add_ps(avx._mm256_mul_ps(dx, dx), avx._mm256_mul_ps(dy, dy));
            let d = avx._mm256_sqrt_ps(square);
            let f = avx._mm256_mul_ps(load(k), avx._mm256_sub_ps(d, load(rest)));
            // 30: greater, false for NaN.
            let apart = avx._mm256_cmp_ps::<30>(d, zero);
            let s = avx._mm256_div_ps(f, avx._mm256_blendv_ps(one, d, apart));
            if BREAKS {
                let f = avx._mm256_and_ps(f, apart);
                let size = avx._mm256_max_ps(f, avx._mm256_mul_ps(sign_wide, f));
                broke = avx._mm256_or_ps(broke, avx._mm256_cmp_ps::<30>(size, load(&limit[i])));
            }
            let (fx, fy) = (avx._mm256_mul_ps(s, dx), avx._mm256_mul_ps(s, dy));
            let pulls = [avx._mm256_unpacklo_ps(fx, fy), avx._mm256_unpackhi_ps(fx, fy)];
            *out = pulp::cast(pulls);
            if !BREAKS {
                let [low, high]: [__m256; 2] = pulp::cast(*force);
                *force = pulp::cast([avx._mm256_add_ps(low, pulls[0]), avx._mm256_add_ps(high, pulls[1])]);
            }
        }
        let mut any = avx._mm256_movemask_ps(broke) != 0;
        for i in 0..far_rest.len() {
            let (far, near) = (position[usize::from(far_rest[i])], near_rest[i]);
            let mut apart = [far[0] - near[0], far[1] - near[1]];
            if OFFSETS {
                apart = [apart[0] + offset_rest[i][0], apart[1] + offset_rest[i][1]];
            }
            let (pull, f) = springs_step::pull(apart, stiffness_rest[i], length_rest[i]);
            out_rest[i] = pull;
            if BREAKS {
                any |= size(f, sign) > limit_rest[i];
            } else {
                force_rest[i] = [force_rest[i][0] + pull[0], force_rest[i][1] + pull[1]];
            }
        }
        if BREAKS && !any {
            let pulls = scratch.pulls[at..at + n].as_flattened();
            for (force, pull) in scratch.force[first..first + n].as_flattened_mut().iter_mut().zip(pulls) {
                *force += *pull;
            }
        }
        !any
    }

    /// Takes `each` pulls each from the forces of points in groups of eight; false if it cannot.
    #[inline(always)]
    pub(in super::super) fn take<T: Real>(
        incoming: &[u16],
        each: usize,
        pulls: &[[T; 2]; LOCAL],
        force: &mut [[T; 2]],
    ) -> bool {
        let Some(v3) = V3::try_new() else { return false };
        let Some(pulls) = (pulls as &dyn Any).downcast_ref::<[[f32; 2]; LOCAL]>() else { return false };
        let (force, _) = force.as_chunks_mut::<8>();
        let (slots, _) = incoming.as_chunks::<8>();
        for (slots, force) in slots.chunks_exact(each).zip(force) {
            let Some(force) = (force as &mut dyn Any).downcast_mut::<[[f32; 2]; 8]>() else { return false };
            let [mut low, mut high]: [__m256; 2] = pulp::cast(*force);
            for slots in slots {
                low = v3.avx._mm256_sub_ps(low, four(pulls, [slots[0], slots[1], slots[2], slots[3]]));
                high = v3.avx._mm256_sub_ps(high, four(pulls, [slots[4], slots[5], slots[6], slots[7]]));
            }
            *force = pulp::cast([low, high]);
        }
        true
    }

    /// Four pairs from anywhere.
    #[inline(always)]
    fn four<const N: usize>(from: &[[f32; 2]; N], at: [u16; 4]) -> __m256 {
        let pair = |i: usize| -> f64 { pulp::cast(from[usize::from(at[i])]) };
        pulp::cast([pair(0), pair(1), pair(2), pair(3)])
    }
}

#[cfg(not(target_arch = "x86_64"))]
mod plain {
    use super::super::springs::{Motion, Real};
    use super::super::springs_patch::{LOCAL, Scratch, Slots, Span};

    /// There is no wide variant.
    pub(in super::super) fn pull<T: Real>(
        _: &Slots<T>,
        _: Span,
        _: usize,
        _: &Motion<T>,
        _: &mut Scratch<T>,
    ) -> Option<bool> {
        None
    }

    /// There is no wide variant.
    pub(in super::super) fn take<T: Real>(_: &[u16], _: usize, _: &[[T; 2]; LOCAL], _: &mut [[T; 2]]) -> bool {
        false
    }
}
