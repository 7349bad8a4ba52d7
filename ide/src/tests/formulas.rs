//! Formulas: completion, signatures, hovers, tokens, inlays and diagnostics.
use super::super::hover::{Evaluated, Pictures, hover};
use super::super::tokens::{Token, tokens};
use super::super::{complete, diagnose, inlay, navigate, signature, structure};
use super::{at_cursor, with};
use std::cell::RefCell;
use std::path::Path;

/// Labels of the completions at the `|`.
fn offered(node: &str) -> Vec<String> {
    at_cursor(node, |cx, _, at| complete(cx, at).into_iter().map(|one| one.label).collect())
}

#[test]
fn offers_names_in_formulas() {
    // Texts, names that must be offered, and names that must not.
    for (node, wanted, unwanted) in [
        (
            r#""last": "= |""#,
            "waves cells.f2 swirl color field used.depth $pitch $tint ridge lines.groove clamp u point.x let pi",
            "last after",
        ),
        (r#""last": "= waves * |""#, "cells color canvas.width", "let last"),
        (r#""last": "= mix(waves, |""#, "color smoothstep", "last"),
        (r#""last": "= wa|""#, "waves", "cells"),
        (
            r##""last": r#"= waves
          + cel|"#"##,
            "cells cells.f2",
            "waves",
        ),
        (r#""last": Blur(input: "= wav|")"#, "waves", "cells"),
        (r#""last": Blur(input: "= waves", radius: "= $p|")"#, "$pitch", "waves"),
        (r#""last": Blur(input: "= waves", radius: "= cl|")"#, "clamp", "cells color u"),
        (r#""last": "= cells.|""#, "cells.f2 cells.ids cells.border", "waves cells.r"),
        (r#""last": "= 1 + cells.f|""#, "cells.f2", "cells.ids"),
        (r#""last": "= leather.|""#, "leather.height leather.base_color", "leather.r leather.material.height"),
        (r#""last": "= leather.base_color.|""#, "leather.base_color.r", "leather.base_color.height"),
        (r#""last": "= color.|""#, "color.r color.bgr", "color.x"),
        (r#""last": "= swirl.|""#, "swirl.x", "swirl.r swirl.z"),
        (r#""last": "= used.|""#, "used.depth used.material used.sum", "used.height"),
        (r#""last": "= used.material.|""#, "used.material.height", "used.depth"),
        (r#""last": "= $tint.|""#, "$tint.r", "$pitch"),
        (r#""last": "= (color + 1).|""#, "r g b", "x"),
        (r#""last": "= rotate(swirl, 30).|""#, "x y", "r"),
        (r#""last": "= point.|""#, "point.x point.z", "canvas.width"),
        (r#""last": "= canvas.|""#, "canvas.width", "point.x"),
        (r#""last": "= lines.|""#, "lines.groove", "ridge"),
        (r#""last": "= let far = swirl * 2; fa|""#, "far", "waves"),
        (r#""last": "= let far = swirl * 2; far.|""#, "far.x", "far.r"),
        (r#""last": "= let far = f|""#, "field floor", "far"),
        (r#""last": "= let |""#, "", "waves clamp"),
        (r#""last": "= waves |""#, "", "cells clamp"),
        (r#""last": "= 12|""#, "", "waves"),
        (r#""last": "= if($style == |, waves, 0)""#, "Fine Coarse", ""),
        (
            r#""last": BlendMaterials(base: "leather", top: "leather", mask: "leather.|")"#,
            "leather.height leather.ao",
            "leather.r",
        ),
        (r#""last": Blur(input: "color.|")"#, "color.r", "color.x"),
        (r#""last": Blur(input: "leather.base_color.|")"#, "leather.base_color.g", ""),
        (r#""last": Blur(|)"#, "input", ""),
        // A material does not fit, but its channels do.
        (
            r#""last": BlendMaterials(base: "leather", top: "leather", mask: "|")"#,
            "leather.height color.r used.material.ao",
            "",
        ),
    ] {
        let offers = offered(node);
        for name in wanted.split_whitespace() {
            assert!(offers.iter().any(|offer| offer == name), "{name} in {node}: {offers:?}");
        }
        for name in unwanted.split_whitespace() {
            assert!(!offers.iter().any(|offer| offer == name), "{name} in {node}: {offers:?}");
        }
    }
}

#[test]
fn offers_fitting_names_first() {
    let rank = |node: &str, name: &str| {
        let offers = offered(node);
        offers.iter().position(|offer| offer == name).unwrap_or_else(|| panic!("{name} in {node}: {offers:?}"))
    };
    for (node, first, second) in [
        (r#""last": "= |""#, "waves", "leather"),
        (r#""last": "= |""#, "leather", "dots"),
        (r#""last": "= |""#, "color", "cross"),
        (r#""last": "= luminance(|)""#, "color", "waves"),
        (r#""last": "= luminance(|)""#, "color", "swirl"),
        (r#""last": "= luminance(|)""#, "color", "max"),
        (r#""last": "= dot(|)""#, "swirl", "waves"),
        (r#""last": "= dot(swirl, |)""#, "swirl", "color"),
        (r#""last": "= dot(color, |)""#, "color", "swirl"),
        (r#""last": "= rotate(|, 30)""#, "swirl", "color"),
        (r#""last": "= normalize(|)""#, "color", "waves"),
        (r#""last": "= swirl + |""#, "cells", "color"),
        (r#""last": "= color * |""#, "waves", "swirl"),
        (r#""last": "= random(|)""#, "cells.ids", "dots"),
        (r#""last": Blur(input: "= |")"#, "waves", "dots"),
        (r#""last": "= let far = 1; |""#, "far", "waves"),
        (r#""last": Blur(input: "leather.|")"#, "leather.height", "leather.anisotropy_angle"),
    ] {
        assert!(rank(node, first) < rank(node, second), "{first} before {second} in {node}");
    }
    let insert = |node: &str, label: &str| {
        at_cursor(node, |cx, _, at| complete(cx, at).into_iter().find(|one| one.label == label).map(|one| one.insert))
    };
    assert_eq!(insert(r#""last": "= rid|""#, "ridge").as_deref(), Some("ridge($0)"));
    assert_eq!(insert(r#""last": "= rid|(waves, 1)""#, "ridge").as_deref(), Some("ridge"));
    assert_eq!(insert(r#""last": |"#, "= …").as_deref(), Some("\"= $0\""));
    assert_eq!(insert(r#""last": Blur(input: |)"#, "= …").as_deref(), Some("\"= $0\""));
}

#[test]
fn shows_signatures_of_functions() {
    let shown = |node: &str| {
        at_cursor(node, |cx, _, at| {
            let found = signature(cx, at)?;
            let active = found.active.map(|index| found.label[found.fields[index].0.clone()].to_owned());
            Some((found.label.clone(), active.unwrap_or_default()))
        })
    };
    let some = |label: &str, active: &str| Some((label.to_owned(), active.to_owned()));
    assert_eq!(shown(r#""last": "= clamp(waves, |""#), some("clamp(x, lo, hi)", "lo"));
    assert_eq!(shown(r#""last": "= clamp(max(|), 0)""#), some("max(a, …)", "a"));
    assert_eq!(shown(r#""last": "= max(1, 2, 3, |)""#), some("max(a, …)", "…"));
    assert_eq!(shown(r#""last": "= 1 + ridge(waves, |0.5)""#), some("ridge(x, w)", "w"));
    assert_eq!(shown(r#""last": "= lines.groove(|)""#), some("lines.groove(x)", "x"));
    assert_eq!(shown(r#""last": "= noise(u, v, |)""#), some("noise(x, y, z)", "z"));
    assert_eq!(shown(r#""last": Blur(input: "= clamp(waves, 0, 1)|")"#).map(|of| of.1), Some("input: Field".into()));
    let doc = at_cursor(r#""last": "= ridge(|)""#, |cx, _, at| signature(cx, at).unwrap().doc);
    assert_eq!(doc, "A ridge along the zeros of `x`.");
}

/// Remembers the texts for which pictures are asked.
#[derive(Default)]
struct Asked(RefCell<Vec<String>>);

impl Pictures for Asked {
    fn kind(&self, _kind: &str) -> Option<String> {
        None
    }

    fn node(&self, _path: &Path, node: &str) -> Option<Evaluated> {
        Some(Evaluated { picture: Some(format!("node:{node}")), about: String::new() })
    }

    fn node_in(&self, _path: &Path, text: &str, node: &str) -> Option<Evaluated> {
        let start = text.find(&format!("\"{node}\": ")).unwrap();
        self.0.borrow_mut().push(text[start..].lines().next().unwrap().to_owned());
        Some(Evaluated { picture: Some("part".to_owned()), about: String::new() })
    }

    fn file(&self, _path: &Path) -> Option<String> {
        None
    }
}

#[test]
fn shows_parts_of_formulas() {
    for (node, wanted) in [
        (r#""last": "= wa|ves * 2""#, "**waves**: `Gray`, by `Perlin`"),
        (r#""last": "= wa|ves * 2""#, "![waves](node:waves)"),
        (r#""last": "= cells.f|2""#, "**cells.f2**: `Gray`, by `Worley`"),
        (r#""last": "= leather.hei|ght""#, "**leather.height**: `Gray`\n\nThe channel of the material; 0 where"),
        (r#""last": Blur(input: "leather.hei|ght")"#, "**leather.height**: `Gray`"),
        (r#""last": "= color.b|gr""#, "**color.bgr**: `Rgb`"),
        (r#""last": "= $pit|ch""#, "**$pitch**: `Number` = **2**"),
        (r#""last": "= cla|mp(waves, 0, 1)""#, "`clamp(x, lo, hi)`"),
        (r#""last": "= rid|ge(waves, 1)""#, "`ridge(x, w)`\n\nA ridge along the zeros of `x`."),
        (r#""last": "= lines.gr|oove(waves)""#, "`lines.groove(x)`"),
        (r#""last": "= let far = swirl; fa|r.x""#, "local name **far**: `Vec2`"),
        (r#""last": "= |u * 2""#, "From 0 to 1 across the canvas."),
        (r#""last": "= poi|nt.x""#, "The position in space"),
        (r#""last": "= waves |* 2 + 1""#, "`waves * 2`: `Gray`"),
        (r#""last": "= waves * color |+ 1""#, "`waves * color + 1`: `Rgb`"),
        (r#""last": "= (waves, 1, 2)|""#, "`(waves, 1, 2)`: `Rgb`"),
        (r#""last": "= max(1, point.x)|""#, "`max(1, point.x)`: `Solid`"),
        (r#""last": "= waves * (2 |+ 3)""#, "`2 + 3` is **5**"),
        (
            r##""last": r#"= waves
          |+ swirl"#"##,
            "`waves + swirl`: `Vec2`",
        ),
        (r#""last": Blur(input: "waves", radius: "= $pitch |* 2")"#, "`$pitch * 2` is **4**"),
        (r#""last": Blur(input: "waves", radius: "= $pit|ch * 2")"#, "is **4 mm**"),
    ] {
        let shown = at_cursor(node, |cx, _, at| hover(cx, at, &Asked::default()));
        let shown = shown.unwrap_or_else(|| panic!("{node}"));
        assert!(shown.markdown.contains(wanted), "{node}: {}", shown.markdown);
    }
    let asked = Asked::default();
    at_cursor(r#""last": "= let r = u; let s = 1; r |* waves + s""#, |cx, _, at| hover(cx, at, &asked));
    at_cursor(r#""last": "= waves |* ""#, |cx, _, at| hover(cx, at, &asked));
    let asked = asked.0.into_inner();
    assert_eq!(asked, [r#""_part_of_formula": "= let r = u; r * waves","#], "a formula with mistakes has no picture");
}

#[test]
fn colors_words_of_formulas() {
    let node = r##""last": r#"= let r = 2 * waves;
      ridge(r, $tint.r) + point.x"#"##;
    let shown: Vec<(String, Token)> = at_cursor(&format!("|{node}"), |cx, file, at| {
        let inside = tokens(cx).into_iter().filter(|(range, _)| at < range.start && range.end < at + node.len());
        inside.map(|(range, token)| (file.at(&range).to_owned(), token)).collect()
    });
    let shown: Vec<(&str, Token)> = shown.iter().map(|(text, token)| (text.as_str(), *token)).collect();
    let expected = [
        ("let", Token::Keyword),
        ("r", Token::Local),
        ("=", Token::Operator),
        ("2", Token::Number),
        ("*", Token::Operator),
        ("waves", Token::Reference),
        ("ridge", Token::Function),
        ("r", Token::Local),
        ("$tint.r", Token::Param),
        ("+", Token::Operator),
        ("point.x", Token::Place),
    ];
    assert_eq!(shown, expected);
    let head = at_cursor("|\"last\": Perlin()", |cx, file, _| {
        let words = tokens(cx).into_iter().map(|(range, token)| (file.at(&range).to_owned(), token));
        words.skip_while(|(text, _)| text != "ridge").take(5).collect::<Vec<_>>()
    });
    let head: Vec<(&str, Token)> = head.iter().map(|(text, token)| (text.as_str(), *token)).collect();
    assert_eq!(head[..4], [("ridge", Token::Function), ("x", Token::Local), ("w", Token::Local), ("1", Token::Number)]);
}

#[test]
fn shows_types_of_formula_nodes() {
    for (formula, ty) in [
        ("waves * 2", "Gray"),
        ("color * waves", "Rgb"),
        ("(u, v)", "Vec2"),
        ("point.x", "Solid"),
        ("leather.base_color.g", "Gray"),
        ("if($style == Fine, color, 0)", "Rgb"),
        ("ridge(swirl, 2)", "Vec2"),
        ("lines.groove(used.sum)", "Gray"),
        ("luminance(color)", "Gray"),
        ("let a = swirl; a.yx + 1", "Vec2"),
        ("2 * 3", "Gray"),
    ] {
        let inlays = at_cursor(&format!("|\"last\": \"= {formula}\""), |cx, file, _| {
            inlay::inlays(cx, &(0..file.text.len()), inlay::InlayKinds::default())
                .into_iter()
                .map(|one| (file.text[..one.at].rsplit(' ').next().unwrap().to_owned(), one.text))
                .collect::<Vec<_>>()
        });
        let last = inlays.iter().find(|(before, _)| before == "\"last\"");
        assert_eq!(last.map(|(_, text)| text.as_str()), Some(format!(": {ty}").as_str()), "{formula}: {inlays:?}");
    }
}

#[test]
fn warns_of_names_that_hide_others() {
    for (nodes, expected) in [
        (r#""u": Perlin(), "last": "= u + 1""#, "a node called \"u\" hides the position"),
        (
            r##""x": Perlin(), "last": r#"= waves
          * x.y"#"##,
            "a node called \"x\" hides the position",
        ),
        (r#""pi": Perlin(), "last": "= 2 * pi""#, "a node called \"pi\" hides the constant"),
        (r#""u": Perlin(), "last": Blur(input: "u")"#, ""),
        (r#""last": "= u""#, ""),
    ] {
        let found = at_cursor(&format!("|{nodes}"), |cx, _, _| diagnose::hints(cx));
        let warning = found.iter().find(|hint| hint.severity == diagnose::Severity::Warning);
        assert_eq!(warning.map_or("", |hint| hint.message.as_str()), expected, "{nodes}");
    }
}

#[test]
fn counts_uses_in_formulas_and_paths() {
    let text = r##"(
  functions: { "twice(a)": "2 * a" },
  nodes: {
    "a": Perlin(), "b": Material(height: "a"), "c": Perlin(), "d": Perlin(), "e": Perlin(), "f": Perlin(),
    "g": "= twice(c) + d", "h": r#"= g
      - e"#,
  },
  outputs: { "x": "b.height", "y": "= h" },
)"##;
    with(text, |cx, file| {
        let unused: Vec<_> =
            diagnose::unused(cx).iter().map(|at| file.entries(super::super::Section::Nodes)[*at].name()).collect();
        assert_eq!(unused, [Some("f")]);
        let outline = structure::outline(cx);
        let names: Vec<&str> = outline.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["functions", "nodes", "outputs"]);
        assert_eq!(outline[0].children[0].name, "twice(a)");
        let g = outline[1].children.iter().find(|entry| entry.name == "g").unwrap();
        assert_eq!(g.detail, "formula → Gray");
        let at = text.find("g\n").unwrap();
        let selected: Vec<&str> = structure::selections(cx, at).iter().map(|range| file.at(range)).collect();
        assert_eq!(selected[..3], ["g", "g\n      - e", "= g\n      - e"]);
        let (_, place) = navigate::definition(cx, file, text.find("twice(c)").unwrap()).unwrap();
        assert_eq!(file.at(&place.range), "twice");
        let (_, place) = navigate::definition(cx, file, text.find("a\" }").unwrap()).unwrap();
        assert_eq!(&text[place.range.start - 6..place.range.end], "twice(a");
    });
}

#[test]
fn places_errors_in_raw_texts() {
    let text = r##"(
  nodes: {
    "waves": Perlin(),
    "sum": r#"= waves
      + wavse"#,
  },
  outputs: { "o": "sum" },
)"##;
    let loaded = shibo_graph::load_text(
        Path::new("/nowhere/a.ron"),
        text,
        &super::registry(),
        &shibo_graph::LoadOptions::default(),
    );
    let found = diagnose::by_file(&loaded.diagnostics, &loaded.sources);
    let errors: Vec<_> = found.values().flatten().map(|one| (&text[one.range.clone()], one.message.as_str())).collect();
    assert_eq!(errors, [("wavse", "there is no node `wavse`")]);
}
