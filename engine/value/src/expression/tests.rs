#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
mod data;
mod functions;
mod language;
mod limits;
mod world;

use super::*;

/// Test parameters and a canvas.
struct Known;

impl Names for Known {
    fn param(&mut self, name: &str) -> Meaning {
        match name {
            "x" => Meaning::Known(Value::Number(3.0)),
            "yes" => Meaning::Known(Value::Bool(true)),
            "tint" => Meaning::Known(Value::Vector(vec![0.5, 0.25, 1.0])),
            "style" => Meaning::Choice("Fine".to_owned(), vec!["Fine".to_owned(), "Coarse".to_owned()]),
            "broken" => Meaning::Broken,
            _ => Meaning::Wrong(Code::UnknownParam, format!("no {name}"), None),
        }
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        (name == "canvas.width").then_some(Meaning::Known(Value::Number(40.0)))
    }

    fn all(&self) -> Vec<String> {
        vec!["canvas.width".to_owned()]
    }

    fn has_words(&self) -> bool {
        true
    }

    fn seed(&mut self) -> Option<u64> {
        Some(7)
    }
}

fn known(text: &str) -> Value {
    evaluate(text, &mut Known).unwrap_or_else(|e| panic!("{text}: {e:?}"))
}

fn value(text: &str) -> f64 {
    match known(text) {
        Value::Number(value) => value,
        Value::Bool(value) => f64::from(u8::from(value)),
        other => panic!("{text}: {other:?}"),
    }
}

fn error(text: &str) -> (Code, Range<usize>) {
    let errors = evaluate(text, &mut Known).expect_err(text);
    (errors[0].code, errors[0].range.clone())
}

#[test]
fn evaluates_mathematics() {
    for (text, expected) in [
        ("1 + 2 * 3", 7.0),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("2^-1^2 * 8", 4.0),
        ("8/-2^2", -2.0),
        ("2 - -$x^2", 11.0),
        ("-2^-2", -0.25),
        ("-sqrt(4)^2 * 3", -12.0),
        ("+2 - +-3", 5.0),
        ("8/4*2", 4.0),
        ("8*3/4*2", 12.0),
        ("1-2+3", 2.0),
        ("7 * 29 % 90", 23.0),
        ("90 % 7 * 2", 12.0),
        ("100 / 8 % 5", 2.5),
        ("1 + 7 % 4 - 1", 3.0),
        ("-7 % 3", 2.0),
        ("7 % -3", -2.0),
        ("-7.5 % 3 + 7.5 % 3", 3.0),
        ("1e-3 * $x", 0.003),
        (".5 + 5.", 5.5),
        ("min(1, max(2, 3))", 1.0),
        ("min(3, 2, 5, 4, 1 + 0.5, 9)", 1.5),
        ("((((($x)))))", 3.0),
        ("(1 + 2) * (3 - (4 - 5))", 12.0),
        ("clamp($x, 0, 2)", 2.0),
        ("lerp(1, 3, 0.5)", 2.0),
        ("round(2.5) + floor(-0.5) + ceil(0.2) + abs(-1)", 4.0),
        ("2 * pi", std::f64::consts::TAU),
        ("pi() - pi", 0.0),
        ("sin(30)", 0.5),
        ("cos(60)", 0.5),
        ("sin(180) + cos(90) + tan(180) + sin(-360)", 0.0),
        ("tan(45) + sin(450) + cos(-180)", 1.0),
        ("asin(0.5) + acos(0.5) + atan(1)", 135.0),
        ("atan2(1, -1)", 135.0),
        ("sign(-3) + sign(0) + sign(0.1) + fract(-0.25)", 0.75),
        ("pow(2, 3) + exp(0) + log(exp(2))", 11.0),
        ("mix(1, 3, 0.5)", 2.0),
        ("smoothstep(0, 2, 1) + smoothstep(0, 2, 5) + smoothstep(1, 1, 0)", 1.5),
        ("smoothstep(0, 4, 1)", 3.0 / 16.0 - 2.0 / 64.0),
        ("step(2, 2) + step(2, 1.9) * 5", 1.0),
        ("length(3, 4) + length(-2)", 7.0),
        ("length((1, 2), 2)", 3.0),
        ("if(1 < 2, 10, 20) + if(2 <= 1, 1, 2)", 12.0),
        ("1 + 1 == 2 && 3 > 2 || 1 / 2 != 0.5", 1.0),
        ("0 || 1 && 0", 0.0),
        ("!0 + !5", 1.0),
        ("(1 >= 1) + (1 != 1) * 2", 1.0),
        ("-2 < -1", 1.0),
        ("!(1 < 2)", 0.0),
        ("canvas.width / 8", 5.0),
        ("$tint.g + $tint.y * 2 + $tint.b", 1.75),
        ("if($style == Coarse, 1, 2) + if($style != Coarse && $yes, 10, 20)", 12.0),
        ("floor(random(3)) + floor(hash(1, 2)) + floor(noise(0.3, 8))", 0.0),
        ("noise(3, -5)", 0.5),
    ] {
        assert!((value(text) - expected).abs() < 1e-12, "{text} = {}", value(text));
    }
}

