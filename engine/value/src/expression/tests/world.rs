//! Names of all sorts, for tests.
use super::super::*;
use std::collections::BTreeMap;

/// Nodes, parameters and functions.
#[derive(Clone, Default)]
pub(super) struct World {
    pub(super) functions: BTreeMap<String, Arc<UserFunction>>,
    /// The names that were asked for, in order.
    pub(super) asked: Vec<String>,
    pub(super) has_words: bool,
}

impl World {
    /// A world with these functions: each a signature and a body.
    pub(super) fn with(functions: &[(&str, &str)]) -> Self {
        let functions = functions.iter().map(|(signature, body)| {
            let function = function(signature, body);
            (function.name.clone(), Arc::new(function))
        });
        Self { functions: functions.collect(), ..Self::default() }
    }
}

/// The function of a signature, such as `ridge(x, w)`.
pub(super) fn function(signature: &str, body: &str) -> UserFunction {
    let (name, params) = signature.trim_end_matches(')').split_once('(').unwrap();
    let params = params.split(", ").filter(|param| !param.is_empty()).map(str::to_owned).collect();
    UserFunction { name: name.to_owned(), params, body: body.to_owned() }
}

/// The value of a plane.
pub(super) fn plane(plane: usize) -> f64 {
    [0.25, -1.5, 3.0, 4.0, 0.2, 0.4, 0.6, 0.0, 1.0, 2.0, 3.0, 4.0, 17.0, 0.75, 9.0][plane % 15]
}

impl Names for World {
    fn param(&mut self, name: &str) -> Meaning {
        match name {
            "n" => Meaning::Known(Value::Number(3.0)),
            "tint" => Meaning::Known(Value::Vector(vec![0.5, 0.25, 1.0])),
            "style" => Meaning::Choice("Fine".to_owned(), vec!["Fine".to_owned(), "Coarse".to_owned()]),
            _ => Meaning::Wrong(Code::UnknownParam, format!("no {name}"), None),
        }
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        self.asked.push(name.to_owned());
        Some(match name {
            "a" | "leaf" => Meaning::Planes { first: 0, count: 1 },
            "b" => Meaning::Planes { first: 1, count: 1 },
            "v" => Meaning::Planes { first: 2, count: 2 },
            "c" | "leaf.color" => Meaning::Planes { first: 4, count: 3 },
            "j" => Meaning::Planes { first: 8, count: 4 },
            "ids" => Meaning::Ids { plane: 12 },
            "noise" => Meaning::Planes { first: 13, count: 1 },
            "x" => Meaning::Planes { first: 14, count: 1 },
            "any" => Meaning::Any { first: 20 },
            _ => return None,
        })
    }

    fn all(&self) -> Vec<String> {
        ["a", "b", "v", "c", "j", "ids", "noise", "x", "any", "leaf"].map(str::to_owned).into()
    }

    fn has_words(&self) -> bool {
        self.has_words
    }

    fn seed(&mut self) -> Option<u64> {
        Some(7)
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        Some(100 + seed)
    }

    fn function(&mut self, name: &str) -> Option<Arc<UserFunction>> {
        self.functions.get(name).cloned()
    }

    fn functions(&self) -> Vec<String> {
        self.functions.keys().cloned().collect()
    }

    fn in_function(&mut self, name: &str) -> Option<Meaning> {
        (name == "canvas.width").then_some(Meaning::Known(Value::Number(40.0)))
    }
}

/// The values of an expression at one point.
pub(super) fn values(text: &str, world: &mut World) -> Vec<f64> {
    let compiled = compile(text, world).unwrap_or_else(|faults| panic!("{text}: {faults:?}"));
    let mut out = vec![f64::NAN; compiled.components()];
    compiled.value_at(&plane, &mut out);
    out
}

/// The only fault of an expression: the faulty text, the message and the help.
pub(super) fn fault(text: &str, world: &mut World) -> (String, String, String) {
    let faults = compile(text, world).expect_err(text);
    assert_eq!(faults.len(), 1, "{text}: {faults:?}");
    let fault = faults[0].clone();
    let written = match &fault.function {
        None => text[fault.range].to_owned(),
        Some(name) => format!("{name}: {}", &world.functions[name].body[fault.range]),
    };
    (written, fault.message, fault.help.unwrap_or_default())
}
