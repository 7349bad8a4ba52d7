//! Pictures rendered in parts, as several machines do: the joined files equal those of a single run byte for byte, and
//! a folder with missing or extra parts gives an error and no file.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use std::path::{Path, PathBuf};

/// A graph with blurs and slopes (halos that wrap or end), strokes, a whole-picture node, all formats, and lines.
const GRAPH: &str = r##"(
  version: 1,
  canvas: (size_mm: (40, 50), resolution: (640, 800), tile: TILE, seed: 3),
  params: { "size": Number(default: 5, range: (0.5, 20), unit: "mm", doc: "Size of the bumps") },
  presets: { "large": { "size": 15 } },
  nodes: {
    "bumps": Perlin(size: "$size"),
    "soft": Blur(input: "bumps", radius: 2),
    "softer": Blur(input: "soft", radius: 3),
    "even": AutoLevels(input: "softer"),
    "normal": HeightToNormal(input: "even"),
    "points": PoissonPoints(pitch: 4),
    "links": ConnectNeighbors(points: "points"),
    "springs": DefineSprings(lattice: "links", field: "bumps", stiffness: (1, 10)),
    "moved": SimulateSprings(springs: "springs", step: 0.1, steps: 2000, drag: 4, boundary: Canvas),
    "wrinkles": PlaceWrinkles(lattice: "moved"),
    "strokes": DrawWrinkles(segments: "wrinkles", width: (0.5, 1)),
    "all": Material(base_color: "#7a4526", height: "even", normal: "normal", roughness: "strokes.mask"),
  },
  outputs: {
    "all": "all",
    "tiff": File(from: "normal", format: Tiff),
    "float": File(from: "softer", format: Tiff, depth: F32),
    "half": File(from: "bumps", format: Exr, depth: F16),
    "lines": "wrinkles",
  },
)
"##;

fn desk(tile: &str) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("TILE", tile));
    desk
}

/// Renders four parts, the last ones first, each in a process of its own.
fn parts(desk: &Desk, dir: &str, more: &str) {
    for part in [3, 4, 1, 2] {
        desk.shibo(&format!("render a.ron --part {part}/4 -o {dir} {more}")).expect(0);
    }
}

#[track_caller]
fn same(desk: &Desk, one: &str, two: &str) {
    assert_eq!(desk.names(one), desk.names(two));
    for name in desk.names(one) {
        assert!(desk.read(&format!("{one}/{name}")) == desk.read(&format!("{two}/{name}")), "{name}");
    }
}

/// Checks that joining fails with exit code 1, prints all of `said`, and writes nothing.
#[track_caller]
fn refused(desk: &Desk, said: &[&str]) {
    let before = desk.names("parts");
    let ran = desk.shibo("join parts -o joined").expect(1);
    for text in said {
        assert!(ran.stderr.contains(text), "{text}: {}", ran.stderr);
    }
    assert!(!desk.path("joined").exists(), "{:?}", desk.names("joined"));
    assert_eq!(desk.names("parts"), before);
}

#[test]
fn joined_parts_are_the_files_of_a_single_run() {
    for (tile, more) in
        [("Both", "--memory 64"), ("None", "--dither"), ("X", "--compress best"), ("Both", "--no-cache")]
    {
        let desk = desk(tile);
        desk.shibo(&format!("render a.ron -o whole --no-cache {more}").replace("--no-cache --no-cache", "--no-cache"))
            .expect(0);
        parts(&desk, "parts", more);
        assert_eq!(desk.names("parts"), ["a.1-of-4.part", "a.2-of-4.part", "a.3-of-4.part", "a.4-of-4.part"]);
        let ran = desk.shibo("join parts -o joined --memory 64").expect(0);
        assert!(ran.stderr.contains("lines.svg"), "{}", ran.stderr);
        same(&desk, "whole", "joined");
        // Joining keeps the parts.
        assert_eq!(desk.names("parts").len(), 4);
    }
}

