//! Programs as data: text, constants, fusion.
use super::super::*;
use super::world::{World, plane, values};
use proptest::prelude::*;

fn compiled(text: &str) -> Compiled {
    compile(text, &mut World::default()).unwrap_or_else(|faults| panic!("{text}: {faults:?}"))
}

fn text(text: &str) -> String {
    compiled(text).encode()
}

fn at(compiled: &Compiled, planes: &dyn Fn(usize) -> f64) -> Vec<f64> {
    let mut out = vec![f64::NAN; compiled.components()];
    compiled.value_at(planes, &mut out);
    out
}

#[test]
fn equal_programs_have_one_text() {
    for (one, other) in [
        ("a*b+1", "  a * b\n + 1 "),
        ("let p = a * 2; let q = b + 1; p - q", "let other = b + 1; let more = a * 2; more - other"),
        ("let unused = sin(c.r); a + 0.5", "a + 1 / 2"),
        ("if(1 < 2, a, exp(b))", "a"),
        ("(a + b, a + b).xx", "let s = a + b; (s, s)"),
        ("a ^ 2", "a * a"),
        ("lerp(a, b, 0.5)", "mix(a, b, 0.5)"),
    ] {
        assert_eq!(text(one), text(other));
    }
    for (one, other) in [
        ("a - b", "b - a"),
        ("a", "b"),
        ("a + 0.1", "a + 0.10000000000000002"),
        ("a < b", "if(a < b, 1, 0)"),
        ("random(a, 1)", "random(a, 2)"),
        ("any", "a"),
        ("(a, b)", "(b, a)"),
    ] {
        assert_ne!(text(one), text(other));
    }
    assert_eq!(
        text("max(c.r * 0.1, random(ids, 1))"),
        "plane 4\nMultiply %0 0.1\nplane 12\nPiece %2 seed 101\nMax %1 %3\n= %4"
    );
}

#[test]
fn texts_give_their_programs_back() {
    for formula in [
        "a",
        "1 / 3",
        "1e300 * 1e300",
        "0 / 0",
        "-0 * 1",
        "c.bgr * sin(a)",
        "a < 2",
        "any + 1",
        "hash(a, b) + noise(a, b, 3)",
        "$style",
        "1e-320 + a",
        "clamp(v, 0.1, 1e22)",
        "random(ids, 3) + random(ids)",
    ] {
        let compiled = compiled(formula);
        let text = compiled.encode();
        let decoded = Compiled::decode(&text).unwrap_or_else(|| panic!("{formula}: {text}"));
        assert_eq!(decoded.encode(), text);
        assert_eq!(format!("{:?}", decoded.value()), format!("{:?}", compiled.value()));
        assert_eq!(
            (decoded.components(), decoded.known_components()),
            (compiled.components(), compiled.known_components())
        );
        assert_eq!(at(&decoded, &plane), at(&compiled, &plane));
    }
}

#[test]
fn refuses_malformed_texts() {
    for text in [
        "",
        "=",
        "= ",
        "= %0",
        "plane 4",
        "plane 4\n",
        "plane 4\n= %1",
        "plane -1\n= %0",
        "plane 4 4\n= %0",
        "= 1 2 3 4 5",
        "plane 4\nNope %0\n= %1",
        "plane 4\nSin\n= %1",
        "plane 4\nSin %0 %0\n= %1",
        "plane 4\nSin %1\n= %1",
        "Sin 30\n= %0",
        "plane 4\nRandom %0\n= %1",
        "plane 4\nSin %0 seed 3\n= %1",
        "plane 04\n= %0",
        "plane 4\n= %0\n",
        "? 1 2",
        "* ",
        "plane 4\nplane 4\nAdd %0 %1\n= %2",
        "plane 4\nplane 5\n= %1",
        "= 1.50",
        "= +1",
        "= 1e0",
        "\u{fe}",
        "plane 4\r\n= %0",
        "plane 99999999999999999999\n= %0",
        "plane 4\nRandom %0 seed -1\n= %1",
        "=  1",
        "plane 4\nPower %0 2\n= %1",
    ] {
        assert!(Compiled::decode(text).is_none(), "{text:?}");
    }
    assert!(Compiled::decode(&"plane 4\n".repeat(1 << 20)).is_none());
    assert!(Compiled::decode(&"a".repeat(1 << 21)).is_none());
}

