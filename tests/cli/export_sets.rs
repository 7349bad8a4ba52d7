//! Documents never name files of another run, even if the command is killed while files get their final names.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// A material with many pictures, all of which differ with the seed.
const GRAPH: &str = r##"(
  canvas: (size_mm: 8, resolution: 64, tile: Both, seed: SEED),
  nodes: {
    "n": Perlin(size: 2), "normal": HeightToNormal(input: "n"),
    "color": GradientMap(input: "n", stops: [(0, "#402010"), (1, "#c0a080")]),
    "m": Material(base_color: "color", roughness: "n", metallic: "n", normal: "normal", height: "n", ao: "n", sheen: "n", coat: "n",
                  coat_roughness: "n", coat_normal: "normal", emission: "color", specular: "n", anisotropy: "n", anisotropy_angle: "n"),
  },
  outputs: { "m": "m" },
)"##;

/// Targets whose documents name pictures, with their documents; the first document names the others.
const TARGETS: [(&str, &[&str]); 5] = [
    ("gltf-files", &["m.gltf"]),
    ("obj", &["m.obj", "m.mtl"]),
    ("materialx", &["m.mtlx"]),
    ("usd", &["m.usda"]),
    ("blender", &["m_blender.py"]),
];

type Set = BTreeMap<String, Vec<u8>>;

fn set(folder: &Path) -> Set {
    let files = folder.read_dir().unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let files = files.filter(|name| !name.starts_with('.')).collect::<Vec<_>>();
    files.into_iter().filter_map(|name| Some((name.clone(), std::fs::read(folder.join(&name)).ok()?))).collect()
}

/// Inode numbers, which tell a new file from the old one of the same name.
fn identities(folder: &Path, names: &Set) -> Vec<Option<u64>> {
    names.keys().map(|name| folder.join(name).metadata().ok().map(|data| data.ino())).collect()
}

/// A killed command leaves the set of one run, or no document.
#[test]
fn killed_exports_leave_no_mixed_set() {
    for (target, documents) in TARGETS {
        let desk = Desk::new();
        let render = |seed: u32, out: &str| {
            desk.write("a.ron", GRAPH.replace("SEED", &seed.to_string()));
            let mut command = desk.command(["render", "a.ron", "--as", target, "--no-cache", "-q", "-o", out]);
            command.stdout(Stdio::null()).stderr(Stdio::null());
            command
        };
        assert!(render(1, "one").status().unwrap().success());
        assert!(render(2, "two").status().unwrap().success());
        let runs = [set(&desk.path("one")), set(&desk.path("two"))];
        let differ = runs[0].keys().filter(|name| runs[1].get(*name) != Some(&runs[0][*name])).count();
        assert!(differ > 5 && runs.iter().all(|run| documents.iter().all(|name| run.contains_key(*name))), "{target}");
        let out = desk.path("out");
        for moment in 0..6_u64 {
            assert!(render(1, "out").status().unwrap().success());
            let before = identities(&out, &runs[0]);
            let mut child = render(2, "out").spawn().unwrap();
            // From the first replaced file on, after a short delay.
            let start = Instant::now();
            while identities(&out, &runs[0]) == before && child.try_wait().unwrap().is_none() {
                assert!(start.elapsed() < Duration::from_secs(60), "{target}: nothing is written");
            }
            std::thread::sleep(Duration::from_micros(60 * moment));
            let _ = child.kill();
            child.wait().unwrap();
            let now = set(&out);
            // Documents of both runs may be equal: the other files then tell the run.
            let whole = |run: &Set| run.iter().all(|(name, content)| now.get(name) == Some(content));
            assert!(
                !now.contains_key(documents[0]) || runs.iter().any(whole),
                "{target}: {} is there after moment {moment}, and not all files are of one run",
                documents[0]
            );
        }
    }
}
