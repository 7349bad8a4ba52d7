//! Pictures change only with a line in library/changes.ron. Source: LASTING §1, *The rule*.
//!
//! `tests/golden/digests.ron` has the digests of small pictures: of every kind with several settings, and of every shipped
//! graph. Each belongs to the last change that alters the picture. `BLESS=1 cargo test --release --test shipped changes`
//! adds digests for new kinds, graphs and changes. It never replaces one.
use crate::bless;
use serde::{Deserialize, Serialize};
use shibo_bridge::lock::{PIXELS, RESOLUTION, bits_of, sample};
use shibo_contract::kinds::{STAND_INS, another, arguments, it, options};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Session, Settings};
use shibo_graph::{Graph, LoadOptions, load, load_text};
use shibo_node::changes::{Change, Changes, Look, Thing, Touches};
use shibo_node::registry::Registry;
use shibo_node::{KindInfo, ParamInfo, ParamType, Role};
use shibo_value::Key;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Settings of a kind besides its defaults.
const SETTINGS: u64 = 6;

/// Digests by the number of the change since which they are right.
type Since<T> = BTreeMap<u32, T>;

/// The file.
#[derive(Default, Serialize, Deserialize)]
struct Digests {
    /// The version of each kind when the table began, or when the kind was added.
    versions: BTreeMap<String, u32>,
    /// The digests of each kind by its arguments.
    kinds: BTreeMap<String, BTreeMap<String, Since<String>>>,
    /// The digests of the outputs of each shipped graph.
    graphs: BTreeMap<String, Since<BTreeMap<String, String>>>,
}

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

impl Digests {
    fn path() -> PathBuf {
        root("tests/golden/digests.ron")
    }

    fn read() -> Self {
        let text =
            std::fs::read_to_string(Self::path()).unwrap_or_else(|_| "(versions: {}, kinds: {}, graphs: {})".into());
        shibo_node::ron_options().from_str(&text).unwrap()
    }

    /// The text of the file: sorted, with a line for each picture.
    fn written(&self) -> String {
        let mut out = String::from(
            "// Digests of pictures, see tests/shipped/changes.rs. Lines are only added.\n(\n    versions: {\n",
        );
        self.versions.iter().for_each(|(kind, version)| out += &format!("        {kind:?}: {version},\n"));
        out += "    },\n    kinds: {\n";
        for (kind, settings) in &self.kinds {
            out += &format!("        {kind:?}: {{\n");
            for (args, since) in settings {
                let since: Vec<String> = since.iter().map(|(change, bits)| format!("{change}: {bits:?}")).collect();
                out += &format!("            {args:?}: {{ {} }},\n", since.join(", "));
            }
            out += "        },\n";
        }
        out += "    },\n    graphs: {\n";
        for (graph, since) in &self.graphs {
            out += &format!("        {graph:?}: {{\n");
            for (change, outputs) in since {
                out += &format!("            {change}: {{\n");
                outputs.iter().for_each(|(name, bits)| out += &format!("                {name:?}: {bits:?},\n"));
                out += "            },\n";
            }
            out += "        },\n";
        }
        out + "    },\n)\n"
    }
}

/// The rule, with the kinds, the table and the digests that it compares.
struct Rule {
    session: Session,
    registry: Arc<Registry>,
    digests: Mutex<Digests>,
    problems: Mutex<Vec<String>>,
}

impl Rule {
    fn changes(&self) -> &Changes {
        self.registry.changes()
    }

    fn complain(&self, problem: String) {
        self.problems.lock().unwrap().push(problem);
    }

    /// The last change that alters a graph.
    fn since(&self, graph: &Graph, name: Option<&str>) -> u32 {
        let own = |thing: Thing<'_>| name.is_some_and(|name| thing == Thing::Graph(name));
        let altering =
            self.changes().since(0).filter(|line| own(line.thing()) || graph.altered_by(line).next().is_some());
        altering.last().map_or(0, |line| line.change)
    }

    /// Compares digests with those of the file; adds them if there are none and `BLESS=1` is set.
    fn compare<T: Clone + PartialEq>(&self, name: &str, known: &mut Since<T>, since: u32, made: T, remedy: &str) {
        match known.get(&since) {
            Some(digest) if *digest == made => {}
            Some(_) => self.complain(format!("the picture of {name} changed: {remedy}")),
            None if bless::blessing() => {
                known.insert(since, made);
            }
            None => self.complain(format!("{name} has no digest of change {since}: BLESS=1 adds it")),
        }
    }