#[test]
fn errors_have_places() {
    use Code::*;
    for (text, code, range) in [
        ("1 + foo(2)", BadExpression, 4..7),
        ("1 + $nope", UnknownParam, 4..9),
        ("1 2", BadExpression, 2..3),
        ("1 +", BadExpression, 3..3),
        ("1 & 2", BadExpression, 2..3),
        ("2mm", BadExpression, 0..3),
        ("1/0", NotFinite, 0..3),
        ("sqrt(0-1)", NotFinite, 0..9),
        ("1 + clamp(1)", BadExpression, 4..9),
        ("1 + sin", BadExpression, 4..7),
        ("pi(1)", BadExpression, 0..2),
        ("max()", BadExpression, 0..3),
        ("min(1,)", BadExpression, 6..7),
        ("(1, 2, 3, 4, 5)", BadExpression, 0..15),
        ("(1, (2, 3))", BadExpression, 4..10),
        ("(1, 2) + (1, 2, 3)", BadExpression, 7..8),
        ("1 < 2 < 3", BadExpression, 6..7),
        ("1 + $style", BadExpression, 4..10),
        ("$style == 3", BadExpression, 0..6),
        ("$style == Fin", UnknownVariant, 10..13),
        ("Fine == Fine", BadExpression, 0..4),
        ("1 + foo", BadExpression, 4..7),
        ("foo", BadExpression, 0..3),
        ("canvas.with", BadExpression, 0..11),
        ("$tint.q", BadExpression, 0..7),
        ("$x.r", BadExpression, 0..4),
        ("$ ", UnknownParam, 0..1),
        ("1 = 2", BadExpression, 2..3),
        ("a ? 1 : 2", BadExpression, 2..3),
        ("if(1, 2)", BadExpression, 0..2),
        ("5!", BadExpression, 1..2),
        ("(1", BadExpression, 2..2),
        ("1)", BadExpression, 1..2),
        ("2 * / 3", BadExpression, 4..5),
        ("3(2)", BadExpression, 1..2),
        ("", BadExpression, 0..0),
        (")", BadExpression, 0..1),
    ] {
        assert_eq!(error(text), (code, range), "{text}");
    }
}

#[test]
fn reports_all_unknown_names_at_once() {
    let errors = evaluate("foo(1) + bar($x)", &mut Known).unwrap_err();
    assert_eq!(errors.iter().map(|e| e.range.clone()).collect::<Vec<_>>(), [0..3, 9..12]);
    let errors = evaluate("$a + $b", &mut Known).unwrap_err();
    assert_eq!(errors.iter().map(|e| e.range.clone()).collect::<Vec<_>>(), [0..2, 5..7]);
}

#[test]
fn omits_consequences_of_reported_errors() {
    assert_eq!(evaluate("$broken + 1", &mut Known), Err(Vec::new()));
}

