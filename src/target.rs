//! `render --as`: writes the materials of a graph for another program, instead of the graph's own outputs.
use crate::quit::Quit;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use shibo_graph::Graph;
use shibo_picture::export::Chosen;
use std::sync::LazyLock;

/// Format of the materials.
#[derive(Clone, Debug)]
pub(crate) struct Target(&'static str, &'static str, Chosen);

static ALL: LazyLock<Vec<Target>> =
    LazyLock::new(|| Chosen::variants().into_iter().map(|(name, doc, chosen)| Target(name, doc, chosen)).collect());

impl ValueEnum for Target {
    fn value_variants<'a>() -> &'a [Self] {
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0).help(self.1))
    }
}

impl Target {
    /// Its name, and a sentence about it.
    pub(crate) fn told(&self) -> (&'static str, &'static str) {
        (self.0, self.1)
    }

    /// Replaces the outputs of the graph by its materials in this format.
    pub(crate) fn replace_outputs(&self, graph: &mut Graph, named: bool) -> Result<(), Quit> {
        graph.export_as(&self.2, named).map_err(Quit::Usage)
    }
}
