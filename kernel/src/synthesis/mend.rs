//! Mends the joints between pieces: for each pixel near a joint, the patch around it is looked up in the exemplar. Then
//! each pixel takes, of the values proposed by the patches around it, the one that agrees best with all of them.
//!
//! Texture optimisation (V. Kwatra et al., 2005) with a vote that selects one value (J. Han et al., 2006): pixels are
//! never blended, so the result is as sharp as the exemplar. Candidate patches are continuations of the neighbours,
//! patches that look like those, and random patches around the best one (C. Barnes et al., 2009). A pass reads only
//! near pixels, and writes none that it reads. Spots that still do not occur in the exemplar after some rounds are
//! replaced ([`spots`]). Cost: O(pixels near joints · patches tried · pixels of a patch).
use super::coverage::{EvenUse, Factors};
use super::layer::Layer;
use super::patches::Patches;
use super::plane::PixelPlane;
use super::region::Region;
use super::rematch::{Search, Terms, ways, weight};
use super::spots;
use super::table::Table;
use super::texels::Texels;
use super::vote::{self, FoundPatch};
use crate::ground::hash::Hash;
use crate::ground::window::index;
use rayon::prelude::*;

/// The coarsest level at which patches are looked up.
const COARSEST: usize = 8;

/// The coarsest level at which spots are replaced.
const REPLACED: usize = 1;

/// Number of rounds before spots are replaced at the level of spacing `h`, given the `rounds` at the finest level.
/// Coarse levels decide the positions of features, and are cheap.
pub(super) fn rounds(rounds: u32, h: usize) -> u32 {
    match h {
        _ if rounds == 0 || h > COARSEST => 0,
        1 => rounds,
        _ => rounds + 1,
    }
}

/// Reach of the patches at the level of spacing `h`, in its pixels.
const fn reach(h: usize) -> usize {
    if h < 8 { 3 } else { 2 }
}

/// Number of further rounds that end with a replacement of spots, at the level of spacing `h`. One more round then
/// joins the surroundings.
const fn replacing(rounds: u32, h: usize) -> u32 {
    if h > REPLACED { 0 } else { rounds }
}

/// Reach of a round at the level of spacing `h`, in its pixels.
fn round_reads(h: usize) -> i32 {
    let reach = index(reach(h));
    reach + 1 + reach.min(vote::REACH)
}

/// Reach of all rounds at the level of spacing `h`, in its pixels, given the rounds at the `finest` level.
pub(super) fn reads(finest: u32, h: usize) -> i32 {
    let (rounds, replacing) = (rounds(finest, h), replacing(finest, h));
    let all = rounds + replacing + u32::from(replacing > 0);
    let times = |count: u32, by: i32| i32::try_from(count).unwrap_or(64) * by;
    times(all, round_reads(h)) + times(replacing, spots::READS) + 1
}

/// Settings for mending a level.
pub(super) struct How {
    /// Number of rounds at the finest level.
    pub(super) rounds: u32,
    /// If set, uses are counted again before every round.
    pub(super) even: Option<EvenUse>,
    /// Weight of the guide; 1 equals the mean difference of two patches.
    pub(super) guide_weight: f32,
    /// Squared difference per pixel below which a patch is good enough after the first round. The difference is
    /// invisible, and better patches would only make more of the result alike.
    pub(super) enough: f32,
    /// Random numbers.
    pub(super) hash: Hash,
}

/// Results of the previous round.
#[derive(Default)]
struct Before {
    found: Vec<FoundPatch>,
    map: Vec<u32>,
    near: Vec<bool>,
    pasted: Vec<bool>,
}

impl Before {
    fn keep(&mut self, region: &Region, part: &Region) {
        region.keep(part, &mut self.found);
        region.keep(part, &mut self.map);
        region.keep(part, &mut self.near);
        region.keep(part, &mut self.pasted);
    }
}

