//! Invariants of all texts, and mistakes found in faulty texts.
use super::*;
use proptest::prelude::*;
use ron::value::Number;
use serde::de::IgnoredAny;

/// A text with the usual forms of a graph.
const GRAPH: &str = r##"// A graph.
(
  version: 1,
  canvas: (size_mm: (40, 30.5), tile: Both), /* as /* it */ is */
  params: { "pitch": Number(default: -1.4e-3, range: (0.4, 6), unit: "mm") },
  nodes: {
    // The first.
    "points": Sown(pitch: "$pitch", seed: 0x1F),
    "stack": Layers(layers: [(mask: "points", count: 3u8), (mask: Kind())], label: "a \"b\"\n"), // behind
    "raw": Text(value: r#"a "quoted" text"#, on: true, c: 'x', r#type: 1..2),
  },
  outputs: { "out": "stack.color" },
)
"##;

fn broken(text: &str) -> Vec<(usize, usize, String)> {
    let tree = Tree::parse(text);
    check(&tree);
    let place = |error: &SyntaxError| {
        let before = &text[..error.range.start];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        (line, column, error.message.to_string())
    };
    tree.errors().iter().map(place).collect()
}

/// Invariants of every tree.
fn check(tree: &Tree) {
    let pieces: String = tree.pieces().iter().map(|piece| &tree.text()[piece.range.clone()]).collect();
    assert_eq!(pieces, **tree.text());
    assert_eq!(tree.root().range(), 0..tree.text().len());
    let mut start = 0;
    for node in tree.nodes() {
        let range = node.range();
        assert!(start <= range.start && range.start <= range.end, "{node:?}");
        start = range.start;
        if let Some(parent) = node.parent() {
            let (inner, outer) = (node.token_range(), parent.token_range());
            assert!(outer.start <= inner.start && inner.end <= outer.end, "{node:?} in {parent:?}");
            assert!(parent.is_broken() || !node.is_broken());
            assert!(parent.children().any(|child| child == node));
        }
    }
    for error in tree.errors() {
        assert!(tree.text().get(error.range.clone()).is_some(), "{error:?}");
    }
    assert!(!tree.root().is_broken() || !tree.errors().is_empty());
}

/// The value of a node as `ron` would return it; `ron` does not keep words.
fn value(node: Node<'_>) -> ron::Value {
    let leaf = |text: &str| ron::from_str::<ron::Value>(text).unwrap();
    match node.kind() {
        NodeKind::Call => match node.name() {
            Some("Some") => {
                let body = node.body().unwrap();
                let one = (body.children().count() == 1 && body.entries().count() == 0).then(|| body.children().next());
                ron::Value::Option(Some(Box::new(one.flatten().map_or_else(|| self::value(body), value))))
            }
            _ if node.body().unwrap().children().next().is_none() => ron::Value::Seq(Vec::new()),
            _ => self::value(node.body().unwrap()),
        },
        NodeKind::Map | NodeKind::Parens if node.entries().next().is_some() => {
            let entry = |entry: Node<'_>| {
                let key = entry.key().unwrap();
                let named = node.kind() == NodeKind::Parens;
                let key = if named { ron::Value::String(entry.key_text().unwrap()) } else { self::value(key) };
                (key, self::value(entry.value().unwrap()))
            };
            ron::Value::Map(node.entries().map(entry).collect())
        }
        NodeKind::Map => ron::Value::Map(ron::Map::new()),
        NodeKind::Parens if node.text() == "()" => leaf("()"),
        NodeKind::Parens | NodeKind::List => ron::Value::Seq(node.children().map(value).collect()),
        NodeKind::Number if node.text().starts_with("b'") => leaf(node.text()),
        _ => leaf(node.text()),
    }
}

fn same(a: &ron::Value, b: &ron::Value) -> bool {
    match (a, b) {
        (ron::Value::Number(Number::F32(a)), ron::Value::Number(Number::F32(b))) => {
            a.get().to_bits() == b.get().to_bits()
        }
        _ => a == b,
    }
}

