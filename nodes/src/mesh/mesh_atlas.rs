//! [`MeshAtlas`]: the layout of a mesh on the canvas.
//!
//! [`kernel::charts`](shibo_kernel::mesh::charts) finds given charts, [`kernel::unwrap`](shibo_kernel::mesh::unwrap)
//! makes new ones. Cost: O(triangles), about 1 µs per triangle; with new charts about 50 µs.
use super::bake_parts::Parts;
use glam::{DVec3, Vec2};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::stop::unwind_when;
use shibo_kernel::mesh::atlas::laid_out;
use shibo_kernel::mesh::layout::{Layout, layout};
use shibo_kernel::mesh::seams::seams;
use shibo_kernel::mesh::unwrap::{Unwrap, UnwrapError, unwrap};
use shibo_kernel::mesh::{bake, fields};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Mesh, Stop, Tiling, Type};
use std::sync::Arc;

mod advice;
mod udim;

pub use udim::Udim;

/// A place in mm.
type Triple = (f64, f64, f64);

/// Source of the charts.
#[choice]
pub enum ChartSource {
    /// The mesh's own UVs, or new charts if it has none.
    #[default]
    Auto,
    /// The mesh's own UVs.
    Given,
    /// New charts.
    New,
    /// The charts of the mesh's own UVs, packed again: all at the same scale, with gaps between them.
    Repack,
}

/// Space around new charts, in texels of `page`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Gutter {
    /// This number of texels.
    Texels(u32),
    /// Enough for two texels at each of this number of mip levels; each level has half the resolution of the one
    /// before.
    Levels(u32),
}

impl Gutter {
    /// The gutter in texels.
    fn texels(self) -> u32 {
        match self {
            Self::Texels(n) => n,
            Self::Levels(n) => 2 << n.clamp(1, 12).saturating_sub(1),
        }
    }
}

/// How new charts are packed.
#[choice]
pub enum Pack {
    /// By shape, also into hollows of other charts.
    #[default]
    Shape,
    /// In rows: much faster for many charts, but less dense.
    Fast,
}

/// Reaction to triangles that overlap on the canvas.
#[choice]
pub enum Overlap {
    /// A warning.
    #[default]
    Warn,
    /// An error.
    Refuse,
}

/// Lays a mesh out on the canvas: each triangle gets a place in the picture, so that textures on the canvas are
/// textures of the mesh.
///
/// The unit square of UVs is the canvas, v down; if UVs lie in several UDIM tiles, the tiles lie side by side on the
/// canvas. Triangles that are connected on the canvas make a *chart*. Nodes without an atlas measure lengths on the
/// canvas. These lengths are right on the surface if the canvas has the scale of the charts; if not, a warning gives
/// the factor.
///
/// ```ron
/// "ball": MeshShape(shape: Sphere),
/// "example": MeshAtlas(mesh: "ball", charts: New),
/// ```
///
/// Elsewhere: Blender *Smart UV Project*, *Pack Islands*; Houdini *UV Flatten*, *UV Layout*; Substance Painter
/// *Auto-unwrap*.
#[node]
pub struct MeshAtlas {
    /// The mesh.
    pub mesh: In<Mesh>,
    /// Source of the charts.
    #[default(ChartSource::Auto)]
    pub charts: ChartSource,
    /// For the mesh's own UVs: the UDIM tiles that the canvas holds.
    #[default(Udim::Auto)]
    pub udim: Udim,
    /// For new charts: largest angle between a triangle and the rest of its chart. Lower values give flatter charts and
    /// more borders.
    #[schemars(range(min = 1, max = 89), extend("unit" = "°"))]
    #[default(70.0)]
    pub angle: f64,
    /// For new charts: largest factor between areas in a chart and on the surface.
    #[schemars(range(min = 1, max = 100))]
    #[default(4.0)]
    pub stretch: f64,
    /// For new charts: resolution of the packing grid, in texels along the shorter side of the canvas.
    #[schemars(range(min = 64, max = 16384), extend("unit" = "px"))]
    #[default(1024)]
    pub page: u32,
    /// For new charts: space around each chart.
    #[schemars(extend("minimum" = 1, "maximum" = 4096))]
    #[default(Gutter::Texels(4))]
    pub gutter: Gutter,
    /// For new charts: method of packing.
    #[default(Pack::Shape)]
    pub pack: Pack,
    /// For new charts: lines at which the surface is cut, each of at least two points on it. From each point to the
    /// next the cut follows the shortest path along edges of polygons. At most 10000 points.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub seams: Vec<Vec<Triple>>,
    /// Reaction to triangles that overlap on the canvas.
    #[default(Overlap::Warn)]
    pub overlap: Overlap,
}

