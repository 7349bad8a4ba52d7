//! Solids that are the same everywhere.
use super::solid::{Patch, Planes, Solid, SolidSource, Wants};
use super::{Cost, Key, Type};
use glam::DVec3;

/// The values of the channels.
struct Constant(Vec<f32>);

impl SolidSource for Constant {
    fn fill(&self, _patch: &Patch<'_>, _inputs: &[Planes<'_>], out: &mut [&mut [f32]]) {
        out.iter_mut().zip(&self.0).for_each(|(plane, value)| plane.fill(*value));
    }

    fn exact(&self, at: &[DVec3], _inputs: &[Vec<f64>]) -> Option<Vec<f64>> {
        Some(self.0.iter().flat_map(|value| std::iter::repeat_n(f64::from(*value), at.len())).collect())
    }

    fn wants(&self) -> Wants {
        Wants { place: false, quads: false, rounded: false }
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}

impl Solid {
    /// The solid of type `ty` with these values everywhere; a single value counts for every channel.
    pub fn constant(ty: Type, values: &[f32]) -> Self {
        let value = |channel: usize| values.get(channel).or(values.first()).copied().unwrap_or(0.0);
        let values: Vec<f32> = (0..ty.channels()).map(value).collect();
        let bytes: Vec<u8> = values.iter().flat_map(|value| (value + 0.0).to_bits().to_le_bytes()).collect();
        let key = Key::of("constant solid", &[ty.name().as_bytes(), &bytes]);
        Self::new(ty, Vec::new(), Constant(values)).keyed(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn has_its_values_everywhere() {
        let points = [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)];
        let color = Solid::constant(Type::SolidColor, &[0.25, 0.5, 1.0]);
        assert_eq!(color.at(&points), [0.25, 0.25, 0.5, 0.5, 1.0, 1.0]);
        assert_eq!(Solid::constant(Type::SolidVector, &[2.0]).at(&points[..1]), [2.0; 3]);
        assert_ne!(color.key(), Solid::constant(Type::SolidVector, &[0.25, 0.5, 1.0]).key());
    }
}
