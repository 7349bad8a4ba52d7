//! Lists of structs whose fields are ports: `layers: [(material: "a"), (material: "b", mask: "m", opacity: 0.5)]`.
//!
//! A value connected to such a port becomes an ordinary slot of the node, with the port `layers.2.mask`; the struct
//! receives the index of the slot.
use super::linker::Linker;
use super::part::{Entry, Shape, SyntaxValue};
use super::read::shorten;
use super::subst::{Substituted, substitute, substitute_with};
use crate::diagnostics::Code;
use crate::node::{ParamInfo, PortInfo, Role};

impl Linker<'_> {
    /// Reads a list of structs: the values of ports become slots of the node, and the slot numbers replace them in the
    /// list. `None` after an error.
    pub(super) fn read_structs(
        &mut self,
        flat: usize,
        name: &str,
        param: &ParamInfo,
        value: &SyntaxValue,
    ) -> Option<Substituted> {
        let scope = self.flats[flat].scope;
        let Shape::List(items) = value.shape() else {
            return substitute(value, &self.scopes[scope].params, self.report);
        };
        let (mut replaced, mut good) = (Vec::new(), true);
        for (index, item) in (1..).zip(&items) {
            let Shape::Named(entries) = item.shape() else { continue };
            good &= self.know_fields(flat, name, param, &entries);
            for field in &param.fields {
                let Role::Port(port) = &field.role else { continue };
                let Some(entry) = entries.iter().find(|entry| entry.name == field.name) else {
                    good &= !port.required || self.missing_in(flat, name, &field.name, port, item);
                    continue;
                };
                let first = self.flats[flat].slots.len();
                match self.read_port(flat, &format!("{name}.{index}.{}", field.name), port, &entry.value) {
                    Some(slots) => {
                        let numbers: Vec<_> = (first..first + slots.len()).map(|slot| slot.to_string()).collect();
                        let text = if port.list { format!("[{}]", numbers.join(", ")) } else { numbers.concat() };
                        replaced.push((entry.value.clone(), text));
                        self.flats[flat].slots.extend(slots);
                    }
                    None => good = false,
                }
            }
        }
        let value = substitute_with(value, &self.scopes[scope].params, self.report, &replaced);
        value.filter(|_| good)
    }

    /// Reports unknown fields of a struct; returns true if there are none.
    fn know_fields(&mut self, flat: usize, name: &str, param: &ParamInfo, entries: &[Entry]) -> bool {
        let names = || param.fields.iter().map(|field| field.name.as_str());
        let unknown: Vec<_> = entries.iter().filter(|entry| !names().any(|name| name == entry.name)).collect();
        for entry in &unknown {
            let kind = &self.flats[flat].kind_name;
            let message = format!("the `{name}` of `{kind}` have no field `{}`", shorten(&entry.name));
            self.report.unknown(entry.key.error(Code::UnknownField, message), &entry.name, "field", names());
        }
        unknown.is_empty()
    }

    fn missing_in(&mut self, flat: usize, name: &str, field: &str, port: &PortInfo, item: &SyntaxValue) -> bool {
        let kind = &self.flats[flat].kind_name;
        let message = format!("each of the `{name}` of `{kind}` needs `{field}` ({})", port.ty);
        let help = format!("write `{field}: \"node\"`");
        self.report.push(item.error(Code::MissingInput, message).help(help));
        false
    }
}

/// Returns true if a parameter is a list of structs with ports.
pub(super) fn has_ports(param: &ParamInfo) -> bool {
    param.fields.iter().any(|field| matches!(field.role, Role::Port(_)))
}