    /// The version of a kind follows from the table.
    fn check_version(&self, info: &KindInfo) {
        let lines = self.changes().since(0).filter(|line| line.thing() == Thing::Kind(&info.kind)).count();
        let lines = u32::try_from(lines).unwrap();
        let mut digests = self.digests.lock().unwrap();
        let first = if bless::blessing() { info.version - lines } else { 0 };
        let begun = digests.versions.entry(info.kind.clone()).or_insert(first);
        let expected = *begun + lines;
        if *begun == 0 {
            self.complain(format!("`{}` has no version in the file: BLESS=1 adds it", info.kind));
        } else if info.version != expected {
            let (kind, version) = (&info.kind, info.version);
            self.complain(format!("`{kind}` has version {version}, but library/changes.ron says {expected}"));
        }
    }

    /// A graph whose node `it` is of a kind, held at a version.
    fn graph_of(&self, info: &KindInfo, args: &str, version: u32) -> Result<Graph, String> {
        let (kind, newest) = (&info.kind, self.changes().newest());
        self.graph_with(info, args, &format!("(change: {newest}, hold: {{ {kind:?}: {version} }})"))
    }

    /// A graph with pins whose node `it` is of a kind.
    fn graph_with(&self, info: &KindInfo, args: &str, pins: &str) -> Result<Graph, String> {
        let (first, nodes) = arguments(&self.registry, info, None)?;
        // A port or a parameter that the kind needs is not written twice.
        let given = |arg: &&str| !args.contains(&format!("{}:", arg.split(':').next().unwrap_or_default()));
        let first: Vec<&str> = split(&first).into_iter().filter(given).collect();
        let all: Vec<&str> = first.into_iter().chain([args]).filter(|part| !part.is_empty()).collect();
        self.load(&format!(
            "(pins: {pins}, canvas: (size_mm: 16, resolution: {PIXELS}, seed: 3), nodes: {{ {STAND_INS} {nodes} \"it\": {}({}) }})",
            info.kind,
            all.join(", ")
        ))
    }

    fn load(&self, text: &str) -> Result<Graph, String> {
        let loaded = load_text(&root("contract.ron"), text, &self.registry, &options(glam::UVec2::splat(PIXELS)));
        let errors: Vec<&str> = loaded.diagnostics.iter().filter(|d| !d.warning).map(|d| d.message.as_str()).collect();
        loaded.graph.ok_or_else(|| errors.join("; "))
    }

    /// Settings by hash: arguments that the kind accepts.
    fn settings(&self, info: &KindInfo) -> Vec<String> {
        let params = info.fields.iter().filter_map(|field| match &field.role {
            Role::Param(param) => Some((&field.name, others(param))),
            Role::Port(_) => None,
        });
        let params: Vec<(&String, Vec<String>)> = params.filter(|(_, values)| !values.is_empty()).collect();
        let chosen = |number: u64, attempt: u64| {
            let taken = params.iter().filter_map(|(name, values)| {
                let key = Key::of("setting", &[name.as_bytes(), &number.to_le_bytes(), &attempt.to_le_bytes()]);
                let [taken, which, ..] = *key.as_bytes();
                (taken % 2 == 0).then(|| format!("{name}: {}", values[usize::from(which) % values.len()]))
            });
            taken.collect::<Vec<_>>().join(", ")
        };
        let mut settings = vec![String::new()];
        for number in 0..SETTINGS {
            let works = |graph: Graph| bits_of(&self.session, &graph, it(&graph)).is_ok();
            let good =
                |args: &String| !settings.contains(args) && self.graph_of(info, args, info.version).is_ok_and(works);
            settings.extend((0..8).map(|attempt| chosen(number, attempt)).find(good));
        }
        settings
    }

    fn check_kind(&self, info: &KindInfo) {
        let kind = &info.kind;
        self.check_version(info);
        let mut known = self.digests.lock().unwrap().kinds.get(kind).cloned().unwrap_or_default();
        if !known.contains_key("") {
            self.settings(info).into_iter().for_each(|args| drop(known.insert(args, Since::default())));
        }
        let versions = (1..info.version).filter(|version| self.registry.has_kept(kind, *version)).chain([info.version]);
        for version in versions {
            for (args, since) in known.iter_mut().filter(|(args, _)| !args.starts_with("example ")) {
                let name = format!("`{kind}({args})` of version {version}");
                let remedy = format!("raise VERSION to {} and add a line to library/changes.ron", info.version + 1);
                match self.graph_of(info, args, version) {
                    Ok(graph) => match bits_of(&self.session, &graph, it(&graph)) {
                        Ok(bits) => self.compare(&name, since, self.since(&graph, None), bits, &remedy),
                        Err(error) => self.complain(format!("{name}: {error:?}")),
                    },
                    Err(error) if version == info.version => self.complain(format!("{name}: {error}")),
                    // An earlier version may not have the field.
                    Err(_) => {}
                }
            }
        }
        self.check_example(info, &mut known);
        self.digests.lock().unwrap().kinds.insert(kind.clone(), known);
    }

