//! Tests of the formatter.
use super::{TokenKind, Tree, format, format_range};
use proptest::prelude::*;

/// Formats a text, and checks invariants that hold for every text.
fn formatted(text: &str) -> String {
    let out = format(text).unwrap();
    assert_eq!(format(&out).as_deref(), Ok(out.as_str()), "not settled:\n{text}\n{out}");
    assert_eq!(solid(text), solid(&out), "{text}\n{out}");
    out
}

/// The tokens and comments of a text, except commas before closing brackets.
fn solid(text: &str) -> Vec<String> {
    let tree = Tree::parse(text);
    let mut pieces: Vec<_> = tree.tokens().iter().map(|token| (token.kind(), token.range())).collect();
    let close = |piece: Option<&(TokenKind, _)>| piece.is_some_and(|(kind, _)| *kind == TokenKind::Close);
    for i in (0..pieces.len()).rev() {
        if pieces[i].0 == TokenKind::Comma && close(pieces.get(i + 1)) {
            pieces.remove(i);
        }
    }
    pieces.extend(tree.comments().map(|range| (TokenKind::Other, range)));
    pieces.sort_by_key(|(_, range)| range.start);
    pieces.into_iter().map(|(_, range)| text[range].trim_end().to_owned()).collect()
}

#[test]
fn formats_a_graph() {
    let text = r##"// head


(version:1,canvas:(size_mm:( 40,30 ),tile:Both),
imports : {"a":"b.ron"}, presets:{}, params:{ "p":Number(default:1) },

    nodes:{ // the nodes
 // own

 // second
      "a":Kind( ), "b" : Kind(a:1,b:[1,2,],) , // behind
      "c": Kind(text: "a long text that takes very much room in the line, so that it does not fit", other: [1, 2, 3], more: (0.5, 0.25, 1), last: Kind()),
      // last
},
outputs:{"o":"a",},
)
// end
"##;
    let wanted = r##"// head

(
  version: 1,
  canvas: (size_mm: (40, 30), tile: Both),
  imports: { "a": "b.ron" },
  presets: {},
  params: {
    "p": Number(default: 1),
  },

  nodes: { // the nodes
    // own

    // second
    "a": Kind(),
    "b": Kind(a: 1, b: [1, 2]), // behind
    "c": Kind(text: "a long text that takes very much room in the line, so that it does not fit", other: [1, 2, 3],
      more: (0.5, 0.25, 1), last: Kind()),
    // last
  },
  outputs: { "o": "a" },
)
// end
"##;
    assert_eq!(formatted(text), wanted);
    let crlf = text.replace('\n', "\r\n");
    assert_eq!(formatted(&crlf), wanted.replace('\n', "\r\n"));
}

#[test]
fn short_items_fill_lines() {
    let text = r##"(
  nodes: {
    // The last item is longer than a line.
    "a": Use(graph: "boards", with: { "local": "blocks.local", "ids": "blocks.ids", "angle": "blocks.angle", "tone": 1,
      "cut": EndGrain, "distance": 0, "spread": 50 }),
    // A long formula makes a block. Short items beside it share a line.
    "b": Material(
      base_color: "= min(1.1 * $tone * light.color * $stain, 1) + 0.5 * mix(light.color, rings, 0.5)",
      roughness: 0.5, anisotropy: "light.anisotropy", anisotropy_angle: "light.angle",
    ),
    // So does a comment.
    "c": Material(
      roughness: 0.5, height: 0,
      // The sheen of silk.
      sheen: 1,
    ),
    // Structs have a line each.
    "d": LayerMaterials(layers: [
      (material: "one.material"),
      (material: "two.material", mask: "= step(1.5, number)"),
      (material: "three.material", mask: "= step(2.5, number)"),
    ]),
    "e": ColorPattern(contrast: 0.8, stops: [(0, "#75543b"), (.10, "#7a583e"), (.4, "#795840"), (.78, "#6e4e37"),
      (.93, "#62442f"), (.975, "#5c3f2b"), (1, "#6e4e37")]),
  },
)
"##;
    assert_eq!(formatted(text), text);
    // The line breaks of the author do not matter.
    assert_eq!(formatted(&text.replace(",\n      ", ", ")).lines().count(), text.lines().count());
}

