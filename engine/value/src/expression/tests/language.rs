//! Local names, components, and the functions of the language.
use super::super::*;
use super::world::{World, fault, values};

fn near(text: &str, expected: &[f64]) {
    let found = values(text, &mut World::default());
    let near = found.len() == expected.len() && found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-9);
    assert!(near, "{text}: {found:?}, not {expected:?}");
}

#[test]
fn local_names_stand_for_values() {
    near("let r = length(v); let f = 1 - r / 10; clamp(f, 0, 1)", &[0.5]);
    near("let p = c.rg; p.yx * 2", &[0.8, 0.4]);
    near("let a = a + 1;\n  let b = a * 2;\n b", &[2.5]);
    // A local name hides nodes, positions and constants, but no function.
    near("let pi = 3; let noise = 2; let x = 1; let min = 5; pi + noise + x + min(min, 9)", &[11.0]);
    // A bare name beside a choice is an option, also where other unknown names are not words.
    near("let e = if($style == Coarse, 1, 2); e + (Fine == $style)", &[3.0]);
}

#[test]
fn words_can_have_local_names() {
    let mut world = World { has_words: true, ..World::default() };
    assert_eq!(values("let s = $style; let w = Fine; if(s == w, 1, 2)", &mut world), [1.0]);
    let (written, message, _) = fault("let s = $style; s + 1", &mut world);
    assert_eq!((written.as_str(), message.as_str()), ("s", "`s` is a choice, not a number"));
}

#[test]
fn nodes_hide_functions_and_constants() {
    near("noise * 2 + noise(3, 5)", &[2.0]);
    near("pi", &[std::f64::consts::PI]);
    let mut world = World::default();
    let _ = compile("true + pi + sin(a)", &mut world);
    assert_eq!(world.asked, ["pi", "a"]);
}

#[test]
fn components_follow_any_value() {
    near("v.yx", &[4.0, 3.0]);
    near("c.bgr - c.zyx", &[0.0; 3]);
    near("(c.r, 2 * c.g).y", &[0.8]);
    near("rotate(v, 90).x + -(1, 2).y ^ 2", &[-8.0]);
    near("(c + 1).xy.y", &[1.4]);
    near("$tint.bgr * (0, 0, 1) + $tint.g", &[0.25, 0.25, 0.75]);
    near("v.xyxy", &[3.0, 4.0, 3.0, 4.0]);
    near("j.yx + (1, 2, 3, 4).xy", &[5.0]);
    near("let q = c * 2; q.zz", &[1.2, 1.2]);
    near("if(a > 0, c, 0).r", &[0.2]);
}

#[test]
fn paths_are_read_from_the_longest_name() {
    let mut world = World::default();
    assert_eq!(values("leaf.color.bgr.r + leaf", &mut world), [0.6 + 0.25]);
    assert_eq!(world.asked, ["leaf.color.bgr.r", "leaf.color.bgr", "leaf.color", "leaf"]);
}

#[test]
fn reports_faults_of_names_and_components() {
    for (text, written, message) in [
        ("a.x", "a.x", "`a` has no component `x`"),
        ("c.xg", "c.xg", "`c` has no component `xg`"),
        ("c.w + 1", "c.w", "`c` has no component `w`"),
        ("v.r", "v.r", "`v` has no component `r`"),
        ("j.x", "j.x", "`j` has no component `x`"),
        ("j.xxyy", "j.xxyy", "`j` has no component `xxyy`"),
        ("c.rgbrg", "c.rgbrg", "`c` has no component `rgbrg`"),
        ("leaf.color.q", "leaf.color.q", "`leaf.color` has no component `q`"),
        ("(a, b).z", ".z", "`(a, b)` has no component `z`"),
        ("sin(a).x", ".x", "`sin(a)` has no component `x`"),
        ("3 .x", ".x", "`3 ` has no component `x`"),
        ("let q = c; q.w", "q.w", "`q` has no component `w`"),
        (".x", ".x", "`.x` cannot stand here"),
        ("a == nope", "nope", "there is no name `nope`"),
        ("ids.x", "ids.x", "`ids` has no component `x`"),
    ] {
        let (found, said, help) = fault(text, &mut World::default());
        let what = text.contains(".x") && !text.contains("c.x") && text != "j.x" && !text.starts_with('.');
        assert_eq!((found.as_str(), said.as_str()), (written, message), "{text}");
        assert!(!what || help.contains("single number") || text.starts_with('j'), "{text}: {help}");
    }
}

