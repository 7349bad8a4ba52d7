//! [`Weave`]: woven cloth.
//!
//! See [`kernel::weave`](shibo_kernel::pattern::weave). Cost: O(pixels) for each output.
use super::pieces::{drawn, places};
use crate::degrees::sin_cos;
use crate::fitted;
use glam::DVec2;
use shibo_kernel::pattern::finish::degrees;
use shibo_kernel::pattern::weave::{Binding, Cloth, WeavePlane, Woven, satin_step};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling, Type};
use std::sync::Arc;

/// Woven cloth, straps, basketry: threads that cross over and under each other.
///
/// Warp threads run down, weft threads across. A *piece* is a float: the part of a thread that shows between two
/// crossings; `local.x` runs along it. On a canvas that tiles, distances between threads are changed so that the whole
/// weave repeats, and a warning gives the change.
///
/// A pixel shows the thread at its centre; only holes are drawn by the share of the pixel that they cover. Threads have
/// steep flanks where one goes under another, and an average over each pixel would cost many times as much. So if
/// threads are less than about ten pixels wide, a small picture differs from the average of a large one: for a smooth
/// picture, render larger and scale the result down.
///
/// ```ron
/// "cloth": Weave(binding: Twill, over: 2, under: 2, pitch: 2, width: 1.9, thickness: 0.6),
/// "example": Relief(height: "cloth"),
/// ```
///
/// Elsewhere: Substance Designer *Weave Generator*; Material Maker *Weave*, *Diagonal Weave*.
#[node]
#[derive(PartialEq)]
pub struct Weave {
    /// Pattern in which threads cross.
    #[default(Binding::Plain)]
    pub binding: Binding,
    /// With `Twill` and `Satin`: number of weft threads that a warp thread goes over. With `Basket`: number of threads
    /// in a group.
    #[schemars(range(min = 1, max = 24))]
    #[default(2)]
    pub over: u32,
    /// With `Twill` and `Satin`: number of weft threads that a warp thread goes under.
    #[schemars(range(min = 1, max = 24))]
    #[default(2)]
    pub under: u32,
    /// Distance between warp threads and between weft threads, from middle to middle; one number sets both.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Xy::new(1.0, 1.0))]
    pub pitch: Xy,
    /// Width of warp and of weft threads; at most the distance between them.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Xy::new(0.85, 0.85))]
    pub width: Xy,
    /// Thickness of warp and of weft threads.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Xy::new(0.4, 0.4))]
    pub thickness: Xy,
    /// Amplitude with which the middle of warp and of weft threads rises and sinks; by default half the thickness of
    /// the other thread, as if both bend equally.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    pub crimp: Option<Xy>,
    /// Rotation of the cloth, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
}

impl Weave {
    fn cloth(&self) -> Cloth {
        let half = DVec2::new(self.thickness.x, self.thickness.y) * 0.5;
        Cloth {
            binding: self.binding,
            over: i64::from(self.over),
            under: i64::from(self.under),
            pitch: DVec2::new(self.pitch.x, self.pitch.y),
            width: DVec2::new(self.width.x, self.width.y),
            crimp: self.crimp.map_or(DVec2::new(half.y, half.x), |c| DVec2::new(c.x, c.y)),
            half,
        }
    }

    fn woven(&self, canvas: &CanvasFacts) -> Option<Woven> {
        Woven::new(self.cloth(), sin_cos(self.angle), (canvas.size_mm(), canvas.tile()))
    }
}

