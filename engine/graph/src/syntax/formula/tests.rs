//! Tests of words, parts and layouts of formulas.
use super::layout::Laid;
use super::*;
use crate::syntax::{TokenKind, Tree, format};
use proptest::prelude::*;
use shibo_value::expression::{UseKind, names_in};

/// Writes all parts of a formula in brackets, `?` for a missing value and `∘` for a missing operator.
fn tree(text: &str) -> String {
    let formula = Formula::parse(text);
    let mut done: Vec<String> = Vec::new();
    for part in formula.parts() {
        let operands = done.split_off(done.len() - part.operands);
        let word = part.word.map_or("∘", |word| formula.word(word));
        done.push(match part.kind {
            PartKind::Missing => "?".to_owned(),
            PartKind::Sign => format!("({word}{})", operands[0]),
            PartKind::Binary => format!("({}{word}{})", operands[0], operands[1]),
            PartKind::Call => format!("{word}[{}]", operands.join(" ")),
            PartKind::Bracket => operands[0].clone(),
            PartKind::Vector => format!("<{}>", operands.join(" ")),
            PartKind::Letters => format!("{}{word}", operands[0]),
            PartKind::Let => format!("let({});", operands[0]),
            _ => word.to_owned(),
        });
    }
    done.concat()
}

#[test]
fn groups_words_by_precedence() {
    for (text, expected) in [
        ("-a ^ 2 * b + c", "(((-(a^2))*b)+c)"),
        ("a ^ b ^ c", "(a^(b^c))"),
        ("a - b - c", "((a-b)-c)"),
        ("2 ^ -a", "(2^(-a))"),
        ("!a || b < c && d", "((!a)||((b<c)&&d))"),
        ("f(a + b, (c, d).y.xx) / g()", "(f[(a+b) <c d>.y.xx]/g[])"),
        ("let r = x + 1; let s = r; s * $t.r", "let((x+1));let(s);(s*$t.r)"),
        ("mix(#7a4526, oak.base_color.bgr, 0.5)", "mix[#7a4526 oak.base_color.bgr 0.5]"),
        ("let + 1", "(let+1)"),
        ("a .x * $t\n.r", "(a.x*$t.r)"),
    ] {
        assert_eq!(tree(text), expected.replace("let(s);", "let(r);"), "{text}");
        assert!(!Formula::parse(text).is_faulty(), "{text}");
    }
}

#[test]
fn reads_unfinished_formulas() {
    for (text, expected) in [
        ("", "?"),
        ("waves * ", "(waves*?)"),
        ("mix(a, ", "mix[a ?]"),
        ("mix(", "mix[?]"),
        ("grain.", "grain."),
        ("a + * b", "(a+(?*b))"),
        ("a b * c", "(a∘(b*c))"),
        ("(a + b", "(a+b)"),
        ("a) + b", "(a+b)"),
        ("(a, b).", "<a b>."),
        ("let a = ", "let(?);"),
        ("let a = waves; ", "let(waves);?"),
        ("let a = f(waves; a", "let(f[waves]);a"),
        ("a , b", "(a∘b)"),
        ("a = b", "(a∘b)"),
        ("waves; a", "wavesa"),
        ("a < b < c", "((a<b)<c)"),
        ("$ + 2waves", "($+2waves)"),
        ("a ? b", "((a∘?)∘b)"),
        ("()", "?"),
    ] {
        assert_eq!(tree(text), expected, "{text}");
        assert!(Formula::parse(text).is_faulty(), "{text}");
    }
}

#[test]
fn finds_words_parts_and_calls_at_places() {
    let text = "let r = x; clamp(r * waves, noise(u, ";
    let formula = Formula::parse(text);
    let at = |word: &str| text.find(word).unwrap();
    let word = |at: usize| formula.word_at(at).map(|index| formula.word(index));
    assert_eq!(word(at("waves")), Some("waves"));
    assert_eq!(word(at("waves") + 5), Some("waves"));
    assert_eq!(word(at("; clamp")), Some("x"));
    assert_eq!(word(at("* waves") + 1), Some("*"));
    let call = |at: usize| formula.call_at(at).map(|call| (formula.at(&call.name).to_owned(), call.argument));
    assert_eq!(call(at("waves")), Some(("clamp".into(), 0)));
    assert_eq!(call(text.len()), Some(("noise".into(), 1)));
    assert_eq!(call(at("clamp") + 2), None);
    let covering = |range| formula.covering(&range).map(|part| formula.at(&formula.parts()[part].range));
    assert_eq!(covering(at("r *")..at("waves") + 1), Some("r * waves"));
    assert_eq!(formula.local("r", at("r *")).map(|local| local.word), Some(1));
    assert!(formula.local("r", at("x;")).is_none());
    let outer = formula.parts().iter().rposition(|part| part.kind == PartKind::Call).unwrap();
    assert_eq!(formula.operands(outer).len(), 2);
}

