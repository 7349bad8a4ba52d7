//! [`DisplaceMesh`]: a mesh with a height as its relief.
//!
//! The height is read once, on a grid in mm that does not depend on the resolution. Triangles are halved at their
//! longest edges where they are off by more than the error, see
//! [`kernel::displace`](shibo_kernel::body::displace). Cost: that of the height, and about 8 µs for each triangle of
//! the result.
use glam::{DVec2, DVec3, UVec2};
use shibo_kernel::body::displace::{
    BYTES_PER_TRIANGLE, Creases, DisplaceError, Displaced, NotFinite, Relief, Spec, TooMany, displace, hidden,
};
use shibo_kernel::body::{Facing, MOST_ERROR, facing};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Mesh, Stop, Type, Window};

/// Texels along the longer side of the canvas, without `pitch`.
const TEXELS: f64 = 2048.0;

/// Maximum number of texels.
const MOST: f64 = 16_777_216.0;

/// Maximum number of triangles.
const MOST_TRIANGLES: usize = 20_000_000;

/// The triangles of an error are counted up to this many times the allowed number.
const COUNTED: usize = 4;

/// Bytes of memory for a texel of the height.
const BYTES_PER_TEXEL: u64 = 12;

/// The answer to a relief that needs more triangles than allowed.
#[choice]
pub enum OverBudget {
    /// An error. It names the needed number of triangles, and the error that the allowed number is enough for.
    #[default]
    Refuse,
    /// A larger error, with a warning.
    Coarsen,
}

/// The direction of the relief at each point.
#[choice]
pub enum ReliefNormals {
    /// The smooth normals of the mesh.
    #[default]
    Smooth,
    /// The normals of the file, where it has some; their mean where several meet.
    File,
}

/// A mesh with a height as its relief, within an error that is stated and kept: for printers, mills and renderers.
///
/// The points of the mesh move along its normals by the height. Triangles become as small as the relief needs, and no
/// smaller. Where charts meet there is one point, so a closed mesh stays closed. `Model` writes the result as STL, 3MF,
/// PLY or OBJ. Its UVs are those of the atlas.
///
/// Each texel of a chart, and each edge at steps of a texel, is within `error` of the height, unless the relief is so
/// steep that triangles of a quarter of a texel are still off by more; a warning tells that.
///
/// ```ron
/// "ball": MeshShape(shape: Sphere, size: (60, 60, 60)),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "place": BakePosition(atlas: "atlas"),
/// "dents": "= noise(place.r / 7, place.g / 7, place.b / 7)",
/// "example": DisplaceMesh(atlas: "atlas", height: "= 6 * dents", error: 0.1, pitch: 0.4),
/// ```
///
/// Elsewhere: Blender *Displace* with *Adaptive Subdivision*; Houdini *Displacement*; BumpMesh; ZBrush *Apply
/// Displacement Map*.
#[node]
pub struct DisplaceMesh {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// The height, outwards.
    #[schemars(extend("unit" = "mm"))]
    pub height: In<Gray>,
    /// A factor of the height, such as 0 where no relief is wanted.
    pub mask: Option<In<Gray>>,
    /// The largest distance between the mesh and the height.
    #[schemars(range(min = 1e-4, max = 10), extend("unit" = "mm"))]
    #[default(0.02)]
    pub error: f64,
    /// The most triangles of the result.
    #[schemars(range(min = 100, max = 20_000_000))]
    #[default(2_000_000)]
    pub triangles: u32,
    /// The answer to a relief that needs more triangles.
    pub over: OverBudget,
    /// The longest edge before the displacement; 0 for edges of any length.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "mm"))]
    pub edge: f64,
    /// The direction of the relief.
    pub normals: ReliefNormals,
    /// Distance over which the relief falls to 0 towards sharp edges; 0 to follow them.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    pub fade: f64,
    /// The least angle between two triangles at a sharp edge.
    #[schemars(range(min = 1, max = 180), extend("unit" = "°"))]
    #[default(40.0)]
    pub crease: f64,
    /// The direction in which a mould opens. A warning tells the undercuts, which it does not let go; (0, 0, 0) does
    /// not look for them.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6))]
    pub pull: (f64, f64, f64),
    /// Distance of the texels at which the height is read; by default a 2048th of the longer side of the canvas.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub pitch: Option<f64>,
}

/// A place on the surface for messages.
fn place(at: DVec3) -> String {
    format!("({:.2}, {:.2}, {:.2}) mm", at.x, at.y, at.z)
}

fn advice(message: String, at: DVec3, port: &str, help: &str) -> Problem {
    Problem::new(Code::Advice, message).at_mm(at.to_array()).at(port).help(help)
}

