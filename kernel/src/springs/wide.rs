//! The inner loops of [`super::block`] in AVX2 instructions, for `f32` on machines that have them: the compiler does
//! not vectorise the gathering of pairs by index. They round like the plain loops, which handle all other cases, so the
//! bits are the same.

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{pull, settle};

#[cfg(not(target_arch = "x86_64"))]
pub(super) use plain::{pull, settle};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use crate::ground::real::Real;
    use crate::springs::block::{Batch, GROUP, LOCAL, Scratch, Slots};
    use crate::springs::moving::Moving;
    use crate::springs::net::{Integrator, Motion};
    use pulp::x86::V3;
    use std::any::Any;
    use std::arch::x86_64::__m256;

    /// Smaller than any distance above 0, since squares above 0 are at least 2^-149. The divisor for ends at the same
    /// position, where the plain loops give 0; only a force above 4e15 would overflow there.
    const LEAST: f32 = f32::from_bits((127 - 75) << 23);

    /// Computes the pulls of a batch and their sums at the owners. Returns the number of computed groups: all, or those
    /// before one in which springs break, or 0.
    #[inline(always)]
    pub(in super::super) fn pull<T: Real>(
        slots: &Slots<T>,
        batch: Batch,
        motion: &Motion<T>,
        scratch: &mut Scratch<T>,
    ) -> usize {
        let Some(v3) = V3::try_new() else { return 0 };
        let Some(slots) = (slots as &dyn Any).downcast_ref::<Slots<f32>>() else { return 0 };
        let Some(scratch) = (scratch as &mut dyn Any).downcast_mut::<Scratch<f32>>() else { return 0 };
        let sign = motion.push_sign();
        let Some(&sign) = (&sign as &dyn Any).downcast_ref::<f32>() else { return 0 };
        match (slots.threshold.is_empty(), batch.offset.is_none()) {
            (true, true) => pull_own::<false, false>(v3, slots, batch, sign, scratch),
            (true, false) => pull_own::<false, true>(v3, slots, batch, sign, scratch),
            (false, true) => pull_own::<true, false>(v3, slots, batch, sign, scratch),
            (false, false) => pull_own::<true, true>(v3, slots, batch, sign, scratch),
        }
    }

    #[inline(always)]
    fn pull_own<const BREAKS: bool, const OFFSETS: bool>(
        v3: V3,
        slots: &Slots<f32>,
        batch: Batch,
        sign: f32,
        scratch: &mut Scratch<f32>,
    ) -> usize {
        match batch.own {
            0 => {
                scratch.force[batch.point..batch.point + batch.groups * GROUP].fill([0.0; 2]);
                batch.groups
            }
            1 => pull_groups::<BREAKS, OFFSETS, 1>(v3, slots, batch, sign, scratch),
            2 => pull_groups::<BREAKS, OFFSETS, 2>(v3, slots, batch, sign, scratch),
            3 => pull_groups::<BREAKS, OFFSETS, 3>(v3, slots, batch, sign, scratch),
            4 => pull_groups::<BREAKS, OFFSETS, 4>(v3, slots, batch, sign, scratch),
            5 => pull_groups::<BREAKS, OFFSETS, 5>(v3, slots, batch, sign, scratch),
            6 => pull_groups::<BREAKS, OFFSETS, 6>(v3, slots, batch, sign, scratch),
            _ => 0,
        }
    }

    #[inline(always)]
    fn pull_groups<const BREAKS: bool, const OFFSETS: bool, const OWN: usize>(
        v3: V3,
        slots: &Slots<f32>,
        batch: Batch,
        sign: f32,
        scratch: &mut Scratch<f32>,
    ) -> usize {
        let Batch { groups, point, offset, .. } = batch;
        let [span, pulls] = batch.slots();
        let far = slots.far[span.clone()].as_chunks::<8>().0.as_chunks::<OWN>().0;
        let stiffness = slots.stiffness[span.clone()].as_chunks::<8>().0.as_chunks::<OWN>().0;
        let length = slots.rest[span.clone()].as_chunks::<8>().0.as_chunks::<OWN>().0;
        let limit = if BREAKS { &slots.threshold[span.clone()] } else { &[] }.as_chunks::<8>().0.as_chunks::<OWN>().0;
        let offsets = if OFFSETS { &slots.offsets[offset.unwrap_or_default()..][..span.len()] } else { &[] };
        let offset = offsets.as_chunks::<8>().0.as_chunks::<OWN>().0;
        let out = scratch.pulls[pulls].as_chunks_mut::<8>().0.as_chunks_mut::<OWN>().0;
        let position: &[[f32; 2]; LOCAL] = scratch.position.first_chunk().expect("room for all");
        let near = position[point..point + groups * GROUP].as_chunks::<8>().0;
        let force = scratch.force[point..point + groups * GROUP].as_chunks_mut::<8>().0;
        let avx = v3.avx;
        let (least, zero) = (avx._mm256_set1_ps(LEAST), avx._mm256_setzero_ps());
        let sign_wide = avx._mm256_set1_ps(sign);
        // All have the length of the batch, which the compiler does not know: indices below the smallest length need no
        // checks.
        let n = groups
            .min(far.len())
            .min(stiffness.len())
            .min(length.len())
            .min(out.len())
            .min(near.len())
            .min(force.len());
        let n = if BREAKS { n.min(limit.len()) } else { n };
        let n = if OFFSETS { n.min(offset.len()) } else { n };
        for group in 0..n {
            let [near_low, near_high]: [__m256; 2] = pulp::cast(near[group]);
            let (mut sum_low, mut sum_high) = (zero, zero);
            let mut broke = zero;
            for i in 0..OWN {
                let far = &far[group][i];
                let mut low = avx._mm256_sub_ps(four(position, [far[0], far[1], far[2], far[3]]), near_low);
                let mut high = avx._mm256_sub_ps(four(position, [far[4], far[5], far[6], far[7]]), near_high);
                if OFFSETS {
                    let [offset_low, offset_high]: [__m256; 2] = pulp::cast(offset[group][i]);
                    low = avx._mm256_add_ps(low, offset_low);
                    high = avx._mm256_add_ps(high, offset_high);
                }
                // The lanes are now in the order of `LANE`, like the constants; unpacking restores the order.
                let dx = avx._mm256_shuffle_ps::<0x88>(low, high);
                let dy = avx._mm256_shuffle_ps::<0xDD>(low, high);
                let square = avx._mm256_add_ps(avx._mm256_mul_ps(dx, dx), avx._mm256_mul_ps(dy, dy));
                let d = avx._mm256_sqrt_ps(square);
                let f = avx
                    ._mm256_mul_ps(pulp::cast(stiffness[group][i]), avx._mm256_sub_ps(d, pulp::cast(length[group][i])));
                // If both ends are at the same position, any divisor works: the quotient is multiplied by 0. NaN stays
                // in `f`.
                let s = avx._mm256_div_ps(f, avx._mm256_max_ps(d, least));
                if BREAKS {
                    // 30: greater, false for NaN.
                    let apart = avx._mm256_cmp_ps::<30>(d, zero);
                    let f = avx._mm256_and_ps(f, apart);
                    let size = avx._mm256_max_ps(f, avx._mm256_mul_ps(sign_wide, f));
                    let limit = pulp::cast(limit[group][i]);
                    broke = avx._mm256_or_ps(broke, avx._mm256_cmp_ps::<30>(size, limit));
                }
                let (fx, fy) = (avx._mm256_mul_ps(s, dx), avx._mm256_mul_ps(s, dy));
                let pulls = [avx._mm256_unpacklo_ps(fx, fy), avx._mm256_unpackhi_ps(fx, fy)];
                out[group][i] = pulp::cast(pulls);
                (sum_low, sum_high) = (avx._mm256_add_ps(sum_low, pulls[0]), avx._mm256_add_ps(sum_high, pulls[1]));
            }
            if BREAKS && avx._mm256_movemask_ps(broke) != 0 {
                return group;
            }
            force[group] = pulp::cast([sum_low, sum_high]);
        }
        groups
    }

    /// Adds the pulls of the springs that end at the points of a run, as listed by `incoming`, and moves the points.
    /// Returns false if there is no wide variant.
    #[inline(always)]
    pub(in super::super) fn settle<T: Real>(
        incoming: &[u16],
        each: usize,
        moving: Moving<'_, T>,
        motion: &Motion<T>,
        pulls: &[[T; 2]; LOCAL],
    ) -> bool {
        let Some(v3) = V3::try_new() else { return false };
        let Some(pulls) = (pulls as &dyn Any).downcast_ref::<[[f32; 2]; LOCAL]>() else { return false };
        let Some(motion) = (motion as &dyn Any).downcast_ref::<Motion<f32>>() else { return false };
        match motion.integrator {
            Integrator::Explicit => settle_by::<true, T>(v3, incoming, each, moving, motion, pulls),
            Integrator::SemiImplicit => settle_by::<false, T>(v3, incoming, each, moving, motion, pulls),
        }
    }

    #[inline(always)]
    fn settle_by<const EXPLICIT: bool, T: Real>(
        v3: V3,
        incoming: &[u16],
        each: usize,
        moving: Moving<'_, T>,
        motion: &Motion<f32>,
        pulls: &[[f32; 2]; LOCAL],
    ) -> bool {
        match each {
            0 => settle_each::<EXPLICIT, 0, T>(v3, incoming, moving, motion, pulls),
            1 => settle_each::<EXPLICIT, 1, T>(v3, incoming, moving, motion, pulls),
            2 => settle_each::<EXPLICIT, 2, T>(v3, incoming, moving, motion, pulls),
            3 => settle_each::<EXPLICIT, 3, T>(v3, incoming, moving, motion, pulls),
            4 => settle_each::<EXPLICIT, 4, T>(v3, incoming, moving, motion, pulls),
            5 => settle_each::<EXPLICIT, 5, T>(v3, incoming, moving, motion, pulls),
            6 => settle_each::<EXPLICIT, 6, T>(v3, incoming, moving, motion, pulls),
            7 => settle_each::<EXPLICIT, 7, T>(v3, incoming, moving, motion, pulls),
            8 => settle_each::<EXPLICIT, 8, T>(v3, incoming, moving, motion, pulls),
            _ => return false,
        }
        true
    }

    #[inline(always)]
    fn settle_each<const EXPLICIT: bool, const EACH: usize, T: Real>(
        v3: V3,
        incoming: &[u16],
        moving: Moving<'_, T>,
        motion: &Motion<f32>,
        pulls: &[[f32; 2]; LOCAL],
    ) {
        let avx = v3.avx;
        let (drag, step) = (avx._mm256_set1_ps(motion.drag), avx._mm256_set1_ps(motion.step));
        let slots = incoming.as_chunks::<8>().0;
        let alike = wide(&[[moving.alike; 2]; 8]);
        let weights = moving.weight.map(|weight| weight.as_chunks::<8>().0);
        let (x, v) = (moving.x.as_chunks_mut::<8>().0, moving.v.as_chunks_mut::<8>().0);
        let groups = moving.force.as_chunks::<8>().0.iter().zip(x).zip(v);
        for (i, ((force, x), v)) in groups.enumerate() {
            let [mut low, mut high] = wide(force);
            for slots in &slots[i * EACH..(i + 1) * EACH] {
                low = avx._mm256_sub_ps(low, four(pulls, [slots[0], slots[1], slots[2], slots[3]]));
                high = avx._mm256_sub_ps(high, four(pulls, [slots[4], slots[5], slots[6], slots[7]]));
            }
            let [weight_low, weight_high] = if let Some(weight) = weights { wide(&weight[i]) } else { alike };
            let ([x_low, x_high], [v_low, v_high]) = (wide(x), wide(v));
            let (x_low, v_low) = moved::<EXPLICIT>(v3, [drag, step], [low, weight_low], x_low, v_low);
            let (x_high, v_high) = moved::<EXPLICIT>(v3, [drag, step], [high, weight_high], x_high, v_high);
            narrow([x_low, x_high], x);
            narrow([v_low, v_high], v);
        }
    }

    /// Coordinates and velocities after a step, computed like [`Motion::advance`].
    #[inline(always)]
    fn moved<const EXPLICIT: bool>(
        V3 { avx, .. }: V3,
        [drag, step]: [__m256; 2],
        [force, weight]: [__m256; 2],
        x: __m256,
        v: __m256,
    ) -> (__m256, __m256) {
        let a = avx._mm256_mul_ps(avx._mm256_sub_ps(force, avx._mm256_mul_ps(drag, v)), weight);
        let faster = avx._mm256_add_ps(v, avx._mm256_mul_ps(a, step));
        let way = if EXPLICIT {
            let half = avx._mm256_mul_ps(avx._mm256_set1_ps(0.5), a);
            let bent = avx._mm256_mul_ps(avx._mm256_mul_ps(half, step), step);
            avx._mm256_add_ps(avx._mm256_mul_ps(v, step), bent)
        } else {
            avx._mm256_mul_ps(faster, step)
        };
        (avx._mm256_add_ps(x, way), faster)
    }

    /// Loads eight pairs of `f32` into registers.
    #[inline(always)]
    fn wide<T: Real>(pairs: &[[T; 2]; 8]) -> [__m256; 2] {
        let pairs = (pairs as &dyn Any).downcast_ref::<[[f32; 2]; 8]>();
        pulp::cast(*pairs.expect("asked before"))
    }

    /// Stores registers as pairs.
    #[inline(always)]
    fn narrow<T: Real>(wide: [__m256; 2], pairs: &mut [[T; 2]; 8]) {
        let pairs = (pairs as &mut dyn Any).downcast_mut::<[[f32; 2]; 8]>();
        *pairs.expect("asked before") = pulp::cast(wide);
    }

    /// Gathers four pairs by index.
    #[inline(always)]
    fn four<const N: usize>(from: &[[f32; 2]; N], at: [u16; 4]) -> __m256 {
        let pair = |i: usize| -> f64 { pulp::cast(from[usize::from(at[i])]) };
        pulp::cast([pair(0), pair(1), pair(2), pair(3)])
    }
}

#[cfg(not(target_arch = "x86_64"))]
mod plain {
    use crate::ground::real::Real;
    use crate::springs::block::{Batch, LOCAL, Scratch, Slots};
    use crate::springs::moving::Moving;
    use crate::springs::net::Motion;

    /// No wide variant exists.
    pub(in super::super) fn pull<T: Real>(_: &Slots<T>, _: Batch, _: &Motion<T>, _: &mut Scratch<T>) -> usize {
        0
    }

    /// No wide variant exists.
    pub(in super::super) fn settle<T: Real>(
        _: &[u16],
        _: usize,
        _: Moving<'_, T>,
        _: &Motion<T>,
        _: &[[T; 2]; LOCAL],
    ) -> bool {
        false
    }
}
