//! Gabor noise: short wave packets at random positions, periodic on a canvas that tiles.
//!
//! Source: A. Lagae et al., "Procedural noise using sparse Gabor convolution" (2009). A packet is a wave with one
//! wavelength under a Gaussian window, `e^(-π a²(X²/s² + Y²)) · cos(2π Y/λ + φ)`, where Y runs across the stripes and X
//! along them; a follows from the bandwidth, s is the aspect. Differs in three ways: phases φ are random instead of
//! weights, which makes the noise statistically the same everywhere; packets lie in cells that repeat with the canvas,
//! a fixed number in each; and each packet is turned as a whole by the angle field at its middle. The Gaussian is
//! lowered by a hundredth, so that it ends.
//!
//! Values have mean ½ and a standard deviation of 0.155, as for all noises. Waves shorter than four pixels fade out,
//! and vanish at two. Cost: O(pixels), about 13 packets each, about 60 ns.

use crate::ground::hash::Hash;
use crate::ground::math::{cos, exp2, max, saturate, smooth};
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, View, WindowExt, index, offset};
use glam::{DVec2, IVec2};
use shibo_value::{Tiling, Window};
use std::f64::consts::{LN_2, PI, TAU};

/// Parameters of the waves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaborSpec {
    /// Distance between stripes, mm, > 0.
    pub wavelength: f64,
    /// Range of wavelengths at half strength, octaves, > 0.
    pub bandwidth: f64,
    /// Length of a packet along its stripes divided by its width, > 0.
    pub aspect: f64,
    /// Direction of the stripes, degrees from +x towards +y; that of the field is added.
    pub angle: f64,
    /// The maximum random turn of a packet either way, degrees.
    pub spread: f64,
}

/// Number of packets in a cell.
const PACKETS: u64 = 4;
/// The value of the Gaussian at its end, as a fraction of its height.
const END: f64 = 0.01;
/// Standard deviation of the values.
const DEVIATION: f64 = 0.155;

/// Gabor noise on a canvas.
#[derive(Clone, Debug)]
pub struct Gabor {
    spec: GaborSpec,
    hash: Hash,
    /// Size of a cell, mm.
    cell: DVec2,
    /// Numbers of cells on the canvas, in directions in which it repeats.
    period: [Option<i64>; 2],
    /// Reach of a packet across its stripes, mm.
    half: f64,
    /// Factor on the sum of packets.
    scale: f64,
}

/// A wave packet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Packet {
    middle: DVec2,
    phase: f32,
    /// The turn in degrees.
    turn: f64,
}

impl GaborSpec {
    /// The parameter a of the Gaussian, 1/mm.
    fn decay(&self) -> f64 {
        let octaves = libm::exp2(self.bandwidth);
        (octaves - 1.0) / (octaves + 1.0) * (PI / LN_2).sqrt() / self.wavelength
    }

    /// Reach of a packet from its middle, mm.
    pub fn reach(&self) -> f64 {
        self.half() * self.aspect.max(1.0)
    }

    fn half(&self) -> f64 {
        (-libm::log(END) / PI).sqrt() / self.decay()
    }
}

/// The Gaussian at a squared fraction of its reach; 0 from 1 on.
#[inline(always)]
fn bell(square: f32) -> f32 {
    // 2^(-square·log2(1/END)), lowered by END.
    const LOG: f32 = 6.643_856;
    const LOW: f32 = 0.01;
    max(exp2(-LOG * square) - LOW, 0.0) * (1.0 / (1.0 - LOW))
}