/// Compares with `ron`; returns true if it accepts the text.
fn compare(text: &str) -> Result<bool, String> {
    let tree = Tree::parse(text);
    check(&tree);
    let good = tree.errors().is_empty();
    let options = ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
        .with_default_extension(ron::extensions::Extensions::UNWRAP_NEWTYPES)
        .with_default_extension(ron::extensions::Extensions::UNWRAP_VARIANT_NEWTYPES);
    match options.from_str::<IgnoredAny>(text) {
        Ok(_) if !good => return Err(format!("{text:?}: {:?}", tree.errors())),
        Err(error) if good && !matches!(error.code, ron::Error::IntegerOutOfBounds) => {
            return Err(format!("{text:?} is taken, but: {error}"));
        }
        _ => {}
    }
    if let (true, Ok(wanted)) = (good, options.from_str::<ron::Value>(text)) {
        let found = value(tree.value().unwrap());
        if !same(&wanted, &found) {
            return Err(format!("{text:?}\n{wanted:?}\n{found:?}"));
        }
    }
    Ok(good)
}

/// Words of RON, chosen so that many random texts of them are nearly valid.
const WORDS: [&str; 44] = [
    "(",
    ")",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ",",
    ":",
    ":",
    "\"a\"",
    "\"b\"",
    "\"",
    "\"x\ny\"",
    "a",
    "b",
    "Kind",
    "1",
    "-2.5",
    "1e3",
    "0x1F",
    "inf",
    "true",
    "None",
    "'c'",
    "r#\"raw\"#",
    "r#type",
    "..",
    "..=",
    "// c\n",
    "/* c */",
    "/*",
    "*/",
    " ",
    "\n",
    "\\",
    "$",
    "3u8",
    "#![enable(implicit_some)]",
    "b\"by\"",
    "1.2.3",
    "2mm",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    #[test]
    fn preserves_every_text(text in "\\PC{0,40}|[()\\[\\]{},:\"'a-c0-9 \\n/*.#r\\\\-]{0,60}") {
        check(&Tree::parse(text.as_str()));
    }

    #[test]
    fn ron_agrees_on_random_words(words in proptest::collection::vec(0..WORDS.len(), 0..14)) {
        let text: String = words.iter().flat_map(|&word| [WORDS[word], " "]).collect();
        compare(&text).map_err(TestCaseError::fail)?;
        let text: String = words.iter().map(|&word| WORDS[word]).collect();
        compare(&text).map_err(TestCaseError::fail)?;
    }

    #[test]
    fn ron_agrees_on_edited_graphs(at in 0..GRAPH.len(), len in 0_usize..6, put in 0..WORDS.len(), puts in any::<bool>()) {
        let mut edited = String::new();
        let cut = |at: usize| (0..=at.min(GRAPH.len())).rev().find(|&i| GRAPH.is_char_boundary(i)).unwrap_or(0);
        edited.push_str(&GRAPH[..cut(at)]);
        edited.push_str(if puts { WORDS[put] } else { "" });
        edited.push_str(&GRAPH[cut(at + len)..]);
        compare(&edited).map_err(TestCaseError::fail)?;
    }
}

#[test]
fn ron_agrees_on_forms_of_values() {
    assert_eq!(compare(GRAPH), Ok(true));
    for good in [
        "1",
        "'\n'",
        "(1,)",
        "( )",
        "()",
        "[]",
        "{}",
        "Kind",
        "Kind()",
        "Kind ( a : 1 , )",
        "Some(3)",
        "Some(a: 1)",
        "{1: 2, 'c': [3]}",
        "..",
        "1..",
        "..2",
        "1..=2",
        "1...2",
        "-inf",
        "+5",
        ".5",
        "5.",
        "1_000",
        "r\"a\\b\"",
        "b'x'",
        "'''",
        "'\\n'",
        "\"\\u{e9}\"",
        "{a: 1}",
        "#![enable(implicit_some)] 1",
        "\u{85}1",
        "1 // end",
        "\"two\nlines\"",
        "(a: \"two\nlines\")",
        "r#a-b",
        "b\"bytes\"",
        "true",
    ] {
        assert_eq!(compare(good), Ok(true), "{good}");
    }
    for bad in [
        "",
        "(",
        ")",
        "(1 2)",
        "(a: 1 b: 2)",
        "(a: 1, 2)",
        "(1, a: 2)",
        "{1}",
        "{1: }",
        "[,]",
        "[1,,]",
        "1 2",
        "1 ..2",
        "..=",
        "true()",
        "\"a",
        "\"\\q\"",
        "'ab'",
        "1.2.3",
        "2mm",
        "é é",
        "$",
        "/* a",
        "#![x]1",
        "(a-b: 1)",
        "Kind{}",
        "[1, 2)",
        "Some",
        "a.b",
        "(\"a\": 1)",
        "1__2.5x",
        "0b12",
        "-",
        "r#",
        "(a:: 1)",
        "(: 1)",
    ] {
        assert_eq!(compare(bad), Ok(false), "{bad}");
    }
}

