//! Formulas: those of the shipped graphs, and others made by the grammar, whole and damaged.
use crate::damage::{Chance, fuzz, plain};
use crate::{Any, files};
use shibo_graph::syntax::formula::{Formula, WordKind, begins, content, literal};
use shibo_value::expression::{self, Compiled, described};

/// Number of formulas made by the grammar.
const MADE: u64 = 3000;

/// The formulas of all shipped graphs, without the equals sign.
fn shipped() -> Vec<Vec<u8>> {
    let texts: Vec<String> = ["graphs", "graphs/lib"]
        .iter()
        .flat_map(|folder| files(folder, ".ron"))
        .map(|text| String::from_utf8_lossy(&text).into_owned())
        .collect();
    let rest = texts.iter().flat_map(|text| text.split("\"=").skip(1));
    rest.filter_map(|rest| rest.split('"').next()).map(|formula| formula.as_bytes().to_vec()).collect()
}

/// Makes formulas by the grammar.
struct Maker(Chance);

impl Maker {
    fn of<'t>(&mut self, words: &[&'t str]) -> &'t str {
        words[self.0.below(words.len())]
    }

    /// A formula with up to three local names.
    fn formula(&mut self) -> String {
        let locals = self.0.below(4);
        let names = ["p", "q", "r"];
        let definitions: String = (0..locals)
            .map(|index| {
                format!("let {} = {};{}", names[index], self.value(3, &names[..index]), self.of(&[" ", "\n  "]))
            })
            .collect();
        definitions + &self.value(4, &names[..locals])
    }

    fn value(&mut self, depth: usize, locals: &[&str]) -> String {
        let known = [
            "u", "v", "w", "ids", "v.x", "w.bgr", "v.y", "$a", "$b", "$b.x", "$c", "pi", "1", "0.5", "2e-3", "#7a4526",
        ];
        if depth == 0 || self.0.below(5) == 0 {
            let all: Vec<&str> = known.iter().chain(locals).copied().collect();
            return self.of(&all).to_owned();
        }
        let below = depth - 1;
        match self.0.below(7) {
            0 => format!("{}{}", self.of(&["-", "!", "+"]), self.value(below, locals)),
            1 => format!("({})", self.value(below, locals)),
            2 => format!("({})", self.values(below, locals, 2)),
            3 => format!("({}).{}", self.values(below, locals, 3), self.of(&["x", "rg", "bgr", "yx", "zzz"])),
            4 | 5 => {
                let operators = ["+", "-", "*", "/", "%", "^", "<", ">=", "==", "!=", "&&", "||"];
                let (a, b) = (self.value(below, locals), self.value(below, locals));
                format!("{a} {} {b}", self.of(&operators))
            }
            _ => {
                let functions = described();
                let one = &functions[self.0.below(functions.len())];
                let values = one.call.matches(',').count() + 1;
                let (name, values) = if self.0.below(6) == 0 { ("f", 2) } else { (one.name, values) };
                format!("{name}({})", self.values(below, locals, values))
            }
        }
    }

    fn values(&mut self, depth: usize, locals: &[&str], count: usize) -> String {
        let values: Vec<String> = (0..count).map(|_| self.value(depth, locals)).collect();
        values.join(", ")
    }
}

/// The program of a formula, if it is a good one. Checks its text and its messages.
pub(crate) fn compiled(text: &str) -> Option<String> {
    expression::names_in(text);
    let compiled = expression::compile(text, &mut Any);
    let program = compiled.as_ref().ok().map(Compiled::encode);
    if let (Some(program), Ok(compiled)) = (&program, &compiled)
        && compiled.components() > 0
    {
        assert_eq!(Compiled::decode(program).map(|decoded| decoded.encode()).as_ref(), Some(program));
        assert_eq!(Compiled::components_over(program, &|_| true), Some(compiled.components()));
    }
    for faults in [compiled.err(), expression::evaluate(text, &mut Any).err()] {
        for fault in faults.into_iter().flatten() {
            plain(&fault.message);
            fault.help.as_deref().into_iter().for_each(plain);
            let inside = fault.function.is_some() || text.get(fault.range.clone()).is_some();
            assert!(inside, "{:?} of {text:?}", fault.range);
        }
    }
    program
}

/// Checks the parts that editors see.
fn parsed(text: &str) -> Formula {
    let formula = Formula::parse(text);
    let mut end = 0;
    for word in formula.words() {
        assert!(text[end..word.range.start].trim().is_empty(), "text between the words of {text:?}");
        end = word.range.end;
    }
    assert!(text[end..].trim().is_empty(), "text behind the words of {text:?}");
    for (index, part) in formula.parts().iter().enumerate() {
        assert!(part.parent.is_none_or(|parent| parent > index), "part {index} of {text:?}");
        assert!(text.get(part.range.clone()).is_some(), "part {index} of {text:?}");
    }
    for at in (0..=text.len()).step_by(1 + text.len() / 8).filter(|at| text.is_char_boundary(*at)) {
        formula.call_at(at);
        formula.word_at(at);
    }
    formula
}

#[test]
fn reads_formulas_of_the_grammar() {
    let made = (0..MADE).map(|seed| Maker(Chance::new(seed)).formula().into_bytes());
    let seeds: Vec<Vec<u8>> = shipped().into_iter().chain(made).collect();
    assert!(seeds.len() > 5000, "{}", seeds.len());
    fuzz("formulas", &seeds, 10_000, |input| {
        let text = String::from_utf8_lossy(input);
        let (formula, program) = (parsed(&text), compiled(&text));
        assert!(program.is_none() || !formula.is_faulty(), "the compiler takes {text:?}, the editor does not");
        let strange = formula.words().iter().any(|word| word.kind == WordKind::Unknown);
        if strange || text.starts_with('=') {
            return;
        }
        let laid = literal(&format!("={text}"), 8, 4);
        let inside = &laid[content(&laid).expect("a literal")];
        let again = &inside[begins(inside).expect("a formula")..];
        assert_eq!(compiled(again), program, "the layout {laid:?} of {text:?} means something else");
        assert_eq!(literal(inside, 8, 4), laid, "another layout each time");
    });
}
