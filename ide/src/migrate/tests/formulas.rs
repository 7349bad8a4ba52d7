//! Formulas that are put together.
use crate::migrate::formula::Formula;
use crate::migrate::words::{Base, Name, SUM};

fn formula(text: &str) -> Formula {
    Formula::read(text).expect("a formula")
}

fn text(formula: &Formula) -> String {
    formula.text(&|name: &Name| match &name.base {
        Base::Text(text) => format!("{text}{}", name.rest),
        _ => String::new(),
    })
}

fn put(outer: &str, inner: &str) -> String {
    let inner = formula(inner);
    let is_hole = |name: &Name| matches!(&name.base, Base::Text(text) if text == "hole");
    text(&formula(outer).replaced(&mut |name| is_hole(name).then(|| inner.clone())))
}

#[test]
fn puts_brackets_only_where_needed() {
    for (outer, inner, expected) in [
        ("hole + 1", "a + b", "a + b + 1"),
        ("1 + hole", "a + b", "a + b + 1"),
        ("x + y + hole", "a + b", "x + y + (a + b)"),
        ("x * y + hole - 1", "a + b", "a + b + x * y - 1"),
        ("x + y * hole", "a * b", "x + a * b * y"),
        ("x - y * hole", "a / b", "x - a / b * y"),
        ("x / y * hole", "a * b", "x / y * (a * b)"),
        ("f(x + hole)", "a - b", "f(a - b + x)"),
        ("f(x) * hole", "a * b", "a * b * f(x)"),
        ("x < y + hole", "a + b", "x < a + b + y"),
        ("-x * hole", "a * b", "-x * (a * b)"),
        ("max(hole, c)", "max(a, b)", "max(a, b, c)"),
        ("max(c, hole)", "min(a, b)", "max(c, min(a, b))"),
        ("max(c, hole)", "max(a, b) + 1", "max(c, max(a, b) + 1)"),
        ("1 - hole", "a - b", "1 - (a - b)"),
        ("1 - hole", "a * b", "1 - a * b"),
        ("2 * hole", "a + b", "2 * (a + b)"),
        ("hole * 2", "a * b", "a * b * 2"),
        ("2 / hole", "a * b", "2 / (a * b)"),
        ("hole ^ 2", "a ^ b", "(a ^ b) ^ 2"),
        ("2 ^ hole", "a ^ b", "2 ^ a ^ b"),
        ("hole ^ 2", "-a", "(-a) ^ 2"),
        ("-hole", "a * b", "-a * b"),
        ("-hole", "a % b", "-(a % b)"),
        ("-hole", "-a", "-(-a)"),
        ("-hole", "a + b", "-(a + b)"),
        ("hole < 1", "a < b", "(a < b) < 1"),
        ("max(hole, 1)", "a + b", "max(a + b, 1)"),
        ("(hole) * 2", "a + b", "(a + b) * 2"),
        ("(hole) * 2", "a", "a * 2"),
        ("1 + hole", "-0.5 * a", "1 - 0.5 * a"),
        ("1 - hole", "-0.5", "1 + 0.5"),
        ("1 * hole", "-0.5", "1 * -0.5"),
        ("1 - hole % a", "-0.5", "1 - -0.5 % a"),
        ("!hole", "a && b", "!(a && b)"),
    ] {
        assert_eq!(put(outer, inner), expected, "{outer} with {inner}");
    }
}

#[test]
fn takes_parts_of_values() {
    for (whole, expected) in [
        ("a", "a.r"),
        ("$c", "$c.r"),
        ("(1, x + 1, 3)", "1"),
        ("mix(a, b, c)", "mix(a, b, c).r"),
        ("a + b", "(a + b).r"),
        ("#fff", "(#fff).r"),
        ("(a, b).yx", "((a, b).yx).r"),
    ] {
        assert_eq!(text(&formula(whole).part(".r")), expected, "{whole}");
    }
    assert_eq!(text(&formula("(1, x + 1)").part(".y")), "x + 1");
    assert_eq!(text(&formula("(1, x + 1)").part(".yx")), "(1, x + 1).yx");
}

#[test]
fn measures_formulas() {
    let of = formula("max(a, (b - 1) * 2) + $c");
    assert_eq!((of.operations(), of.depth(), of.binds()), (4, 2, SUM));
    assert_eq!(formula("-2").literal(), Some(-2.0));
    assert!(formula("0.5 * $c * canvas.width").is_constant() && !formula("x").is_constant());
    assert_eq!(formula("max(a, f(b, c))").arguments("max").map(|arguments| arguments.len()), Some(2));
    assert_eq!(formula("max(a, b) + max(c, d)").arguments("max"), None);
}
