//! What objects and fields look like in JSON.
use glam::DVec3;
use serde::{Serialize, Serializer};
use shibo_engine::value::{
    ColorPattern, CoordMap, Curve, Exemplar, Lattice, Points, Segments, Skeleton, Solid, SpringNet,
};
use std::collections::BTreeMap;

/// A number that reads back exactly; what JSON cannot say is a word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Number(pub(super) f32);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            n if n.is_nan() => serializer.serialize_str("nan"),
            n if n.is_infinite() => serializer.serialize_str(if n > 0.0 { "inf" } else { "-inf" }),
            n => serializer.serialize_f32(n),
        }
    }
}

/// The same in double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exact(f64);

impl Serialize for Exact {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            n if n.is_nan() => serializer.serialize_str("nan"),
            n if n.is_infinite() => serializer.serialize_str(if n > 0.0 { "inf" } else { "-inf" }),
            n => serializer.serialize_f64(n),
        }
    }
}

type Pair = [Number; 2];
type Triple = [Exact; 3];

/// What is printed.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Data {
    Field(FieldData),
    Material(MaterialData),
    Points(PointsData),
    Lattice(LatticeData),
    Springs(SpringsData),
    Segments(SegmentsData),
    Exemplar(ExemplarData),
    Coords(CoordsData),
    Curve(CurveData),
    Skeleton(SkeletonData),
    Pattern(PatternData),
    Solid(SolidData),
}

/// A field at the pixels of a picture, or at points.
#[derive(Serialize)]
pub(super) struct FieldData {
    #[serde(rename = "type")]
    pub(super) ty: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) size: Option<[u32; 2]>,
    pub(super) channels: usize,
    pub(super) values: Vec<Number>,
}

#[derive(Serialize)]
pub(super) struct MaterialData {
    #[serde(rename = "type")]
    ty: &'static str,
    fields: BTreeMap<&'static str, FieldData>,
}

#[derive(Serialize)]
pub(super) struct PointsData {
    #[serde(rename = "type")]
    ty: &'static str,
    points: Vec<Pair>,
}

#[derive(Serialize)]
pub(super) struct LatticeData {
    #[serde(rename = "type")]
    ty: &'static str,
    points: Vec<Pair>,
    links: Vec<[u32; 2]>,
    alive: Vec<bool>,
    /// By how many canvases the second end of each link is shifted, on canvases that tile.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    offsets: Vec<[i8; 2]>,
    /// After a simulation only.
    #[serde(skip_serializing_if = "Option::is_none")]
    velocities: Option<Vec<Pair>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    broken: Option<Vec<(u32, u32)>>,
}

#[derive(Serialize)]
pub(super) struct SpringsData {
    #[serde(flatten)]
    lattice: LatticeData,
    stiffness: Vec<Number>,
    rest_length: Vec<Number>,
    mass: Vec<Number>,
}

#[derive(Serialize)]
pub(super) struct SegmentsData {
    #[serde(rename = "type")]
    ty: &'static str,
    segments: Vec<[Number; 4]>,
    width: Vec<Number>,
}

/// What is shown of an exemplar, and what is known of it.
#[derive(Serialize)]
pub(super) struct ExemplarData {
    #[serde(rename = "type")]
    ty: &'static str,
    size: [u32; 2],
    channels: usize,
    values: Vec<Number>,
    periodic: [bool; 2],
    /// Spacings of the levels that are analysed.
    levels: Vec<usize>,
    /// The vectors by which it repeats, in pixels, once they are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    lattice: Option<[[f64; 2]; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    strength: Option<f64>,
}

/// Positions in an exemplar, by rows.
#[derive(Serialize)]
pub(super) struct CoordsData {
    #[serde(rename = "type")]
    ty: &'static str,
    size: [u32; 2],
    start: [i32; 2],
    /// Finest pixels per pixel.
    spacing: u32,
    /// Shares, after a whole synthesis.
    coherence: Number,
    coverage: Number,
    coords: Vec<Pair>,
}

#[derive(Serialize)]
pub(super) struct CurveData {
    #[serde(rename = "type")]
    ty: &'static str,
    points: Vec<Triple>,
}