impl Gabor {
    /// For a canvas of this size in mm that repeats in the given directions.
    pub fn new(spec: &GaborSpec, (size, tiling): (DVec2, Tiling), hash: Hash) -> Self {
        let half = spec.half();
        let side = half * spec.aspect.sqrt();
        let fit = |size: f64, tiles: bool| {
            let count = (size / side).round().clamp(1.0, 1e9);
            #[expect(clippy::cast_possible_truncation, reason = "limited to 10^9")]
            let cells = count as i64;
            if tiles { (size / count, Some(cells)) } else { (side, None) }
        };
        let ((x, across), (y, down)) = (fit(size.x, tiling.x), fit(size.y, tiling.y));
        let cell = DVec2::new(x, y);
        // Half the integral of the squared Gaussian over the plane, times packets per mm².
        let steps = 2000;
        let area: f64 = (0..steps)
            .map(|k| (f64::from(k) + 0.5) / f64::from(steps))
            .map(|r| f64::from(bell(narrow(r * r))).powi(2) * TAU * r / f64::from(steps))
            .sum();
        let variance = 0.5 * area * half * half * spec.aspect * PACKETS as f64 / cell.element_product();
        Self { spec: *spec, hash, cell, period: [across, down], half, scale: DEVIATION / variance.sqrt() }
    }

    /// Halo of angles around a window, in pixels.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded by the canvas")]
    pub fn halo(&self, step: [f64; 2]) -> [usize; 2] {
        step.map(|step| ((self.spec.reach() / step).ceil() as usize).saturating_add(1))
    }

    /// Fills `out` over the frame's window. `angles` are degrees over that window grown by the [halo](Self::halo).
    ///
    /// # Panics
    /// If `out` is smaller than the window.
    pub fn fill(&self, frame: &Frame, angles: Option<&View<'_>>, out: &mut [f32]) {
        let rect = frame.window;
        let pixels = self.spec.wavelength / frame.step[0].max(frame.step[1]);
        let visible = smooth(narrow(0.5 * pixels - 1.0));
        out[..rect.len()].fill(0.0);
        if visible > 0.0 && !rect.is_empty() {
            let strength = narrow(self.scale) * visible;
            simd::dispatch(
                #[inline(always)]
                || {
                    self.packets(frame, |packet| {
                        let turn =
                            packet.turn + angles.map_or(0.0, |angles| f64::from(nearest(frame, angles, packet.middle)));
                        self.add(frame, packet, turn, strength, out);
                    });
                },
            );
        }
        out[..rect.len()].iter_mut().for_each(|v| *v = saturate(*v + 0.5));
    }

    /// Calls `each` for all packets that reach the window, in the order of their cells.
    #[inline(always)]
    fn packets(&self, frame: &Frame, mut each: impl FnMut(Packet)) {
        let rect = frame.window;
        let reach = self.spec.reach();
        let low = DVec2::from(frame.center(rect.x, rect.y)) - reach;
        let high = DVec2::from(frame.center(rect.right() - 1, rect.bottom() - 1)) + reach;
        let (low, high) = ((low / self.cell).floor(), (high / self.cell).floor());
        #[expect(clippy::cast_possible_truncation, reason = "cells of the canvas and a little around it")]
        let range = |k: usize| low[k] as i64..=high[k] as i64;
        for row in range(1) {
            for column in range(0) {
                let name =
                    |at: i64, k: usize| self.period[k].map_or(at, |period| at.rem_euclid(period)).cast_unsigned();
                let hash = self.hash.with(name(column, 0)).with(name(row, 1));
                for n in 0..PACKETS {
                    let draw = |k: u64| hash.unit(4 * n + k);
                    let middle = (DVec2::new(column as f64, row as f64) + DVec2::new(draw(0), draw(1))) * self.cell;
                    let turn = self.spec.angle + self.spec.spread * (2.0 * draw(3) - 1.0);
                    each(Packet { middle, phase: narrow(draw(2) * TAU), turn });
                }
            }
        }
    }