impl DisplaceMesh {
    /// Columns and rows of texels.
    fn texels(&self, size: DVec2) -> DVec2 {
        let pitch = self.pitch.unwrap_or(size.max_element() / TEXELS);
        (size / pitch).ceil().max(DVec2::splat(4.0))
    }

    /// The heights on the texels.
    fn relief<'a>(&self, cx: &Context<'_>, atlas: &'a Atlas) -> Result<Relief<'a>, Stop> {
        let size: UVec2 = self.texels(cx.size_mm()).as_uvec2();
        let (grid, window) = (cx.canvas.grid(size), Window::full(size));
        let mut values = cx.evaluator.raster(&cx.get(&self.height)?, &grid, window)?.plane(0).to_vec();
        let mut port = "height";
        if let Some(mask) = cx.get_opt(&self.mask)? {
            let mask = cx.evaluator.raster(&mask, &grid, window)?;
            if mask.plane(0).iter().any(|share| !share.is_finite()) {
                port = "mask";
            }
            values.iter_mut().zip(mask.plane(0)).for_each(|(height, share)| *height *= share);
        }
        let creases = Creases { reach: self.fade, angle: self.crease.to_radians() };
        Relief::new(atlas, values, size, (self.fade > 0.0).then_some(creases)).map_err(|NotFinite { on_canvas, at }| {
            let message = format!(
                "{port} is not a finite number at ({:.2}, {:.2}) mm of the canvas, {} of the mesh",
                on_canvas.x,
                on_canvas.y,
                place(at)
            );
            let help = "look for divisions by zero or overflow in the nodes before it";
            Problem::new(Code::NotFinite, message).at(port).help(help).into()
        })
    }

    /// Refuses an error below the rounding of places.
    fn check_rounding(&self, atlas: &Atlas) -> Result<(), Problem> {
        let [low, high] = atlas.mesh.bounds();
        let rounding = 3.0_f64.sqrt() * low.abs().max(high.abs()).max_element() / 16_777_216.0;
        if 2.0 * rounding <= self.error {
            return Ok(());
        }
        let message =
            format!("error is `{}` mm; places of this mesh are rounded by up to {rounding:.1e} mm", self.error);
        let least = 2.1 * rounding;
        let help = if least > MOST_ERROR {
            "make the mesh smaller, or move it to the origin".to_owned()
        } else {
            format!("write `error: {least:.1e}` or more, or move the mesh to the origin")
        };
        Err(Problem::new(Code::BadValue, message).at("error").help(help))
    }

    /// Refuses a mesh that has too many triangles itself, or needs too much memory.
    fn check_size(&self, cx: &Context<'_>, atlas: &Atlas) -> Result<(), Problem> {
        let (own, allowed) = (atlas.mesh.triangles.len(), self.triangles as usize);
        if own > allowed {
            let message = format!("the mesh itself has {own} triangles; {allowed} are allowed");
            let help = format!("write `triangles: {}`, or give a mesh with fewer", (2 * own).min(MOST_TRIANGLES));
            return Err(Problem::new(Code::OverBudget, message).at("triangles").help(help));
        }
        let texels = u64::from(self.texels(cx.size_mm()).as_uvec2().element_product());
        let (needed, memory) = (BYTES_PER_TEXEL * texels + BYTES_PER_TRIANGLE * own as u64, cx.evaluator.memory());
        if needed <= memory {
            return Ok(());
        }
        let message = format!(
            "{texels} texels of the height and {own} triangles of the mesh need {} MiB; {} MiB are allowed",
            needed.div_ceil(1 << 20),
            memory >> 20
        );
        Err(Problem::new(Code::TooLarge, message).at("pitch").help("raise `--memory`, or make `pitch` larger"))
    }

    /// Refuses a relief that turned the mesh inside out.
    fn check_facing(atlas: &Atlas, made: &Mesh) -> Result<(), Problem> {
        let is_open = atlas.across.iter().flatten().any(|across| *across == Atlas::END);
        if is_open || facing(made) == Facing::Outwards || facing(&atlas.mesh) != Facing::Outwards {
            return Ok(());
        }
        let message = "the relief turns the mesh, or a piece of it, inside out";
        let help = "reduce the depth: it must be less than half the thickness of the mesh";
        Err(Problem::new(Code::BadValue, message).at("height").help(help))
    }