#[test]
fn left_out_branches_need_no_planes() {
    assert_eq!(compiled("if($n > 2, a, c.g + j.xx) * 2").planes(), [0]);
    assert_eq!(compiled("let unused = v; if(false, x, c.b)").planes(), [6]);
    assert_eq!(compiled("(x, c.r, b)").planes(), [1, 4, 14]);
    assert!(compiled("0.5 * 3").planes().is_empty());
}

#[test]
fn known_planes_become_constants() {
    let known = |text: &str| compiled(text).known(&|plane| if plane == 0 { Some(3.0) } else { None });
    assert_eq!(known("a * 2 > 1").value(), Some(Value::Bool(true)));
    assert_eq!(known("(a, a ^ 2)").value(), Some(Value::Vector(vec![3.0, 9.0])));
    assert_eq!(known("if(a > 1, b, c.r)").planes(), [1]);
    assert_eq!(known("b ^ (a - 1)").encode(), text("b * b"));
    let (long, terms) = (String::from("b"), 40_000);
    let long = long + &" + b * a".repeat(terms);
    assert_eq!(at(&compiled(&long).known(&|plane| (plane == 0).then_some(0.0)), &plane), [-1.5]);
}

#[test]
fn fusion_merges_common_parts() {
    let outer = compiled("c.r + c.g * c.b");
    let inner = Arc::new(compiled("(sin(a), sin(a) * b, sin(a) + b)"));
    let fused = outer.fuse(&|plane| Some((inner.clone(), plane - 4)), &|_, plane| plane + 50).unwrap();
    assert_eq!(fused.planes(), [50, 51]);
    let same = compiled("sin(a) + (sin(a) * b) * (sin(a) + b)");
    // Products and sums of fields may overflow; sines cannot.
    let finite = |text: &str| text.matches("Finite").count();
    assert_eq!(finite(&fused.encode()), 2);
    assert_eq!(at(&fused, &|index| plane(index - 50)), at(&same, &plane));
    assert_eq!(same.encode().lines().count() + 2, fused.encode().lines().count());
}

#[test]
fn values_that_are_not_finite_count_as_0_between_programs() {
    let inner = Arc::new(compiled("a / 0"));
    let fused = compiled("1 + b").fuse(&|_| Some((inner.clone(), 0)), &|_, plane| plane).unwrap();
    assert_eq!(at(&fused, &plane), [1.0]);
    let constant = Arc::new(compiled("1e60"));
    let fused = compiled("1 + b").fuse(&|_| Some((constant.clone(), 0)), &|_, plane| plane).unwrap();
    assert_eq!(fused.value(), Some(Value::Number(1.0)), "too large for a field");
    assert!(compiled("b").fuse(&|_| Some((inner.clone(), 3)), &|_, plane| plane).is_none(), "no such component");
}

#[test]
fn long_programs_are_not_fused() {
    let part =
        |step: f64| format!("a{}", (0..1500).map(|i| format!(" * (b + {})", f64::from(i) + step)).collect::<String>());
    let inner = [0.0, 0.5].map(|step| Arc::new(compiled(&part(step))));
    let fuse = |text: &str| compiled(text).fuse(&|plane| Some((inner[plane - 4].clone(), 0)), &|_, plane| plane);
    assert!(fuse("c.r + 1").is_some());
    assert!(fuse("c.r + c.g").is_none());
}

