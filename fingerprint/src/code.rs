//! The part of a source file that can change results: its tokens without comments and tests.
use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::iter::Peekable;

/// The words that begin an item. An attribute `#[cfg(test)]` before anything else (a field, a statement) is kept as code.
const ITEMS: [&str; 13] =
    ["mod", "fn", "use", "impl", "struct", "enum", "const", "static", "type", "trait", "pub", "unsafe", "async"];

/// A file as the fingerprint sees it.
#[derive(Default)]
pub(crate) struct Code {
    /// The bytes to hash: tokens divided by line feeds, or the bytes of a file that is not Rust.
    pub(crate) content: Vec<u8>,
    /// Modules in files of their own that exist in tests alone: their paths within the sources, without `.rs`.
    pub(crate) test_modules: Vec<String>,
}

impl Code {
    /// Reads the file `name`, a path within the sources.
    pub(crate) fn read(name: &str, content: Vec<u8>) -> Self {
        let tokens = name.ends_with(".rs").then(|| std::str::from_utf8(&content).ok()?.parse::<TokenStream>().ok());
        let Some(tokens) = tokens.flatten() else {
            return Self { content, test_modules: Vec::new() };
        };
        let mut code = Self::default();
        code.take(name, tokens);
        code
    }

    fn take(&mut self, file: &str, tokens: TokenStream) {
        let mut tokens = tokens.into_iter().peekable();
        while let Some(token) = tokens.next() {
            if is(&token, '#') {
                let mut ahead = tokens.clone();
                // Comments that document a whole file are `#![doc = "…"]`.
                ahead.next_if(|token| is(token, '!'));
                let attribute = attribute(ahead.next().as_ref()).unwrap_or_default();
                let skipped = match attribute.as_str() {
                    doc if doc.starts_with("doc=") => Some(None),
                    "cfg(test)" => skip_item(file, &mut ahead),
                    _ => None,
                };
                if let Some(module) = skipped {
                    self.test_modules.extend(module);
                    tokens = ahead;
                    continue;
                }
            }
            self.token(file, token);
        }
    }

    fn token(&mut self, file: &str, token: TokenTree) {
        match token {
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Brace => ("{", "}"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::None => ("", ""),
                };
                self.line(open);
                self.take(file, group.stream());
                self.line(close);
            }
            // `= =` differs from `==`.
            TokenTree::Punct(punct) => self.line(&format!("{}{:?}", punct.as_char(), punct.spacing())),
            token => self.line(&token.to_string()),
        }
    }

    fn line(&mut self, text: &str) {
        self.content.extend_from_slice(text.as_bytes());
        self.content.push(b'\n');
    }
}

/// True if the file `name` belongs to the module at `module`, a path without `.rs`.
pub(crate) fn within(name: &str, module: &str) -> bool {
    name.strip_prefix(module).is_some_and(|rest| rest == ".rs" || rest.starts_with('/'))
}

fn is(token: &TokenTree, mark: char) -> bool {
    matches!(token, TokenTree::Punct(punct) if punct.as_char() == mark)
}

/// The text of an attribute without its brackets and without spaces, if this token is one.
fn attribute(token: Option<&TokenTree>) -> Option<String> {
    match token {
        Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Bracket => {
            Some(group.stream().into_iter().map(|token| token.to_string().replace(' ', "")).collect())
        }
        _ => None,
    }
}

/// Skips the item after `#[cfg(test)]`. Returns the path of the module's file if it has one, or `None` if no item follows.
fn skip_item(file: &str, tokens: &mut Peekable<impl Iterator<Item = TokenTree>>) -> Option<Option<String>> {
    let mut path = None;
    while tokens.peek().is_some_and(|token| is(token, '#')) {
        tokens.next();
        let attribute = attribute(tokens.next().as_ref())?;
        path = path.or_else(|| Some(attribute.strip_prefix("path=")?.trim_matches('"').to_owned()));
    }
    let begins = matches!(tokens.peek(), Some(TokenTree::Ident(word)) if ITEMS.contains(&word.to_string().as_str()));
    if !begins {
        return None;
    }
    let mut module = None;
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Ident(word) if word == "mod" => module = tokens.peek().map(ToString::to_string),
            token if is(&token, ';') => {
                return Some(module.map(|module| module_path(file, &module, path.as_deref())));
            }
            TokenTree::Group(group) if group.delimiter() == Delimiter::Brace => {
                tokens.next_if(|token| is(token, ';'));
                return Some(None);
            }
            _ => {}
        }
    }
    Some(None)
}

/// The path of the module `name` that `file` declares, without `.rs`; `path` is the text of its attribute `path`.
fn module_path(file: &str, name: &str, path: Option<&str>) -> String {
    let (folder, last) = file.rsplit_once('/').map_or(("", file), |(folder, last)| (folder, last));
    let join = |folder: &str, name: &str| if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") };
    match (path, last) {
        (Some(path), _) => join(folder, path.trim_end_matches(".rs")),
        (None, "mod.rs" | "lib.rs" | "main.rs") => join(folder, name),
        (None, _) => join(file.trim_end_matches(".rs"), name),
    }
}