#[test]
fn finds_nodes_at_offsets() {
    let tree = Tree::parse(GRAPH);
    let at = GRAPH.find("$pitch").unwrap();
    let node = tree.covering(at..at);
    assert_eq!((node.kind(), node.string().as_deref()), (NodeKind::Text, Some("$pitch")));
    let keys: Vec<_> = node.ancestors().filter_map(Node::key_text).collect();
    assert_eq!(keys, ["pitch", "points", "nodes"]);
    assert_eq!(tree.tokens()[tree.token_at(at).unwrap()].start(), at - 1);
    assert_eq!(tree.covering(0..GRAPH.len()), tree.root());
    assert_eq!(tree.comments().count(), 4);
    assert!(tree.is_comment(GRAPH.find("first").unwrap()) && tree.is_comment(GRAPH.find("is */").unwrap()));
    assert!(!tree.is_comment(at) && tree.is_comment(GRAPH.find("// behind").unwrap() + 9));
    let nodes = tree.value().and_then(|value| value.entry("nodes")).and_then(Node::value).unwrap();
    assert_eq!(tree.comments_in(nodes.range()).count(), 2);
}

#[test]
fn parses_large_texts_in_linear_time() {
    let many = 1 << 20;
    let mut texts: Vec<String> = [
        "(",
        ")",
        "\"",
        "[",
        "{",
        ",",
        ":",
        "'",
        "/*",
        "\\\"\n",
        "r#\"\n",
        "a ",
        "-",
        "\"\n",
        "(a:",
        "{\"a\":(b: ",
        "\"a\":",
        "#",
    ]
    .iter()
    .map(|piece| piece.repeat(many / piece.len()))
    .collect();
    texts.push(format!("{}{}", "(".repeat(many / 2), "\n)".repeat(many / 4)));
    texts.push(format!("{}{}", "(".repeat(many / 2), "]".repeat(many / 2)));
    texts.push(format!("[{}{}", "(".repeat(many / 2), "\n ]".repeat(many / 6)));
    texts.push(format!("({}(a: 1,\n{}", " ".repeat(many / 2), "a: 1,\n".repeat(many / 12)));
    texts.push(format!("({})", "a: b c: 1, ".repeat(many / 11)));
    for text in texts {
        let tree = Tree::parse(text.as_str());
        assert!(!tree.errors().is_empty());
        // Every token is in few nodes, and no mistake is reported repeatedly.
        assert!(tree.nodes().count() <= 3 * tree.tokens().len() + 300, "{}", &text[..20]);
    }
}

#[test]
fn rejects_brackets_nested_too_deep() {
    let tree = Tree::parse(format!("{}1{}", "[".repeat(128), "]".repeat(128)));
    assert!(tree.errors().is_empty());
    let tree = Tree::parse(format!("{}1{}", "[".repeat(129), "]".repeat(129)));
    assert_eq!(tree.errors().len(), 1);
    let error = &tree.errors()[0];
    assert_eq!((error.range.start, error.code), (128, crate::diagnostics::Code::TooLarge));
    let shallow = Tree::parse_nested("[[[1]]]", 2);
    assert_eq!(shallow.errors()[0].range.start, 2);
}