/// Maximum number of texels along a side of the grid that finds overlaps.
const LOOK: u32 = 1024;
/// Share of texels that may be covered twice without a warning.
const TWICE: f64 = 1e-3;

impl MeshAtlas {
    /// The UVs of all corners on the canvas.
    fn uvs(&self, mesh: &Mesh, cx: &Context<'_>) -> Result<Vec<[Vec2; 3]>, Stop> {
        let repack = match self.charts {
            ChartSource::Auto | ChartSource::New if mesh.uvs.is_empty() => false,
            ChartSource::New => false,
            ChartSource::Auto | ChartSource::Given if !mesh.uvs.is_empty() => {
                if self.charts == ChartSource::Auto && !self.seams.is_empty() {
                    cx.evaluator.warn(advice::idle(self.charts));
                }
                let (size, until) = (cx.size_mm(), || cx.check().is_err());
                let laid = unwind_when(&until, |watch| self.udim.laid(mesh, size.x / size.y, watch));
                let (uvs, told) = laid.ok_or(Stop::Cancelled)??;
                told.into_iter().for_each(|problem| cx.evaluator.warn(problem));
                return Ok(uvs);
            }
            _ if mesh.uvs.is_empty() => {
                let message = format!("the mesh has no UVs, which `charts: {:?}` needs", self.charts);
                return Err(Problem::new(Code::MissingInput, message).at("charts").help("take `charts: New`").into());
            }
            _ => true,
        };
        let how = Unwrap {
            repack,
            angle: narrow(self.angle),
            stretch: narrow(self.stretch),
            page: self.page,
            gutter: self.gutter.texels(),
            tight: self.pack == Pack::Shape,
        };
        let line = |line: &Vec<Triple>| line.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect();
        let lines: Vec<Vec<DVec3>> = self.seams.iter().filter(|_| !repack).map(line).collect();
        let seams = match &lines[..] {
            [] => Vec::new(),
            lines => seams(mesh, lines).map_err(|error| advice::seam(&error))?,
        };
        unwrap(mesh, cx.size_mm(), &how, &seams, &|| cx.check().is_ok()).map_err(|error| match error {
            UnwrapError::Cancelled => Stop::Cancelled,
            UnwrapError::Full(_) => Problem::new(Code::BadValue, format!("the mesh: {error}"))
                .at("gutter")
                .help("lower `gutter`, or raise `page`")
                .into(),
            UnwrapError::Impossible(_) => Problem::new(Code::BadValue, format!("the mesh: {error}")).at("mesh").into(),
        })
    }

    /// Warnings about a finished atlas, and errors that need it.
    fn look(&self, atlas: &Atlas, found: Layout, cx: &Context<'_>) -> Result<(), Stop> {
        if let Some((share, pair)) = found.overlap.filter(|(share, _)| *share > TWICE) {
            let name = |n: usize| {
                let part = atlas.mesh.part_names.get(usize::from(atlas.mesh.parts.get(n).copied().unwrap_or(0)));
                format!("triangle {n} of `{}`", part.map_or("", String::as_str))
            };
            let message = format!(
                "{:.1} % of the texels belong to several triangles, for example {} and {}; each texel shows one of them",
                100.0 * share,
                name(pair[0]),
                name(pair[1])
            );
            let help = "if both may look alike, leave it; else take `charts: Repack` or `New`, which lay the charts out anew, so that pictures painted for these UVs no longer fit";
            if self.overlap == Overlap::Refuse {
                return Err(Problem::new(Code::BadValue, message).at("overlap").help(help).into());
            }
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("overlap").help(help));
        } else if found.close {
            let side = self.page.min(LOOK);
            let message = format!("charts come closer to each other than two texels at {side}²: colours may bleed");
            let help = "render larger pictures; or take `charts: Repack`, which lays the charts out anew, so that pictures painted for these UVs no longer fit";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("charts").help(help));
        }
        if let Some(problem) = advice::scale(atlas) {
            cx.evaluator.warn(problem);
        }
        Ok(())
    }
}