#[test]
fn costs_follow_the_table() {
    assert_eq!(compiled("a + b").cost(), 1);
    assert!((10..20).contains(&compiled("sin(a)").cost()) && compiled("noise(a, b)").cost() > 20);
    assert_eq!(compiled("2 + 3").cost(), 0);
}

#[test]
fn values_at_a_point_are_finite() {
    assert_eq!(values("(a / 0, log(-1), a)", &mut World::default()), [0.0, 0.0, 0.25]);
}

/// Formulas of one number that read the planes 0 and 1.
fn formula() -> impl Strategy<Value = String> {
    let leaf =
        prop_oneof![Just("a".to_owned()), Just("b".to_owned()), (-20..20_i32).prop_map(|n| format!("({n} / 4)"))];
    leaf.prop_recursive(4, 24, 3, |inner| {
        const UNARY: [&str; 10] = ["sin", "sqrt", "log", "abs", "triangle", "cbrt", "-", "random", "floor", "exp"];
        const BINARY: [&str; 8] = ["+", "-", "*", "/", "%", "<", "&&", "^"];
        prop_oneof![
            (proptest::sample::select(&UNARY[..]), inner.clone()).prop_map(|(f, x)| format!("{f}({x})")),
            (inner.clone(), proptest::sample::select(&BINARY[..]), inner.clone())
                .prop_map(|(x, op, y)| format!("({x} {op} {y})")),
            (inner.clone(), inner.clone(), inner.clone()).prop_map(|(x, y, z)| format!("if({x}, {y}, {z})")),
            (inner.clone(), inner).prop_map(|(x, y)| format!("smooth_min({x}, max({y}, {x}), noise({y}, {x}, 2))")),
        ]
    })
}

proptest! {
    #[test]
    fn round_trips_by_text(one in formula(), two in formula()) {
        let compiled = compiled(&format!("({one}, {two})"));
        let text = compiled.encode();
        let decoded = Compiled::decode(&text);
        prop_assert_eq!(decoded.map(|decoded| decoded.encode()), Some(text));
    }

    #[test]
    fn decodes_no_damaged_text(one in formula(), at in 0..400_usize, with in "[ -~\n]{0,3}") {
        let mut text = compiled(&one).encode();
        let at = at % (text.len() + 1);
        text.replace_range(at..(at + 1).min(text.len()), &with);
        if let Some(decoded) = Compiled::decode(&text) {
            prop_assert_eq!(decoded.encode(), text);
        }
    }

    #[test]
    fn fusion_is_the_same_as_two_steps(outer in formula(), first in formula(), second in formula(), both: bool) {
        let (outer, inner) = (compiled(&outer), [first, second].map(|text| Arc::new(compiled(&text))));
        let replaced = |plane: usize| plane == 0 || both;
        let fused = outer.fuse(
            &|plane| replaced(plane).then(|| (inner[plane].clone(), 0)),
            &|outer, plane| outer.map_or(plane, |outer| 10 * (outer + 1) + plane),
        );
        let fused = fused.unwrap();
        let single = |value: f64| Op::Finite.value([value, 0.0, 0.0], 0);
        let steps = at(&outer, &|index| if replaced(index) { single(at(&inner[index], &plane)[0]) } else { plane(index) });
        let once = at(&fused, &|index| plane(index % 10));
        prop_assert_eq!(steps[0].to_bits(), once[0].to_bits(), "{:?} {:?}", steps, once);
    }

    #[test]
    fn known_planes_give_the_same_values(text in formula()) {
        let compiled = compiled(&text);
        let known = compiled.known(&|index| (index == 0).then(|| plane(0)));
        let all = compiled.known(&|index| Some(plane(index)));
        prop_assert!(all.planes().is_empty() && known.planes().iter().all(|plane| *plane == 1));
        let (once, twice) = (at(&compiled, &plane)[0], at(&known, &plane)[0]);
        prop_assert!((once - twice).abs() <= 1e-9 * once.abs().max(1.0), "{} {}", once, twice);
    }
}
