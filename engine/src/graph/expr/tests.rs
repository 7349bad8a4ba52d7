#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use super::*;

fn value(text: &str) -> f64 {
    let lookup = |name: &str| match name {
        "x" => Lookup::Number(3.0),
        "broken" => Lookup::Broken,
        _ => Lookup::Wrong(Code::UnknownParam, format!("no {name}"), None),
    };
    evaluate(text, lookup).unwrap_or_else(|e| panic!("{text}: {e:?}"))
}

fn error(text: &str) -> (Code, Range<usize>) {
    let lookup = |_: &str| Lookup::Wrong(Code::UnknownParam, String::new(), None);
    let errors = evaluate(text, lookup).expect_err(text);
    (errors[0].code, errors[0].range.clone())
}

#[test]
fn mathematics_hold() {
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
        ("-7 % 3", -1.0),
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
        ("(1, 2)", BadExpression, 2..3),
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
fn all_unknown_names_are_told_at_once() {
    let errors = evaluate("foo(1) + bar($x)", |_| Lookup::Number(1.0)).unwrap_err();
    assert_eq!(errors.iter().map(|e| e.range.clone()).collect::<Vec<_>>(), [0..3, 9..12]);
    let errors = evaluate("$a + $b", |_| Lookup::Wrong(Code::UnknownParam, String::new(), None)).unwrap_err();
    assert_eq!(errors.iter().map(|e| e.range.clone()).collect::<Vec<_>>(), [0..2, 5..7]);
}

#[test]
fn what_follows_from_another_error_is_silent() {
    assert_eq!(evaluate("$broken + 1", |_| Lookup::Broken), Err(Vec::new()));
}

#[test]
fn nesting_is_bounded_and_length_is_not() {
    assert_eq!(error(&"(".repeat(1 << 17)), (Code::BadExpression, 256..257));
    assert_eq!(error(&"-".repeat(1 << 17)), (Code::BadExpression, 256..257));
    assert_eq!(error(&"1^".repeat(1 << 17)).0, Code::BadExpression);
    let sum = format!("1{}", "+ 1 * (2)".repeat(1 << 17));
    assert_eq!(value(&sum), 1.0 + f64::from(1 << 18));
}

#[test]
fn the_tree_knows_where_its_parts_stand() {
    let tree = super::parse::parse("-(1 + $x) * max(2, 3)").unwrap();
    let ranges: Vec<_> = tree.nodes.iter().map(|node| node.range.clone()).collect();
    assert_eq!(ranges, [2..3, 6..8, 2..8, 0..9, 16..17, 19..20, 12..21, 0..21]);
}

proptest::proptest! {
    #[test]
    fn nothing_panics(text in "[0-9a-z$+*/^(), .é-]{0,40}") {
        let _ = evaluate(&text, |_| Lookup::Number(1.5));
    }

    /// Without brackets: first all that binds tighter, then the rest, each from left to right.
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