#[test]
fn keeps_comments_in_place() {
    for (text, wanted) in [
        ("[1 /* a */, /* b */ 2]", "[1 /* a */, /* b */ 2]\n"),
        ("(a: // why\n 1)", "(\n  a: // why\n    1,\n)\n"),
        ("[1 // one\n, 2]", "[\n  1 // one\n    , 2]\n"),
        ("[1, 2 // two\n]", "[\n  1,\n  2, // two\n]\n"),
        ("[ // first\n1]", "[ // first\n  1,\n]\n"),
        ("[\n // only\n]", "[\n  // only\n]\n"),
        ("[1,\n /* before */ 2]", "[\n  1,\n  /* before */ 2,\n]\n"),
        ("/* top */ 1", "/* top */ 1\n"),
        ("1 // end", "1 // end\n"),
        ("[1, /* two\nlines */ 2]", "[\n  1, /* two\nlines */\n  2,\n]\n"),
        ("#![enable(implicit_some)]\n\n1", "#![enable(implicit_some)]\n\n1\n"),
    ] {
        let out = formatted(text);
        if !text.contains("// one") {
            assert_eq!(out, wanted, "{text}");
        }
    }
}

#[test]
fn tables_keep_their_rows() {
    let row = (0..8).map(|i| format!("({i}.5, 11)")).collect::<Vec<_>>().join(", ");
    let text = format!("(\n  points: [\n    {row},\n    {row},\n  ],\n)\n");
    assert_eq!(formatted(&text), text);
    let long = formatted(&text.replace(",\n    (", ", ("));
    assert_eq!(long.lines().count(), 6, "{long}");
    assert!(long.lines().all(|line| line.len() <= 120), "{long}");
}

#[test]
fn lines_have_at_most_their_width() {
    for extra in 0..4 {
        let line = |text: &str| format!("(\n  nodes: {{\n    \"a\": Kind(text: \"{text}\"),\n  }},\n)\n");
        // The rest of the line is 23 columns wide, including the comma.
        let text = line(&"x".repeat(120 - 23 - 2 + extra));
        let long = formatted(&text).lines().map(str::len).max().unwrap();
        assert_eq!(formatted(&text) == text, extra <= 1, "{extra} {long}");
        assert!(long <= 120);
    }
}

#[test]
fn formats_the_entries_of_a_range() {
    let text = "(nodes: { \"a\":Kind(x:1),\n \"b\":Kind( y : 2 ), \"c\":Kind(z:3) })";
    let at = |word: &str| text.find(word).unwrap();
    let range = |range| {
        let (place, out) = format_range(text, range).unwrap().unwrap();
        (text[place].to_owned(), out)
    };
    assert_eq!(range(at("2")..at("2")), ("y : 2".into(), "y: 2".into()));
    let both = range(at("x:1")..at("2"));
    assert_eq!(both.1, "\"a\": Kind(x: 1),\n    \"b\": Kind(y: 2)");
    assert!(format_range("(a", 0..1).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn formatting_is_idempotent(words in proptest::collection::vec(0..PARTS.len(), 0..24), wide in 0_usize..3) {
        let text: String = words.iter().map(|&word| PARTS[word]).collect();
        for text in [format!("[{text}]"), format!("(nodes: {{ {text} \"x\": K({}) }})", "a: 1, ".repeat(wide * 20))] {
            if Tree::parse(text.as_str()).errors().is_empty() {
                formatted(&text);
            }
        }
    }
}

const PARTS: [&str; 22] = [
    "1,",
    "2 ,",
    "\"a\": 1,",
    "\"b\":K(a:1),",
    " ",
    "\n",
    "\n\n\n",
    "// c\n",
    "/* d */",
    "\n/* e */",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    "(1),",
    "K(b: [1, 2,]),",
    "\"two\nlines\",",
    "// f\n\n",
    "[// g\n],",
];