    /// The text about too many triangles, and the remedies.
    fn too_many(&self, many: &TooMany, spec: &Spec) -> (String, String) {
        let allowed = spec.triangles;
        let needed = many.needed.map_or_else(|| format!("more than {}", spec.most), |needed| needed.to_string());
        let message = format!("{} mm needs {needed} triangles; {allowed} are allowed", self.error);
        let triangles = many.needed.map(|needed| format!("`triangles: {needed}`"));
        let error = many.error.map(|error| format!("`error: {error}`"));
        let remedies: Vec<String> = triangles.into_iter().chain(error).collect();
        let help = match &remedies[..] {
            [] if self.edge > 0.0 => "raise `edge` or `triangles`".to_owned(),
            [] => "raise `triangles`, or reduce the height".to_owned(),
            remedies => format!("write {}", remedies.join(", or ")),
        };
        (message, help)
    }

    /// Warns of everything that the result does not show by itself.
    fn warn(&self, cx: &Context<'_>, made: &Displaced, spec: &Spec) {
        let warn = |problem| cx.evaluator.warn(problem);
        let mut error = self.error;
        if let Some(many) = &made.coarser {
            error = many.error.unwrap_or(error);
            let (message, help) = self.too_many(many, spec);
            let message = format!("{message}, so the error is {error} mm");
            warn(Problem::new(Code::Advice, message).at("triangles").help(help));
        }
        let (off, at) = made.off;
        if off > error {
            let message = format!(
                "the mesh is up to {off:.4} mm off the height, at {}: it is too steep for its texels",
                place(at)
            );
            warn(advice(message, at, "height", "blur the height, or make `pitch` smaller"));
        }
        if let Some((apart, at)) = made.apart {
            let message =
                format!("the heights of two charts differ by {apart:.4} mm on their border, at {}", place(at));
            warn(advice(
                message,
                at,
                "height",
                "make the height of fields on the atlas, such as `BakePosition` or `BakeSolid`",
            ));
        }
        if let Some((count, at)) = made.folded {
            let message = format!("{count} triangles face inwards, at {}: the relief folds over itself", place(at));
            warn(advice(message, at, "height", "reduce the depth where the mesh bends, or blur the height"));
        }
        let found = if DVec3::from(self.pull) == DVec3::ZERO {
            None
        } else {
            hidden(&made.mesh, self.pull.into(), &|| cx.check().is_err())
        };
        if let Some(found) = found {
            let message = format!("{:.2} % of the surface is undercut, at {}", 100.0 * found.share, place(found.at));
            warn(advice(message, found.at, "pull", "reduce the steepness of the height, or change the direction"));
        }
    }
}

impl Node for DisplaceMesh {
    const OUTPUTS: &'static [Output] = &[Output::new("mesh", Type::Mesh, "The mesh with the relief.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let texels = self.texels(canvas.size_mm()).element_product();
        if texels <= MOST {
            return Vec::new();
        }
        // Three digits, rounded up.
        let least = 1.001 * (canvas.size_mm().element_product() / MOST).sqrt();
        let mut unit = 1.0_f64;
        while least < 100.0 * unit {
            unit /= 10.0;
        }
        let least = (least / unit).ceil() / (1.0 / unit).round();
        let message =
            format!("pitch is too small; the height would be read at {texels:.0} texels, and {MOST:.0} are allowed");
        vec![Problem::new(Code::TooLarge, message).at("pitch").help(format!("write `pitch: {least}` or more"))]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let atlas = cx.get(&self.atlas)?;
        self.check_rounding(&atlas)?;
        self.check_size(cx, &atlas)?;
        let relief = self.relief(cx, &atlas)?;
        let texels = BYTES_PER_TEXEL * u64::from(relief.texels());
        let room = cx.evaluator.memory().saturating_sub(texels) / BYTES_PER_TRIANGLE;
        let room = usize::try_from(room).unwrap_or(usize::MAX);
        let triangles = self.triangles as usize;
        let spec = Spec {
            error: self.error,
            triangles,
            coarsen: self.over == OverBudget::Coarsen,
            most: (COUNTED * triangles).min(room).min(MOST_TRIANGLES),
            edge: if self.edge > 0.0 { self.edge } else { f64::INFINITY },
            file_normals: self.normals == ReliefNormals::File,
        };
        let made = displace(&relief, &spec, &|| cx.check().is_err()).map_err(|error| match error {
            DisplaceError::Stopped => Stop::Cancelled,
            DisplaceError::TooMany(many) => {
                let (message, help) = self.too_many(&many, &spec);
                Problem::new(Code::OverBudget, message).at("triangles").help(help).into()
            }
            DisplaceError::Memory => {
                let message = format!(
                    "{} mm needs more than {} triangles, for which the memory is too small",
                    self.error, spec.most
                );
                Problem::new(Code::TooLarge, message)
                    .at("triangles")
                    .help("raise `--memory`, or make `error` larger")
                    .into()
            }
        })?;
        Self::check_facing(&atlas, &made.mesh)?;
        self.warn(cx, &made, &spec);
        cx.check()?;
        Ok(Outputs::one(made.mesh))
    }
}
