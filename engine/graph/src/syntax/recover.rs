//! The content of brackets, and recovery after mistakes.
use super::fault::SyntaxError;
use super::lex::TokenKind::{self, Close, Colon, Comma, Ident, Number, Open, Str};
use super::nodes::NodeKind;
use super::parse::{BracketBlock, Parser};

/// Indentation beyond this many columns is ignored.
const WIDE: usize = 1000;

/// The longest list, in tokens, that is recognized without its opening bracket.
const LONGEST_LIST: usize = 100;

/// The help for an `=` in place of a colon.
const EQUALS: &str = "write `name: value`, with a colon";

impl Parser<'_> {
    /// Parses the content of a bracket that ends before the token `end`, or earlier if it has no partner.
    pub(super) fn items(&mut self, block: BracketBlock, end: usize) {
        while self.at < end && !self.is_over(block) {
            match self.kind() {
                Some(Close) => self.stray(),
                Some(Comma) => self.lonely_commas(end),
                _ => {
                    let first = self.nodes.len();
                    match (block.kind, block.named) {
                        (NodeKind::Map, _) => self.entry(block, end),
                        (_, true) => self.field(block, end),
                        _ => {
                            self.value(end);
                            self.strays(end);
                            if self.is_garbage(block, end) {
                                self.garbage(first, block, end);
                            }
                        }
                    }
                    self.separator(block, end);
                }
            }
        }
    }

    /// Returns true if the fields of a bracket have names, judged by the first field.
    pub(super) fn begins_named(&self, end: usize) -> bool {
        let kind = |i: usize| self.kind_of(self.at + i).filter(|_| self.at + i < end);
        match (kind(0), kind(1)) {
            (Some(Ident | Str), Some(Colon)) | (Some(Colon), _) => true,
            (Some(Ident), Some(Number | Str | Ident)) => self.is_name(self.at) && !self.starts_line(self.at + 1),
            (Some(Ident), Some(TokenKind::Other)) => self.equals(self.at + 1) > 0,
            (Some(Ident), Some(Comma)) => kind(2) == Some(Ident) && kind(3) == Some(Colon),
            (Some(Ident), Some(Open)) => self.pairs.partner(self.at + 1).is_some_and(|close| {
                close + 3 < end && self.kind_of(close + 1) == Some(Comma) && self.are(close + 2, Ident, Colon)
            }),
            _ => false,
        }
    }

    /// Returns true if a word looks like the name of a field.
    fn is_name(&self, token: usize) -> bool {
        self.word(token).starts_with(|c: char| c.is_lowercase()) && !matches!(self.word(token), "true" | "false")
    }

    /// Returns true if a token is the first in its line.
    fn starts_line(&self, token: usize) -> bool {
        let Some(here) = self.tokens.get(token) else { return true };
        let before = token.checked_sub(1).map_or(0, |before| self.tokens[before].end());
        token == 0 || self.text[before..here.start()].contains('\n')
    }

    /// The indentation of a token's line.
    fn indent(&self, token: usize) -> usize {
        let at = self.tokens.get(token).map_or(self.text.len(), |token| token.start());
        let line = &self.text.as_bytes()[self.line(at)..];
        line.iter().take(WIDE).take_while(|&&byte| matches!(byte, b' ' | b'\t')).count()
    }

    /// Returns true if an entry of another bracket begins here, so the closing bracket of this one must be missing.
    fn is_over(&self, block: BracketBlock) -> bool {
        let Some(opening) = block.open_ended else { return false };
        if self.kind() == Some(Comma) {
            // The comma left over from `),` without its bracket.
            return self.starts_line(self.at);
        }
        let field = self.are(self.at, Ident, Colon);
        match block.kind {
            NodeKind::Map => field,
            _ if self.are(self.at, Str, Colon) => opening > 0,
            _ if !block.named => field,
            _ => field && opening > 0 && self.starts_line(self.at) && self.indent(self.at) <= self.indent(opening),
        }
    }

    /// Returns true if an entry of this bracket begins at a token.
    fn starts_entry(&self, block: BracketBlock, token: usize) -> bool {
        let lost_colon =
            || self.kind_of(token) == Some(Str) && self.starts_line(token) && self.are(token + 1, Ident, Open);
        match block.kind {
            NodeKind::Map => self.are(token, Str, Colon) || lost_colon(),
            NodeKind::Parens if block.named => self.are(token, Ident, Colon),
            _ => false,
        }
    }

    /// Returns true if an item is followed by something that cannot follow it.
    fn is_garbage(&self, block: BracketBlock, end: usize) -> bool {
        let here = self.at;
        if here >= end || self.kind() == Some(Comma) || self.is_over(block) || self.starts_entry(block, here) {
            return false;
        }
        // In a list, a value on its own line is another item.
        block.named || !self.starts_line(here) || !self.starts_value(here)
    }

    fn starts_value(&self, token: usize) -> bool {
        !matches!(self.kind_of(token), None | Some(Close | Comma | Colon | TokenKind::Other))
    }

    /// Puts the node `first` and everything up to the next item into an error node.
    fn garbage(&mut self, first: usize, block: BracketBlock, end: usize) {
        self.fault_after();
        self.recovering = true;
        let node = self.open_around(first, NodeKind::Error);
        while self.at < end {
            match self.kind() {
                Some(Comma) if self.is_separator(block, end) => break,
                Some(Open) => self.at = self.pairs.partner(self.at).map_or(self.at, |close| close.min(end - 1)) + 1,
                _ if self.starts_line(self.at) && self.starts_entry(block, self.at) => break,
                _ if self.is_over(block) => break,
                _ => self.at += 1,
            }
        }
        self.close(node);
    }

    /// Returns true if the next token, a comma, ends an item.
    fn is_separator(&self, block: BracketBlock, end: usize) -> bool {
        let next = self.at + 1;
        !block.named || next >= end || self.starts_line(next) || self.starts_entry(block, next)
    }

    /// Reads the comma after an item.
    fn separator(&mut self, block: BracketBlock, end: usize) {
        let told = std::mem::take(&mut self.recovering);
        if self.at >= end || self.is_over(block) {
            return;
        }
        if self.kind() == Some(Comma) {
            self.at += 1;
        } else if !told {
            self.fault_here("expected comma", "separate values with `,`");
        }
    }

    /// Reads commas without a value before them.
    fn lonely_commas(&mut self, end: usize) {
        self.fault_here("expected a value before the comma", "leave out the comma");
        let node = self.open(NodeKind::Error);
        while self.at < end && self.kind() == Some(Comma) {
            self.at += 1;
        }
        self.close(node);
    }

    /// Reads a closing bracket without an opening one. The text around it is still read.
    fn stray(&mut self) {
        self.fault_here("this bracket closes nothing", "leave it out, or write the opening one");
        if let Some(fault) = self.faults.last_mut() {
            fault.weak = true;
        }
        self.at += 1;
    }

    fn strays(&mut self, end: usize) {
        while self.at < end && self.kind() == Some(Close) {
            self.stray();
        }
    }

    /// The number of tokens of an `=`, or `=>`, in place of a colon; 0 if there is none.
    fn equals(&self, token: usize) -> usize {
        match self.word(token) {
            "=" if self.word(token + 1) == ">" && self.touches(token + 1) => 2,
            "=" => 1,
            _ => 0,
        }
    }

    /// Parses an entry of a map.
    fn entry(&mut self, block: BracketBlock, end: usize) {
        let entry = self.open(NodeKind::Entry);
        let key = self.kind();
        self.plain_value(end);
        if self.at < end && self.kind() == Some(Colon) {
            self.at += 1;
            self.entry_value(block, end);
            if matches!(key, Some(Colon | TokenKind::Other)) {
                self.nodes[entry].kind = NodeKind::Error;
            }
        } else if self.at < end && self.equals(self.at) > 0 {
            self.fault_here("expected colon", EQUALS);
            self.at += self.equals(self.at);
            self.entry_value(block, end);
        } else if self.at < end && self.starts_value(self.at) && !self.starts_line(self.at) {
            self.fault_here("expected colon", "write `\"name\": value`");
            self.entry_value(block, end);
        } else {
            self.fault_here("expected colon and a value", "write `\"name\": value`");
            let missing = self.nodes.len();
            self.leaf(NodeKind::Missing, 0);
            if key != Some(Str) {
                self.nodes[entry].kind = NodeKind::Error;
            }
            if self.is_garbage(block, end) {
                self.garbage(missing, block, end);
            }
        }
        self.close(entry);
    }

    /// Parses a field: `name: value`.
    fn field(&mut self, block: BracketBlock, end: usize) {
        let next = self.kind_of(self.at + 1).filter(|_| self.at + 1 < end);
        let same_line = !self.starts_line(self.at + 1);
        match (self.kind(), next) {
            (Some(Ident), Some(Colon)) => self.named_value(block, end, 2),
            (Some(Ident), Some(TokenKind::Other)) if self.equals(self.at + 1) > 0 => {
                let equals = self.equals(self.at + 1);
                self.at += 1;
                self.fault_here("expected colon", EQUALS);
                self.at -= 1;
                self.named_value(block, end, 1 + equals);
            }
            (Some(Ident), Some(Number | Str | Open)) if same_line => {
                self.at += 1;
                self.fault_here("expected colon", "write `name: value`");
                self.at -= 1;
                self.named_value(block, end, 1);
            }
            (Some(Ident), Some(Ident)) if same_line && !self.are(self.at + 1, Ident, Colon) => {
                self.at += 1;
                self.fault_here("expected colon", "write `name: value`");
                self.at -= 1;
                self.named_value(block, end, 1);
            }
            (Some(Ident), _) => {
                self.fault_here("expected colon and a value after this name", "write `name: value`");
                let node = self.nodes.len();
                self.leaf(NodeKind::Word, 1);
                self.as_error(node, block, end);
            }
            _ => {
                let help = match (self.kind(), next) {
                    (Some(Str), Some(Colon)) => {
                        "close the brackets before it with `)`; in `( )` names of fields have no quotes"
                    }
                    _ => "write `name: value`",
                };
                // Entries of another bracket come in groups: report only the first.
                let quoted = (self.kind(), next) == (Some(Str), Some(Colon));
                if !quoted || self.quoted_until != end {
                    self.fault_here("expected the name of a field", help);
                }
                self.quoted_until = if quoted { end } else { self.quoted_until };
                let node = self.nodes.len();
                if quoted {
                    self.named_value(block, end, 2);
                } else {
                    self.plain_value(end);
                }
                self.as_error(node, block, end);
            }
        }
    }

    /// Turns the item that began with `node` into an error, as it is not a field.
    fn as_error(&mut self, node: usize, block: BracketBlock, end: usize) {
        if self.is_garbage(block, end) {
            self.garbage(node, block, end);
        } else {
            let error = self.open_around(node, NodeKind::Error);
            self.close(error);
        }
    }

    /// Parses an entry whose key is one token; key and colon together are `head` tokens.
    fn named_value(&mut self, block: BracketBlock, end: usize, head: usize) {
        let entry = self.open(NodeKind::Entry);
        let key = if self.kind() == Some(Str) { NodeKind::Text } else { NodeKind::Word };
        self.leaf(key, 1);
        self.at += head - 1;
        self.entry_value(block, end);
        self.close(entry);
    }

    /// Parses the value of an entry, after its colon.
    fn entry_value(&mut self, block: BracketBlock, end: usize) {
        let first = self.nodes.len();
        let nothing = self.at >= end || matches!(self.kind(), None | Some(Comma | Close));
        if nothing || (self.starts_line(self.at) && self.starts_entry(block, self.at)) {
            self.fault_here("expected a value", "write a value, or leave the field out");
            self.leaf(NodeKind::Missing, 0);
        } else {
            self.value(end);
        }
        self.strays(end);
        if self.is_garbage(block, end) {
            self.garbage(first, block, end);
        }
    }

    /// Parses a map without its `{`, if there is one here.
    pub(super) fn implied_map(&mut self, limit: usize) -> bool {
        let stray = self.pairs.stray_from(self.at).filter(|&stray| stray < limit && self.word(stray) == "}");
        let begins = self.are(self.at, Str, Colon) && self.may_nest();
        let (true, Some(end)) = (begins, stray) else { return false };
        self.fault_here("expected `{` before the first name", "write `{ \"name\": value }`");
        self.implied(NodeKind::Map, end);
        true
    }

    /// Parses fields without their `(`, if there are some here.
    pub(super) fn implied_parens(&mut self, limit: usize) -> bool {
        if !self.lacks_opening(self.at, limit) {
            return false;
        }
        self.fault_here("expected `(` before the first field", "write `(field: value)`");
        let end = self.pairs.stray_from(self.at).unwrap_or(limit);
        self.implied(NodeKind::Parens, end);
        true
    }

    /// Returns true if a field begins here, and a `)` without a partner ends its line or stands below on its own line.
    pub(super) fn lacks_opening(&self, token: usize, limit: usize) -> bool {
        let Some(stray) = self.pairs.stray_from(token).filter(|&stray| stray < limit) else { return false };
        if !self.are(token, Ident, Colon) || self.word(stray) != ")" || !self.may_nest() {
            return false;
        }
        let block = self.starts_line(token)
            && self.starts_line(stray)
            && token.checked_sub(1).is_some_and(|word| self.indent(word) == self.indent(stray));
        block || self.line(self.tokens[token].start()) == self.line(self.tokens[stray].start())
    }

    /// Parses a list or a tuple without its opening bracket, if there is one here: values up to a closing bracket
    /// without a partner in the same line.
    pub(super) fn implied_values(&mut self, limit: usize) -> bool {
        let Some(stray) = self.pairs.stray_from(self.at).filter(|&stray| stray < limit) else { return false };
        let same_line = self.line(self.tokens[self.at].start()) == self.line(self.tokens[stray].start());
        if !same_line || !self.may_nest() || !self.are_values(stray) {
            return false;
        }
        let list = self.word(stray) == "]";
        let (kind, message) = match list {
            true => (NodeKind::List, "expected `[` before the first value"),
            false => (NodeKind::Parens, "expected `(` before the first value"),
        };
        self.fault_here(message, "write `[1, 2]` for a list, and `(1, 2)` for a pair");
        self.implied(kind, stray);
        true
    }

    /// Returns true if only values and commas stand before `stray`.
    fn are_values(&self, stray: usize) -> bool {
        let (mut at, mut commas) = (self.at, 0);
        for _ in 0..LONGEST_LIST {
            if at >= stray {
                return at == stray && (commas > 0 || self.word(stray) == "]");
            }
            match self.kind_of(at) {
                Some(Open) => match self.pairs.partner(at) {
                    Some(close) => at = close,
                    None => return false,
                },
                Some(Comma) => commas += 1,
                Some(Ident | Number | Str | TokenKind::Char | TokenKind::Dots) => {}
                _ => return false,
            }
            at += 1;
        }
        false
    }

    /// Reports that the closing bracket is missing: at the end of the line if the bracket was opened there, else at the next
    /// token.
    pub(super) fn not_closed(&mut self, opening: usize, kind: NodeKind) {
        let (before, after) = match kind {
            NodeKind::Parens => ("expected `)` before this", "expected `)` after this"),
            NodeKind::List => ("expected `]` before this", "expected `]` after this"),
            _ => ("expected `}` before this", "expected `}` after this"),
        };
        self.fault_here(before, "close the bracket before it");
        let last = self.tokens[self.at.saturating_sub(1)].range();
        let is_comma = self.word(self.at.saturating_sub(1)) == ",";
        let ends_line = self.at < self.tokens.len()
            && self.starts_line(self.at)
            && self.line(self.tokens[opening].start()) == self.line(last.start);
        if let Some(fault) = self.faults.last_mut() {
            fault.bracket = Some(self.tokens[opening].range());
            if ends_line {
                // The comma after the bracket is missing, too.
                self.recovering = true;
                // An earlier mistake in the line may be the cause.
                fault.weak = true;
                fault.range = last;
                if !is_comma {
                    (fault.message, fault.help) = (after.into(), Some("close the bracket"));
                }
            }
        }
        // More fields may belong here.
        if kind == NodeKind::Parens {
            self.leaf(NodeKind::Error, 0);
        }
    }

    /// Reports a mistake at the next token, or at the end of the text.
    pub(super) fn fault_here(&mut self, message: &'static str, help: &'static str) {
        let fault = match self.tokens.get(self.at) {
            Some(token) => SyntaxError::new(token.range(), message).help(help),
            None => {
                let end = self.text.len();
                let ends = ("the file ends too early", "a bracket, a quote or a value is missing at the end");
                let (message, help) = if self.tokens.is_empty() { (message, help) } else { ends };
                SyntaxError { unfinished: true, ..SyntaxError::new(end..end, message).help(help) }
            }
        };
        self.faults.push(fault);
    }

    /// Reports that the next token cannot follow the one before it.
    fn fault_after(&mut self) {
        let after_number = self.at.checked_sub(1).is_some_and(|before| self.kind_of(before) == Some(Number))
            && !self.starts_line(self.at);
        let help = match self.kind() {
            Some(Ident) if after_number => "write numbers without a unit: lengths are in mm, angles in degrees",
            Some(TokenKind::Other)
                if after_number && matches!(self.word(self.at), "°" | "%" | "\u{b5}" | "\u{3bc}") =>
            {
                "write numbers without a unit: lengths are in mm, angles in degrees, shares from 0 to 1"
            }
            Some(TokenKind::Other) if after_number && matches!(self.word(self.at), "*" | "/" | "^") => {
                "a calculation stands in double quotes, `\"= 2 * 3\"`"
            }
            _ if self.word(self.at) == "." => "write the names of nodes in quotes, `\"node.port\"`",
            _ => "separate values with `,`",
        };
        self.fault_here("expected comma", help);
    }
}