impl Node for MeshAtlas {
    const OUTPUTS: &'static [Output] = &[
        Output::new("atlas", Type::Atlas, "The mesh on the canvas."),
        Output::new("mask", Type::Gray, "1 where a texel's centre lies in a chart, 0 elsewhere."),
        Output::new(
            "charts",
            Type::Ids,
            "The number of each texel's chart, from 1; 0 beyond charts and their gutters.",
        ),
        Output::new(
            "stretch",
            Type::Gray,
            "How many times more a texel is stretched in one direction than across it: 1 or more.",
        ),
        Output::new("texel", Type::Gray, "How large a texel is on the surface.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        advice::faults(&self.seams).into_iter().chain(self.udim.fault()).collect()
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let kept = matches!(self.charts, ChartSource::Given | ChartSource::Repack);
        let seams = (kept && !self.seams.is_empty()).then(|| advice::idle(self.charts));
        seams.into_iter().chain(self.udim.idle(self.charts)).collect()
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mesh = cx.get(&self.mesh)?;
        let uvs = self.uvs(&mesh, cx)?;
        let until = || cx.check().is_err();
        let made = unwind_when(&until, |watch| {
            let atlas = laid_out(mesh, &uvs, cx.size_mm(), watch).map_err(|error| advice::atlas(&error))?;
            let look = layout(&atlas, self.page.min(LOOK), watch);
            Ok::<_, Problem>((Arc::new(atlas), look))
        });
        let (atlas, found) = made.ok_or(Stop::Cancelled)??;
        self.look(&atlas, found, cx)?;
        let mask = fields::baked(Type::Gray, &atlas, |texels, mut planes| {
            if let [out] = &mut planes[..] {
                bake::mask(texels.values, out);
            }
        });
        let stretches: Vec<[f64; 2]> = (0..atlas.uvs.len()).into_par_iter().map(|n| bake::stretch(&atlas, n)).collect();
        let ratio = |[large, small]: &[f64; 2]| if *small > 0.0 { narrow((large / small).min(1e6)) } else { 0.0 };
        let ratios: Vec<f32> = stretches.iter().map(ratio).collect();
        let scales: Vec<f32> = stretches.iter().map(|[large, small]| narrow((large * small).sqrt())).collect();
        let stretch = fields::baked(Type::Gray, &atlas, move |texels, mut planes| {
            if let [out] = &mut planes[..] {
                bake::of_triangles(texels, &ratios, out);
            }
        });
        let texel = fields::baked(Type::Gray, &atlas, move |texels, mut planes| {
            if let [out] = &mut planes[..] {
                bake::of_triangles(texels, &scales, out);
                let step = narrow((texels.grid.step.x * texels.grid.step.y).sqrt());
                out.iter_mut().for_each(|scale| *scale *= step);
            }
        });
        let charts = Parts::Chart.field(&atlas);
        let outputs = Outputs::one(shibo_value::Value::Atlas(atlas));
        Ok(outputs.with("mask", mask).with("charts", charts).with("stretch", stretch).with("texel", texel))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshForm, MeshShape};
    use crate::testing::{canvas, check_field, outputs, port};
    use shibo_value::{Field, Value};

    fn mesh(shape: MeshForm) -> Mesh {
        let node = MeshShape { shape, segments: 24, ..MeshShape::default() };
        match outputs(&node, &[], &canvas()).unwrap().take("mesh", true) {
            Some(Value::Mesh(mesh)) => Mesh::clone(mesh),
            other => panic!("{other:?}"),
        }
    }

    fn made(node: &MeshAtlas, mesh: Mesh) -> Result<Outputs, Stop> {
        outputs(node, &[Value::Mesh(Arc::new(mesh))], &canvas())
    }

