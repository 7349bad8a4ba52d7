//! The places of a graph file, from the lists of fields that the loader accepts.
use super::{any, definition, described, named, object};
use serde_json::{Map, Value as Json, json};
use shibo_graph::schema::{CANVAS, INPUT, LAYOUT, LOCAL, PARAM_TYPES, PINS, ROOT, instance, output, param};
use shibo_node::ParamType;
use shibo_node::registry::Registry;
use shibo_picture::export::{FieldDecl, NumberForm, Numbers, TARGETS, Takes};
use shibo_value::{Accepts, Canvas};

/// A graph file.
pub(super) fn graph(registry: &Registry) -> Json {
    fields(ROOT, &["nodes"], |name| match name {
        "version" => Some(json!({ "const": 1 })),
        "family" => Some(json!({ "type": "string", "maxLength": 40, "pattern": "^[a-z0-9]+( [a-z0-9]+)*$" })),
        "pins" => Some(pins(registry)),
        "canvas" => Some(canvas()),
        "imports" => Some(named(json!({ "type": "string" }))),
        "graphs" => Some(named(definition("local"))),
        "functions" => {
            // A function has its arguments in its name.
            Some(
                json!({ "type": "object", "additionalProperties": { "anyOf": [{ "type": "string" }, definition("comment")] } }),
            )
        }
        name => section(name),
    })
}

/// A local graph.
pub(super) fn local() -> Json {
    described(fields(LOCAL, &["nodes"], section), "A graph that is defined in the file that uses it.")
}

/// The sections that local graphs have too.
fn section(name: &str) -> Option<Json> {
    match name {
        "params" => Some(named(params())),
        "presets" => Some(named(named(scalar()))),
        "inputs" => Some(named(inputs())),
        "nodes" => Some(named(any(vec![definition("node"), definition("formula")]))),
        "outputs" => Some(json!({
            "type": "object",
            "patternProperties": { (super::COMMENTS): definition("comment"), "^[A-Za-z0-9_-][A-Za-z0-9_.-]*$": definition("output") },
            "additionalProperties": false,
        })),
        _ => None,
    }
}

/// An object with the fields of a place. `own` knows the form of fields that the declaration leaves open.
fn fields(declared: &[FieldDecl], required: &[&str], own: impl Fn(&str) -> Option<Json>) -> Json {
    let field = |field: &FieldDecl| {
        let schema = own(field.name).unwrap_or_else(|| takes(field));
        (field.name.to_owned(), described(schema, &field.manual()))
    };
    object(declared.iter().map(field).collect(), required)
}

/// The values that a field declares.
fn takes(field: &FieldDecl) -> Json {
    match field.takes {
        Takes::Truth(default) => json!({ "type": "boolean", "default": default }),
        Takes::Words(words) | Takes::Word(words) => json!({ "enum": words() }),
        Takes::Quality => json!({ "type": "number", "minimum": 1, "maximum": 100 }),
        Takes::Material | Takes::Gray | Takes::Height | Takes::Body | Takes::Output => definition("reference"),
        Takes::Ids => definition("wire"),
        Takes::Mesh => any(vec![json!({ "enum": field.takes.words() }), definition("reference")]),
        Takes::Value => json!({}),
        Takes::Numbers(numbers) => number_forms(&numbers),
    }
}

/// The values that a field of numbers takes.
fn number_forms(numbers: &Numbers) -> Json {
    let [least, most] = numbers.range;
    let ty = if matches!(numbers.form, NumberForm::Whole | NumberForm::Counts) { "integer" } else { "number" };
    let one = json!({ "type": ty, "minimum": least, "maximum": most });
    let pair = json!({ "type": "array", "items": one, "minItems": 2, "maxItems": 2 });
    let form = match numbers.form {
        NumberForm::One | NumberForm::Whole => one,
        NumberForm::Counts => pair,
        NumberForm::Rising => json!({ "type": "array", "items": one, "minItems": 1 }),
        NumberForm::Pairs => json!({ "type": "array", "items": pair, "minItems": 1 }),
    };
    let words = (numbers.words)();
    if words.is_empty() { form } else { any(vec![json!({ "enum": words }), form]) }
}

fn pins(registry: &Registry) -> Json {
    let change = json!({ "type": "integer", "minimum": 1, "maximum": registry.changes().newest() });
    let version = json!({ "type": "integer", "minimum": 1 });
    let kinds: Map<String, Json> = registry.kinds().map(|kind| (kind.to_owned(), version.clone())).collect();
    let held = |name: &str| match name {
        "change" => Some(change.clone()),
        _ => Some(object(kinds.clone(), &[])),
    };
    any(vec![change.clone(), fields(PINS, &["change"], held)])
}

/// A number, or two, each with these further keywords; or formulas.
fn one_or_two(ty: &str, bounds: Json) -> Json {
    let mut one = json!({ "type": ty });
    if let (Some(one), Json::Object(bounds)) = (one.as_object_mut(), bounds) {
        one.extend(bounds);
    }
    let each = any(vec![one.clone(), definition("formula")]);
    any(vec![one, definition("formula"), json!({ "type": "array", "items": each, "minItems": 2, "maxItems": 2 })])
}

fn size_mm() -> Json {
    one_or_two("number", json!({ "exclusiveMinimum": 0, "maximum": Canvas::MAX_SIZE_MM }))
}