#[test]
fn splits_texts_as_the_compiler_does() {
    for text in [
        "0.16 * waves - $folds * soft_folds.height.x",
        "if($style == Coarse, noise(8 * u, 8 * v), point.x)",
        "lines.ridge(x, 0.2) + 1e-3 + $tint.r",
        "let r = waves.x; let s = r.x * f(r); (s, r).yx + let",
        "let a = a; a.x ? § * b.",
        "a.5 + grain",
    ] {
        let formula = Formula::parse(text);
        let mine = formula.words().iter().enumerate().filter_map(|(index, word)| {
            let part = formula.part_of(index).map(|part| &formula.parts()[part]);
            let name = formula.word(index).split('.').next().unwrap();
            let kind = match word.kind {
                WordKind::Param => UseKind::Param,
                WordKind::Name if formula.is_call(index) => UseKind::Function,
                WordKind::Name if part.is_some_and(|part| part.kind == PartKind::Let && part.word == Some(index)) => {
                    return None;
                }
                WordKind::Name if formula.local(name, word.range.start).is_some() => UseKind::Local,
                WordKind::Name => UseKind::Name,
                _ => return None,
            };
            Some((word.range.start, kind))
        });
        let theirs: Vec<_> = names_in(text).into_iter().map(|name| (name.range.start, name.kind)).collect();
        assert_eq!(mine.collect::<Vec<_>>(), theirs, "{text}");
    }
}

#[test]
fn finds_the_content_of_literals() {
    let inside = |literal: &str| content(literal).map(|range| literal[range].to_owned());
    assert_eq!(inside("\"= a\"").as_deref(), Some("= a"));
    assert_eq!(inside("r#\"= a\n + b\"#").as_deref(), Some("= a\n + b"));
    assert_eq!(inside("r\"= a\"").as_deref(), Some("= a"));
    assert_eq!(inside("\"= a").as_deref(), Some("= a"));
    assert_eq!(inside("r#\"= a").as_deref(), Some("= a"));
    assert_eq!(inside("\"= \\u{61}\""), None);
    assert_eq!(inside("b\"= a\""), None);
    assert_eq!((begins("= a"), begins("== a"), begins("a")), (Some(1), None, None));
}

/// Lays out a graph, and checks invariants.
fn formatted(text: &str) -> String {
    let out = format(text).unwrap();
    assert_eq!(format(&out).as_deref(), Ok(out.as_str()), "not settled:\n{text}\n{out}");
    assert_eq!(solid(text), solid(&out), "{text}\n{out}");
    out
}

/// The tokens of a text; the words of its formulas.
fn solid(text: &str) -> Vec<String> {
    let tree = Tree::parse(text);
    let mut found = Vec::new();
    for token in tree.tokens() {
        let literal = &text[token.range()];
        let inside = content(literal).filter(|_| token.kind() == TokenKind::Str).map(|range| &literal[range]);
        match inside {
            Some(inside) => {
                found.push("\"".to_owned());
                found.extend(words(inside).into_iter().map(|word| inside[word.range].to_owned()));
            }
            None if literal == "," => {}
            None => found.push(literal.to_owned()),
        }
    }
    found
}

#[test]
fn lays_out_formulas() {
    for (text, expected) in [
        ("=a*b-( c+\n1 )", "= a * b - (c + 1)"),
        ("= f ( - x ,y ) .xy", "= f(-x, y).xy"),
        ("=let a=1;-a^2", "= let a = 1; -a ^ 2"),
        ("= !a&&b<=- -c", "= !a && b <= --c"),
        ("=a  .x+#fff .r", "= a .x + #fff.r"),
        // Mistakes stay as they are.
        ("=a*", "=a*"),
        ("=  ", "=  "),
        ("==a*b", "==a*b"),
        ("a*b", "a*b"),
    ] {
        let node = format!("(\n  nodes: {{\n    \"n\": \"{text}\",\n  }},\n)\n");
        assert_eq!(formatted(&node), node.replace(text, expected), "{text}");
    }
    let other = "(\n  functions: { \"f(x)\": \"2 * x\" },\n  nodes: {\n    \"n\": K(note: \"=a*b\", a: \"= a * b\"),\n  },\n)\n";
    assert_eq!(formatted(&other.replace("2 * x", "2*x").replace("a * b", "a*b")), other);
}

