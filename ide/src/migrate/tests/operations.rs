//! Each operation of each kind.
use super::{lines, migrated, output};

#[test]
fn rewrites_all_operations_of_math() {
    for (operation, expected) in [
        ("Add", "n + k"),
        ("Subtract", "n - k"),
        ("Multiply", "n * k"),
        ("Divide", "n / k"),
        ("MultiplyAdd", "c + n * k"),
        ("Min", "min(n, k)"),
        ("Max", "max(n, k)"),
        ("SmoothMin", "smooth_min(n, k, c)"),
        ("SmoothMax", "smooth_max(n, k, c)"),
        ("Power", "max(n, 0) ^ k"),
        ("Sqrt", "sqrt(max(n, 0))"),
        ("Exp", "exp(n)"),
        ("Log2", "log(max(n, 1.1754944e-38)) / log(2)"),
        ("Abs", "abs(n)"),
        ("Sign", "sign(n)"),
        ("Modulo", "n % k"),
        ("PingPong", "k * triangle(n / (2 * k))"),
        ("Floor", "floor(n)"),
        ("Ceil", "ceil(n)"),
        ("Round", "floor(n + 0.5)"),
        ("Fract", "fract(n)"),
        ("Snap", "if(k == 0, n, k * floor(n / k))"),
        ("Sin", "sin(n)"),
        ("Cos", "cos(n)"),
        ("Tan", "tan(n)"),
        ("Atan2", "atan2(n, k)"),
        ("Hypot", "sqrt(n ^ 2 + k ^ 2)"),
        ("Smoothstep", "smoothstep(k, c, n)"),
        ("Step", "step(k, n)"),
        ("Clamp", "clamp(n, k, c)"),
        ("Mix", "mix(n, k, c)"),
        ("Less", "n < k"),
        ("Greater", "n > k"),
    ] {
        let found = output(&format!("Math(operation: {operation}, a: \"n\", b: \"k\", c: \"c\")"));
        assert_eq!(found, format!("\"o\": \"= {expected}\""), "{operation}");
    }
}

#[test]
fn fills_in_defaults_of_math() {
    for (node, expected) in [
        ("Math(a: \"n\", b: 2)", "n + 2"),
        ("Math(operation: Multiply, a: \"n\")", "0 * n"),
        ("Math(operation: MultiplyAdd, a: \"n\", b: 3)", "3 * n + 1"),
        ("Math(operation: Clamp, a: \"n\")", "clamp(n, 0, 1)"),
        ("Math(operation: Smoothstep, a: \"n\")", "smoothstep(0, 1, n)"),
        ("Math(operation: Multiply, a: \"n\", b: \"$wide\")", "$wide * n"),
        ("Math(operation: Multiply, a: \"n\", b: \"= $wide * -0.1\")", "-0.1 * $wide * n"),
        ("Math(operation: Multiply, a: \"n\", b: \"#7a4526\")", "#7a4526 * n"),
        ("Math(operation: Multiply, a: \"n\", b: (1, 0.5, .25))", "(1, 0.5, .25) * n"),
        ("Math(operation: Power, a: \"n\", b: 0x10)", "max(n, 0) ^ 16"),
        ("Math(operation: Snap, a: \"n\", b: 0.5)", "0.5 * floor(n / 0.5)"),
        ("Math(operation: Multiply, a: \"p.mask\", b: -1)", "-p.mask"),
    ] {
        assert_eq!(output(node), format!("\"o\": \"= {expected}\""), "{node}");
    }
}