impl Node for Weave {
    const OUTPUTS: &'static [Output] = &[
        Output::new(
            "height",
            Type::Gray,
            "Height over the middle of the cloth; holes are as deep as the lowest thread.",
        )
        .in_unit("mm"),
        Output::new("gap", Type::Gray, "1 in the holes between threads, 0 on them.").formerly("mask"),
        Output::new("warp", Type::Gray, "1 where a warp thread lies on top, 0 where a weft thread does."),
        Output::new("ids", Type::Ids, "The number of the float, from 1; in a hole that of the nearest thread."),
        Output::new("local", Type::Vec2, "The place within the float from its middle: along the thread and across it.")
            .in_unit("mm"),
        Output::new("angle", Type::Gray, "The angle of the thread on top, from +x towards +y.").in_unit("°"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let threads = self.over + self.under;
        if self.binding == Binding::Satin {
            if self.over.min(self.under) != 1 {
                let message = format!("`Satin` over {} and under {}; one of them must be 1", self.over, self.under);
                return vec![Problem::new(Code::OutOfRange, message).at("over").help("write `over: 4, under: 1`")];
            }
            if satin_step(i64::from(threads)).is_none() {
                let message = format!("there is no satin of {threads} threads; it takes 5, or 7 and more");
                return vec![Problem::new(Code::OutOfRange, message).at("over").help("write `over: 4, under: 1`")];
            }
        }
        let cloth = self.cloth();
        if cloth.width.cmpgt(cloth.pitch * (1.0 + 1e-9)).any() {
            let (w, p) = (cloth.width, cloth.pitch);
            let message = format!(
                "width is `({}, {})` mm; threads must not be wider than their distance, ({}, {}) mm",
                w.x, w.y, p.x, p.y
            );
            return vec![Problem::new(Code::OutOfRange, message).at("width")];
        }
        if self.woven(canvas).is_none() { vec![fitted::too_many("pitch")] } else { Vec::new() }
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let Some(woven) = self.woven(canvas) else { return Vec::new() };
        let wanted = DVec2::new(self.pitch.x, self.pitch.y);
        fitted::advice(
            ("pitch", "distances of threads"),
            [wanted, woven.fit.units()],
            [self.angle, degrees(woven.fit.direction(DVec2::X))],
            fitted::FITS,
        )
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let woven = Arc::new(self.woven(cx.canvas).ok_or_else(|| fitted::too_many("pitch"))?);
        let tiling = cx.tiling();
        let plane = |ty: Type, plane: WeavePlane| {
            drawn(&woven, ty, tiling, move |woven, frame, out| woven.fill(plane, frame, out))
        };
        let local = places(&woven, tiling, Woven::local);
        Ok(Outputs::one(plane(Type::Gray, WeavePlane::Height))
            .with("gap", plane(Type::Gray, WeavePlane::Gap))
            .with("warp", plane(Type::Gray, WeavePlane::Warp))
            .with("ids", plane(Type::Ids, WeavePlane::Ids))
            .with("local", local)
            .with("angle", plane(Type::Gray, WeavePlane::Angle)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::{OnCanvas as _, canvas};

    #[test]
    fn every_binding_conforms() {
        for (binding, over, under) in [
            (Binding::Plain, 1, 1),
            (Binding::Twill, 3, 1),
            (Binding::Satin, 1, 4),
            (Binding::Satin, 7, 1),
            (Binding::Basket, 3, 1),
        ] {
            for angle in [0.0, 45.0] {
                let node = Weave { binding, over, under, angle, pitch: Xy::new(1.3, 0.9), ..Weave::default() };
                conforms(&node, &[]);
            }
        }
    }

    #[test]
    fn refuses_invalid_weaves() {
        let refused = |node: Weave| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        let satin = |over, under| Weave { binding: Binding::Satin, over, under, ..Weave::default() };
        assert_eq!(refused(satin(4, 1)), None);
        assert_eq!(refused(satin(3, 1)).as_deref(), Some("over"));
        assert_eq!(refused(satin(3, 2)).as_deref(), Some("over"));
        assert_eq!(refused(Weave { width: Xy::new(1.1, 0.5), ..Weave::default() }).as_deref(), Some("width"));
        assert_eq!(
            refused(Weave { pitch: Xy::new(1e-3, 1e-3), width: Xy::new(1e-4, 1e-4), ..Weave::default() }).as_deref(),
            Some("pitch")
        );
        let uneven = Weave { pitch: Xy::new(1.3, 1.0), ..Weave::default() };
        assert!(uneven.advice_on(&canvas())[0].message.starts_with("distances of threads are 1."));
    }
}