#[test]
fn reports_clipped_samples_once_as_a_sum() {
    let desk = desk("Both");
    desk.write(
        "a.ron",
        GRAPH
            .replace("TILE", "Both")
            .replace("\"even\": AutoLevels(input: \"softer\")", "\"even\": Remap(input: \"softer\", to: (-9, 10))")
            .replace(
                "\"tiff\": File(from: \"normal\", format: Tiff),",
                "\"tiff\": File(from: \"even\", format: Tiff),",
            ),
    );
    let whole = desk.shibo("render a.ron -o whole --output tiff --no-cache").expect(0);
    for part in 1..=4 {
        let ran = desk.shibo(&format!("render a.ron --part {part}/4 -o parts --output tiff")).expect(0);
        assert!(!ran.stderr.contains("clipped"), "{}", ran.stderr);
    }
    let joined = desk.shibo("join parts -o joined").expect(0);
    let told = |text: &str| {
        let line = text.lines().find(|line| line.contains("clipped")).unwrap_or_else(|| panic!("{text}")).to_owned();
        line.split_once("samples").unwrap().0.rsplit_once(' ').unwrap().0.rsplit(' ').next().unwrap().to_owned()
    };
    assert_eq!(told(&whole.stderr), told(&joined.stderr));
    same(&desk, "whole", "joined");
}

#[test]
fn reports_missing_and_duplicate_parts() {
    let desk = desk("Both");
    let none = desk.shibo("join nowhere -o joined").expect(1);
    assert!(none.stderr.contains("nowhere"), "{}", none.stderr);
    std::fs::create_dir(desk.path("parts")).unwrap();
    refused(&desk, &["no parts", "--part"]);
    parts(&desk, "parts", "");
    let (second, third) = (desk.path("parts/a.2-of-4.part"), desk.path("parts/a.3-of-4.part"));
    std::fs::rename(&second, desk.path("kept")).unwrap();
    refused(&desk, &["part 2/4 is missing"]);
    std::fs::copy(&third, desk.path("parts/again.part")).unwrap();
    refused(&desk, &["part 2/4 is missing", "part 3/4 is there twice", "again.part"]);
    std::fs::remove_file(desk.path("parts/again.part")).unwrap();
    std::fs::rename(desk.path("kept"), &second).unwrap();
    desk.shibo("join parts -o joined").expect(0);
}

#[test]
fn reports_parts_of_another_render() {
    let desk = desk("Both");
    parts(&desk, "parts", "");
    let place = desk.path("parts/a.2-of-4.part");
    let good = std::fs::read(&place).unwrap();
    let graph = GRAPH.replace("TILE", "Both");
    desk.write("b.ron", &graph);
    desk.write("seed.ron", graph.replace("seed: 3", "seed: 4"));
    desk.write("edited.ron", graph.replace("radius: 2", "radius: 2.5"));
    let cases = [
        ("render b.ron --part 2/4", "b.2-of-4.part", "another graph: `b`"),
        ("render seed.ron --part 2/4", "seed.2-of-4.part", "another graph: `seed`"),
        ("render a.ron --part 2/4 --set seed=4", "a.2-of-4.part", "another seed: 4, not 3"),
        ("render a.ron --part 2/4 --set size=6", "a.2-of-4.part", "other parameters: size: 6"),
        ("render a.ron --part 2/4 --resolution 1280", "a.2-of-4.part", "another size: 1024 × 1280, not 640 × 800"),
        ("render a.ron --part 2/4 --output all", "a.2-of-4.part", "other outputs"),
        ("render a.ron --part 2/4 --dither", "a.2-of-4.part", "encoded in another way"),
        ("render a.ron --part 2/3", "a.2-of-3.part", "is one of 3, not of 4"),
    ];
    for (line, name, said) in cases {
        let _ = std::fs::remove_dir_all(desk.path("other"));
        desk.shibo(&format!("{line} -o other")).expect(0);
        std::fs::copy(desk.path(format!("other/{name}")), &place).unwrap();
        let number = if name.contains("of-3") { "part 2/3" } else { "part 2/4" };
        refused(&desk, &[number, said]);
    }
    for (file, said) in [("seed.ron", "another seed: 4, not 3"), ("edited.ron", "at another time")] {
        std::fs::create_dir_all(desk.path("sub")).unwrap();
        std::fs::copy(desk.path(file), desk.path("sub/a.ron")).unwrap();
        desk.shibo("render sub/a.ron --part 2/4 -o other").expect(0);
        std::fs::copy(desk.path("other/a.2-of-4.part"), &place).unwrap();
        refused(&desk, &["part 2/4", said]);
    }
    std::fs::write(&place, good).unwrap();
    desk.shibo("join parts -o joined").expect(0);
}

