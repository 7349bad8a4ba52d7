//! The manual of nodes for agents.
use super::Refusal;
use crate::Tools;
use crate::manual::{Found, node, search};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value as Json, json};
use shibo_ide::manual::markdown;
use shibo_ide::manual::words::WORDS;

/// The most kinds of an answer.
const MOST: usize = 40;

/// Words to look for.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchRequest {
    /// Words of a name or a summary, or the name of a node in another program; empty for all kinds.
    #[serde(default)]
    pub words: String,
}

/// A kind to describe.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KindRequest {
    /// The kind, such as `Perlin`; also `Use` and `Each`.
    pub kind: String,
}

/// Kinds of nodes that were found, the best first.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct FoundKinds {
    /// The kinds.
    pub nodes: Vec<FoundKind>,
}

/// A kind of nodes.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct FoundKind {
    /// The kind, such as `Perlin`.
    pub kind: String,
    /// The family of nodes.
    pub family: String,
    /// The first sentence of its manual.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub summary: Option<String>,
    /// Its names in other programs, if they are the reason why it was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elsewhere: Option<String>,
}

/// The manual of a kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct KindManual {
    /// The kind.
    pub kind: String,
    /// The family of nodes.
    pub family: String,
    /// The whole manual with an example, as Markdown.
    pub manual: String,
    /// The version of the kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<u32>,
    /// The description.
    #[serde(default)]
    pub doc: String,
    /// The ports.
    #[serde(default)]
    pub ports: Vec<PortManual>,
    /// The parameters.
    #[serde(default)]
    pub parameters: Vec<ParamManual>,
    /// The outputs.
    #[serde(default)]
    pub outputs: Vec<OutputManual>,
}

/// A port of a kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct PortManual {
    /// The name.
    pub name: String,
    /// The type of values that it takes.
    #[serde(rename = "type")]
    pub ty: String,
    /// True if it must be given.
    pub required: bool,
    /// True if it takes a list of wires.
    pub list: bool,
    /// The value without a wire.
    pub default: Json,
    /// The least and the largest number in place of a wire.
    pub range: Option<(Option<f64>, Option<f64>)>,
    /// The unit.
    pub unit: Option<String>,
    /// The description.
    pub doc: String,
}

/// A parameter of a kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ParamManual {
    /// The name.
    pub name: String,
    /// The type of its value.
    #[serde(rename = "type")]
    pub ty: String,
    /// The value if it is not given.
    pub default: Json,
    /// The same, as a graph writes it.
    pub written: Json,
    /// True if it must be given.
    pub required: bool,
    /// The least and the largest value.
    pub range: Option<(Option<f64>, Option<f64>)>,
    /// True if the least value itself is not allowed.
    pub above_min: bool,
    /// True if `inf` is allowed.
    pub infinite: Json,
    /// The unit.
    pub unit: Option<String>,
    /// The words to choose from.
    pub choices: Vec<String>,
    /// Their descriptions.
    pub choice_docs: Vec<String>,
    /// The ports of an element of a list.
    pub ports: Vec<PortManual>,
    /// The parameters of an element of a list.
    pub fields: Vec<ParamManual>,
    /// The description.
    pub doc: String,
}

/// An output of a kind.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct OutputManual {
    /// The name.
    pub name: String,
    /// Names of earlier versions.
    pub former: Json,
    /// The type.
    #[serde(rename = "type")]
    pub ty: String,
    /// The unit.
    pub unit: Option<String>,
    /// The description.
    pub doc: String,
}

/// The kinds that match some words, the best first.
pub fn search_nodes(tools: &Tools, request: &SearchRequest) -> FoundKinds {
    let registry = &tools.registry;
    let of = |kind: &str, summary: Option<String>, elsewhere: Option<String>| {
        let family = registry.info(kind).map(|info| info.family.to_owned()).unwrap_or_default();
        FoundKind { kind: kind.to_owned(), family, summary, elsewhere }
    };
    let nodes = if request.words.trim().is_empty() {
        registry.kinds().map(|kind| of(kind, None, None)).collect()
    } else {
        let found = search(registry, &request.words);
        let one = |found: &Found<'_>| of(found.kind, Some(found.summary.clone()), found.elsewhere.clone());
        found.iter().take(MOST).map(one).collect()
    };
    FoundKinds { nodes }
}

/// The manual of a kind: ports, parameters and outputs as in [`crate::manual::nodes`], and the text with an example as Markdown.
///
/// # Errors
/// A kind that does not exist, with the most similar ones.
pub fn describe_node(tools: &Tools, request: &KindRequest) -> Result<KindManual, Refusal> {
    let described = if let Some(info) = tools.registry.info(&request.kind) {
        let mut described = node(info);
        if let Some(fields) = described.as_object_mut() {
            fields.insert("manual".to_owned(), markdown::node(info).into());
        }
        described
    } else if let Some(word) = WORDS.iter().find(|word| word.name == request.kind) {
        json!({ "kind": word.name, "family": word.family, "manual": &*word.doc })
    } else {
        let kinds: Vec<&str> = tools.registry.kinds().chain(WORDS.iter().map(|word| word.name)).collect();
        let help = shibo_value::diagnostics::suggest(&request.kind, "kind", &kinds);
        let kind = shibo_value::diagnostics::shorten(&request.kind);
        return Err(Refusal::new("unknown", format!("there is no kind `{kind}`"), help));
    };
    serde_json::from_value(described).map_err(|error| Refusal::new("defect", error.to_string(), "please report it"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::testing::tools;

    #[test]
    fn manuals_lose_nothing_by_their_types() {
        let tools = tools();
        for kind in tools.registry.kinds() {
            let manual = describe_node(&tools, &KindRequest { kind: kind.to_owned() }).unwrap();
            let mut typed = serde_json::to_value(manual).unwrap();
            typed.as_object_mut().unwrap().remove("manual");
            assert_eq!(typed, node(tools.registry.info(kind).unwrap()), "{kind}");
        }
        let manual = describe_node(&tools, &KindRequest { kind: "Use".to_owned() }).unwrap();
        assert!(!manual.manual.is_empty() && manual.ports.is_empty());
    }
}