#[test]
fn rewrites_all_operations_of_solid_math() {
    for (operation, expected) in [
        ("Add", "s + t"),
        ("Subtract", "s - t"),
        ("Multiply", "s * t"),
        ("MultiplyAdd", "0.5 + s * t"),
        ("Divide", "s / t"),
        ("Min", "min(s, t)"),
        ("Max", "max(s, t)"),
        ("Power", "max(s, 0) ^ t"),
        ("Fraction", "fract(s)"),
        ("Floor", "floor(s)"),
        ("Absolute", "abs(s)"),
        ("SmoothStep", "if(0.5 > t, smoothstep(t, 0.5, s), step(t, s))"),
        ("Sine", "sin(360 * s / t)"),
    ] {
        let found = output(&format!("SolidMath(operation: {operation}, a: \"s\", b: \"t\", c_value: 0.5)"));
        let expected = expected.replace("0.5 + s * t", "s * t + 0.5");
        assert_eq!(found, format!("\"o\": \"= {expected}\""), "{operation}");
    }
    for (node, expected) in [
        ("SolidMath(a: \"s\")", "\"s\""),
        ("SolidMath(operation: MultiplyAdd, a: \"s\", b_value: 0.004)", "\"= 0.004 * s\""),
        ("SolidMath(operation: SmoothStep, a: \"s\", b_value: 0.4, c_value: 0.8)", "\"= smoothstep(0.4, 0.8, s)\""),
        ("SolidMath(operation: SmoothStep, a: \"s\", b_value: 0.8, c_value: 0.4)", "\"= step(0.8, s)\""),
        ("SolidMath(operation: Multiply, a: \"s\", b: \"t\", b_value: 7)", "\"= s * t\""),
    ] {
        assert_eq!(output(node), format!("\"o\": {expected}"), "{node}");
    }
}

#[test]
fn keeps_form_of_expressions() {
    for (node, expected) in [
        ("Expression(a: \"n\", b: \"k\", formula: \"a*2 + (a - b)/3\")", "n * 2 + (n - k) / 3"),
        ("Expression(a: \"c\", formula: \"= a.r + a.b\")", "c.r + c.b"),
        ("Expression(a: \"n\", b: 0.5, c: \"$wide\", formula: \"mix(a, b, c) - b\")", "mix(n, 0.5, $wide) - 0.5"),
        ("Expression(a: \"#ff0000\", b: \"n\", formula: \"a.g * b\")", "(#ff0000).g * n"),
        ("Expression(formula: \"sin(360 * u) + y / canvas.height * pi\")", "sin(360 * u) + y / canvas.height * pi"),
        ("Expression(a: \"p.local\", formula: \"length(a) < a.x\")", "length(p.local) < p.local.x"),
        ("Expression(a: \"n\", b: \"k\", formula: \"a\")", ""),
    ] {
        let expected = if expected.is_empty() { "\"o\": \"n\"".to_owned() } else { format!("\"o\": \"= {expected}\"") };
        assert_eq!(output(node), expected, "{node}");
    }
}

#[test]
fn seeds_random_numbers_of_expressions() {
    let of = |formula: &str, seed: &str| {
        let node = format!("Expression(a: \"p.ids\", formula: \"{formula}\", seed: {seed})");
        let migration = migrated(&super::graph(&format!("    \"r\": {node},\n"), "\"o\": \"r\""));
        let formula =
            migration.text.split("\"o\": \"= ").nth(1).and_then(|rest| rest.split('"').next()).map(str::to_owned);
        (formula.unwrap_or_default(), migration.warnings.len())
    };
    assert_eq!(of("random(a)", "0"), ("random(p.ids)".into(), 0));
    assert_eq!(of("random(a)", "3"), ("random(p.ids, 3)".into(), 1));
    assert_eq!(of("hash(a, x)", "\\\"$wide\\\"".replace('\\', "").as_str()), ("hash(p.ids, x, $wide)".into(), 1));
    assert_eq!(of("noise(x, y) * 2", "\"= $wide + 1\""), ("noise(x, y, $wide + 1) * 2".into(), 1));
    assert_eq!(of("x + y", "3"), ("x + y".into(), 0));
    assert_eq!(of("random(a + 0.5)", "0"), ("hash(p.ids, 0.5)".into(), 1));
}

#[test]
fn limits_masks_only_where_needed() {
    for (node, expected) in [
        ("MixSolids(a: \"s\", b: \"t\")", "mix(s, t, 0.5)"),
        ("MixSolids(a: \"s\", b: \"t\", amount: 0.2)", "mix(s, t, 0.2)"),
        ("MixSolids(a: \"s\", b: \"t\", amount: \"$wide\")", "mix(s, t, clamp($wide, 0, 1))"),
        ("MixSolids(a: \"s\", b: \"t\", amount: \"= $wide / 4\")", "mix(s, t, $wide / 4)"),
        ("MixSolids(a: \"s\", b: \"t\", mask: \"s\")", "mix(s, t, clamp(s, 0, 1))"),
        (
            "MixSolids(a: \"s\", b: \"t\", mask: SolidMath(operation: SmoothStep, a: \"s\", c_value: 2))",
            "mix(s, t, smoothstep(1, 2, s))",
        ),
    ] {
        assert_eq!(output(node), format!("\"o\": \"= {expected}\""), "{node}");
    }
}

