//! Converts the inputs of [`super::SimulateSprings`] to the arguments of the kernel, and the result to the outputs.
use super::reading::mass_at;
use super::strain::{Strain, StrainQuantity};
use crate::bounds::told;
use glam::Vec2;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::lines::Raster;
use shibo_kernel::leather::links::{GridShape, radius_estimate, radius_links_until};
use shibo_kernel::springs::{Mass, Net, Outcome};
use shibo_node::{Context, Outputs};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Lattice, Points, ScalarMap, SpringNet, Stop, Tiling};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The springs in the form of the kernel, without dampers, thresholds and fixed points.
pub(super) fn net(springs: &SpringNet) -> Net<'_, f32> {
    let lattice = &springs.lattice;
    let points = &lattice.points;
    let shape = lattice.grid.map(|grid| GridShape {
        nx: grid.columns as usize,
        ny: grid.rows as usize,
        eight: grid.diagonals,
        periodic: points.periodic == Tiling::BOTH,
    });
    Net {
        links: &lattice.links,
        wraps: &lattice.offsets,
        size: lattice.points.size_mm.as_vec2().to_array(),
        stiffness: &springs.stiffness,
        rest: &springs.rest_length,
        mass: if springs.mass.is_empty() { Mass::One } else { Mass::Each(&springs.mass) },
        grid: shape,
        ..Net::default()
    }
}

/// The mass of a point at any place; places beyond a canvas that repeats are wrapped.
pub(super) fn live_mass<'a>(
    map: &'a ScalarMap,
    points: &Points,
    weightless: &'a AtomicBool,
) -> impl Fn([f32; 2]) -> f32 + Sync + use<'a> {
    let raster = Raster {
        values: &map.values,
        width: map.size.x as usize,
        height: map.size.y as usize,
        size: points.size_mm.as_vec2(),
        periodic: points.periodic == Tiling::BOTH,
    };
    move |place| {
        let mass = mass_at(map, &raster, Vec2::from_array(place));
        if mass > 0.0 {
            return mass;
        }
        weightless.store(true, Ordering::Relaxed);
        1.0
    }
}

/// The springs of a net, followed by contacts between bodies.
pub(super) struct Contacts {
    pub(super) links: Vec<[u32; 2]>,
    pub(super) wraps: Vec<[i8; 2]>,
    pub(super) stiffness: Vec<f32>,
    pub(super) rest: Vec<f32>,
    pub(super) pushes: Vec<bool>,
}

impl Contacts {
    /// Contacts between bodies of a diameter and a stiffness; `None` without bodies.
    ///
    /// # Errors
    /// If too many bodies would touch.
    pub(super) fn of(cx: &Context<'_>, springs: &SpringNet, body: f64, hardness: f64) -> Result<Option<Self>, Stop> {
        if body <= 0.0 {
            return Ok(None);
        }
        let (lattice, points) = (&springs.lattice, &springs.lattice.points);
        let (size, reach, periodic) = (points.size_mm.as_vec2(), narrow(3.0 * body), points.periodic == Tiling::BOTH);
        let pairs = radius_estimate(&points.positions, reach, size, periodic);
        let most = (cx.evaluator.memory() / 50) as f64;
        if pairs > most || (periodic && reach >= 0.5 * size.min_element()) {
            let message =
                format!("body is `{}` mm: about {pairs:.0} bodies would touch; at most {most:.0} are allowed", body);
            let help = format!(
                "points are about {} mm apart; bodies must be smaller than that",
                told(f64::from(points.pitch))
            );
            return Err(Problem::new(Code::TooLarge, message).at("body").help(help).into());
        }
        let until = || cx.check().is_err();
        let near = radius_links_until(&points.positions, reach, size, periodic, &until);
        cx.check()?;
        let (springs_count, count) = (lattice.links.len(), near.pairs.len());
        let extend = |list: &[f32], value: f32| [list, &vec![value; count]].concat();
        let wraps = match (lattice.offsets.is_empty(), near.wraps.is_empty()) {
            (true, true) => Vec::new(),
            (true, false) => [&vec![[0, 0]; springs_count], &near.wraps[..]].concat(),
            (false, true) => [&lattice.offsets[..], &vec![[0, 0]; count]].concat(),
            (false, false) => [&lattice.offsets[..], &near.wraps[..]].concat(),
        };
        Ok(Some(Self {
            links: [&lattice.links[..], &near.pairs[..]].concat(),
            wraps,
            stiffness: extend(&springs.stiffness, narrow(hardness)),
            rest: extend(&springs.rest_length, narrow(body)),
            pushes: [vec![false; springs_count], vec![true; count]].concat(),
        }))
    }
}

/// The quantile of `values` at `share`.
pub(super) fn quantile(values: &[f32], share: f64) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index into the list")]
    let at = ((sorted.len() as f64 * share.clamp(0.0, 1.0)).ceil() as usize).saturating_sub(1);
    sorted.get(at).copied().unwrap_or(f32::INFINITY)
}

/// Outputs of the node.
pub(super) fn outputs(lattice: &Lattice, outcome: &Outcome<f32>) -> Outputs {
    let vectors = |list: &[[f32; 2]]| list.iter().map(|p| Vec2::from_array(*p)).collect::<Vec<_>>();
    let points = Arc::new(Points {
        positions: vectors(&outcome.positions),
        regular: Some(lattice.points.regular.clone().unwrap_or_else(|| lattice.points.positions.clone())),
        ..Points::clone(&lattice.points)
    });
    let broken: Vec<(u32, u32)> = outcome.broken.iter().map(|b| (b.link, b.step)).collect();
    let kept: Vec<usize> = broken.iter().map(|b| b.0 as usize).collect();
    let select = |offsets: &[[i8; 2]]| {
        if offsets.is_empty() { Vec::new() } else { kept.iter().map(|&l| offsets[l]).collect() }
    };
    let only_broken = Lattice {
        points: points.clone(),
        links: Arc::new(kept.iter().map(|&l| lattice.links[l]).collect()),
        offsets: Arc::new(select(&lattice.offsets)),
        // All links of the new lattice are broken ones, with new numbers.
        broken: (0u32..).zip(&broken).map(|(n, &(_, step))| (n, step)).collect(),
        ..Lattice::default()
    };
    let moved = Arc::new(Lattice {
        points: points.clone(),
        velocities: Some(vectors(&outcome.velocities)),
        broken,
        ..lattice.clone()
    });
    // The separate output of points does not belong to a lattice.
    let alone = points.alone();
    let strain = |what| Strain::field(&moved, what);
    let (stretch, breakage) = (strain(StrainQuantity::Stretch), strain(StrainQuantity::Breakage));
    Outputs::one(moved)
        .with("points", alone)
        .with("broken", only_broken)
        .with("stretch", stretch)
        .with("breakage", breakage)
}