fn seed() -> Json {
    any(vec![json!({ "type": "integer", "minimum": 0, "maximum": u64::MAX }), definition("formula")])
}

fn canvas() -> Json {
    fields(CANVAS, &[], |name| match name {
        "size_mm" => Some(size_mm()),
        "resolution" => Some(one_or_two("integer", json!({ "minimum": 1, "maximum": Canvas::MAX_RESOLUTION }))),
        "seed" => Some(seed()),
        // `None` is a word and a value.
        _ => CANVAS.iter().find(|field| field.name == name).map(|field| {
            let words: Vec<Json> = field.takes.words().into_iter().map(Json::from).chain([Json::Null]).collect();
            any(vec![json!({ "enum": words }), definition("formula")])
        }),
    })
}

fn pair() -> Json {
    json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 })
}

fn text() -> Json {
    json!({ "type": "string" })
}

/// A value of a parameter of a graph. A word is an object.
fn scalar() -> Json {
    json!({ "type": ["number", "boolean", "string", "array", "object"] })
}

/// The declaration of a parameter.
fn params() -> Json {
    let declared = PARAM_TYPES.into_iter().map(|ty| {
        let value = match ty {
            ParamType::Integer => vec![json!({ "type": "integer" }), definition("formula")],
            ParamType::Number => vec![json!({ "type": "number" }), definition("formula")],
            ParamType::Bool => vec![json!({ "type": "boolean" }), definition("formula")],
            ParamType::Color => {
                let channels =
                    json!({ "type": "array", "items": { "type": ["number", "string"] }, "minItems": 3, "maxItems": 3 });
                vec![definition("color"), channels, definition("formula")]
            }
            ParamType::Choice => vec![text(), json!({ "type": "object", "maxProperties": 1 })],
            _ => vec![text()],
        };
        let own = |name: &str| match name {
            "default" => Some(any(value.clone())),
            "range" => Some(pair()),
            "options" => Some(json!({ "type": "array", "items": { "type": ["string", "object"] } })),
            _ => Some(text()),
        };
        (ty.name().to_owned(), fields(&param(ty.name()), &["default"], own))
    });
    word(declared.collect())
}

/// An object with one of these words.
fn word(words: Map<String, Json>) -> Json {
    let mut schema = object(words, &[]);
    if let Some(object) = schema.as_object_mut() {
        object.insert("minProperties".to_owned(), 1.into());
    }
    schema
}

/// The declaration of an input.
fn inputs() -> Json {
    let declared = Accepts::all().map(|ty| {
        let own = |name: &str| match name {
            "default" => {
                Some(any(vec![definition("wire"), definition("color"), json!({ "type": ["number", "array"] })]))
            }
            _ => Some(text()),
        };
        let mut schema = fields(INPUT, &[], own);
        if let Some(object) = schema.as_object_mut() {
            object.insert("type".to_owned(), json!(["object", "null"]));
        }
        (ty.name().to_owned(), schema)
    });
    word(declared.collect())
}

/// The value of an output.
pub(super) fn outputs() -> Json {
    let words = std::iter::once("File").chain(TARGETS.iter().map(|target| target.info().name));
    let forms = words.map(|name| (name.to_owned(), definition(&format!("output.{name}"))));
    any(vec![definition("reference"), word(forms.collect())])
}

/// The forms of an output that is not just a name.
pub(super) fn export() -> impl Iterator<Item = (String, Json)> {
    let words = std::iter::once("File").chain(TARGETS.iter().map(|target| target.info().name));
    words.map(|name| {
        let declared = output(name);
        let needs = |field: &&FieldDecl| {
            field.name == "from"
                || matches!(field.takes, Takes::Material | Takes::Height | Takes::Body | Takes::Word(_))
        };
        let required: Vec<&str> = declared.iter().filter(needs).map(|field| field.name).collect();
        let own = |name: &str| (name == "range").then(|| any(vec![pair(), json!({ "enum": ["Fit"] })]));
        (format!("output.{name}"), fields(declared, &required, own))
    })
}

/// `Use` and `Each`.
pub(super) fn instances() -> impl Iterator<Item = (String, Json)> {
    [("Use", false, &["graph"][..]), ("Each", true, &["graph", "over", "ids"])].into_iter().map(
        |(name, each, required)| {
            let own = |name: &str| match name {
                "graph" | "preset" | "note" => Some(text()),
                "over" => {
                    Some(any(vec![json!({ "type": "integer", "minimum": 1, "maximum": 64 }), definition("formula")]))
                }
                "with" => Some(named(any(vec![scalar(), definition("node")]))),
                "seed" => Some(seed()),
                "canvas" => Some(layout()),
                _ => None,
            };
            (name.to_owned(), fields(&instance(each), required, own))
        },
    )
}

fn layout() -> Json {
    fields(LAYOUT, &[], |name| match name {
        "scale" => Some(one_or_two("number", json!({ "minimum": 1e-3, "maximum": 1e3 }))),
        "angle" => Some(any(vec![json!({ "type": "number", "minimum": -360, "maximum": 360 }), definition("formula")])),
        "offset" => Some(one_or_two("number", json!({ "minimum": -1e6, "maximum": 1e6 }))),
        _ => Some(size_mm()),
    })
}