    /// The example of the manual; another text is another example.
    fn check_example(&self, info: &KindInfo, known: &mut BTreeMap<String, Since<String>>) {
        let block = info.doc.split("```ron\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap_or_default();
        let text = format!("(canvas: (size_mm: 40, resolution: {PIXELS}, tile: Both, seed: 1), nodes: {{ {block} }})");
        let path = root("library/examples/example.ron");
        let options = LoadOptions { working_dir: root("library/examples"), ..LoadOptions::default() };
        let Some(graph) = load_text(&path, &text, &self.registry, &options).graph else { return };
        let Some(node) = graph.nodes.node_indices().find(|node| graph.nodes[*node].name == "example") else { return };
        let name = format!("example {}", &Key::of("example", &[text.as_bytes()]).to_string()[..16]);
        match bits_of(&self.session, &graph, node) {
            Ok(bits) => {
                let known = known.entry(name).or_default();
                let remedy = format!("raise its VERSION to {} and add a line to library/changes.ron", info.version + 1);
                self.compare(
                    &format!("the example of `{}`", info.kind),
                    known,
                    self.since(&graph, None),
                    bits,
                    &remedy,
                );
            }
            Err(error) => self.complain(format!("{}: {error:?}", info.kind)),
        }
    }

    fn check_graph(&self, path: &Path) {
        let name = path.strip_prefix(root("graphs")).unwrap().with_extension("").display().to_string();
        let options = LoadOptions { resolution: Some(RESOLUTION), ..LoadOptions::default() };
        let graph = load(path, &self.registry, &options).graph.unwrap();
        let samples = match sample(&self.session, &graph, &CancelToken::default()) {
            Ok(samples) => samples,
            Err(error) => return self.complain(format!("{name}: {error:?}")),
        };
        let bits = samples.into_iter().map(|(name, sample)| (name, sample.bits)).collect();
        let mut known = self.digests.lock().unwrap().graphs.get(&name).cloned().unwrap_or_default();
        let remedy = format!("add a line `graph: {name:?}` to library/changes.ron, or let the line of a kind touch it");
        self.compare(&format!("shibo:{name}"), &mut known, self.since(&graph, Some(&name)), bits, &remedy);
        self.digests.lock().unwrap().graphs.insert(name, known);
    }
}

/// Values of a parameter other than its default: all choices, or one value.
fn others(param: &ParamInfo) -> Vec<String> {
    let choices = param.choices.iter().filter(|choice| !choice.has_arguments && choice.name != param.written);
    match param.ty {
        ParamType::Choice => choices.map(|choice| choice.name.clone()).collect(),
        _ => another(param).into_iter().collect(),
    }
}

/// Arguments, split at the commas between them.
fn split(args: &str) -> Vec<&str> {
    let (mut depth, mut from, mut parts) = (0_i32, 0, Vec::new());
    for (at, c) in args.char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(args[from..at].trim());
                from = at + 1;
            }
            _ => {}
        }
    }
    parts.push(args[from..].trim());
    parts
}

/// The rule with these digests.
fn rule(digests: Digests) -> Rule {
    let registry = Arc::new(shibo_library::registry());
    let session = Session::new(registry.clone(), &Settings { threads: 2, ..Settings::default() }).unwrap();
    Rule { session, registry, digests: Mutex::new(digests), problems: Mutex::default() }
}