#[test]
fn limits_nesting_but_not_length() {
    assert_eq!(error(&"(".repeat(1 << 17)), (Code::BadExpression, 256..257));
    assert_eq!(error(&"-".repeat(1 << 17)), (Code::BadExpression, 256..257));
    assert_eq!(error(&"1^".repeat(1 << 17)).0, Code::BadExpression);
    let sum = format!("1{}", "+ 1 * (2)".repeat(1 << 17));
    assert_eq!(value(&sum), 1.0 + f64::from(1 << 18));
}

#[test]
fn records_ranges_of_parts() {
    let tree = super::unit::load("-(1 + $x) * max(2, 3)", &mut Known).units.remove(0).tree;
    let ranges: Vec<_> = tree.nodes.iter().map(|node| node.range.clone()).collect();
    assert_eq!(ranges, [2..3, 6..8, 2..8, 0..9, 16..17, 19..20, 12..21, 0..21]);
}

#[test]
fn distinguishes_sorts_of_values() {
    assert_eq!(known("$x > 2"), Value::Bool(true));
    assert_eq!(known("$yes"), Value::Bool(true));
    assert_eq!(known("if($yes, false, true)"), Value::Bool(false));
    assert_eq!(known("$yes + 1"), Value::Number(2.0));
    assert_eq!(known("if($x > 2, Coarse, Fine)"), Value::Word("Coarse".to_owned()));
    assert_eq!(known("$style"), Value::Word("Fine".to_owned()));
    assert_eq!(known("$tint * 2 + (0, 0, 1)"), Value::Vector(vec![1.0, 0.5, 3.0]));
    assert_eq!(known("min((1, 5), 3)"), Value::Vector(vec![1.0, 3.0]));
}

#[test]
fn random_numbers_vary_and_are_reproducible() {
    let numbers: Vec<f64> = (0..50).map(|i| value(&format!("random({i})"))).collect();
    assert!(numbers.iter().all(|number| (0.0..1.0).contains(number)));
    let mut sorted = numbers.clone();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    assert_eq!(sorted.len(), 50);
    assert_eq!(value("random(4)"), numbers[4]);
    assert_eq!(value("random(-0)"), numbers[0]);
    assert_ne!(value("hash(1, 2)"), value("hash(2, 1)"));
    assert_eq!(value("hash((1, 2), 3)"), value("hash(1, 2, 3)"));
}

/// Two test fields: `a` with one component and `c` with three.
struct Planes;

impl Names for Planes {
    fn param(&mut self, _name: &str) -> Meaning {
        Meaning::Broken
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        match name {
            "a" => Some(Meaning::Planes { first: 0, count: 1 }),
            "c" => Some(Meaning::Planes { first: 4, count: 3 }),
            _ => None,
        }
    }

    fn all(&self) -> Vec<String> {
        vec!["a".to_owned(), "c".to_owned()]
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        Some(7)
    }
}

fn program(text: &str) -> Program {
    compile(text, &mut Planes).unwrap().program(&|_| [Some(0.0); 2], [false; 2]).unwrap()
}

/// Reference interpreter of a program.
fn run(program: &Program, plane: impl Fn(usize) -> f64) -> Vec<f64> {
    let constants = program.constants.iter().map(|value| f64::from(*value));
    let mut values: Vec<f64> = constants.chain(program.planes.iter().map(|number| plane(*number))).collect();
    for instruction in &program.instructions {
        let args = instruction.args.map(|arg| values[usize::from(arg)]);
        values.push(instruction.op.value(args, instruction.seed));
    }
    program.results.iter().map(|result| values[usize::from(*result)]).collect()
}

#[test]
fn programs_match_their_expressions() {
    let plane = |plane: usize| [2.0, 0.0, 0.0, 0.0, 5.0, 6.0, 7.0][plane];
    for (text, expected) in [
        ("a", vec![2.0]),
        ("1 + 2", vec![3.0]),
        ("c * a + 1", vec![11.0, 13.0, 15.0]),
        ("(c.b, a)", vec![7.0, 2.0]),
        ("a^3 - a^4 + a^0.5 * a^0.5", vec![-6.0]),
        ("if(a > 1, c, 0)", vec![5.0, 6.0, 7.0]),
        ("a + (a - (a * (a / (a + a))))", vec![3.0]),
        ("length(c)", vec![110.0_f64.sqrt()]),
        ("min(c, 6, 5 + a / 4)", vec![5.0, 5.5, 5.5]),
    ] {
        let found = run(&program(text), plane);
        assert!(
            found.len() == expected.len() && found.iter().zip(&expected).all(|(f, e)| (f - e).abs() < 1e-6),
            "{text} {found:?}"
        );
    }
}

