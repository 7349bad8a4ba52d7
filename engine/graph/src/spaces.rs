//! Nodes that work on the canvas and in space: the types of their outputs, and errors at values that do not go together.
use super::linker::{Linker, Slot, Target};
use super::read::shorten;
use crate::diagnostics::{Code, Diagnostic};
use crate::node::OutputType;
use crate::value::{Accepts, Type};

/// Types of fields that go only with fields of the same type.
const ALONE: [Type; 3] = [Type::Ids, Type::Vec2, Type::Jacobian];

impl Linker<'_> {
    /// Returns true if a solid or a material of solids is at one of these ports of a node.
    pub(super) fn reads_space(&self, flat: usize, ports: &[&str]) -> bool {
        self.flats[flat].slots.iter().filter(|slot| is_at(slot, ports)).any(|slot| self.is_in_space(slot))
    }

    /// Returns true if a value at one of these ports, or at another that takes both, is in space or becomes a solid there.
    pub(super) fn makes_solid(&self, flat: usize, ports: &[&str]) -> bool {
        let converted = |slot: &Slot| self.type_of(&slot.target).is_some_and(|ty| slot.wants.solid_of(ty).is_some());
        let solid = |slot: &Slot| self.is_in_space(slot) || slot.wants.fits(Accepts::InSpace) || converted(slot);
        self.flats[flat].slots.iter().any(|slot| (slot.wants.is_anywhere() || is_at(slot, ports)) && solid(slot))
    }

    /// The widest of the types at these ports, as a solid.
    pub(super) fn widest_solid(&self, flat: usize, ports: &[&str]) -> Option<Type> {
        let types: Vec<_> = self.targets(flat, ports).map(|target| self.type_of(target)).collect();
        let has = |of: &[Type]| types.iter().flatten().any(|ty| of.contains(ty));
        if let Some(ty) = [Type::SolidMaterial, Type::SolidVector].into_iter().find(|ty| has(&[*ty])) {
            return Some(ty);
        }
        match has(&[Type::SolidColor, Type::Rgb, Type::Normal, Type::Picture]) {
            true => Some(Type::SolidColor),
            false => (!types.contains(&None)).then_some(Type::Solid),
        }
    }

    /// The widest of the types at these ports, as a field; for a material, a material.
    pub(super) fn widest_field(&self, flat: usize, ports: &[&str]) -> Option<Type> {
        let types: Vec<_> = self.targets(flat, ports).map(|target| self.field_type(target)).collect();
        let has = |of: &[Type]| types.iter().flatten().any(|ty| of.contains(ty));
        if has(&[Type::SolidMaterial, Type::Material]) {
            return Some(Type::Material);
        }
        if has(&[Type::Normal]) {
            return Some(Type::Normal);
        }
        if has(&[Type::Rgb, Type::SolidColor, Type::SolidVector]) {
            return Some(Type::Rgb);
        }
        // Vectors, matrices and numbers of pieces are not converted.
        if let Some(ty) = ALONE.into_iter().find(|ty| has(&[*ty])) {
            return Some(ty);
        }
        // A port value with an error could have any of these types.
        let unknown = types.contains(&None) || (!self.flats[flat].good && types.is_empty());
        (!unknown).then_some(Type::Gray)
    }

    /// The values at these ports.
    fn targets(&self, flat: usize, ports: &[&str]) -> impl Iterator<Item = &Target> {
        self.flats[flat].slots.iter().filter(|slot| is_at(slot, ports)).map(|slot| &slot.target)
    }

    fn is_in_space(&self, slot: &Slot) -> bool {
        self.type_of(&slot.target).is_some_and(Type::is_in_space)
    }

    /// Returns true for constants, and for values made of constants only by nodes that work on the canvas and in space:
    /// these make constants of constants.
    fn is_constant_everywhere(&self, target: &Target) -> bool {
        let (mut open, mut seen) = (vec![target], 0);
        while let Some(target) = open.pop() {
            if self.is_constant(target) {
                continue;
            }
            let Target::Out { flat, output } = target else { return false };
            let node = &self.flats[*flat];
            // Inputs that lead back to themselves have been reported.
            seen += 1;
            let makes = match node.info {
                Some(info) => info.outputs.get(*output).is_some_and(|output| works_anywhere(output.ty)),
                None => self.type_of(target).is_some_and(Type::is_material) && node.channel.is_none(),
            };
            if !makes || seen > self.flats.len() {
                return false;
            }
            open.extend(node.slots.iter().map(|slot| &slot.target));
        }
        true
    }

    /// Errors at the values of a node that would have to become vectors, matrices or numbers of pieces, because others
    /// are. Only ports that decide the type of an output count.
    pub(super) fn mixed_types(&self, flat: usize) -> Vec<Diagnostic> {
        let node = &self.flats[flat];
        let outputs = node.info.iter().flat_map(|info| info.outputs).map(|output| output.ty);
        let ports = outputs.filter_map(|ty| match ty {
            OutputType::Like(ports) | OutputType::ValueOf(ports) => Some(ports),
            _ => None,
        });
        let ports: Vec<&str> = ports.flatten().copied().collect();
        let typed = || {
            let slots = node.slots.iter().filter(|slot| is_at(slot, &ports));
            slots.filter_map(|slot| Some((slot, self.field_type(&slot.target)?)))
        };
        let Some((first, wanted)) = typed().find(|(_, ty)| ALONE.contains(ty)) else { return Vec::new() };
        let error = |slot: &Slot, ty: Type| {
            let message = format!("{} is {ty}, but {} is {wanted}; they do not go together", slot.port, first.port);
            let error = slot.part.error(Code::TypeMismatch, message);
            error.help(format!("connect {wanted} to both")).related(first.part.span(), format!("this is {wanted}"))
        };
        typed().filter(|(_, ty)| *ty != wanted).map(|(slot, ty)| error(slot, ty)).collect()
    }

    /// Errors at the values of a node that are on the canvas, if other values are in space.
    pub(super) fn mixed_spaces(&self, flat: usize) -> Vec<Diagnostic> {
        let node = &self.flats[flat];
        let outputs = node.info.iter().flat_map(|info| info.outputs).map(|output| output.ty);
        let counts = |slot: &Slot| {
            outputs.clone().any(|ty| match ty {
                OutputType::MaterialOf(ports) | OutputType::NumberOf(ports) | OutputType::ColorOf(ports) => {
                    is_at(slot, ports)
                }
                OutputType::ValueOf(_) | OutputType::Told => slot.wants.is_anywhere(),
                OutputType::Fixed(_) | OutputType::Like(_) => false,
            })
        };
        let slots = || node.slots.iter().filter(|slot| counts(slot));
        let Some(solid) = slots().find(|slot| self.is_in_space(slot)) else { return Vec::new() };
        let on_canvas = |slot: &&Slot| {
            let ty = self.type_of(&slot.target);
            ty.is_some_and(|ty| !ty.is_in_space()) && !self.is_constant_everywhere(&slot.target)
        };
        let error = |slot: &Slot| {
            let is = match self.type_of(&slot.target) {
                Some(Type::Material) => "a material on the canvas".to_owned(),
                Some(ty) => format!("a field ({ty})"),
                None => "a field".to_owned(),
            };
            let message = format!("{} is {is}, but {} is in space; they do not go together", slot.port, solid.port);
            let help = format!("cut {} first: `CutPlane(solid: {})`", solid.port, shorten(solid.part.str()));
            let error = slot.part.error(Code::TypeMismatch, message).help(help);
            error.related(solid.part.span(), "this value is a function of a point in space")
        };
        slots().filter(on_canvas).map(error).collect()
    }
}

/// Returns true for outputs that are on the canvas or in space as the values at some ports.
fn works_anywhere(ty: OutputType) -> bool {
    !matches!(ty, OutputType::Fixed(_) | OutputType::Like(_) | OutputType::Told)
}

/// Returns true if a slot belongs to one of these ports, also as a part of a list of structs: `layers.2.mask`.
fn is_at(slot: &Slot, ports: &[&str]) -> bool {
    let name = slot.port.name();
    ports.iter().any(|port| name == *port || name.split_once('.').is_some_and(|(list, _)| list == *port))
}
