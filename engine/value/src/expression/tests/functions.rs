//! Functions of the user.
use super::super::*;
use super::world::{World, fault, function, values};

fn lib() -> World {
    World::with(&[
        ("ridge(x, w)", "1 - smoothstep(0, w, abs(x))"),
        ("twice(x)", "2 * x"),
        ("swap(v)", "v.yx"),
        ("four(x)", "let y = twice(x); twice(y)"),
        ("wide()", "canvas.width / 8"),
        ("bad(x)", "x + y"),
        ("pair(x)", "x + (1, 2)"),
        ("lit(c)", "luminance(c)"),
        ("own(i)", "random(i, 5) + random(i)"),
        ("tint(x)", "$n * x"),
        ("me(x)", "me(x - 1)"),
        ("one(x)", "two(x)"),
        ("two(x)", "1 + one(x)"),
        ("open(x)", "(x + 1"),
        ("lib.f(x)", "g(x) + lib.deep.h(x)"),
        ("lib.g(x)", "x + 1"),
        ("lib.deep.h(x)", "k(x) * 10"),
        ("lib.deep.k(x)", "x + 2"),
        ("g(x)", "100"),
    ])
}

#[test]
fn functions_are_compiled_in_place() {
    for (text, expected) in [
        ("ridge(0, 1) + ridge(9, 1)", vec![1.0]),
        ("twice(c)", vec![0.4, 0.8, 1.2]),
        ("twice(four(a)) + 1", vec![3.0]),
        ("swap(v)", vec![4.0, 3.0]),
        ("swap(c) + swap((1, 2)).x", vec![2.4, 2.2]),
        ("wide()", vec![5.0]),
        ("own(ids) - random(ids) - random(17, 5)", vec![0.0]),
        // A function of an import calls functions of that import first.
        ("lib.f(1)", vec![32.0]),
        ("if(1 > 2, twice(a), b)", vec![-1.5]),
    ] {
        let found = values(text, &mut lib());
        let near = found.len() == expected.len() && found.iter().zip(&expected).all(|(f, e)| (f - e).abs() < 1e-9);
        assert!(near, "{text}: {found:?}");
    }
    let text = |text: &str| compile(text, &mut lib()).unwrap().encode();
    assert_eq!(text("four(a) + four(a)"), text("2 * (2 * a) + 2 * (2 * a)"));
}

#[test]
fn reports_faults_at_their_place() {
    for (text, written, message) in [
        ("1 + nope(a)", "nope", "there is no function `nope`"),
        ("ridge(a)", "ridge", "`ridge` takes 2 values; found 1"),
        ("twice()", "twice", "`twice` takes 1 value; found 0"),
        ("wide(a)", "wide", "`wide` takes 0 values; found 1"),
        ("a + bad(a)", "bad: y", "a function does not see `y`"),
        ("pair(c)", "pair: +", "2 components and 3 do not go together"),
        ("lit(v)", "lit: luminance", "`luminance` takes 3 components for `c`; found 2"),
        ("tint(a)", "tint: $n", "a function does not see the parameter `$n`"),
        ("me(3)", "me: me", "`me` calls itself here"),
        ("1 + one(3)", "two: one", "`one` calls itself here"),
        ("open(a)", "open: ", "the expression ends too early"),
        ("twice(ids)", "twice: x", "`x` are numbers of pieces"),
        ("twice($style)", "$style", "`$style` is a choice, not a number"),
        ("twice", "twice", "there is no name `twice`"),
    ] {
        let (found, said, _) = fault(text, &mut lib());
        assert_eq!((found.as_str(), said.as_str()), (written, message), "{text}");
    }
    let (_, _, help) = fault("rigde(a, 1)", &mut lib());
    assert!(help.contains("`ridge`"), "{help}");
}

#[test]
fn checks_functions_without_calls() {
    let check = |signature: &str, body: &str| {
        let faults = check_function(&function(signature, body), &mut lib());
        assert!(faults.iter().all(|fault| fault.function.as_deref() == signature.split('(').next()), "{faults:?}");
        faults
            .iter()
            .map(|fault| format!("{}: {}", &body[fault.range.clone()], fault.message))
            .collect::<Vec<_>>()
            .join("; ")
    };
    assert_eq!(check("f(x, w)", "x * w.r + canvas.width + luminance(x) + random(x, w)"), "");
    assert_eq!(check("f(x)", "bad(x) + pair(c)"), "c: a function does not see `c`");
    assert_eq!(check("f(x)", "x + y + z"), "y: a function does not see `y`; z: a function does not see `z`");
    assert_eq!(check("f(x)", "nope(x)"), "nope: there is no function `nope`");
    assert_eq!(check("f(x)", "ridge(x)"), "ridge: `ridge` takes 2 values; found 1");
    assert_eq!(check("f(x)", "(x"), ": the expression ends too early");
    assert_eq!(check("f(x)", "let x = 2; x"), "x: `x` is a parameter of the function");
    assert_eq!(check("f(x)", "1 + f(x)"), "f: `f` calls itself here");
    assert_eq!(check("one(x)", "two(x) + two(1)"), "two: `one` calls itself here; two: `one` calls itself here");
    assert_eq!(check("f(x)", "one(x)"), "");
    assert_eq!(check("f(x)", "x * (1, 2) + (1, 2, 3)"), "+: 2 components and 3 do not go together");
    assert_eq!(check("f()", ""), ": the expression is empty");
    assert_eq!(check("lib.f(x)", "g(x) + deep.h(x)"), "");
}

#[test]
fn limits_calls_of_functions() {
    let chain = |length: usize| {
        let functions: Vec<(String, String)> =
            (0..length).map(|i| (format!("f{i}(x)"), format!("f{}(x) + 1", i + 1))).collect();
        let mut functions: Vec<(&str, &str)> = functions.iter().map(|(s, b)| (s.as_str(), b.as_str())).collect();
        let last = format!("f{length}(x)");
        functions.push((&last, "x"));
        World::with(&functions)
    };
    assert_eq!(values("f0(a)", &mut chain(31)), [31.25]);
    let (_, message, _) = fault("f0(a)", &mut chain(32));
    assert_eq!(message, "calls of functions nest deeper than 32");
    let doubling: Vec<(String, String)> =
        (0..30).map(|i| (format!("f{i}(x)"), format!("f{0}(x) + f{0}(x + 1)", i + 1))).collect();
    let mut functions: Vec<(&str, &str)> = doubling.iter().map(|(s, b)| (s.as_str(), b.as_str())).collect();
    functions.push(("f30(x)", "x"));
    for text in ["f0(a)", "f0(1)"] {
        let (_, message, _) = fault(text, &mut World::with(&functions));
        assert_eq!(message, "with its functions the formula has more than 4096 operations", "{text}");
    }
}
