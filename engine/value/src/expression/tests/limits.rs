//! Long and random texts: no panic, and a time proportional to their length.
use super::super::*;
use super::world::{World, function};
use crate::clock::Stopwatch;
use proptest::prelude::*;

/// Compiles a text in every way; all within a second.
fn compile_fast(text: &str) -> Result<Compiled, Vec<Fault>> {
    let start = Stopwatch::thread();
    let _ = evaluate(text, &mut World { has_words: true, ..World::default() });
    let _ = names_in(text);
    let _ = check_function(&function("f(x)", text), &mut World::default());
    let compiled = compile(text, &mut World::default());
    if let Ok(compiled) = &compiled {
        let text = compiled.encode();
        let _ = (Compiled::decode(&text), compiled.known(&|_| Some(1.0)), compiled.cost(), compiled.planes());
        let _ = compiled.program(&|_| [Some(0.0); 2], [true; 2]);
    }
    let time = start.elapsed();
    assert!(time.as_secs_f64() < 1.0, "{time:?} for {}", shorten(text));
    compiled
}

#[test]
fn long_texts_take_less_than_a_second() {
    const LENGTH: usize = 1 << 17;
    let repeat = |part: &str| part.repeat(LENGTH / part.len());
    for part in [
        "(", "-", "!", ")", "1^", "let a=1;", "a.", "a+", "sin(", "a,", "(a,b).x", ".x", ";", "=", "$", "$n.", "f(",
        "a b ", "é", "1e", "if(1,", "c.rgb.", "let ", "x=", "((a)", "hash(a,", "&&",
    ] {
        let _ = compile_fast(&repeat(part));
    }
    let sum = repeat("a*b+");
    assert!(compile_fast(&format!("{sum}1")).is_ok());
    let numbers: String = (0..15_000).map(|i| format!("a*{i}+")).collect();
    assert!(compile_fast(&format!("{numbers}1")).is_ok());
    assert!(compile_fast(&format!("({sum}c)")).is_ok());
    assert!(compile_fast(&format!("a{}", repeat("^1"))).is_err(), "too deep");
}

#[test]
fn many_names_take_less_than_a_second() {
    let locals: String = (0..10_000).map(|i| format!("let n{i} = a * {i};\n")).collect();
    assert!(compile_fast(&format!("{locals} n9999 + n17")).is_ok());
    let chained: String = (1..10_000).map(|i| format!("let n{i} = n{} + a;", i - 1)).collect();
    assert!(compile_fast(&format!("let n0 = b; {chained} n9999")).is_ok());
    let unknown: String = (0..10_000).map(|i| format!("n{i} + ")).collect();
    assert_eq!(compile_fast(&format!("{unknown} 1")).map_err(|faults| faults.len()).err(), Some(16));
    let called: String = (0..10_000).map(|i| format!("f{i}(1) + ")).collect();
    assert_eq!(compile_fast(&format!("{called} 1")).map_err(|faults| faults.len()).err(), Some(16));
    let many: Vec<(String, String)> = (0..10_000).map(|i| (format!("f{i}(x)"), "x + 1".to_owned())).collect();
    let many: Vec<(&str, &str)> = many.iter().map(|(signature, body)| (signature.as_str(), body.as_str())).collect();
    let mut world = World::with(&many);
    let start = Stopwatch::thread();
    assert_eq!(compile(&format!("{called} 1"), &mut world).map_err(|faults| faults.len()).err(), Some(16), "too many");
    assert!(start.elapsed().as_secs_f64() < 1.0);
}

/// Parts of formulas.
const WORDS: [&str; 44] = [
    "a",
    "c",
    "v",
    "j",
    "ids",
    "any",
    "x",
    "leaf.color",
    "noise",
    "1",
    "2.5",
    "(",
    "(",
    ")",
    ")",
    ",",
    " + ",
    " - ",
    " * ",
    " / ",
    "%",
    "^",
    "<",
    "==",
    "&&",
    "!",
    "$n",
    "$style",
    "$tint",
    "min(",
    "if(",
    "noise(",
    "hash(",
    "length(",
    "Fine",
    ".x",
    ".bgr",
    "let ",
    "q",
    " = ",
    "; ",
    "luminance(",
    "random(",
    "f(",
];

fn check(text: &str) -> Result<(), TestCaseError> {
    let mut world = World::with(&[("f(x)", "x.x + luminance(x) * g(x)"), ("g(x)", "rotate(x, 3).y")]);
    for has_words in [false, true] {
        world.has_words = has_words;
        let faults =
            [compile(text, &mut world).err(), evaluate(text, &mut world).err()].into_iter().flatten().flatten();
        let own = check_function(&function("h(x, q)", text), &mut world);
        for fault in faults.chain(own) {
            let of = match fault.function.as_deref() {
                None | Some("h") => text.to_owned(),
                Some(name) => world.function(name).map(|function| function.body.clone()).unwrap_or_default(),
            };
            prop_assert!(of.get(fault.range.clone()).is_some(), "{:?} of {}", fault, of);
        }
    }
    for one in names_in(text) {
        prop_assert!(text.get(one.range.clone()).is_some_and(|written| written.contains(&one.name)), "{:?}", one);
    }
    if let Ok(compiled) = compile(text, &mut world) {
        let _ = compiled.growth(&|_| [Some(1.0), None]);
        let program = compiled.program(&|plane| [Some(if plane == 0 { 4.0 } else { 0.0 }), Some(0.0)], [true; 2]);
        prop_assert!(program.is_ok());
        if compiled.components() > 0 {
            let text = compiled.encode();
            prop_assert_eq!(Compiled::decode(&text).map(|decoded| decoded.encode()), Some(text));
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn random_texts_do_not_panic(text in "[0-9a-z$+*/^()<>=!&|%, .;é\n-]{0,1024}") {
        check(&text)?;
    }

    #[test]
    fn random_unicode_does_not_panic(text in ".{0,256}") {
        check(&text)?;
    }

    /// Nearly valid texts reach deeper code than random ones.
    #[test]
    fn random_words_do_not_panic(words in proptest::collection::vec(proptest::sample::select(WORDS.to_vec()), 0..24)) {
        check(&words.concat())?;
    }
}