#[test]
fn reports_one_mistake_once_at_its_place() {
    let graph = |line: &str| {
        format!(
            "(\n  nodes: {{\n    \"x\": A(),\n    {line}\n    \"y\": B(z: 1),\n  }},\n  outputs: {{ \"o\": \"x\" }},\n)\n"
        )
    };
    for (line, column, message) in [
        ("\"b\" Bands(),", 9, "expected colon"),
        ("\"b\": Bands(pitch 1),", 22, "expected colon"),
        ("\"b\": Bands(pitch: ),", 23, "expected a value"),
        ("\"b\": Bands(pitch: 1, size: 2", 32, "expected `)` after this"),
        ("\"b\": Bands(pitch: 1, size: 2,", 33, "expected `)` before this"),
        ("\"b\": Bands(size: [1, 2", 26, "expected `]` after this"),
        ("\"b\": Bands(pitch: 1)),", 25, "closes nothing"),
        ("\"b\": Bands pitch: 1),", 16, "expected `(`"),
        ("\"b\": Bands(pitch: 1],", 24, "expected `)`"),
        ("\"b\": Bands(size: [1, 2),", 27, "expected `]`"),
        ("\"b: Bands(pitch: 1),", 5, "quote"),
        ("b\": Bands(pitch: 1),", 5, "quote"),
        ("\"b\": Bands(pitch: \"x, size: 2),", 23, "quote"),
        ("\"b\": Bands(pitch: x\", size: 2),", 23, "quote"),
        ("\"b\": Bands(pitch: 2mm),", 24, "expected comma"),
        ("\"b\": Bands(pitch: a.port),", 24, "expected comma"),
        ("\"b\": Bands(pitch: 1 size: 2),", 25, "expected comma"),
        ("\"b\": Bands(pitch: 1, pit),", 26, "expected colon and a value"),
        ("\"b\": Bands(\"pitch\": 1),", 16, "expected the name of a field"),
        ("\"b\": Bands(pitch: 1, 3),", 26, "expected the name of a field"),
        ("\"b\": Bands(pitch: 1,, size: 2),", 25, "before the comma"),
        ("\"b\": ,", 10, "expected a value"),
        ("\"b\",", 8, "expected colon and a value"),
        ("$", 5, "character"),
        ("\"b\": Bands(label: 'text'),", 23, "single character"),
        ("\"b\": Bands(label: \"a\\q\"),", 23, "escape"),
        ("\"b\": Bands(pitch: 1.2.3),", 23, "no number"),
        ("\"b\": Bands{pitch: 1},", 15, "expected `(`"),
        ("\"b\": Bands[pitch: 1],", 15, "expected `(`"),
        ("\"b\": Bands(pitch = 1, size: 2),", 22, "expected colon"),
        ("\"b\": Bands(size: 2, pitch => 1),", 31, "expected colon"),
        ("\"b\" = Bands(pitch: 1),", 9, "expected colon"),
        ("\"b\": Bands(pitch: -\"1\"),", 23, "character"),
        ("\"b\": Bands(pitch: 5 mm, size: 2),", 25, "expected comma"),
        ("/* \"b\": Bands(),", 5, "no end"),
    ] {
        let text = graph(line);
        let found = broken(&text);
        let wanted = (4, column);
        assert_eq!(found.len(), 1, "{line}\n{found:#?}");
        assert_eq!((found[0].0, found[0].1), wanted, "{line}\n{found:#?}");
        assert!(found[0].2.contains(message), "{line}\n{found:#?}");
        // The text around the mistake is read.
        let tree = Tree::parse(text.as_str());
        let top = tree.value().unwrap();
        let nodes = top.entry("nodes").and_then(Node::value).unwrap_or_else(|| panic!("{line}"));
        let good = |name: &str| nodes.entry(name).and_then(Node::value).is_some_and(|value| !value.is_broken());
        assert!(good("x") && good("y"), "{line}\n{:?}", tree.nodes().collect::<Vec<_>>());
        assert!(top.entry("outputs").and_then(Node::value).is_some_and(|value| !value.is_broken()), "{line}");
    }
}

