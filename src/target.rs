//! `render --as`: writes the materials of a graph for another program, instead of the graph's own outputs.
use crate::quit::Quit;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use shibo_engine::export::Variant;
use shibo_engine::graph::Graph;
use std::sync::LazyLock;

/// Format of the materials.
#[derive(Clone, Debug)]
pub(crate) struct Target(Variant);

static ALL: LazyLock<Vec<Target>> = LazyLock::new(|| Variant::all().into_iter().map(Target).collect());

impl ValueEnum for Target {
    fn value_variants<'a>() -> &'a [Self] {
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name).help(self.0.doc))
    }
}

impl Target {
    /// Replaces the outputs of the graph by its materials in this format.
    pub(crate) fn replace_outputs(&self, graph: &mut Graph, named: bool) -> Result<(), Quit> {
        graph.export_as(&self.0.target, named).map_err(Quit::Usage)
    }
}
