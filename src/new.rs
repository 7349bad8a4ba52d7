//! `shibo new`: a commented graph file to start from.
use crate::quit::Quit;
use crate::templates::{TEMPLATES, Template};
use crate::terminal::{Style, Terminal};
use clap::Args;
use shibo_engine::diagnostics::suggest;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo new                            list the templates
  shibo new calf --from leather        make calf.ron";

/// Make a commented graph file to start from.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct NewArgs {
    /// The graph file to make; `.ron` is added if it is missing. Nothing is ever overwritten.
    name: Option<PathBuf>,
    /// The template to start from; without it, the templates are listed.
    #[arg(long, value_name = "TEMPLATE", requires = "name")]
    from: Option<String>,
}

/// Runs the command.
pub(crate) fn run(args: &NewArgs, terminal: &Terminal) -> Result<(), Quit> {
    let Some(from) = &args.from else { return list(args, terminal) };
    let Some(template) = TEMPLATES.iter().find(|t| t.name == from) else {
        let names: Vec<&str> = TEMPLATES.iter().map(|t| t.name).collect();
        return Err(Quit::Usage(format!("there is no template `{from}`; {}", suggest(from, "template", &names))));
    };
    let Some(path) = args.name.as_deref().and_then(file) else {
        return Err(Quit::Usage("the name of the graph file is missing".to_owned()));
    };
    create(&path, template).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists => Quit::failed(format!("`{}` exists already; it was left alone", path.display())),
        _ => Quit::failed(format!("cannot write `{}`: {e}", path.display())),
    })?;
    terminal.say(&format!("wrote {}", path.display()));
    terminal.say(&format!("now try: shibo render {}", path.display()));
    Ok(())
}

/// Lists the templates. If a name was given, but no template, it also says how to make that file.
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

/// The path with its extension.
fn file(name: &Path) -> Option<PathBuf> {
    let mut file = name.file_name()?.to_os_string();
    if name.extension().is_none_or(|extension| extension != "ron") {
        file.push(".ron");
    }
    Some(name.with_file_name(file))
}

fn create(path: &Path, template: &Template) -> std::io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(template.text.as_bytes()).inspect_err(|_| {
        // A file that could be written only in part is removed.
        let _ = fs::remove_file(path);
    })
}