/// Mends a level: `image` is its picture; the map of `layer` holds indices of its tables.
pub(super) fn mend((table, image): (&Table, &Texels<f32>), how: &How, layer: &mut Layer) {
    let patches = Patches::new(image, table, reach(table.h));
    layer.trim();
    layer.map.par_iter_mut().with_min_len(1024).for_each(|at| *at = patches.at(table.pixel(*at)));
    let reach = index(patches.reach);
    let settled = weight(2.0 * how.enough);
    let (rounds, replacing) = (rounds(how.rounds, table.h), replacing(how.rounds, table.h));
    let mut before = Before::default();
    for k in 0..rounds + replacing + u32::from(replacing > 0) {
        before.keep(&layer.trim(), &layer.region);
        let Layer { region, map, guide, fixed, phases, factors, .. } = layer;
        let counted =
            how.even.map(|even| Factors::count(&even, table.plane, table.usable_bins, region, |p| patches.bin(map[p])));
        let terms = Terms {
            factors: counted.as_ref().or(factors.as_ref()),
            guide,
            guide_weight: how.guide_weight,
            fixed,
            phases,
            enough: how.enough,
        };
        let near = spread(&torn(&patches, region, map), region.plane, reach);
        // Unchanged surroundings would give the same match, and patches that fit well were settled the round before.
        let fresh = if k == 0 {
            near.clone()
        } else {
            let changed: Vec<bool> = map.iter().zip(&before.map).map(|(now, before)| now != before).collect();
            let changed = spread(&changed, region.plane, 1);
            let open = |p: usize| !before.near[p] || before.found[p].weight < settled;
            // Look up everything around pasted pixels.
            let pasted = spread(&before.pasted, region.plane, reach);
            (0..map.len()).map(|p| near[p] && (pasted[p] || changed[p] && open(p))).collect()
        };
        let (ways, hash) = (ways(&patches, region.plane), how.hash.with(u64::from(k)));
        let (terms, last) = (&terms, &before.found[..]);
        let found = Search { table, patches: &patches, region, terms, hash, map, near: &near, last, ways }.all(&fresh);
        before = Before { map: map.clone(), near, ..Before::default() };
        let open = spread(&fresh, region.plane, vote::REACH.min(reach));
        vote::vote(&patches, region, &found, (&open, fixed), map);
        let mut spent = round_reads(table.h);
        if (rounds..rounds + replacing).contains(&k) {
            before.pasted = spots::replace((table, &patches), region, (terms, how.hash), &found, map);
            spent += spots::READS;
        }
        before.found = found;
        layer.spend(spent);
    }
    layer.spend(1);
    layer.map.par_iter_mut().with_min_len(1024).for_each(|at| *at = patches.known(*at));
}

/// Marks the pixels whose right or lower neighbour does not continue them.
fn torn(patches: &Patches, region: &Region, map: &[u32]) -> Vec<bool> {
    let PixelPlane { w, h, wrap } = region.plane;
    let (right, down) = (patches.step(1, 0), patches.step(0, 1));
    let goes_on = |at: u32, step: u32, to: u32| patches.home(at.wrapping_add(step)) == to;
    let mut torn = vec![false; w * h];
    torn.par_chunks_mut(w).with_min_len(16).enumerate().for_each(|(y, torn)| {
        let row = &map[y * w..(y + 1) * w];
        let below = if y + 1 < h { Some(y + 1) } else { wrap[1].then_some(0) };
        for (x, torn) in torn.iter_mut().enumerate() {
            let beside = if x + 1 < w { Some(x + 1) } else { wrap[0].then_some(0) };
            *torn = beside.is_some_and(|beside| !goes_on(row[x], right, row[beside]))
                || below.is_some_and(|below| !goes_on(row[x], down, map[below * w + x]));
        }
    });
    torn
}

/// Marks the pixels with a marked one at most `r` columns and rows away (a dilation).
fn spread(marked: &[bool], plane: PixelPlane, r: i32) -> Vec<bool> {
    let PixelPlane { w, h, wrap } = plane;
    let mut rows = vec![false; w * h];
    rows.par_chunks_mut(w).zip(marked.par_chunks(w)).with_min_len(16).for_each(|(out, row)| {
        for x in (0..w).filter(|x| row[*x]) {
            for k in index(x) - r..=index(x) + r {
                if wrap[0] || (0..index(w)).contains(&k) {
                    out[PixelPlane::bring(k, w, wrap[0])] = true;
                }
            }
        }
    });
    let mut out = vec![false; w * h];
    out.par_chunks_mut(w).with_min_len(16).enumerate().for_each(|(y, out)| {
        for k in index(y) - r..=index(y) + r {
            if wrap[1] || (0..index(h)).contains(&k) {
                let from = PixelPlane::bring(k, h, wrap[1]) * w;
                out.iter_mut().zip(&rows[from..from + w]).for_each(|(out, marked)| *out |= marked);
            }
        }
    });
    out
}
