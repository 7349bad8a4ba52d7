//! Fixes of lost or extra brackets, commas, colons and quotes: each place where one may stand is tried.
use super::super::diagnose::Finding;
use super::super::format::is_laid_out;
use super::super::rename::{Edit, apply};
use super::super::world::Cx;
use super::budget::Budget;
use super::{Applies, Fix, mistakes};
use shibo_graph::syntax::{Token, TokenKind};
use std::ops::Range;

/// Most places that are read for one finding.
const PLACES: usize = 400;
/// Most texts that are checked for one finding.
const TRIED: usize = 10;
/// Lines above a mistake in which a bracket may be lost.
const LINES: usize = 6;
/// Longest text in bytes whose places are tried; each is read as a whole.
const LONGEST: usize = 100_000;

/// Inserts or removes a sign, where that leaves the fewest mistakes.
pub(super) fn fixes(cx: Cx<'_>, finding: &Finding, budget: &mut Budget) -> Vec<Fix> {
    let text = &cx.file.text;
    if text.len() > LONGEST {
        return Vec::new();
    }
    let (before, most) = (cx.file.tree.errors().len(), budget.places(text.len()));
    // Mistakes left, untidy, not at the end of a line, rank.
    let mut found: Vec<(usize, bool, bool, usize, Edit)> = Vec::new();
    for (rank, edit) in candidates(cx, finding).into_iter().take(PLACES).enumerate() {
        if rank >= most || !budget.parse(text.len()) {
            budget.end();
            break;
        }
        let edited = apply(text, std::slice::from_ref(&edit));
        let left = mistakes(&edited);
        // The layout is made for places that help.
        if left < before && budget.parse(2 * text.len()) {
            let rest = text[edit.range.end..].trim_start_matches([',', ' ']);
            found.push((left, !is_laid_out(&edited), !rest.starts_with(['\n', '\r']), rank, edit));
        }
    }
    let fewest = found.iter().map(|(left, ..)| *left).min().unwrap_or_default();
    found.retain(|(left, ..)| *left == fewest);
    found.sort_by_key(|(left, untidy, inside, rank, _)| (*left, *untidy, *inside, *rank));
    let tidy = found.iter().filter(|(_, untidy, ..)| !untidy).count();
    let is_sole = tidy == 1 || found.len() == 1;
    let level = |index: usize| if index == 0 && is_sole { Applies::Sure } else { Applies::Likely };
    let fix = |(index, (.., edit)): (usize, (usize, bool, bool, usize, Edit))| {
        let title = match edit.text.trim() {
            "" => format!("Remove `{}`", cx.file.at(&edit.range)),
            sign => format!("Insert `{sign}`"),
        };
        Fix::new(title, level(index), vec![edit])
    };
    found.into_iter().take(TRIED).enumerate().map(fix).collect()
}

