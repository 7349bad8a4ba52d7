//! The outputs of a graph.
use super::linker::{Linker, Target};
use super::output_decl::OutputDecl;
use super::part::{Shape, SyntaxValue};
use super::read::shorten;
use crate::diagnostics::{Code, Span};
use crate::picture::is_output_letter;
use crate::value::Type;
use crate::{Export, GraphOutput};
use petgraph::graph::NodeIndex;
use std::collections::BTreeMap;

/// The longest name of an output in bytes.
const MAX_NAME: usize = 100;

impl Linker<'_> {
    /// Checks the outputs of the first scope. A graph that is only imported may have outputs of any type; solids are
    /// not rendered.
    pub(super) fn outputs(&mut self, rendered: bool) -> Vec<GraphOutput> {
        let docs = self.docs;
        self.enter(0);
        let mut outputs = Vec::new();
        let mut names = BTreeMap::new();
        for decl in &docs[self.scopes[0].doc].document.outputs {
            let named = self.check_name(decl);
            let Some(from) = &decl.from else { continue };
            let Shape::Text(reference) = from.shape() else { continue };
            let meaning = self.resolve(0, from, &reference);
            let Some(mut ty) = self.type_of(&meaning.target) else { continue };
            if let Some(error) = self.check_movable(from, &meaning.target) {
                self.report.push(error);
                continue;
            }
            // Solids are outputs for graphs that import this one.
            if rendered && ty.is_in_space() && decl.export.is_none() {
                continue;
            }
            let is_body = decl.export.as_ref().is_some_and(|export| export.target.target.info().has_body());
            if rendered && ty.renders().is_none() && !ty.is_in_space() && !is_body {
                let message =
                    format!("an output must be a picture, a material or segments; `{}` is {ty}", shorten(&reference));
                let help = "connect a node that draws it; its data can be had with `dump`";
                self.report.push(from.error(Code::TypeMismatch, message).help(help));
                continue;
            }
            let Target::Out { mut flat, mut output } = meaning.target else {
                let message =
                    format!("`{}` is a number or a colour; an output must come from a node", shorten(&reference));
                self.report.push(from.error(Code::TypeMismatch, message));
                continue;
            };
            let Ok(mesh) = self.export_mesh(decl) else { continue };
            let cut = (ty == Type::SolidMaterial).then(|| self.cut_on_mesh(from, (flat, output), mesh)).flatten();
            if let Some(cut) = cut {
                (flat, output, ty) = (cut, 0, Type::Material);
            }
            let Ok(export) = self.export(decl, from, (flat, ty)) else { continue };
            if named {
                self.claim(decl, (flat, ty), export.as_ref(), &mut names);
            }
            outputs.push(GraphOutput {
                format: decl.format,
                depth: decl.depth,
                combined: decl.combined,
                range: decl.range,
                storage: decl.storage,
                export,
                mesh,
                ..GraphOutput::plain(decl.name.clone(), (NodeIndex::new(flat), output), ty, from.span())
            });
        }
        outputs
    }

    fn check_name(&mut self, decl: &OutputDecl) -> bool {
        let why = if decl.name.is_empty() {
            "it is empty"
        } else if decl.name.len() > MAX_NAME {
            "it is longer than 100 bytes"
        } else if !decl.name.chars().all(is_output_letter) {
            "an output's name is letters, digits, `_`, `-` and `.`"
        } else if decl.name.starts_with('.') {
            "a file whose name begins with a dot is hidden"
        } else {
            return true;
        };
        let message = format!("`{}` cannot be the name of an output: {why}", shorten(&decl.name));
        self.report.push(decl.key.error(Code::BadName, message));
        false
    }

    /// Reserves the file names of an output, which must differ in more than letter case.
    fn claim(
        &mut self,
        decl: &OutputDecl,
        (flat, ty): (usize, Type),
        export: Option<&Export>,
        names: &mut BTreeMap<String, (Span, String)>,
    ) {
        let channels = || {
            // The channels of a faulty material are unknown.
            let channels = self.flats[flat].channels.unwrap_or_default();
            channels.iter().map(|channel| format!("{}_{}", decl.name, channel.name())).collect::<Vec<_>>()
        };
        let files: Vec<String> = match export.map(|export| export.target.plan()) {
            Some(plan) if !plan.one_file => {
                let also = plan.also.iter().map(|suffix| format!("{}_{suffix}", decl.name));
                channels().into_iter().chain(also).chain([decl.name.clone()]).collect()
            }
            Some(plan) => {
                let also = plan.also.iter().map(|suffix| format!("{}_{suffix}", decl.name));
                also.chain([decl.name.clone()]).collect()
            }
            None if ty == Type::Material && !decl.combined => channels(),
            None => vec![decl.name.clone()],
        };
        for file in files {
            if let Some((span, other)) = names.get(&file.to_ascii_lowercase()) {
                let message = if *other == decl.name {
                    continue;
                } else if file == decl.name {
                    format!("`{file}` would overwrite a file of the output `{other}`")
                } else {
                    format!("`{}` would write `{file}`, as the output `{other}` does", decl.name)
                };
                self.report.push(name_error(&decl.key, message, *span));
                return;
            }
            names.insert(file.to_ascii_lowercase(), (decl.key.span(), decl.name.clone()));
        }
    }
}

fn name_error(key: &SyntaxValue, message: String, other: Span) -> crate::diagnostics::Diagnostic {
    let help = "names must differ by more than upper and lower case";
    key.error(Code::BadName, message).help(help).related(other, "the other output is here")
}