    fn atlas_in(outputs: &Outputs) -> Arc<Atlas> {
        match outputs.take("atlas", true) {
            Some(Value::Atlas(atlas)) => atlas.clone(),
            other => panic!("{other:?}"),
        }
    }

    fn field_in(outputs: &Outputs, name: &str) -> Field {
        match outputs.take(name, false) {
            Some(Value::Field(field)) => field.clone(),
            other => panic!("{name}: {other:?}"),
        }
    }

    fn node(charts: ChartSource) -> MeshAtlas {
        MeshAtlas { mesh: port(0), charts, page: 256, ..MeshAtlas::default() }
    }

    #[test]
    fn outputs_hold_in_any_window() {
        let outputs = made(&node(ChartSource::Auto), mesh(MeshForm::Torus)).unwrap();
        for name in ["mask", "charts", "stretch", "texel"] {
            check_field(&field_in(&outputs, name));
        }
    }

    #[test]
    fn takes_charts_from_the_chosen_source() {
        let count = |charts, mesh| atlas_in(&made(&node(charts), mesh).unwrap()).chart_count();
        assert_eq!(count(ChartSource::Auto, mesh(MeshForm::Cube)), 6);
        assert_eq!(count(ChartSource::Given, mesh(MeshForm::Cube)), 6);
        assert_eq!(count(ChartSource::Repack, mesh(MeshForm::Cylinder)), 3);
        let mut bare = mesh(MeshForm::Torus);
        bare.uvs.clear();
        assert!(count(ChartSource::Auto, bare.clone()) > 1);
        assert!(count(ChartSource::New, mesh(MeshForm::Torus)) > 1);
        for charts in [ChartSource::Given, ChartSource::Repack] {
            let Err(Stop::Failed(problem)) = made(&node(charts), bare.clone()) else { panic!("no error") };
            assert_eq!((problem.code, problem.field.as_deref()), (Code::MissingInput, Some("charts")));
        }
    }

    #[test]
    fn wrong_uvs_are_refused() {
        let mut tiled = mesh(MeshForm::Torus);
        tiled.uvs.iter_mut().flatten().for_each(|uv| *uv *= 3.0);
        let Err(Stop::Failed(problem)) = made(&node(ChartSource::Auto), tiled.clone()) else { panic!("no error") };
        assert_eq!((problem.code, problem.field.as_deref()), (Code::BadValue, Some("charts")));
        assert!(problem.help.unwrap().contains("Repack"));
        assert!(atlas_in(&made(&node(ChartSource::Repack), tiled).unwrap()).chart_count() > 0);
        // Two sides of a box at the same place.
        let mut double = mesh(MeshForm::Cube);
        let half = double.uvs.len() / 6;
        for n in 0..half {
            double.uvs[n] = double.uvs[n + half];
        }
        let refuse = MeshAtlas { overlap: Overlap::Refuse, ..node(ChartSource::Given) };
        let Err(Stop::Failed(problem)) = made(&refuse, double.clone()) else { panic!("no error") };
        assert_eq!((problem.code, problem.field.as_deref()), (Code::BadValue, Some("overlap")));
        assert!(made(&node(ChartSource::Given), double).is_ok());
    }

    #[test]
    fn advises_size_of_canvas() {
        // A sheet of 60 mm on a canvas of 32 mm.
        let outputs = made(&node(ChartSource::Auto), mesh(MeshForm::Plane)).unwrap();
        let advice = advice::scale(&atlas_in(&outputs)).unwrap();
        assert_eq!(advice.help.as_deref(), Some("set `canvas.size_mm: 60.0`"));
        let canvas = canvas();
        let texel = crate::testing::raster(&field_in(&outputs, "texel"), &canvas);
        assert!(texel.data().iter().all(|v| (v - 60.0 / 64.0).abs() < 1e-5));
        let stretch = crate::testing::raster(&field_in(&outputs, "stretch"), &canvas);
        assert!(stretch.data().iter().all(|v| (v - 1.0).abs() < 1e-4));
    }

    #[test]
    fn converts_gutters_to_texels() {
        assert_eq!((Gutter::Texels(3).texels(), Gutter::Levels(1).texels(), Gutter::Levels(6).texels()), (3, 2, 64));
    }
}
