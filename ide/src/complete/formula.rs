//! Completion in formulas: nodes, local names, positions, functions and parameters.
use super::super::around::Around;
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::formula::{CANVAS, FormulaText, Inferred, PLACES, Role, Space};
use super::super::functions::{self, Function, Head};
use super::super::habits::{self, Class};
use super::ranks::Candidate;
use super::{Ask, Completion, Sort, Topic};
use shibo_graph::syntax::formula::{Formula, PartKind, WordKind};
use shibo_value::{Accepts, Type};
use std::collections::HashSet;

/// Penalty for single numbers, and for what may be one, where several components are wanted.
const APART: f64 = 6.0;

/// A position in a formula.
struct Place<'f, 'a> {
    text: &'f FormulaText<'a>,
    formula: Formula,
    /// The position.
    offset: usize,
    /// The word that is being typed.
    word: Option<usize>,
    /// Types of all parts.
    types: Vec<Inferred>,
}

/// The values that fit at a position.
#[derive(Default)]
struct Wanted {
    /// Number of components that a value must have if it has several.
    count: Option<usize>,
    /// A single number is wanted.
    single: bool,
    /// Several components are wanted.
    several: bool,
    /// The space of the other values.
    space: Option<Space>,
    /// Numbers of pieces are allowed.
    ids: bool,
    /// Options of the choice that the value is compared with.
    options: Vec<String>,
}

impl<'a> Ask<'a> {
    /// Completes in a formula.
    pub(super) fn formula(&mut self, expect: Expect<'a>, text: &FormulaText<'a>) -> Vec<Completion> {
        let Some(place) = self.place(text) else { return Vec::new() };
        let start = place.word.map_or(place.offset, |word| place.formula.words()[word].range.start);
        let end = place.word.map_or(place.offset, |word| place.formula.words()[word].range.end);
        let Some(replace) = text.in_file(&(start..end)) else { return Vec::new() };
        self.replace = replace;
        let typed = text.says().get(start..place.offset).unwrap_or_default();
        if let (Some((base, _)), Some(word)) = (typed.rsplit_once('.'), place.word) {
            return self.after_dot(expect, &place, base, word);
        }
        self.names(expect, &place)
    }