#[test]
fn changes_of_pictures_have_a_line_in_the_table() {
    let rule = rule(Digests::read());
    let kinds: Vec<String> = rule.registry.kinds().map(str::to_owned).collect();
    let left = Mutex::new(kinds.iter());
    let graphs = crate::graphs::shipped();
    let left_graphs = Mutex::new(graphs.iter());
    let work = || {
        while let Some(kind) = { left.lock().unwrap().next() } {
            rule.check_kind(rule.registry.info(kind).unwrap());
        }
        while let Some(path) = { left_graphs.lock().unwrap().next() } {
            rule.check_graph(path);
        }
    };
    // Two at a time, because a small picture mostly uses one thread.
    std::thread::scope(|scope| [(); 2].map(|()| scope.spawn(work)).map(|worker| worker.join().unwrap()));
    let (digests, mut problems) = (rule.digests.into_inner().unwrap(), rule.problems.into_inner().unwrap());
    problems.sort();
    if problems.is_empty() {
        // Nothing is replaced, so that the file only grows.
        problems.extend(bless::compare(&Digests::path(), digests.written().as_bytes()).err());
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn another_picture_asks_for_a_version_and_a_line() {
    let mut digests = Digests::read();
    let since = digests.kinds.get_mut("Perlin").unwrap().get_mut("").unwrap();
    *since.last_entry().unwrap().get_mut() = "0".repeat(16);
    digests.versions.insert("Simplex".to_owned(), 7);
    let rule = rule(digests);
    for kind in ["Perlin", "Simplex", "ValueNoise"] {
        rule.check_kind(rule.registry.info(kind).unwrap());
    }
    let problems = rule.problems.into_inner().unwrap().join("\n");
    let expected = "the picture of `Perlin()` of version 1 changed: raise VERSION to 2 and add a line to library/changes.ron\n\
                    `Simplex` has version 1, but library/changes.ron says 7";
    assert_eq!(problems, expected);
}

/// The message about a version that the program does not have.
const GONE: &str = " is not in this program any more";

/// A graph that is pinned at any change so far has the picture of that change, or is refused by name.
#[test]
fn pinned_kinds_have_the_pictures_of_their_change_or_are_refused() {
    let rule = rule(Digests::read());
    let digests = rule.digests.lock().unwrap();
    let (mut same, mut refused) = (0, 0);
    let kinds: BTreeSet<&str> = rule.changes().since(0).filter_map(|line| line.kind.as_deref()).collect();
    for kind in kinds {
        let info = rule.registry.info(kind).unwrap();
        let lines = rule.changes().since(0).filter(|line| line.thing() == Thing::Kind(kind));
        let pins: BTreeSet<u32> = lines.flat_map(|line| [line.change - 1, line.change]).collect();
        for (args, since) in digests.kinds[kind].iter().filter(|(args, _)| !args.starts_with("example ")) {
            for change in &pins {
                let place = format!("`{kind}({args})` pinned at change {change}");
                let graph = match rule.graph_with(info, args, &change.to_string()) {
                    Ok(graph) => graph,
                    Err(error) => {
                        assert!(
                            error.contains(&format!("`{kind}` of version ")) && error.contains(GONE),
                            "{place}: {error}"
                        );
                        refused += 1;
                        continue;
                    }
                };
                let altering = |line: &&Change| line.look == Look::Look && graph.altered_by(line).next().is_some();
                assert_eq!(rule.changes().since(*change).find(altering), None, "{place} has a newer look");
                let bits = bits_of(&rule.session, &graph, it(&graph)).unwrap();
                assert_eq!(since.get(&rule.since(&graph, None)), Some(&bits), "{place}");
                same += 1;
            }
        }
    }
    assert!(same > 20 && refused > 0, "{same} the same, {refused} refused");
}

/// The program has no earlier texts of shipped graphs.
#[test]
fn shipped_graphs_of_an_earlier_change_are_refused() {
    let rule = rule(Digests::read());
    let mut refused = 0;
    for graph in shibo_library::graphs() {
        let name = graph.path.strip_suffix(".ron").unwrap();
        let uses = |change: u32| {
            let import = format!("imports: {{ \"it\": \"shibo:{}\" }}", graph.name);
            let loaded = rule.load(&format!("(pins: {change}, {import}, nodes: {{ \"it\": Use(graph: \"it\") }})"));
            loaded.err().filter(|error| error.contains(GONE))
        };
        assert_eq!(uses(rule.changes().newest()), None, "{name}");
        let mine = |line: &&Change| line.thing() == Thing::Graph(name) && line.look == Look::Look;
        for line in rule.changes().since(0).filter(mine).filter(|line| line.touches == Touches::All) {
            let error =
                uses(line.change - 1).unwrap_or_else(|| panic!("{name} has a newer look than change {}", line.change));
            assert!(
                error.contains(&format!("`shibo:{}` of version {}{GONE}", graph.name, line.version - 1)),
                "{error}"
            );
            refused += 1;
        }
    }
    assert!(refused > 50, "{refused}");
}