#[derive(Serialize)]
pub(super) struct SkeletonData {
    #[serde(rename = "type")]
    ty: &'static str,
    trunk: Vec<[Triple; 4]>,
    branches: Vec<BranchData>,
}

#[derive(Serialize)]
struct BranchData {
    start: Triple,
    direction: Triple,
    thickening_speed: Exact,
    length: Exact,
    dead_from: Exact,
    lifetime: Exact,
}

#[derive(Serialize)]
pub(super) struct PatternData {
    #[serde(rename = "type")]
    ty: &'static str,
    entries: usize,
    table: Vec<[Number; 3]>,
    widths: Vec<Number>,
}

/// A solid at points, channels innermost.
#[derive(Serialize)]
pub(super) struct SolidData {
    #[serde(rename = "type")]
    ty: &'static str,
    channels: usize,
    values: Vec<Exact>,
}

impl Data {
    /// A material, by the names of its channels.
    pub(super) fn material(fields: BTreeMap<&'static str, FieldData>) -> Self {
        Self::Material(MaterialData { ty: "Material", fields })
    }
}

fn pairs(vectors: &[glam::Vec2]) -> Vec<Pair> {
    vectors.iter().map(|v| [Number(v.x), Number(v.y)]).collect()
}

fn numbers(values: &[f32]) -> Vec<Number> {
    values.iter().map(|&v| Number(v)).collect()
}

/// Points.
pub(super) fn points(points: &Points) -> Data {
    Data::Points(PointsData { ty: "Points", points: pairs(&points.positions) })
}

/// Points and links.
pub(super) fn lattice(lattice: &Lattice) -> Data {
    Data::Lattice(lattice_data("Lattice", lattice))
}

fn lattice_data(ty: &'static str, lattice: &Lattice) -> LatticeData {
    LatticeData {
        ty,
        points: pairs(&lattice.points.positions),
        links: lattice.links.to_vec(),
        alive: lattice.alive(),
        offsets: lattice.offsets.to_vec(),
        velocities: lattice.velocities.as_deref().map(pairs),
        broken: lattice.velocities.is_some().then(|| lattice.broken.clone()),
    }
}

/// Springs.
pub(super) fn springs(springs: &SpringNet) -> Data {
    let mass = if springs.mass.is_empty() { vec![1.0; springs.lattice.points.len()] } else { springs.mass.clone() };
    Data::Springs(SpringsData {
        lattice: lattice_data("SpringNet", &springs.lattice),
        stiffness: numbers(&springs.stiffness),
        rest_length: numbers(&springs.rest_length),
        mass: numbers(&mass),
    })
}

/// Line segments.
pub(super) fn segments(segments: &Segments) -> Data {
    let ends = |[a, b]: &[glam::Vec2; 2]| [a.x, a.y, b.x, b.y].map(Number);
    Data::Segments(SegmentsData {
        ty: "Segments",
        segments: segments.ends.iter().map(ends).collect(),
        width: numbers(&segments.width),
    })
}

/// An exemplar.
pub(super) fn exemplar(exemplar: &Exemplar) -> Data {
    let (n, channels) = (exemplar.len(), if exemplar.is_color() { 3 } else { 1 });
    let values = (0..n).flat_map(|p| (0..channels).map(move |c| Number(exemplar.shown[c * n + p]))).collect();
    let vectors = exemplar.lattice.and_then(|lattice| lattice.vectors);
    Data::Exemplar(ExemplarData {
        ty: "Exemplar",
        size: exemplar.frame.size.to_array(),
        channels,
        values,
        periodic: [exemplar.frame.periodic.x, exemplar.frame.periodic.y],
        levels: exemplar.levels.iter().map(|level| level.h).collect(),
        lattice: vectors.map(|v| v.map(|v| v.to_array())),
        strength: exemplar.lattice.map(|lattice| lattice.strength),
    })
}

/// Coordinates.
pub(super) fn coords(map: &CoordMap) -> Data {
    Data::Coords(CoordsData {
        ty: "CoordMap",
        size: map.size.to_array(),
        start: map.start.to_array(),
        spacing: map.spacing,
        coherence: Number(map.coherence),
        coverage: Number(map.coverage),
        coords: map.coords.iter().map(|c| c.map(Number)).collect(),
    })
}