#[test]
fn breaks_long_formulas_at_their_loosest_operators() {
    let relief = "0.16 * (waves - 0.5) - 0.16 * $folds * soft_folds + $pitch * (0.075 * plump - 0.1 * grain.grooves - 0.035 * creases.grooves * (1 - grain.grooves))";
    let text = format!(
        "(\n  nodes: {{\n    \"relief\": \"= {relief}\",\n    \"b\": K(height: \"={relief}\", c: 1),\n  }},\n)\n"
    );
    let expected = r##"(
  nodes: {
    "relief": r#"= 0.16 * (waves - 0.5) - 0.16 * $folds * soft_folds
      + $pitch * (0.075 * plump - 0.1 * grain.grooves - 0.035 * creases.grooves * (1 - grain.grooves))"#,
    "b": K(
      height: r#"= 0.16 * (waves - 0.5) - 0.16 * $folds * soft_folds
        + $pitch * (0.075 * plump - 0.1 * grain.grooves - 0.035 * creases.grooves * (1 - grain.grooves))"#,
      c: 1,
    ),
  },
)
"##;
    assert_eq!(formatted(&text), expected);
    let bowl = "(\n  nodes: {\n    \"bowl\": r#\"=let r=length(x-10,y-10);\nlet f=1-r/8; clamp(f,0,1)\"#,\n  },\n)\n";
    let expected = r##"(
  nodes: {
    "bowl": r#"= let r = length(x - 10, y - 10);
      let f = 1 - r / 8;
      clamp(f, 0, 1)"#,
  },
)
"##;
    assert_eq!(formatted(bowl), expected);
    // A formula that fits has one line.
    let short = "(\n  nodes: {\n    \"a\": r#\"= x\n + y\"#,\n  },\n)\n";
    assert!(formatted(short).contains("\"a\": \"= x + y\","));
    let crlf = formatted(&bowl.replace('\n', "\r\n"));
    assert_eq!(crlf, expected.replace('\n', "\r\n"));
    let long = format!("({})", ["clamp(waves_of_the_sea, 0, 1)"; 12].join(", "));
    let out = formatted(&text.replace(relief, &long));
    assert!(out.lines().all(|line| line.len() <= 120), "{out}");
}

#[test]
fn layouts_take_linear_time() {
    let start = std::time::Instant::now();
    for text in [
        format!("= {}1", "1 + ".repeat(100_000)),
        format!("= {}", "(".repeat(128 << 10)),
        format!("= {}1", "-".repeat(128 << 10)),
        format!("= {}a", "let a=1;".repeat(20_000)),
        format!("= {}", "a,".repeat(50_000)),
    ] {
        assert!(Laid::of(&format!("\"{text}\""), false).is_none_or(|laid| laid.literal(0, 2, 120, "\n").len() > 9));
    }
    assert!(start.elapsed().as_secs() < 5, "{:?}", start.elapsed());
}

const WORDS: [&str; 26] = [
    "a",
    "wave_s.xy",
    "let ",
    "b",
    "=",
    ";",
    "(",
    ")",
    ",",
    "+",
    "-",
    "*",
    "^",
    "<=",
    "!",
    " ",
    "\n",
    "f(",
    "0.5",
    "$p.r",
    "#7a4526",
    ".x",
    "1e-3",
    "clamp(",
    "?",
    "long_name_of_a_node_in_a_graph",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn layouts_keep_all_words(picked in proptest::collection::vec(0..WORDS.len(), 0..40)) {
        let text: String = picked.iter().map(|&word| WORDS[word]).collect();
        formatted(&format!("(\n  nodes: {{\n    \"n\": r#\"={text}\"#,\n    \"m\": K(a: r#\"={text}\"#, b: [1]),\n  }},\n)\n"));
    }

    #[test]
    fn parses_any_text(text in "\\PC{0,60}") {
        let formula = Formula::parse(&text);
        let root = formula.root().map(|root| formula.parts()[root].range.clone());
        prop_assert!(root.is_none_or(|range| text.get(range).is_some()));
        for at in (0..=text.len()).filter(|at| text.is_char_boundary(*at)) {
            formula.word_at(at);
            formula.call_at(at);
            formula.covering(&(at..at));
        }
    }
}