#[test]
fn folds_constants_and_shares_repeated_parts() {
    assert_eq!(program("a * (2 + 3 * sin(30) - sqrt(16))").instructions.len(), 1);
    assert_eq!(program("sin(a) + sin(a)").instructions.len(), 2);
    assert_eq!(program("if(1 > 2, exp(a), a)").instructions.len(), 0);
}

#[test]
fn long_formulas_are_refused() {
    let terms: String = (0..4000).map(|i| format!(" + a * {i}.5")).collect();
    let program = compile(&format!("a{terms}"), &mut Planes).unwrap().program(&|_| [Some(0.0); 2], [false; 2]);
    let message = program.err().map(|fault| fault.message).unwrap_or_default();
    assert!(message.contains("at most 4096"), "{message}");
}

/// Parts of expressions.
const WORDS: [&str; 28] = [
    "a", "c", "c.r", "1", "2.5", "(", "(", ")", ")", ",", " + ", " - ", " * ", " / ", "%", "^", "<", "==", "&&", "!",
    "$x", "$style", "min(", "if(", "noise(", "hash(", "length(", "Fine",
];

proptest::proptest! {
    #[test]
    fn nothing_panics(text in "[0-9a-z$+*/^()<>=!&|%, .é-]{0,40}") {
        for faults in [evaluate(&text, &mut Known).err(), compile(&text, &mut Planes).err()].into_iter().flatten() {
            for fault in faults {
                let inside = fault.range.start <= fault.range.end && fault.range.end <= text.len();
                proptest::prop_assert!(inside && text.get(fault.range.clone()).is_some(), "{:?}", fault);
            }
        }
    }

    /// Nearly valid texts reach deeper code than random ones.
    #[test]
    fn nothing_panics_on_words(words in proptest::collection::vec(proptest::sample::select(WORDS.to_vec()), 0..24)) {
        let text = words.concat();
        for faults in [evaluate(&text, &mut Known).err(), compile(&text, &mut Planes).err()].into_iter().flatten() {
            for fault in faults {
                proptest::prop_assert!(fault.range.start <= fault.range.end && fault.range.end <= text.len(), "{:?}", fault);
            }
        }
        if let Ok(compiled) = compile(&text, &mut Planes) {
            let _ = compiled.growth(&|_| [Some(1.0), None]);
            let program = compiled.program(&|plane| [Some(if plane == 0 { 4.0 } else { 0.0 }), Some(0.0)], [true; 2]).unwrap();
            run(&program, |_| 0.5);
        }
    }

    /// Without brackets: tighter operators first, then the rest, each from left to right.
    #[test]
    fn operators_go_from_left_to_right(first in 1..9_u8, rest in proptest::collection::vec(("[-+*/%]", 1..9_u8), 0..12)) {
        let mut text = first.to_string();
        let mut terms = vec![f64::from(first)];
        let (mut sign, mut factor) = (1.0, f64::from(first));
        for (operator, number) in &rest {
            text += &format!(" {operator} {number}");
            let number = f64::from(*number);
            match operator.as_str() {
                "*" => factor *= number,
                "/" => factor /= number,
                // Only the signs between terms are negative.
                "%" => factor %= number,
                other => (sign, factor) = (if other == "-" { -1.0 } else { 1.0 }, { terms.push(0.0); number }),
            }
            if let Some(last) = terms.last_mut() {
                *last = sign * factor;
            }
        }
        let expected = terms.into_iter().fold(0.0, |sum, term| sum + term);
        proptest::prop_assert_eq!(value(&text), expected, "{}", text);
    }
}