#[test]
fn reports_faults_of_definitions() {
    for (text, written, advice) in [
        ("let a = 1;", "", "after the last `;`"),
        ("let a = 1", "", "the formula that uses `a`"),
        ("a + 1;", ";", "no `;` at its end"),
        ("a; b", ";", "only a definition"),
        ("let a = 1; let a = 2; a", "a", "another name"),
        ("let q = r; let r = 1; q", "r", "to the front"),
        ("let q.r = 1; q", "q.r", "letters, digits"),
        ("let 3 = 1; 3", "3", "letters, digits"),
        ("let q 3; q", "3", "let name = …"),
        ("let true = 1; 2", "true", ""),
        ("let if = 1; 2", "if", ""),
        ("1 + let q = 2; q", "let", "before the formula"),
        ("(let q = 2; q)", "let", "before the formula"),
        ("a = 2", "=", "`==`"),
        ("let q = (1; q", ";", "only a definition"),
        ("let", "let", ""),
        ("let q = q + 1; q", "q", "to the front"),
    ] {
        let (found, _, help) = fault(text, &mut World::default());
        assert_eq!(found, written, "{text}");
        assert!(help.contains(advice), "{text}: {help}");
    }
}

#[test]
fn functions_of_vectors_compute() {
    near("dot((1, 2, 3), (4, 5, 6)) + dot(v, v)", &[57.0]);
    near("cross((1, 0, 0), (0, 1, 0))", &[0.0, 0.0, 1.0]);
    near("normalize(v) + normalize((0, 0))", &[0.6, 0.8]);
    near("rotate((1, 0), 30)", &[3f64.sqrt() / 2.0, 0.5]);
    near("luminance((1, 1, 1)) + luminance(c)", &[1.0 + 0.04252 + 0.28608 + 0.04332]);
    near("sum(c, v)", &[8.2]);
    near("remap(5, 0, 10, (1, 2), 3) + remap(20, 0, 10, 0, 1)", &[4.0, 4.5]);
    near("triangle(1.25) + triangle(-2) + triangle(0.5)", &[1.5]);
    near("snap(7, 2) + snap(-7, 2) + snap(0.3, 0)", &[-1.7]);
    near("multiply(2, 3) + screen(0.5, 0.5) + overlay(0.25, 0.5) + soft_light(0.4, 0.5)", &[7.4]);
    near("darken(c, 0.3) + lighten(c, 0.5)", &[0.7, 0.8, 0.9]);
    near("smooth_min(1, 1, 0.4) + smooth_max(1, 1, 0.4) + smooth_min(0, 5, 1)", &[2.0]);
    near("log2(8) + cbrt(-27)", &[0.0]);
    near("from_oklab(oklab((0.2, 0.5, 0.1))) - (0.2, 0.5, 0.1) < 1e-5", &[1.0; 3]);
    near("hsv((0, from_srgb(0.5), 1))", &[210.0, 1.0, 1.0]);
    near("srgb(from_hsv((300, 0.5, 0.8)))", &[0.8, 0.4, 0.8]);
    near("noise(3, -5, 7)", &[0.5]);
}

#[test]
fn reports_wrong_numbers_of_components_at_the_function() {
    for (text, written, message) in [
        ("1 + luminance(a)", "luminance", "`luminance` takes 3 components for `c`; found 1"),
        ("oklab(v)", "oklab", "`oklab` takes 3 components for `c`; found 2"),
        ("dot(a, v)", "dot", "`dot` takes a vector for `a`; found 1"),
        ("dot(c, v)", "dot", "2 components and 3 do not go together"),
        ("rotate(c, 3)", "rotate", "`rotate` takes 2 components for `v`; found 3"),
        ("rotate(v, v)", "rotate", "`rotate` takes 1 component for `angle`; found 2"),
        ("cross(v, c)", "cross", "`cross` takes 3 components for `a`; found 2"),
        ("normalize(3)", "normalize", "`normalize` takes a vector for `v`; found 1"),
        ("noise(1)", "noise", "`noise` takes 2 or 3 values; found 1"),
        ("random()", "random", "`random` takes 1 or 2 values; found 0"),
        ("remap(1, v, c, 1, 1)", "remap", "2 components and 3 do not go together"),
    ] {
        let (found, said, _) = fault(text, &mut World::default());
        assert_eq!((found.as_str(), said.as_str()), (written, message), "{text}");
    }
    let (_, _, help) = fault("luminance(a)", &mut World::default());
    assert!(help.contains("luminance(c)") && help.contains("(r, g, b)"), "{help}");
}

