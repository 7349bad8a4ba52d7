//! Messages about the parameters of a [`MeshAtlas`](super::MeshAtlas) and its mesh, with remedies.
use super::{ChartSource, Triple};
use glam::DVec2;
use shibo_kernel::mesh::atlas::AtlasError;
use shibo_kernel::mesh::seams::SeamError;
use shibo_value::Atlas;
use shibo_value::diagnostics::{Code, Problem};

/// Maximum number of points of all seams.
const MOST: usize = 10_000;

/// Advice to change the size of the canvas, if lengths differ from those on the surface by more than 5 %.
pub(super) fn scale(atlas: &Atlas) -> Option<Problem> {
    let scale = atlas.scale();
    if (scale - 1.0).abs() <= 0.05 {
        return None;
    }
    let size: DVec2 = atlas.size_mm * scale;
    let size = if size.x == size.y { format!("{:.1}", size.x) } else { format!("({:.1}, {:.1})", size.x, size.y) };
    let message = format!(
        "lengths are {scale:.3} times as long on the surface as on the canvas, so features measured in mm have the wrong size"
    );
    Some(Problem::new(Code::Advice, message).at("mesh").help(format!("set `canvas.size_mm: {size}`")))
}

/// The problem for UVs that cannot be used.
pub(super) fn atlas(error: &AtlasError) -> Problem {
    let code = if matches!(error, AtlasError::Charts(_)) { Code::TooLarge } else { Code::BadValue };
    let help = match error {
        AtlasError::Missing | AtlasError::Flat => "take `charts: New`",
        AtlasError::Outside { .. } => {
            "these are UVs of textures that repeat, or of charts that cross the border of a UDIM tile; `charts: Repack` lays the charts out anew, so pictures painted for these UVs no longer fit"
        }
        AtlasError::Charts(_) => "take `charts: New`, or split the mesh by `part` of `LoadMesh`",
    };
    Problem::new(code, format!("the mesh: {error}")).at("charts").help(help)
}

/// Faults of seams that do not depend on the mesh.
pub(super) fn faults(seams: &[Vec<Triple>]) -> Vec<Problem> {
    let mut problems = Vec::new();
    if let Some(short) = seams.iter().position(|line| line.len() < 2) {
        problems.push(Problem::new(Code::BadValue, format!("seam {short} has fewer than two points")).at("seams"));
    }
    if seams.iter().map(Vec::len).sum::<usize>() > MOST {
        problems.push(Problem::new(Code::TooLarge, format!("the seams have more than {MOST} points")).at("seams"));
    }
    problems
}

/// Advice about seams that have no effect.
pub(super) fn idle(charts: ChartSource) -> Problem {
    let message = format!("`seams` does nothing: `charts: {charts:?}` keeps the charts of the mesh");
    Problem::new(Code::Advice, message).at("seams").help("take `charts: New`, or leave it out")
}

/// The problem for seams that do not fit the mesh.
pub(super) fn seam(error: &SeamError) -> Problem {
    let help = match error {
        SeamError::Far { .. } => "give points in mm in the mesh's coordinates, z up",
        SeamError::Apart { .. } => "give each piece of the mesh seams of its own",
    };
    Problem::new(Code::BadValue, error.to_string()).at("seams").help(help)
}