#[test]
fn reports_and_repairs_damaged_parts() {
    let desk = desk("Both");
    parts(&desk, "parts", "");
    desk.shibo("join parts -o whole").expect(0);
    let place = desk.path("parts/a.2-of-4.part");
    let good = std::fs::read(&place).unwrap();
    let cut = |length: usize| std::fs::write(&place, &good[..length]).unwrap();
    for length in [0, 1, 15, 16, 300, good.len() / 2, good.len() - 49, good.len() - 1] {
        cut(length);
        refused(&desk, &["part 2/4", if length == 0 { "is empty" } else { "is truncated" }]);
    }
    let flip = |at: usize| {
        let mut bytes = good.clone();
        bytes[at] ^= 1;
        std::fs::write(&place, bytes).unwrap();
    };
    for at in [0, 9, 40, good.len() / 2, good.len() - 200, good.len() - 45, good.len() - 1] {
        flip(at);
        refused(&desk, &["part 2/4"]);
    }
    // All damaged parts are reported, not only the first.
    let third = desk.path("parts/a.3-of-4.part");
    let mut bytes = std::fs::read(&third).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&third, bytes).unwrap();
    flip(good.len() / 2);
    refused(&desk, &["part 2/4", "part 3/4", "is damaged"]);
    // The same commands repair the damaged parts and leave the others.
    let first = std::fs::metadata(desk.path("parts/a.1-of-4.part")).unwrap().modified().unwrap();
    parts(&desk, "parts", "");
    assert_eq!(std::fs::metadata(desk.path("parts/a.1-of-4.part")).unwrap().modified().unwrap(), first);
    assert_eq!(std::fs::read(&place).unwrap(), good);
    desk.shibo("join parts -o joined").expect(0);
    same(&desk, "whole", "joined");
}

#[test]
fn refuses_part_with_name_outside_the_folder() {
    let desk = desk("Both");
    desk.shibo("render a.ron --part 1/1 -o parts --output lines").expect(0);
    let place = desk.path("parts/a.1-of-1.part");
    let text = std::fs::read(&place).unwrap();
    // The new name has the same length as the original. The part is not sealed again, so it counts as damaged.
    let find = |text: &[u8], word: &[u8]| text.windows(word.len()).position(|w| w == word).unwrap();
    let mut bytes = text.clone();
    let at = find(&bytes, b"lines.svg");
    bytes[at..at + 9].copy_from_slice(b"../li.svg");
    std::fs::write(&place, &bytes).unwrap();
    refused(&desk, &["part 1/1", "damaged"]);
    assert!(!desk.path("li.svg").exists());
}

#[test]
fn refuses_invalid_part_arguments() {
    let desk = desk("Both");
    for (line, said) in [
        ("render a.ron --part 0/4", "1/16 is the first"),
        ("render a.ron --part 5/4", "1/16 is the first"),
        ("render a.ron --part 1/9", "4 rows of tiles"),
        ("render a.ron --part 1/2 --region 0,0,8,8", "cannot be used with"),
        ("render a.ron --part 1/2 --as usd", "cannot be used with"),
        ("render a.ron --part 1/2 --preset large --preset large+large", "the same names"),
        ("join", "PARTS"),
    ] {
        let ran = desk.shibo(line).expect(2);
        assert!(ran.stderr.contains(said), "{line}: {}", ran.stderr);
    }
    desk.write(
        "a.ron",
        GRAPH.replace("TILE", "Both").replace("\"lines\": \"wrinkles\"", "\"glb\": Gltf(material: \"all\")"),
    );
    let ran = desk.shibo("render a.ron --part 1/2").expect(2);
    assert!(ran.stderr.contains("glb") && ran.stderr.contains("--output"), "{}", ran.stderr);
    assert!(!desk.path("out").exists() || desk.names("out").is_empty());
}

#[test]
fn parts_reuse_prepared_results() {
    let desk = desk("Both");
    let first = desk.shibo("prepare a.ron").expect(0);
    assert!(first.stdout.contains("moved") && first.stderr.contains("stored"), "{}{}", first.stdout, first.stderr);
    assert!(!desk.path("out").exists());
    let again = desk.shibo("prepare a.ron").expect(0);
    assert!(!again.stdout.contains("moved"), "{}", again.stdout);
    let ran = desk.shibo("render a.ron --part 2/4 -o parts --stats json").expect(0).json();
    let node = ran["nodes"].as_array().unwrap().iter().find(|node| node["name"] == "moved").unwrap();
    assert_ne!(node["state"], "computed", "{node}");
    let told = desk.shibo("prepare a.ron --no-cache --progress openjd -q").expect(0);
    assert!(told.stdout.contains("openjd_status: "), "{}", told.stdout);
    assert!(Path::new(&desk.path("parts/a.2-of-4.part")).exists());
}

/// Number of pixels computed for the node `noise`.
fn pixels(ran: crate::support::Ran) -> u64 {
    let stats = ran.expect(0).json();
    let node = stats["nodes"].as_array().unwrap().iter().find(|node| node["name"] == "noise").unwrap();
    node["pixels"].as_u64().unwrap()
}

