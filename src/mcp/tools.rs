//! The tools: names, manuals, schemas, and the operations behind them.
use schemars::{JsonSchema, schema_for};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json, json};
use shibo_bridge::agents::{
    Checked, CompareArgs, DescribeRequest, Described, FixArgs, Fixed, Formatted, FoundKinds, KindManual, KindRequest,
    ListRequest, ListedGraphs, NoPicture, Refusal, RenderRequest, Rendered, SaveRequest, Saved, SearchRequest, Source,
    State, check, compare_pictures, describe, describe_node, fix, format, list, render, save, search_nodes,
};
use shibo_bridge::compare::Comparison;
use shibo_engine::eval::CancelToken;

/// The answer of a tool.
pub(super) struct Answer {
    /// The structured content.
    pub(super) json: Json,
    /// A picture.
    pub(super) png: Option<Vec<u8>>,
    /// True if the call failed; the content tells why.
    pub(super) is_error: bool,
}

impl Answer {
    fn of(value: &impl Serialize) -> Self {
        Self { json: serde_json::to_value(value).unwrap_or_default(), png: None, is_error: false }
    }

    fn failed(value: &impl Serialize) -> Self {
        Self { is_error: true, ..Self::of(value) }
    }
}

impl From<Refusal> for Answer {
    fn from(refusal: Refusal) -> Self {
        Self::failed(&json!({ "refused": refusal }))
    }
}

impl From<NoPicture> for Answer {
    fn from(reason: NoPicture) -> Self {
        match reason {
            NoPicture::Refused(refusal) => refusal.into(),
            NoPicture::Faulty(checked) => Self::failed(&json!({ "diagnostics": checked })),
        }
    }
}

type Run = fn(&State, Json, &CancelToken) -> Answer;

/// A tool.
pub(super) struct ToolInfo {
    pub(super) name: &'static str,
    pub(super) doc: &'static str,
    pub(super) input: fn() -> Json,
    /// The schema of the structured content.
    pub(super) output: fn() -> Json,
    pub(super) writes: bool,
    pub(super) run: Run,
}

fn schema<T: JsonSchema>() -> Json {
    schema_for!(T).to_value()
}

/// Reads the arguments of a call and runs it.
fn with<T: DeserializeOwned>(arguments: Json, run: impl FnOnce(T) -> Answer) -> Answer {
    match serde_json::from_value(arguments) {
        Ok(request) => run(request),
        Err(error) => Refusal::new("bad-arguments", error.to_string(), "see the schema of the tool").into(),
    }
}

fn answer<T: Serialize>(done: Result<T, Refusal>) -> Answer {
    done.map_or_else(Answer::from, |value| Answer::of(&value))
}

/// All tools.
pub(super) const TOOLS: &[ToolInfo] = &[
    ToolInfo {
        name: "search_nodes",
        doc: "Finds kinds of nodes by words, or by their names in other programs. Without words: all kinds.",
        input: schema::<SearchRequest>,
        output: schema::<FoundKinds>,
        writes: false,
        run: |state, arguments, _| with(arguments, |request| Answer::of(&search_nodes(&state.tools, &request))),
    },
    ToolInfo {
        name: "describe_node",
        doc: "The manual of a kind: ports, parameters with ranges and units, outputs, and an example.",
        input: schema::<KindRequest>,
        output: schema::<KindManual>,
        writes: false,
        run: |state, arguments, _| with(arguments, |request| answer(describe_node(&state.tools, &request))),
    },
    ToolInfo {
        name: "list_graphs",
        doc: "The shipped graphs, `shibo:NAME`, and the graph files that may be read.",
        input: schema::<ListRequest>,
        output: schema::<ListedGraphs>,
        writes: false,
        run: |state, arguments, cancel| {
            with(arguments, |request| Answer::of(&list(&state.tools.until(cancel), &state.folders, &request)))
        },
    },
    ToolInfo {
        name: "describe_graph",
        doc: "The contents of a graph: parameters with ranges and units, presets, outputs, imports, nodes with their readers.",
        input: schema::<DescribeRequest>,
        output: schema::<Described>,
        writes: false,
        run: |state, arguments, cancel| {
            with(arguments, |request| match describe(&state.tools.until(cancel), &state.folders, &request) {
                Ok(Ok(described)) => Answer::of(&described),
                Ok(Err(checked)) => NoPicture::Faulty(checked).into(),
                Err(refusal) => refusal.into(),
            })
        },
    },
    ToolInfo {
        name: "check",
        doc: "All errors and warnings of a graph, each with line, column and remedy.",
        input: schema::<Source>,
        output: schema::<Checked>,
        writes: false,
        run: |state, arguments, cancel| {
            with(arguments, |source| answer(check(&state.tools.until(cancel), &state.folders, &source)))
        },
    },
    ToolInfo {
        name: "fix",
        doc: "A graph after fixes of its errors: names, words of other programs, units, other notations, lost brackets. Saves nothing.",
        input: schema::<FixArgs>,
        output: schema::<Fixed>,
        writes: false,
        run: |state, arguments, cancel| {
            with(arguments, |args| answer(fix(&state.tools.until(cancel), &state.folders, &args)))
        },
    },
    ToolInfo {
        name: "format",
        doc: "A graph in the usual layout.",
        input: schema::<Source>,
        output: schema::<Formatted>,
        writes: false,
        run: |state, arguments, cancel| {
            with(arguments, |source| answer(format(&state.tools.until(cancel), &state.folders, &source)))
        },
    },
    ToolInfo {
        name: "render",
        doc: "A thumbnail of an output or a node as PNG, with the range and the mean of its values. `region` shows a part enlarged.",
        input: schema::<RenderRequest>,
        output: schema::<Rendered>,
        writes: false,
        run: |state, arguments, cancel| {
            with(arguments, |request| match render(state, &request, cancel) {
                Ok((png, facts)) => Answer { png: Some(png), ..Answer::of(&facts) },
                Err(reason) => reason.into(),
            })
        },
    },
    ToolInfo {
        name: "compare",
        doc: "The differences between two pictures of a material, in words and numbers: size, direction, contrast, colour, detail.",
        input: schema::<CompareArgs>,
        output: schema::<Comparison>,
        writes: false,
        run: |state, arguments, cancel| {
            with(arguments, |args| match compare_pictures(state, &args, cancel) {
                Ok(comparison) => Answer::of(&comparison),
                Err(reason) => reason.into(),
            })
        },
    },
    ToolInfo {
        name: "write",
        doc: "Saves a graph as a file `*.ron`. An existing file is replaced only if its SHA-256 is `expect`.",
        input: schema::<SaveRequest>,
        output: schema::<Saved>,
        writes: true,
        run: |state, arguments, _| with(arguments, |request| answer(save(&state.folders, &request))),
    },
];

/// The schema of a tool as an object.
pub(super) fn object(schema: Json) -> Map<String, Json> {
    match schema {
        Json::Object(object) => object,
        _ => Map::new(),
    }
}