#[test]
fn reports_a_missing_bracket_in_its_line() {
    let text = include_str!("../../../../graphs/calf.ron").replace("\r\n", "\n");
    let lines: Vec<&str> = text.lines().collect();
    let mut asked = 0;
    for (index, line) in lines.iter().enumerate() {
        let count = |c: char| line.matches(c).count();
        let is_whole =
            count('(') > 0 && [('(', ')'), ('[', ']'), ('{', '}')].iter().all(|(a, b)| count(*a) == count(*b));
        let Some(end) = line.trim_end().strip_suffix("),").map(str::len).filter(|_| is_whole) else { continue };
        let mut torn: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        torn[index].remove(end);
        let found = broken(&torn.join("\n"));
        assert_eq!((found.len(), found[0].0), (1, index + 1), "{line}\n{found:#?}");
        asked += 1;
    }
    assert!(asked > 20, "{asked}");
}

#[test]
fn keeps_other_sections_when_a_bracket_is_missing() {
    for (text, line) in [
        ("(\n  canvas: (size: 1,\n  nodes: {\n    \"a\": A(),\n  },\n  outputs: { \"o\": \"a\" },\n)\n", 2),
        ("(\n  canvas: (size: 1),\n  nodes: {\n    \"a\": A(),\n  outputs: { \"o\": \"a\" },\n)\n", 5),
        ("(\n  canvas: (size: 1),\n  nodes: \n    \"a\": A(),\n  },\n  outputs: { \"o\": \"a\" },\n)\n", 4),
        ("\n  canvas: (size: 1),\n  nodes: {\n    \"a\": A(),\n  },\n  outputs: { \"o\": \"a\" },\n)\n", 2),
        ("(\n  canvas: (size: 1),\n  nodes: {\n    \"a\": A(),\n  },\n  outputs: { \"o\": \"a\" },\n", 7),
        ("(\n  canvas: size: 1),\n  nodes: {\n    \"a\": A(),\n  },\n  outputs: { \"o\": \"a\" },\n)\n", 2),
        ("(canvas: (size: 1), nodes: { \"a\": A() outputs: { \"o\": \"a\" })", 1),
        ("(\n  canvas: (size: 1),\n  nodes: {\n    \"a\": A(),\n  ),\n  outputs: { \"o\": \"a\" },\n)\n", 5),
    ] {
        let found = broken(text);
        assert!(found.len() == 1 && found[0].0 == line, "{text}\n{found:#?}");
        let tree = Tree::parse(text);
        let top = tree.value().unwrap();
        let keys: Vec<_> = top.entries().filter_map(Node::key_text).collect();
        assert_eq!(keys, ["canvas", "nodes", "outputs"], "{text}");
        let nodes = top.entry("nodes").and_then(Node::value).unwrap();
        assert_eq!(nodes.entries().filter_map(Node::key_text).collect::<Vec<_>>(), ["a"], "{text}");
    }
}

#[test]
fn reports_an_unfinished_text_as_one_mistake() {
    for text in ["(\n  version: 1,\n  node", "(nodes: { \"a\": Bands(pitch: 2, cou", "(nodes: {"] {
        let tree = Tree::parse(text);
        assert_eq!(tree.errors().len(), 1, "{text}: {:#?}", tree.errors());
        assert!(tree.errors()[0].unfinished, "{text}");
    }
}

#[test]
fn reads_long_lines_with_a_missing_quote() {
    for (text, tokens) in [("\"a\" ".repeat(50_000) + "\"", 50_001), ("r#\"a, ".repeat(50_000), 50_000)] {
        let tree = Tree::parse(text.as_str());
        let strings = tree.tokens().iter().filter(|token| token.kind() == TokenKind::Str).count();
        assert_eq!(strings, tokens, "{}", &text[..20]);
        assert!(!tree.errors().is_empty(), "{}", &text[..20]);
        assert_eq!(tree.pieces().iter().map(|piece| &text[piece.range.clone()]).collect::<String>(), text);
    }
}