fn triple(v: &DVec3) -> Triple {
    v.to_array().map(Exact)
}

/// Points of a line.
pub(super) fn curve(curve: &Curve) -> Data {
    Data::Curve(CurveData { ty: "Curve", points: curve.points.iter().map(triple).collect() })
}

/// A trunk and its branches.
pub(super) fn skeleton(skeleton: &Skeleton) -> Data {
    let branch = |branch: &shibo_engine::value::Branch| BranchData {
        start: triple(&branch.start),
        direction: triple(&branch.direction),
        thickening_speed: Exact(branch.thickening),
        length: Exact(branch.length),
        dead_from: Exact(branch.dead_from),
        lifetime: Exact(branch.lifetime),
    };
    Data::Skeleton(SkeletonData {
        ty: "Skeleton",
        trunk: skeleton.trunk.iter().map(|controls| controls.each_ref().map(triple)).collect(),
        branches: skeleton.branches.iter().map(branch).collect(),
    })
}

/// The colours of years.
pub(super) fn pattern(pattern: &ColorPattern) -> Data {
    Data::Pattern(PatternData {
        ty: "ColorPattern",
        entries: pattern.entries,
        table: pattern.table.iter().map(|color| color.map(Number)).collect(),
        widths: numbers(&pattern.widths),
    })
}

/// A solid's values at points, given one channel after another.
pub(super) fn solid(solid: &Solid, values: &[f64]) -> Data {
    let (channels, points) = (solid.channels(), values.len() / solid.channels());
    let value = |i: usize| Exact(values[i % channels * points + i / channels]);
    Data::Solid(SolidData { ty: solid.ty().name(), channels, values: (0..values.len()).map(value).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, Vec2};
    use serde_json::{Value as Json, json};
    use std::sync::Arc;

    fn json(data: &impl Serialize) -> Json {
        serde_json::to_value(data).unwrap()
    }

    fn square() -> Lattice {
        let points = Points {
            positions: vec![Vec2::ZERO, Vec2::new(0.5, f32::INFINITY)],
            size_mm: DVec2::ONE,
            pitch: 1.0,
            ..Points::default()
        };
        Lattice {
            points: Arc::new(points),
            links: Arc::new(vec![[0, 1]]),
            offsets: Arc::default(),
            grid: None,
            velocities: None,
            broken: vec![],
        }
    }

    #[test]
    fn numbers_read_back_exactly() {
        for n in [0.1_f32, 1.0 / 3.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, -0.0, 16_777_217.0] {
            let text = serde_json::to_string(&Number(n)).unwrap();
            assert_eq!(text.parse::<f32>().unwrap().to_bits(), n.to_bits(), "{text}");
        }
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(Number);
        assert_eq!(json(&odd), json!(["nan", "inf", "-inf"]));
    }

    #[test]
    fn objects_have_their_fields() {
        let mut lattice = square();
        let plain =
            json!({ "type": "Lattice", "points": [[0.0, 0.0], [0.5, "inf"]], "links": [[0, 1]], "alive": [true] });
        assert_eq!(json(&super::lattice(&lattice)), plain);
        lattice.velocities = Some(vec![Vec2::ONE; 2]);
        lattice.broken = vec![(0, 7)];
        let simulated = json(&super::lattice(&lattice));
        assert_eq!(simulated["velocities"], json!([[1.0, 1.0], [1.0, 1.0]]));
        assert_eq!((&simulated["broken"], &simulated["alive"]), (&json!([[0, 7]]), &json!([false])));
        let springs = SpringNet {
            lattice: Arc::new(square()),
            stiffness: vec![2.0],
            rest_length: vec![-0.5],
            ..SpringNet::default()
        };
        let springs = json(&super::springs(&springs));
        assert_eq!(springs["type"], "SpringNet");
        assert_eq!(springs["mass"], json!([1.0, 1.0]));
        assert_eq!(springs["rest_length"], json!([-0.5]));
    }
}