    /// The position of the cursor; `None` where no name can stand.
    fn place<'f>(&self, text: &'f FormulaText<'a>) -> Option<Place<'f, 'a>> {
        let offset = text.offset(self.at)?;
        let formula = text.parse();
        let before = formula.word_before(offset);
        let kind = |index: usize| formula.words()[index].kind;
        let word = before.filter(|index| formula.words()[*index].range.end >= offset);
        let word = match word.map(kind) {
            Some(WordKind::Name | WordKind::Param | WordKind::Letters) => word,
            Some(WordKind::Number | WordKind::Color | WordKind::Unknown) => return None,
            _ => None,
        };
        let before = if word.is_some() { word.and_then(|word| word.checked_sub(1)) } else { before };
        let is_let = |index: usize| formula.word(index) == "let";
        if before.is_some_and(|before| is_let(before) && kind(before) == WordKind::Name) {
            return None;
        }
        // After a value, an operator must follow.
        let is_value = |index: usize| {
            matches!(
                kind(index),
                WordKind::Name | WordKind::Param | WordKind::Number | WordKind::Close | WordKind::Color
            )
        };
        if word.is_none() && before.is_some_and(is_value) {
            return None;
        }
        let types = self.types.parts(&formula, text.role);
        Some(Place { text, formula, offset, word, types })
    }

    /// Completes behind a dot.
    fn after_dot(&mut self, expect: Expect<'a>, place: &Place<'_, 'a>, base: &str, word: usize) -> Vec<Completion> {
        let (formula, role) = (&place.formula, place.text.role);
        let first = base.split('.').next().unwrap_or_default();
        if formula.words()[word].kind == WordKind::Letters {
            // Components of brackets: only the letters are replaced.
            self.replace.start += 1;
            let part = formula.part_of(word).map(|part| formula.operands(part));
            let of = part.and_then(|operands| place.types.get(*operands.first()?).copied());
            return of.map_or(Vec::new(), |of| self.components("", of.into(), 0.0));
        }
        if let Some(name) = base.strip_prefix('$') {
            let color = self.cx.file.entry(Section::Params, name).and_then(|item| self.cx.file.head(item));
            let of = if color == Some("Color") { Inferred::Numbers(3, Space::Constant) } else { Inferred::Unknown };
            return self.components(base, of.into(), 0.0);
        }
        if let Some(local) = formula.local(first, place.offset) {
            let of = place.types.get(local.value).copied().unwrap_or(Inferred::Unknown);
            return if first == base { self.components(base, of.into(), 0.0) } else { Vec::new() };
        }
        let mut found = Vec::new();
        let wanted = self.wanted(expect, place);
        if role == Role::Point {
            found.extend(self.behind(base, &|ty| fitness(ty, &wanted)));
        }
        let own = found.is_empty();
        let places: &[(&str, &str)] = if role == Role::Point { &PLACES } else { &[] };
        let known = places.iter().chain(&CANVAS).filter(|(name, _)| own && name.contains('.'));
        found.extend(known.map(|(name, doc)| self.offer(name, Sort::Value, doc, Topic::Text((*doc).to_owned()), 0.0)));
        let of_import = |function: &Function| function.name.split_once('.').is_some_and(|(import, _)| import == base);
        let functions = functions::of_graphs(self.cx).into_iter().filter(of_import);
        found.extend(functions.map(|function| self.function(&function, 0.0)));
        found
    }

    /// Completes a name.
    fn names(&mut self, expect: Expect<'a>, place: &Place<'_, 'a>) -> Vec<Completion> {
        let role = place.text.role;
        let wanted = self.wanted(expect, place);
        let of = |class: Class| move |offer: Completion| Candidate { offer, class, wire: 0.0 };
        let mut found: Vec<Candidate> = self.own_names(place, &wanted).into_iter().map(of(Class::Local)).collect();
        // Values that fit come first where colours or vectors are wanted.
        let apart = if wanted.several { APART } else { 0.0 };
        if let Role::Point | Role::Value = role {
            let score = |one: &Completion| match (role, one.detail == "Color") {
                (Role::Point, true) if wanted.single => 2.0,
                (Role::Point, true) => -1.0,
                _ => apart,
            };
            let params = self.params(Expect::Canvas(Some(""))).into_iter();
            found.extend(params.map(|one| Completion { score: score(&one), ..one }).map(of(Class::Param)));
        }
        if role == Role::Point {
            let wires = self.references(expect, &|ty| fitness(ty, &wanted));
            found.extend(wires.into_iter().map(|one| {
                let (wire, score) = (one.score, fitness(self.types.of(&one.label), &wanted));
                Candidate { offer: Completion { score, ..one }, class: Class::Node, wire: wire - score }
            }));
        }
        let mut seen = HashSet::new();
        for function in functions::of_language().filter(|one| seen.insert(one.name.clone())) {
            let class = if function.call.ends_with(')') { Class::Function } else { Class::Place };
            found.extend([self.function(&function, apart)].map(of(class)));
        }
        let own = functions::of_graphs(self.cx);
        found.extend(own.iter().map(|one| self.function(one, 0.0)).map(of(Class::Function)));
        let name =
            |name: &str, doc: &str, score| self.offer(name, Sort::Value, doc, Topic::Text(doc.to_owned()), score);
        let known = |(place, doc): (&str, &str)| of(Class::Place)(name(place, doc, apart));
        found.extend(CANVAS.map(known));
        match role {
            Role::Point => found.extend(PLACES.map(known)),
            Role::Value => {
                if let Expect::Value(_, param) = expect {
                    let choices = param.choices.iter().map(|choice| name(&choice.name, &choice.doc, 0.0));
                    found.extend(choices.map(of(Class::Place)));
                }
            }
            Role::Function(_) => {}
        }
        let (start, end) = match place.word {
            Some(word) => (word, word + 1),
            None => [place.formula.word_before(place.offset).map_or(0, |before| before + 1); 2].into(),
        };
        let around = &Around::of(&place.formula, start, end);
        let is_node = matches!(expect, Expect::Entry(Section::Nodes, _));
        let name = self.port_name(expect);
        let field = if is_node { "" } else { name };
        self.ranked(expect, &habits::Place { point: role == Role::Point, field, name, around }, found)
    }

    /// Local names, values of the function, options of a compared choice, and `let`.
    fn own_names(&self, place: &Place<'_, 'a>, wanted: &Wanted) -> Vec<Completion> {
        let formula = &place.formula;
        let mut found = Vec::new();
        for local in formula.locals().iter().filter(|local| local.from <= place.offset) {
            let of = place.types.get(local.value).copied().unwrap_or(Inferred::Unknown);
            let value = formula.at(&formula.parts()[local.value].range);
            let topic = Topic::Text(format!("`{value}`"));
            let score = penalty(of, wanted);
            let ty = of.ty().map_or("local name", Accepts::name);
            found.push(self.offer(formula.at(&local.range), Sort::Value, ty, topic, score));
        }
        let none = || Topic::Text(String::new());
        for value in place.text.values(self.cx) {
            found.push(self.offer(value, Sort::Value, "a value of the function", none(), 0.0));
        }
        for option in &wanted.options {
            found.push(self.offer(option, Sort::Choice, "an option", none(), -6.0));
        }
        let start = place.word.map_or(place.offset, |word| formula.words()[word].range.start);
        let before = formula.word_before(start).map(|before| formula.words()[before].kind);
        if matches!(before, None | Some(WordKind::Semicolon)) {
            let offer = self.offer("let", Sort::Function, "a local name", none(), 30.0);
            found.push(Completion { insert: "let ${1:name} = $2; $0".to_owned(), snippet: true, ..offer });
        }
        found
    }

    /// A function with its brackets, or a constant.
    fn function(&self, function: &Function, score: f64) -> Completion {
        let topic = Topic::Text(function.doc.clone());
        let offer = self.offer(&function.name, Sort::Function, &function.call, topic, score);
        let follows = self.cx.file.text[self.replace.end..].starts_with('(');
        let takes = function.call.ends_with(')') && !follows;
        let insert = if takes { format!("{}($0)", function.name) } else { function.name.clone() };
        Completion { insert, snippet: takes, ..offer }
    }

    /// The values that fit at a position: by the operator or function there, the other values, and the port.
    fn wanted(&self, expect: Expect<'a>, place: &Place<'_, 'a>) -> Wanted {
        let formula = &place.formula;
        let parts = formula.parts();
        let own = place.word.and_then(|word| formula.part_of(word));
        let own = own.or_else(|| {
            parts.iter().position(|part| part.kind == PartKind::Missing && part.range.start >= place.offset)
        });
        let mut wanted = Wanted::default();
        let others = parts.iter().zip(&place.types).enumerate().filter(|(index, _)| Some(*index) != own);
        wanted.space = others.filter_map(|(_, (_, of))| of.space()).filter(|space| *space != Space::Constant).max();
        let Some((own, parent)) = own.and_then(|own| Some((own, parts[own].parent?))) else {
            // The brackets of a call may be empty.
            return match formula.call_at(place.offset).filter(|_| own.is_none()) {
                Some(call) => self.by_call(formula.at(&call.name), call.argument, None, wanted),
                None => self.by_port(expect, wanted),
            };
        };
        let operands = formula.operands(parent);
        let word = parts[parent].word.map_or("", |word| formula.word(word));
        let siblings = || operands.iter().filter(|operand| **operand != own);
        match parts[parent].kind {
            PartKind::Binary => {
                wanted.count = siblings().filter_map(|sibling| place.types[*sibling].count()).max();
                wanted.ids = matches!(word, "==" | "!=");
                wanted.options = siblings().flat_map(|sibling| self.options(formula, *sibling)).collect();
                let outermost = parts[parent].parent.is_none();
                if outermost { self.by_port(expect, wanted) } else { wanted }
            }
            PartKind::Call => {
                let index = operands.iter().position(|operand| *operand == own).unwrap_or(0);
                let others = siblings().filter_map(|sibling| place.types[*sibling].count()).max();
                self.by_call(word, index, others, wanted)
            }
            PartKind::Vector => Wanted { single: true, ..wanted },
            _ => wanted,
        }
    }

    /// Adds what a function takes as its value `index`. Its other values have at most `others` components.
    fn by_call(&self, function: &str, index: usize, others: Option<usize>, wanted: Wanted) -> Wanted {
        let call = functions::called(self.cx, function).into_iter().next().map(|one| one.call).unwrap_or_default();
        let name = Head::of(&call).params.get(index).map(|range| &call[range.clone()]);
        // The manual calls colours `c` and vectors `v` if they are the first value.
        let (count, several) = match (function, index, name) {
            ("cross", ..) | (_, 0, Some("c")) => (Some(3), true),
            ("rotate", 0, _) => (Some(2), true),
            ("dot", ..) => (others.filter(|count| *count > 1), true),
            (_, 0, Some("v")) => (None, true),
            _ => (others, false),
        };
        Wanted { count, several, ids: matches!(function, "random" | "hash"), ..wanted }
    }

    /// Options of a part that is the parameter of a choice.
    fn options(&self, formula: &Formula, part: usize) -> Vec<String> {
        let part = &formula.parts()[part];
        let name = formula.at(&part.range).strip_prefix('$').filter(|_| part.kind == PartKind::Param);
        name.map_or(Vec::new(), |name| self.cx.file.options(name))
    }

    /// Adds what the port of the whole formula takes.
    fn by_port(&self, expect: Expect<'a>, wanted: Wanted) -> Wanted {
        match expect.reference(self.cx).flatten() {
            Some(Accepts::One(Type::Gray)) => Wanted { single: true, ..wanted },
            Some(Accepts::One(Type::Vec2)) => Wanted { count: wanted.count.or(Some(2)), ..wanted },
            Some(Accepts::One(ty)) if ty.is_solid() => Wanted { space: Some(Space::Solid), ..wanted },
            _ => wanted,
        }
    }
}

/// Penalty for a value of a type.
fn fitness(ty: Option<Accepts>, wanted: &Wanted) -> f64 {
    ty.map_or(1.5, |ty| penalty(Inferred::of(ty), wanted))
}

fn penalty(of: Inferred, wanted: &Wanted) -> f64 {
    match of {
        Inferred::Numbers(count, space) => {
            let several = count > 1;
            let other = several && wanted.count.is_some_and(|wanted| wanted > 1 && wanted != count);
            let apart = space != Space::Constant && wanted.space.is_some_and(|wanted| wanted != space);
            let many = several && wanted.single;
            let few = !several && wanted.several;
            f64::from(u8::from(other)) * 6.0
                + f64::from(u8::from(apart)) * 8.0
                + f64::from(u8::from(many)) * 2.0
                + f64::from(u8::from(few)) * APART
        }
        Inferred::Ids if wanted.ids => -1.0,
        Inferred::Ids => 20.0,
        // Its channels are numbers.
        Inferred::Object(Accepts::One(Type::Material | Type::SolidMaterial) | Accepts::AnyMaterial) => 30.0,
        Inferred::Object(_) => 1000.0,
        Inferred::Unknown | Inferred::Word => 1.5,
    }
}
