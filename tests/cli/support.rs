//! Shared by the tests of the command: a folder for each test, and ways to run `shibo` in it.
#![allow(dead_code, clippy::unwrap_used, reason = "each test program uses a part of it, and fails by panicking")]
use serde_json::Value as Json;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A graph whose fields are read many rows at a time: within 16 MiB, pictures of 2304² are made in strips.
pub(crate) const WIDE: &str = r#"(
  version: 1,
  canvas: (size_mm: 100, resolution: 128, tile: Both, seed: 1),
  nodes: {
    "noise": Perlin(size: 9),
    "soft": Blur(input: "noise", radius: 1.5),
    "softer": Blur(input: "soft", radius: 1.5),
    "both": "= noise + softer",
    "edges": "= soft - softer",
  },
  outputs: { "bumps": "both", "mask": "edges" },
)"#;

/// A small graph that uses fields and objects.
pub(crate) const GRAPH: &str = r#"(
  version: 1,
  canvas: (size_mm: 40, resolution: 96, tile: Both, seed: 1),
  params: { "size": Number(default: 5, range: (0.5, 20), unit: "mm", doc: "Size of the bumps") },
  presets: { "large": { "size": 15 } },
  nodes: {
    "bumps": Perlin(size: "$size"),
    "points": PoissonPoints(pitch: 4),
    "links": ConnectNeighbors(points: "points"),
    "springs": DefineSprings(lattice: "links", field: "bumps", stiffness: (1, 10)),
    "moved": SimulateSprings(springs: "springs", step: 0.1, steps: 20, drag: 4, boundary: Periodic),
    "wrinkles": PlaceWrinkles(lattice: "moved"),
    "strokes": DrawWrinkles(segments: "wrinkles", width: (0.5, 1)),
  },
  outputs: { "bumps": "bumps", "mask": "strokes.mask" },
)
"#;

/// A number as `dump` prints it.
pub(crate) fn number(v: &Json) -> f64 {
    v.as_f64().unwrap_or_else(|| if v == "inf" { f64::INFINITY } else { panic!("{v}") })
}

/// Exit code and output of a run.
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Ran {
    /// Fails unless the exit code is `code`.
    #[track_caller]
    pub(crate) fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }

    /// Stdout as one JSON value.
    #[track_caller]
    pub(crate) fn json(&self) -> Json {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {}\n{}", self.stdout, self.stderr))
    }
}

/// A folder to work in.
pub(crate) struct Desk {
    dir: tempfile::TempDir,
}

impl Desk {
    /// An empty folder.
    pub(crate) fn new() -> Self {
        Self { dir: tempfile::tempdir().unwrap() }
    }

    /// A folder with the small graph as `a.ron`.
    pub(crate) fn with_graph() -> Self {
        let desk = Self::new();
        desk.write("a.ron", GRAPH);
        desk
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The names in a folder, including hidden ones.
    pub(crate) fn names(&self, dir: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(dir)).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The command, with this folder as its home and a cache of its own.
    pub(crate) fn command<A: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = A>) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("shibo"));
        command.current_dir(self.dir.path()).args(args).stdin(Stdio::null());
        command.env("XDG_CACHE_HOME", self.path("cache")).env_remove("NO_COLOR");
        command
    }

    pub(crate) fn run<A: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = A>) -> Ran {
        finish(self.command(args))
    }

    /// Runs a command line whose words contain no blanks.
    pub(crate) fn shibo(&self, line: &str) -> Ran {
        self.run(line.split_whitespace())
    }
}

/// Runs a command to its end.
pub(crate) fn finish(mut command: Command) -> Ran {
    let output = command.output().unwrap();
    Ran {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// The samples of a picture, by rows, with its width.
pub(crate) fn samples(path: &Path) -> (usize, Vec<[u16; 4]>) {
    let picture = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).to_rgba16();
    (picture.width() as usize, picture.pixels().map(|p| p.0).collect())
}