#[test]
fn takes_channels_by_their_paths() {
    for (node, output, expected) in [
        ("MaterialChannel(material: \"m\")", "r", "\"m.height\""),
        ("MaterialChannel(material: \"m\", channel: Roughness)", "r.value", "\"m.roughness\""),
        ("MaterialChannel(material: \"m\", channel: Roughness)", "r.rgb", "\"m.roughness\""),
        ("MaterialChannel(material: \"m\", channel: BaseColor)", "r.rgb", "\"m.base_color\""),
        ("MaterialChannel(material: \"m\", channel: BaseColor)", "r", "\"= luminance(m.base_color)\""),
        ("MaterialChannel(material: \"m\", channel: AnisotropyAngle)", "r", "\"m.anisotropy_angle\""),
        ("SplitChannels(input: \"c\")", "r.g", "\"c.g\""),
        ("SplitChannels(input: \"c\")", "r", "\"c.x\""),
        ("SplitChannels(input: \"p.local\")", "r.g", "\"p.local.y\""),
        ("SplitChannels(input: \"p.local\")", "r.z", "\"= 0\""),
    ] {
        let found = lines(&format!("    \"r\": {node},\n"), &format!("\"o\": \"{output}\"")).1;
        assert_eq!(found, format!("\"o\": {expected}"), "{node}");
    }
    let normal = "    \"h\": HeightToNormal(input: \"n\"),\n    \"r\": SplitChannels(input: \"h\"),\n";
    assert_eq!(lines(normal, "\"o\": \"r.z\"").1, "\"o\": \"= 2 * h.z - 1\"");
    assert_eq!(lines(normal, "\"o\": \"r.b\"").1, "\"o\": \"h.b\"");
    let adds = "    \"r\": SplitChannels(input: \"c\"),\n    \"e\": Math(a: \"r.r\", b: \"r.b\"),\n";
    assert_eq!(lines(adds, "\"o\": \"e\"").1, "\"o\": \"= c.r + c.b\"");
}

#[test]
fn names_main_output_beside_output_of_same_name() {
    // `LayerMaterials` has an output `height`.
    let nodes = "    \"lay\": BlendMaterials(base: \"m\", top: \"m\", mask: \"n\"),\n    \"r\": MaterialChannel(material: \"lay\"),\n";
    let outputs = super::kinds().info("BlendMaterials").expect("a kind").outputs;
    let clashes = outputs.iter().any(|output| output.name == "height");
    let expected =
        if clashes { format!("\"o\": \"lay.{}.height\"", outputs[0].name) } else { "\"o\": \"lay.height\"".into() };
    assert_eq!(lines(nodes, "\"o\": \"r\"").1, expected);
}

#[test]
fn writes_vectors_and_constants() {
    for (node, output, expected) in [
        ("MakeVector(x: \"n\", y: 2)", "r", "\"= (n, 2)\""),
        ("MakeVector(x: \"n\")", "r.vector", "\"= (n, 0)\""),
        ("MakeVector(angle: \"n\")", "r", "\"= rotate((1, 0), n)\""),
        ("MakeVector(angle: 30, length: \"n\")", "r", "\"= rotate((n, 0), 30)\""),
        ("PackChannels(r: \"n\", b: \"k\")", "r", "\"= (n, 0, k)\""),
    ] {
        let found = lines(&format!("    \"r\": {node},\n"), &format!("\"o\": \"{output}\"")).1;
        assert_eq!(found, format!("\"o\": {expected}"), "{node}");
    }
    let constant = "    \"r\": Constant(value: 0.25, color: \"#9a5a34\"),\n";
    let read = "    \"e\": Blend(base: \"r.color\", top: \"r\"),\n    \"f\": Math(a: \"r\", b: \"n\"),\n";
    let (nodes, _) = lines(&format!("{constant}{read}"), "\"o\": \"e\", \"q\": \"f\"");
    assert_eq!(nodes, "    \"e\": Blend(base: \"#9a5a34\", top: 0.25),\n");
    let grey = "    \"r\": Constant(value: \"$wide\"),\n    \"e\": Blend(base: \"r.color\", top: \"n\"),\n";
    assert_eq!(lines(grey, "\"o\": \"e\"").0, "    \"e\": Blend(base: \"$wide\", top: \"n\"),\n");
    assert_eq!(output("Constant()"), "\"o\": \"= 0.5\"");
}

