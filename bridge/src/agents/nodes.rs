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

/// The kinds that match some words, the best first, as `{"nodes": [{"kind", "family", "summary", "elsewhere"}]}`.
pub fn search_nodes(tools: &Tools, request: &SearchRequest) -> Json {
    let registry = &tools.registry;
    let family = |kind: &str| registry.info(kind).map(|info| info.family);
    let nodes: Vec<Json> = if request.words.trim().is_empty() {
        registry.kinds().map(|kind| json!({ "kind": kind, "family": family(kind) })).collect()
    } else {
        let found = search(registry, &request.words);
        let one = |found: &Found<'_>| {
            let (kind, summary) = (found.kind, &found.summary);
            json!({ "kind": kind, "family": family(kind), "summary": summary, "elsewhere": found.elsewhere })
        };
        found.iter().take(MOST).map(one).collect()
    };
    json!({ "nodes": nodes })
}

/// The manual of a kind: ports, parameters and outputs as in [`crate::manual::nodes`], and the text with an example as Markdown.
///
/// # Errors
/// A kind that does not exist, with the most similar ones.
pub fn describe_node(tools: &Tools, request: &KindRequest) -> Result<Json, Refusal> {
    if let Some(info) = tools.registry.info(&request.kind) {
        let mut described = node(info);
        if let Some(fields) = described.as_object_mut() {
            fields.insert("manual".to_owned(), markdown::node(info).into());
        }
        return Ok(described);
    }
    if let Some(word) = WORDS.iter().find(|word| word.name == request.kind) {
        return Ok(json!({ "kind": word.name, "family": word.family, "manual": &*word.doc }));
    }
    let kinds: Vec<&str> = tools.registry.kinds().chain(WORDS.iter().map(|word| word.name)).collect();
    let help = shibo_value::diagnostics::suggest(&request.kind, "kind", &kinds);
    let kind = shibo_value::diagnostics::shorten(&request.kind);
    Err(Refusal::new("unknown", format!("there is no kind `{kind}`"), help))
}
