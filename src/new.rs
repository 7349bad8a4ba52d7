//! `shibo new`: a commented graph file to start from.
use crate::library;
use crate::quit::Quit;
use crate::templates::TEMPLATES;
use crate::terminal::{Style, Terminal};
use clap::Args;
use shibo_ide::actions::pinned;
use shibo_value::diagnostics::suggest;
use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo new                            list the templates
  shibo new --list                     also list the graphs that others can import
  shibo new calf --from leather        make calf.ron
  shibo new wood --from walnut         a copy of a graph that comes with the program, to change

The graph is pinned: later versions of nodes leave its picture alone (`shibo pin`).";

/// Make a commented graph file to start from.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct NewArgs {
    /// The graph file to make; `.ron` is added if it is missing. Nothing is ever overwritten.
    name: Option<PathBuf>,
    /// The template, or the graph of `--list`, to start from; without it, the templates are listed.
    #[arg(long, value_name = "TEMPLATE", requires = "name")]
    from: Option<String>,
    /// List the graphs that come with the program: templates, materials and sub-graphs.
    #[arg(long, conflicts_with_all = ["name", "from"])]
    list: bool,
    /// Write no pin: the graph follows the newest versions of its nodes.
    #[arg(long)]
    no_pin: bool,
}

/// Runs the command.
pub(crate) fn run(args: &NewArgs, terminal: &Terminal) -> Result<(), Quit> {
    if args.list {
        return everything(terminal);
    }
    let Some(from) = &args.from else { return list(args, terminal) };
    let text = text(from)?;
    let newest = Some(library::registry().changes().newest()).filter(|_| !args.no_pin);
    let text = newest.and_then(|newest| pinned(&text, Some(newest))).unwrap_or(text);
    let Some(path) = args.name.as_deref().and_then(file) else {
        return Err(Quit::Usage("the name of the graph file is missing".to_owned()));
    };
    create(&path, &text).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists => Quit::failed(format!("`{}` exists already; it was left alone", path.display())),
        _ => Quit::failed(format!("cannot write `{}`: {e}", path.display())),
    })?;
    terminal.say(&format!("wrote {}", path.display()));
    terminal.say(&format!("now try: shibo render {}", path.display()));
    Ok(())
}

/// Lists the templates. If a name was given without a template, it also says how to make that file.
fn list(args: &NewArgs, terminal: &Terminal) -> Result<(), Quit> {
    let mut page = terminal.page();
    for template in TEMPLATES {
        page.styled(Style::Bold, &format!("{:10}", template.name)).push(template.doc).end();
    }
    terminal.print(&page)?;
    match &args.name {
        None => Ok(()),
        Some(name) => Err(Quit::Usage(format!("say which: `shibo new {} --from TEMPLATE`", name.display()))),
    }
}

/// Lists all graphs of the library.
fn everything(terminal: &Terminal) -> Result<(), Quit> {
    let mut page = terminal.page();
    let graphs = library::graphs();
    let widest = graphs.iter().map(|graph| graph.name.len()).max().unwrap_or(0);
    let mut section = |title: &str, rows: &mut dyn Iterator<Item = (&str, &str)>| {
        page.styled(Style::Bold, title).end();
        for (name, doc) in rows {
            page.push("  ").styled(Style::Accent, &format!("{name:widest$}  ")).push(doc).end();
        }
        page.end();
    };
    section("Templates: shibo new NAME --from TEMPLATE", &mut TEMPLATES.iter().map(|t| (t.name, t.doc)));
    let mut families: BTreeMap<&str, Vec<&library::Graph>> = BTreeMap::new();
    for graph in graphs.iter().filter(|graph| !graph.is_part()) {
        families.entry(graph.family().unwrap_or("others")).or_default().push(graph);
    }
    for (family, members) in families {
        let title = format!("Graphs to render and to import, \"shibo:NAME\": {family}");
        section(&title, &mut members.into_iter().map(|graph| (graph.name, graph.doc())));
    }
    let mut parts = graphs.iter().filter(|graph| graph.is_part()).map(|graph| (graph.name, graph.doc()));
    section("Sub-graphs to import: \"shibo:NAME\"", &mut parts);
    page.push("For example `imports: { \"walnut\": \"shibo:walnut\" }`; `shibo nodes Use` tells more.").end();
    terminal.print(&page)
}

/// Text of a template or library graph. In a copy, imports of files beside the original are written by library name.
fn text(from: &str) -> Result<String, Quit> {
    if let Some(template) = TEMPLATES.iter().find(|t| t.name == from) {
        return Ok(template.text.to_owned());
    }
    let graphs = library::graphs();
    let Some(graph) = graphs.iter().find(|graph| graph.name == from) else {
        let names: Vec<&str> = TEMPLATES.iter().map(|t| t.name).chain(graphs.iter().map(|graph| graph.name)).collect();
        let help = suggest(from, "template", &names);
        return Err(Quit::Usage(format!("there is no template `{from}`; {help}; `shibo new --list` shows all")));
    };
    if ["\"pictures/", "\"meshes/"].iter().any(|folder| graph.text.contains(folder)) {
        let help = format!("import it: `imports: {{ \"{from}\": \"shibo:{from}\" }}`");
        return Err(Quit::Usage(format!("`{from}` reads a file that lies beside it, so it cannot be copied; {help}")));
    }
    let mut text = graph.text.to_owned();
    for known in &graphs {
        let named = format!("\"shibo:{}\"", known.name);
        text = text.replace(&format!("\"{}\"", known.path), &named);
        // Sub-graphs lie in one folder and name each other without it.
        if known.is_part() {
            text = text.replace(&format!("\"{}.ron\"", known.name), &named);
        }
    }
    Ok(text)
}

/// The path with its extension.
fn file(name: &Path) -> Option<PathBuf> {
    let mut file = name.file_name()?.to_os_string();
    if name.extension().is_none_or(|extension| extension != "ron") {
        file.push(".ron");
    }
    Some(name.with_file_name(file))
}

fn create(path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_bytes()).inspect_err(|_| {
        // A partly written file is removed.
        let _ = fs::remove_file(path);
    })
}
