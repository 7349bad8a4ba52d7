//! Finding a node by what it does, or by what another program calls it.
use super::doc::{Block, blocks, summary};
use shibo_engine::node::KindInfo;
use shibo_engine::registry::Registry;

/// How the paragraph of a manual begins that names the nodes of other programs.
const ELSEWHERE: &str = "Elsewhere:";

/// Names of other programs for kinds whose manual has no such paragraph, and for the use of sub-graphs.
const OTHERS: &[(&str, &str)] = &[
    ("Use", "Substance Designer Graph Instance, Blender Node Group, Houdini Subnet, Material Maker Group"),
    ("Each", "Houdini For-Each, Copy to Points, Blender Instance on Points, Substance Designer Multi Switch"),
    ("Math", "Blender Math, Substance Designer Pixel Processor, Houdini Math, Unreal Add Multiply"),
    ("Expression", "Substance Designer Pixel Processor, Houdini VEX Wrangle, Material Maker Custom Shader"),
    ("Blend", "Substance Designer Blend, Blender Mix Color, Photoshop Layer, Material Maker Blend"),
    ("BlendMaterials", "Substance Designer Material Blend, Height Blend, Blender Mix Shader"),
    ("GradientMap", "Blender ColorRamp, Substance Designer Gradient Map, Houdini Ramp, Material Maker Colorize"),
    ("Levels", "Substance Designer Levels, Blender Map Range, RGB Curves, Photoshop Levels"),
    ("Remap", "Blender Map Range, Houdini Fit, Substance Designer Histogram Scan, Histogram Range"),
    ("Transform", "Substance Designer Transformation 2D, Blender Mapping, Material Maker Transform"),
    ("Warp", "Substance Designer Directional Warp, Vector Warp, Blender Displace, Material Maker Warp"),
    ("Blur", "Substance Designer Blur HQ, Gaussian Blur, Material Maker Gaussian Blur"),
    ("DistanceField", "Substance Designer Distance, Material Maker Distance, Houdini SDF"),
    ("Pillow", "Substance Designer Bevel, Material Maker Bevel"),
    ("Worley", "Substance Designer Cells, Blender Voronoi Texture, Houdini Worley Noise, Material Maker Voronoi"),
    ("Perlin", "Blender Noise Texture, Houdini Perlin Noise, Substance Designer Perlin Noise"),
    ("Fractal", "Blender Noise Texture, Musgrave Texture, fBm, Substance Designer Clouds, Fractal Sum"),
    ("Gradient", "Substance Designer Gradient Linear, Blender Gradient Texture, Wave Texture"),
    ("Constant", "Substance Designer Uniform Color, Blender Value, RGB"),
    ("Image", "Substance Designer Bitmap, Blender Image Texture, Houdini File"),
    ("HeightToNormal", "Substance Designer Normal, Blender Bump, Material Maker Normal Map"),
    ("AmbientOcclusion", "Substance Designer Ambient Occlusion HBAO, RTAO, Blender Ambient Occlusion"),
    ("Relief", "Substance Designer 3D View, Blender Viewport, Light"),
    ("Material", "Substance Designer Output, Base Material, Blender Principled BSDF, Material Output"),
    ("MaterialChannel", "Substance Designer Material Switch, Blender Separate, Houdini Extract"),
    ("TileSampler", "Substance Designer Tile Sampler, Shape Splatter, Material Maker Tiler"),
    ("PoissonPoints", "Blender Distribute Points on Faces, Poisson Disk, Houdini Scatter"),
    ("Exemplar", "Texture synthesis, Substance Designer Make It Tile"),
];

/// A kind that was found, its first sentence, and what other programs call it, if that is why.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Found<'r> {
    pub(super) kind: &'r str,
    pub(super) summary: String,
    pub(super) elsewhere: Option<String>,
}

/// The names that other programs have for a kind.
fn elsewhere(kind: &str, doc: &str) -> String {
    let paragraph = blocks(doc).into_iter().find_map(|block| match block {
        Block::Paragraph(text) => text.strip_prefix(ELSEWHERE).map(|names| names.trim().replace('*', "")),
        _ => None,
    });
    let other = || OTHERS.iter().find(|(name, _)| *name == kind).map(|(_, names)| (*names).to_owned());
    paragraph.or_else(other).unwrap_or_default()
}

/// Letters and digits only, in lower case: `ColorRamp`, `color ramp` and `colour_ramp` differ by one letter at most.
fn squash(text: &str) -> String {
    let plain: String = text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    plain.replace("colour", "color").replace("grey", "gray")
}

/// How well a kind fits, the smallest being the best.
fn rank(query: &str, kind: &str, summary: &str, elsewhere: &str) -> Option<(u8, usize)> {
    let (whole, name) = (squash(query), squash(kind));
    let words: Vec<String> = query.split_whitespace().map(squash).filter(|word| !word.is_empty()).collect();
    if words.is_empty() {
        return None;
    }
    let all_in = |text: &str| words.iter().all(|word| text.contains(word.as_str()));
    let rank = if name.starts_with(&whole) {
        0
    } else if name.contains(&whole) {
        1
    } else if elsewhere.split([',', '.']).any(|one| squash(one).contains(&whole)) {
        2
    } else if squash(summary).contains(&whole) {
        3
    } else if all_in(&squash(&format!("{kind} {summary} {elsewhere}"))) {
        4
    } else {
        return None;
    };
    Some((rank, name.len()))
}

/// The kinds that fit a query, the best first.
pub(super) fn search<'r>(registry: &'r Registry, query: &str) -> Vec<Found<'r>> {
    let kinds =
        registry.kinds().filter_map(|kind| registry.info(kind)).map(|info: &KindInfo| (&*info.kind, &*info.doc));
    let mut found = Vec::new();
    for (kind, doc) in kinds.chain(super::composition::KINDS) {
        let (summary, names) = (summary(doc), elsewhere(kind, doc));
        if let Some(rank) = rank(query, kind, &summary, &names) {
            let elsewhere = (matches!(rank.0, 2 | 4) && !names.is_empty()).then_some(names);
            found.push((rank, Found { kind, summary, elsewhere }));
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.kind.cmp(b.1.kind)));
    found.into_iter().map(|(_, found)| found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_programs_are_found() {
        let doc = "Does a thing.\n\nElsewhere: Substance Designer *Tile Sampler*, Material Maker *Tiler*.";
        assert_eq!(elsewhere("Kind", doc), "Substance Designer Tile Sampler, Material Maker Tiler.");
        assert!(elsewhere("GradientMap", "Colours.").contains("ColorRamp"));
        assert_eq!(elsewhere("Unknown", "Nothing."), "");
    }

    #[test]
    fn the_nearest_comes_first() {
        let rank = |query: &str| rank(query, "GradientMap", "Colours by value.", "Blender ColorRamp, Houdini Ramp.");
        assert_eq!(rank("gradient").map(|r| r.0), Some(0));
        assert_eq!(rank("Map").map(|r| r.0), Some(1));
        assert_eq!(rank("colour ramp").map(|r| r.0), Some(2));
        assert_eq!(rank("colors by").map(|r| r.0), Some(3));
        assert_eq!(rank("value ramp").map(|r| r.0), Some(4));
        // Across the names of two nodes it comes last.
        assert_eq!(rank("ramp hou").map(|r| r.0), Some(4));
        assert_eq!(rank("spring"), None);
        assert_eq!(rank(" "), None);
    }
}
