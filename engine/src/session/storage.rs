//! The fields of a picture as stored in its file: colour spaces, direction of normals, and fields for mip levels.
use super::job::Job;
use super::plan::{OutputPart, Planned};
use crate::export::y_down;
use crate::graph::{FileColors, Storage};
use crate::picture::{Depth, Encoding, MipFilter, REC709_TO_AP1, Transfer};
use crate::value::{Channel, Field, Halo, Material, Tile, Type, Value};

/// The chromaticities of AP1: red, green, blue and white.
const AP1: [f32; 8] = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.321_68, 0.337_67];
/// The chromaticities of Rec.709.
const REC709: [f32; 8] = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];

/// The primaries that a file's header states, if the graph states a colour space.
pub(super) fn chromaticities(storage: &Storage) -> Option<[f32; 8]> {
    storage.color_space.map(|space| if space == FileColors::AcesCg { AP1 } else { REC709 })
}

/// Converts a field to its stored form.
pub(super) fn stored(storage: &Storage, field: Field) -> Field {
    match field.ty() {
        Type::Normal if storage.normal_down => y_down(&field),
        Type::Rgb if storage.color_space == Some(FileColors::AcesCg) => to_ap1(&field),
        _ => field,
    }
}

fn to_ap1(color: &Field) -> Field {
    Field::map(Type::Rgb, [color.clone()], Halo::NONE, |out: &mut Tile, [from]: [&Tile; 1]| {
        for (row, plane) in REC709_TO_AP1.iter().zip(out.planes_mut()) {
            let pixels = from.plane(0).iter().zip(from.plane(1)).zip(from.plane(2));
            plane.iter_mut().zip(pixels).for_each(|(out, ((r, g), b))| *out = row[0] * r + row[1] * g + row[2] * b);
        }
        Ok(())
    })
}

/// The mip filters of a job's picture; empty without mip levels. Adds the normal that a roughness needs to the fields,
/// if the picture lacks it.
pub(super) fn mips(job: &mut Job<'_>, channel: Option<Channel>, material: Option<&Material>) -> Vec<MipFilter> {
    let storage = job.planned.output.storage;
    if !storage.mip || !job.planned.format.has_mips() {
        return Vec::new();
    }
    let mut filters = Vec::new();
    let mut first = 0;
    for (name, field) in &job.fields {
        let own = channel.or_else(|| Channel::from_name(name));
        match normal_of(own).filter(|_| storage.widen_roughness) {
            Some(normal) if material.is_some_and(|material| material.get(normal).is_some()) => {
                let within = job.fields.iter().position(|(name, _)| name == normal.name());
                let planes = |count: usize| job.fields.iter().take(count).map(|(_, field)| field.channels()).sum();
                filters.push(MipFilter::Roughness { normal: planes(within.unwrap_or(job.fields.len())) });
            }
            _ if field.ty() == Type::Normal => filters.push(MipFilter::Normal),
            _ => filters.extend(std::iter::repeat_n(MipFilter::Mean, field.channels())),
        }
        first += field.channels();
    }
    let beyond = filters.iter().any(|filter| matches!(filter, MipFilter::Roughness { normal } if *normal >= first));
    if let Some(normal) = normal_of(channel).filter(|_| beyond).and_then(|normal| material?.get(normal)) {
        job.fields.push((String::new(), normal.clone()));
        job.beyond = 1;
    }
    filters
}

/// The normals whose averaging widens a roughness.
fn normal_of(channel: Option<Channel>) -> Option<Channel> {
    match channel? {
        Channel::Roughness => Some(Channel::Normal),
        Channel::CoatRoughness => Some(Channel::CoatNormal),
        _ => None,
    }
}

/// The names of a field's channels in a file; for a material `channel.R`.
fn channel_names(prefix: &str, ty: Type) -> Vec<String> {
    let parts: &[&str] = match ty {
        Type::Rgb => &["R", "G", "B"],
        Type::Normal if prefix.is_empty() => &["R", "G", "B"],
        Type::Normal => &["X", "Y", "Z"],
        Type::Vec2 => &["X", "Y"],
        Type::Jacobian => &["J00", "J01", "J10", "J11"],
        _ if prefix.is_empty() => &["Y"],
        _ => return vec![prefix.to_owned()],
    };
    let dot = if prefix.is_empty() { "" } else { "." };
    parts.iter().map(|part| format!("{prefix}{dot}{part}")).collect()
}

/// The conversion of values to samples.
pub(super) fn encoding(planned: &Planned<'_>, job: &Job<'_>) -> Encoding {
    let ty = job.fields.first().map_or(Type::Gray, |(_, field)| field.ty());
    let whole = match planned.depth {
        Depth::U8 => 255.0,
        _ => 65_535.0,
    };
    let (lo, hi) = if ty == Type::Ids { (0.0, whole) } else { planned.range };
    #[expect(clippy::cast_possible_truncation, reason = "picture samples are f32")]
    let range = (lo as f32, hi as f32);
    let light = matches!(planned.output.storage.color_space, Some(FileColors::LinearRec709 | FileColors::AcesCg));
    let transfer = if ty == Type::Rgb && !light { Transfer::Srgb } else { Transfer::Raw };
    Encoding { transfer, range: Some(range), ..Encoding::default() }
}

/// The job of a picture of `value`.
pub(super) fn job<'g>(mut planned: Planned<'g>, value: &Value) -> Job<'g> {
    let fields = match (value, &planned.part) {
        (Value::Material(material), OutputPart::Channel(channel)) => {
            vec![(String::new(), material.or_default(*channel))]
        }
        (Value::Material(material), _) => {
            material.channels().iter().map(|(channel, field)| (channel.name().to_owned(), field.clone())).collect()
        }
        _ => {
            let (field, told) = value.rendered().unzip();
            planned.metadata.extend(told.into_iter().flatten());
            field.map(|field| (String::new(), field)).into_iter().collect()
        }
    };
    let storage = planned.output.storage;
    let (part, fields) =
        (planned.part.clone(), fields.into_iter().map(|(name, field)| (name, stored(&storage, field))));
    let fields = fields.collect();
    let mut job = Job { planned, fields, lines: value.lines(), beyond: 0, mips: Vec::new(), files: None };
    let channel = if let OutputPart::Channel(channel) = part { Some(channel) } else { None };
    job.mips = mips(&mut job, channel, if let Value::Material(material) = value { Some(material) } else { None });
    job
}

impl Job<'_> {
    /// The names of the file's channels.
    pub(super) fn channels(&self) -> Vec<String> {
        let own = &self.fields[..self.fields.len() - self.beyond];
        own.iter().flat_map(|(name, field)| channel_names(name, field.ty())).collect()
    }
}