    /// Adds a packet, turned by `turn` degrees.
    #[inline(always)]
    fn add(&self, frame: &Frame, packet: Packet, turn: f64, strength: f32, out: &mut [f32]) {
        let rect = frame.window;
        let (sin, c) = (libm::sin(turn.to_radians()), libm::cos(turn.to_radians()));
        // q = A dx² + 2 B dx dy + C dy² is 1 where the Gaussian ends.
        let across = 1.0 / (self.half * self.half);
        let along = across / (self.spec.aspect * self.spec.aspect);
        let (qa, qb) = (c * c * along + sin * sin * across, c * sin * (along - across));
        let qc = sin * sin * along + c * c * across;
        let wave = TAU / self.spec.wavelength;
        let (wx, wy) = (-sin * wave, c * wave);
        let rows = span(frame, 1, packet.middle.y, (qa / (qa * qc - qb * qb)).sqrt());
        for y in rows.0..rows.1 {
            let dy = frame.center(0, y)[1] - packet.middle.y;
            let square = (qb * dy) * (qb * dy) - qa * (qc * dy * dy - 1.0);
            if square <= 0.0 {
                continue;
            }
            let (from, to) = span(frame, 0, packet.middle.x - qb * dy / qa, square.sqrt() / qa);
            let start = offset(y - rect.y) * rect.columns() + offset(from - rect.x);
            let line = &mut out[start..start + offset(to - from)];
            let (qa, qb) = (narrow(qa), narrow(2.0 * qb * dy));
            let (qc, wx, wy) = (narrow(qc * dy * dy), narrow(wx), narrow(wy * dy) + packet.phase);
            for (out, x) in line.iter_mut().zip(from..) {
                // Computed from the pixel's absolute position, so that it is the same in every window.
                let dx = narrow(frame.center(x, 0)[0] - packet.middle.x);
                let square = dx * (qa * dx + qb) + qc;
                *out += strength * bell(square) * cos(wx * dx + wy);
            }
        }
    }
}

/// The half-open range of the window's pixels, along an axis, within `half` mm of a position, plus one pixel.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "limited to the window")]
fn span(frame: &Frame, axis: usize, place: f64, half: f64) -> (i32, i32) {
    let rect = frame.window;
    let (low, high) = if axis == 0 { (rect.x, rect.right()) } else { (rect.y, rect.bottom()) };
    let pixel = |mm: f64| (mm - frame.origin[axis]) / frame.step[axis] - 0.5;
    let bring = |at: f64| at.clamp(f64::from(low), f64::from(high)) as i32;
    let (from, to) = (bring(pixel(place - half).floor()), bring(pixel(place + half).ceil() + 1.0));
    (from, to.max(from))
}