#[test]
fn random_numbers_of_pieces_have_a_seed_of_their_own() {
    let number = |seed, piece| f64::from(of_piece(seed, piece));
    near("random(ids, $n)", &[number(103, 17.0)]);
    near("random(5, 2 - 1)", &[number(101, 5.0)]);
    near("random((1, 2), 0)", &[number(100, 1.0), number(100, 2.0)]);
    for text in ["random(ids, a)", "random(ids, 0.5)", "random(ids, -1)", "random(ids, v)", "random(ids, 1e99)"] {
        let (_, message, _) = fault(text, &mut World::default());
        assert!(message.contains("constant whole number"), "{text}: {message}");
    }
    let (written, message, _) = fault("random(1, $style)", &mut World::default());
    assert_eq!((written.as_str(), message.as_str()), ("$style", "`$style` is a choice, not a number"));
    // A surrounding without seeds for pieces.
    let faults = compile("random(1, 2)", &mut super::Known).unwrap_err();
    assert_eq!(faults[0].range, 0..6);
}

#[test]
fn numbers_of_pieces_only_name_pieces() {
    near("random(ids) == random(17)", &[1.0]);
    near("hash(ids, 2) == hash(17, 2)", &[1.0]);
    near("if(ids == 17, 1, 2) + (ids != 3) + (ids == ids)", &[3.0]);
    near("let p = ids; random(p, 1) == random(17, 1)", &[1.0]);
    for text in [
        "ids + 1",
        "ids",
        "-ids",
        "min(ids, 2)",
        "(ids, 1)",
        "if(ids, 1, 2)",
        "if(a, ids, 2)",
        "ids < 3",
        "sin(ids)",
        "noise(ids, 1)",
        "length(ids)",
        "luminance(ids)",
        "1 * ids",
    ] {
        let (written, message, help) = fault(text, &mut World::default());
        assert_eq!((written.as_str(), message.as_str()), ("ids", "`ids` are numbers of pieces"), "{text}");
        assert!(help.contains("random(ids)"), "{help}");
    }
    let (written, message, _) = fault("let p = ids; p * 2", &mut World::default());
    assert_eq!((written.as_str(), message.as_str()), ("p", "`p` are numbers of pieces"));
}

#[test]
fn unknown_components_go_with_all_others() {
    let components = |text: &str| compile(text, &mut World::default()).unwrap().known_components();
    for (text, expected) in [
        ("any", None),
        ("any + 1", None),
        ("any * c", Some(3)),
        ("any.x", Some(1)),
        ("any.bgr", Some(3)),
        ("any.xy", None),
        ("any.height", None),
        ("any.color.r", Some(1)),
        ("(any, any)", Some(2)),
        ("if(any > 1, any, v)", Some(2)),
        ("min(any, 1)", None),
        ("luminance(any)", Some(1)),
        ("rotate(any, any)", Some(2)),
        ("dot(any, c)", Some(1)),
        ("length(any)", Some(1)),
        ("random(any, 3)", None),
        ("let q = any; q.w + q.height.r", Some(1)),
        ("any == 3", None),
        ("any == $style", Some(1)),
        ("if(any == 3, $style, $style)", None),
        ("if($n > 2, any, $style)", None),
        ("cross(any, c) + any", Some(3)),
        ("oklab(any + 1).x", Some(1)),
    ] {
        assert_eq!(components(text), expected, "{text}");
    }
    let planes = |text: &str| compile(text, &mut World::default()).unwrap().planes();
    assert_eq!(planes("any.b + any"), [20, 22]);
}

#[test]
fn finds_names_in_texts() {
    let found = |text: &str| {
        let uses = names_in(text);
        let uses = uses.iter().map(|one| format!("{:?} {} {}", one.kind, one.name, &text[one.range.clone()]));
        uses.collect::<Vec<_>>().join(", ")
    };
    assert_eq!(
        found("let q = sin(leaf.color.r); q.x + $tint.r * lib.f(pi, true) - q"),
        "Local q q, Function sin sin, Name leaf.color.r leaf.color.r, Local q q, Param tint $tint, Function lib.f lib.f, \
         Name pi pi, Local q q"
    );
    // A name is not visible in its own definition.
    assert_eq!(found("let q = q; q"), "Local q q, Name q q, Local q q");
    assert_eq!(found("a + ? § b ) = let 3.x, c("), "Name a a, Name b b, Name let let, Function c c");
    assert_eq!(found(""), "");
}