/// Edits that may mend a mistake, the most likely first.
fn candidates(cx: Cx<'_>, finding: &Finding) -> Vec<Edit> {
    let (text, tokens) = (&cx.file.text, cx.file.tree.tokens());
    let here = tokens.partition_point(|token| token.end() <= finding.range.start);
    let line = line_of(text, finding.range.start);
    let before = tokens[..here].last().map_or(0, |token| token.end());
    let insert = |at: usize, sign: &str| Edit { range: at..at, text: sign.to_owned() };
    let mut found = Vec::new();
    if text[line.clone()].matches('"').count() % 2 == 1 {
        found.extend(quote_places(text, &line).into_iter().map(|at| insert(at, "\"")));
        found.extend(quotes(text, &line).map(|at| Edit { range: at..at + 1, text: String::new() }));
    }
    found.push(insert(before, ","));
    found.push(insert(before, ":"));
    if let Some(token) = tokens.get(here).filter(|token| {
        matches!(
            token.kind(),
            TokenKind::Comma | TokenKind::Close | TokenKind::Open | TokenKind::Other | TokenKind::Colon
        )
    }) {
        found.push(Edit { range: token.range(), text: String::new() });
        if token.kind() == TokenKind::Close {
            // The wrong closing bracket.
            found.extend([")", "}", "]"].map(|close| Edit { range: token.range(), text: close.to_owned() }));
        }
    }
    // The finding, and the bracket that it is about.
    let bracket = finding.related.first().map(|(_, range, _)| range.start);
    let above = text[..line.start].rmatch_indices('\n').nth(LINES).map_or(0, |(newline, _)| newline + 1);
    let start = bracket.map_or(above, |bracket| bracket.min(above));
    let first = tokens.partition_point(|token| token.start() < start);
    let last = tokens.partition_point(|token| token.start() < line.end).max(here);
    let near = &tokens[first.max(last.saturating_sub(PLACES / 3))..last];
    let balance = balance(text, tokens);
    if let (Some(token), true) = (near.first(), first == 0) {
        let opens = balance.iter().filter(|(.., more)| *more < 0);
        found.extend(opens.map(|(open, ..)| insert(token.start(), open)));
    }
    for (index, token) in near.iter().enumerate().rev() {
        for (open, close, more) in balance {
            // Closing brackets stand behind values.
            if more > 0 && token.kind() != TokenKind::Colon {
                found.push(insert(token.end(), close));
                let next = near.get(index + 1).map(|next| next.start());
                let blank = next.and_then(|next| text.get(token.end()..next));
                // `3 ,` becomes `3 },`.
                if let (Some(next), Some(" ")) = (next, blank) {
                    found.push(insert(next, close));
                }
            }
            if more < 0
                && matches!(
                    token.kind(),
                    TokenKind::Ident
                        | TokenKind::Str
                        | TokenKind::Number
                        | TokenKind::Colon
                        | TokenKind::Open
                        | TokenKind::Comma
                )
            {
                if open == "(" && token.kind() == TokenKind::Ident {
                    // `Perlinsize` becomes `Perlin(size`.
                    found.extend(torn(cx, token.range()).map(|at| insert(at, open)));
                }
                let next = near.get(index + 1);
                let below = next.filter(|next| text[token.end()..next.start()].contains('\n'));
                if let (Some(next), TokenKind::Open | TokenKind::Comma) = (below, token.kind()) {
                    // An element that begins a line.
                    found.push(insert(next.start(), open));
                }
                found.push(match next.filter(|_| below.is_none()) {
                    // `Kind field` becomes `Kind(field`.
                    Some(next) if token.kind() == TokenKind::Ident => {
                        Edit { range: token.end()..next.start(), text: open.to_owned() }
                    }
                    Some(next) => Edit { range: next.start()..next.start(), text: open.to_owned() },
                    None => insert(token.end(), &format!(" {open}")),
                });
            }
        }
    }
    found
}

/// Words before brackets that are no kinds of nodes.
const CALLED: [&str; 11] =
    ["Use", "Each", "Number", "Integer", "Color", "Choice", "Switch", "Text", "File", "Gltf", "Usd"];

/// The places behind kinds that begin a word, the longest kind first.
fn torn(cx: Cx<'_>, word: Range<usize>) -> impl Iterator<Item = usize> {
    let says = cx.file.at(&word);
    let known = cx.registry().kinds().chain(CALLED).filter(|kind| says.len() > kind.len() && says.starts_with(kind));
    let mut ends: Vec<usize> = known.map(|kind| word.start + kind.len()).collect();
    ends.sort_unstable_by(|a, b| b.cmp(a));
    ends.into_iter()
}

/// The number of opening brackets without a closing one, of each sort.
fn balance(text: &str, tokens: &[Token]) -> [(&'static str, &'static str, isize); 3] {
    let mut counts = [("(", ")", 0), ("{", "}", 0), ("[", "]", 0)];
    for token in tokens {
        let says = &text[token.range()];
        for (open, close, more) in &mut counts {
            *more += isize::from(says == *open) - isize::from(says == *close);
        }
    }
    counts
}

fn line_of(text: &str, at: usize) -> Range<usize> {
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    start..text[at..].find('\n').map_or(text.len(), |newline| at + newline)
}

fn quotes(text: &str, line: &Range<usize>) -> impl Iterator<Item = usize> {
    let start = line.start;
    text[line.clone()].match_indices('"').map(move |(at, _)| start + at)
}

/// Places where a quote may stand: at both ends of each word, and before signs that end a text.
fn quote_places(text: &str, line: &Range<usize>) -> Vec<usize> {
    let says = &text[line.clone()];
    let is_inside = |c: char| c == '_' || c == '.' || c == '/' || c == '-' || c.is_alphanumeric();
    let mut found = Vec::new();
    let mut before = ' ';
    for (at, c) in says.char_indices().chain([(says.len(), '\n')]) {
        let begins = (is_inside(c) || matches!(c, '$' | '#' | '=')) && !is_inside(before);
        let next = says[at..].trim_start().chars().next().unwrap_or('\n');
        let is_end = matches!(c, ':' | ',' | '\n') || matches!(next, ')' | ']' | '}');
        let ends = is_end && !is_inside(c) && !before.is_whitespace();
        if (begins || ends) && before != '"' && c != '"' {
            found.push(line.start + at);
        }
        before = c;
    }
    found
}