/// Angle at the pixel nearest to a position, among the given pixels.
#[expect(clippy::cast_possible_truncation, reason = "limited to the window")]
fn nearest(frame: &Frame, angles: &View<'_>, place: DVec2) -> f32 {
    let window: Window = angles.window();
    let at = (place - DVec2::from(frame.origin)) / DVec2::from(frame.step);
    let low = IVec2::new(window.x, window.y);
    let high = low + IVec2::new(index(window.columns()), index(window.rows())) - 1;
    let at = at.floor().clamp(low.as_dvec2(), high.as_dvec2());
    angles.at(at.x as i32, at.y as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: DVec2 = DVec2::new(30.0, 20.0);

    fn spec() -> GaborSpec {
        GaborSpec { wavelength: 1.0, bandwidth: 1.0, aspect: 1.0, angle: 0.0, spread: 0.0 }
    }

    fn render(spec: &GaborSpec, rect: Window, step: f64) -> Vec<f32> {
        let mut out = vec![0.0; rect.len()];
        Gabor::new(spec, (SIZE, Tiling::BOTH), Hash::new(7)).fill(&Frame::new(rect, [step; 2]), None, &mut out);
        out
    }

    #[test]
    fn is_the_sum_of_its_packets() {
        let spec = GaborSpec { aspect: 2.0, angle: 30.0, spread: 40.0, bandwidth: 0.8, ..spec() };
        let gabor = Gabor::new(&spec, (SIZE, Tiling::BOTH), Hash::new(7));
        let rect = Window::of(40, 31, 37, 20);
        let frame = Frame::new(rect, [0.1, 0.1]);
        let mut packets = Vec::new();
        gabor.packets(&frame, |packet| packets.push(packet));
        // The definition, packet by packet.
        let half_strength = libm::exp2(0.8);
        let a = (half_strength - 1.0) / (half_strength + 1.0) * (PI / LN_2).sqrt();
        let value = |x: f64, y: f64| {
            let sum: f64 = packets
                .iter()
                .map(|packet| {
                    let angle = packet.turn.to_radians();
                    let (dx, dy) = (x - packet.middle.x, y - packet.middle.y);
                    let (along, across) = (dx * angle.cos() + dy * angle.sin(), dy * angle.cos() - dx * angle.sin());
                    let bell = (-PI * a * a * (along * along / 4.0 + across * across)).exp();
                    ((bell - 0.01) / 0.99).max(0.0) * (TAU * across + f64::from(packet.phase)).cos()
                })
                .sum();
            (0.5 + gabor.scale * sum).clamp(0.0, 1.0)
        };
        let mut out = vec![0.0; rect.len()];
        gabor.fill(&frame, None, &mut out);
        for (k, got) in out.iter().enumerate() {
            let [x, y] = frame.center(40 + index(k % 37), 31 + index(k / 37));
            assert!((f64::from(*got) - value(x, y)).abs() < 2e-4, "{k}: {got} {}", value(x, y));
        }
    }

    #[test]
    fn has_its_mean_and_deviation_and_its_wavelength() {
        for (bandwidth, aspect, angle) in [(1.0, 1.0, 0.0), (0.6, 3.0, 50.0), (1.5, 0.6, 200.0)] {
            let out = render(
                &GaborSpec { bandwidth, aspect, angle, wavelength: 0.3, ..spec() },
                Window::of(0, 0, 600, 400),
                0.05,
            );
            let n = out.len() as f64;
            let mean = out.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
            let deviation = (out.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / n).sqrt();
            assert!((mean - 0.5).abs() < 0.02 && (deviation - 0.155).abs() < 0.02, "{bandwidth}: {mean} {deviation}");
        }
        // Stripes along x, 1 mm apart: the correlation is negative at half a wavelength and positive at a whole one.
        let out = render(&GaborSpec { bandwidth: 0.3, ..spec() }, Window::of(0, 0, 600, 400), 0.05);
        let product = |dx: usize, dy: usize| {
            let pairs = (0..340 * 500).map(|k| (k % 500 + 600 * (k / 500), dx + 600 * dy));
            pairs.map(|(k, d)| f64::from(out[k] - 0.5) * f64::from(out[k + d] - 0.5)).sum::<f64>() / (340.0 * 500.0)
        };
        let whole = product(0, 0);
        assert!(product(0, 10) < -0.8 * whole && product(0, 20) > 0.7 * whole && product(10, 0) > 0.8 * whole);
    }

    #[test]
    fn windows_agree_and_repeat() {
        let spec = GaborSpec { aspect: 4.0, angle: 20.0, spread: 15.0, ..spec() };
        let whole = render(&spec, Window::of(-20, -20, 340, 120), 0.1);
        let part = render(&spec, Window::of(3, 17, 50, 40), 0.1);
        for y in 0..40 {
            let start = (y + 37) * 340 + 23;
            assert_eq!(part[y * 50..(y + 1) * 50], whole[start..start + 50], "row {y}");
        }
        let there = render(&spec, Window::of(303, 217, 50, 40), 0.1);
        assert!(part.iter().zip(&there).all(|(a, b)| (a - b).abs() < 1e-4));
        // Waves of less than two pixels vanish.
        assert!(render(&spec, Window::of(0, 0, 40, 30), 0.6).iter().all(|v| *v == 0.5));
    }

    #[test]
    fn packets_are_turned_by_the_field() {
        let gabor = Gabor::new(&spec(), (SIZE, Tiling::BOTH), Hash::new(7));
        let rect = Window::of(0, 0, 60, 40);
        let frame = Frame::new(rect, [0.1; 2]);
        let big = rect.with_halo(gabor.halo(frame.step));
        let (mut turned, angles) = (vec![0.0; rect.len()], vec![70.0; big.len()]);
        gabor.fill(&frame, Some(&View::new(&angles, big)), &mut turned);
        assert_eq!(turned, render(&GaborSpec { angle: 70.0, ..spec() }, rect, 0.1));
    }
}