/// A slow field under a wide blur, whose halo is half as high as a part.
const FAR: &str = r#"(
  version: 1,
  canvas: (size_mm: (32, 64), resolution: (512, 1024), tile: TILE, seed: 3),
  nodes: { "noise": Gabor(wavelength: 5, spread: 40), "soft": Blur(input: "noise", radius: 2.4) },
  outputs: { "soft": File(from: "soft", format: Exr) },
)
"#;

#[test]
fn parts_compute_no_pixel_twice() {
    for tile in ["Both", "None"] {
        let desk = Desk::new();
        desk.write("a.ron", FAR.replace("TILE", tile));
        let whole = pixels(desk.shibo("render a.ron -o whole --no-cache --stats json"));
        let part = |n: u32, dir: &str, cache: &str| {
            pixels(desk.shibo(&format!("render a.ron --part {n}/4 -o {dir} --stats json {cache}")))
        };
        let alone: u64 = (1..=4).map(|n| part(n, "alone", "--no-cache")).sum();
        assert!(alone * 4 > whole * 5, "blurs reach too little for this test: {alone} of {whole}");
        // In any order, a part reuses the pixels that a neighbour computed beyond its edge.
        for order in [[1, 2, 3, 4], [3, 1, 4, 2], [4, 2, 3, 1]] {
            let dir = format!("parts{}{}", order[0], order[1]);
            let cache = format!("--cache-dir cache{}{}", order[0], order[1]);
            let shared: u64 = order.into_iter().map(|n| part(n, &dir, &cache)).sum();
            assert!(shared * 100 <= whole * 105, "{tile}: {order:?} computed {shared} of {whole} pixels");
            assert_eq!(desk.names(&dir).len(), 4, "{:?}", desk.names(&dir));
            desk.shibo(&format!("join {dir} -o joined{dir}")).expect(0);
            same(&desk, "whole", &format!("joined{dir}"));
        }
    }
}

/// The tiles in a cache.
fn tiles(desk: &Desk, cache: &str) -> Vec<PathBuf> {
    let entries = |dir: PathBuf| dir.read_dir().into_iter().flatten().map(|entry| entry.unwrap().path());
    let mut tiles: Vec<_> = entries(desk.path(format!("{cache}/tiles"))).flat_map(entries).collect();
    tiles.sort();
    tiles
}

#[test]
fn concurrent_parts_and_damaged_overlaps_change_no_pixel() {
    let desk = Desk::new();
    desk.write("a.ron", FAR.replace("TILE", "Both"));
    desk.shibo("render a.ron -o whole --no-cache").expect(0);
    let part = |n: u32, dir: &str| {
        desk.shibo(&format!("render a.ron --part {n}/4 -o {dir} --cache-dir cache_{dir}")).expect(0);
    };
    std::thread::scope(|scope| {
        for n in 1..=4 {
            let part = &part;
            scope.spawn(move || part(n, "at_once"));
        }
    });
    desk.shibo("join at_once -o joined").expect(0);
    same(&desk, "whole", "joined");
    // Damaged, truncated and swapped tiles change no pixel.
    part(1, "damaged");
    for next in [3, 2, 4] {
        let tiles = tiles(&desk, "cache_damaged");
        assert!(tiles.len() > 3, "{tiles:?}");
        for (n, tile) in tiles.iter().enumerate() {
            let mut bytes = std::fs::read(tile).unwrap();
            let middle = bytes.len() / 2;
            match n % 3 {
                0 => bytes[middle] ^= 1,
                1 => bytes.truncate(middle),
                _ => bytes = std::fs::read(&tiles[0]).unwrap(),
            }
            std::fs::write(tile, bytes).unwrap();
        }
        part(next, "damaged");
    }
    desk.shibo("join damaged -o mended").expect(0);
    same(&desk, "whole", "mended");
}

#[test]
fn computes_wide_parts_from_left_to_right() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        FAR.replace("TILE", "Both").replace("(32, 64), resolution: (512, 1024)", "(160, 32), resolution: (2560, 512)"),
    );
    desk.shibo("render a.ron -o whole --no-cache").expect(0);
    for n in [2, 1] {
        desk.shibo(&format!("render a.ron --part {n}/2 -o parts --memory 40 --no-cache")).expect(0);
    }
    assert_eq!(desk.names("parts").len(), 2, "{:?}", desk.names("parts"));
    desk.shibo("join parts -o joined").expect(0);
    same(&desk, "whole", "joined");
}