#[test]
fn renames_kinds() {
    let (nodes, _) = lines(
        "    \"r\": SetChannels(material: \"m\", height: Math(operation: Multiply, a: \"n\", b: 2), coat: 1),\n    \
         \"g\": ColorSolid(solid: \"s\", stops: [(0, \"#000000\"), (1, \"#ffffff\")]),\n    \
         \"d\": ColorSolid(solid: SolidMath(operation: Absolute, a: \"s\")),\n",
        "\"o\": \"r.material\"",
    );
    assert_eq!(
        nodes,
        "    \"r\": Material(from: \"m\", height: \"= 2 * n\", coat: 1),\n    \
         \"g\": GradientMap(input: \"s\", stops: [(0, \"#000000\"), (1, \"#ffffff\")]),\n    \
         \"d\": GradientMap(input: \"= abs(s)\", stops: [(0, (0.02, 0.01, 0.006)), (1, (0.8, 0.6, 0.4))]),\n"
    );
}

#[test]
fn tells_what_it_cannot_rewrite() {
    for (node, message) in [
        ("Math(operation: \"$wide\", a: \"n\")", "`operation` is not a word"),
        ("Math(a: \"true\", b: 2)", "rename the node first"),
        ("Math(operation: Cube, a: \"n\")", "there is no operation `Cube`"),
        ("Math(b: 2)", "`a` is not given"),
        ("Math(a: \"n\", q: 2)", "`Math` has no field `q`"),
        ("Math(a: \"two words\", b: 2)", "cannot be a part of a formula"),
        ("Expression(a: \"n\", formula: \"a +\")", "ends too early"),
        ("Expression(a: \"n\", formula: \"a + b\")", "`b` is not connected"),
        ("Expression(a: \"n\")", "`formula` is not given"),
        ("Expression(a: \"p.ids\", formula: \"a % 3\")", "numbers of pieces"),
        ("MaterialChannel(material: \"m\", channel: Colour)", "there is no channel"),
    ] {
        let text = super::graph(&format!("    \"r\": {node},\n"), "\"o\": \"r\"");
        let migration = migrated(&text);
        assert_eq!(migration.text, text, "{node}");
        let found = migration.warnings.iter().any(|warning| warning.message.contains(message));
        assert!(found, "{node}: {:?}", migration.warnings);
    }
}

#[test]
fn places_faults_of_formulas() {
    let text = super::graph("    \"r\": Expression(a: \"n\", formula: \"a + §\"),\n", "\"o\": \"r\"");
    let warning = migrated(&text).warnings.remove(0);
    assert_eq!(&text[warning.range], "§");
}

#[test]
fn avoids_names_that_nodes_hide() {
    let of = |node: &str, formula: &str| {
        let nodes = format!("    \"{node}\": Perlin(),\n    \"r\": Expression(formula: \"{formula}\"),\n");
        let migration = migrated(&super::graph(&nodes, "\"o\": \"r\""));
        assert_eq!(migration.warnings.len(), 1, "{formula}");
        let outputs = migration.text.split("outputs: { ").nth(1).unwrap_or_default().to_owned();
        outputs.split(" }").next().unwrap_or_default().to_owned()
    };
    assert_eq!(of("x", "x + y"), "\"o\": \"= u * canvas.width + y\"");
    assert_eq!(of("v", "2 / v"), "\"o\": \"= 2 / (y / canvas.height)\"");
    assert_eq!(of("pi", "pi * x"), "\"o\": \"= 3.141592653589793 * x\"");
    assert_eq!(of("canvas", "canvas.width * x"), "\"o\": \"r\"");
}
