//! Splits a text into tokens.
use super::conflict::{self, Marks};
use super::fault::SyntaxError;
use super::literal;
use crate::diagnostics::Code;
use std::ops::Range;

/// The byte order mark that some editors write before a UTF-8 text. It is not part of the text.
pub(super) const MARK: char = '\u{FEFF}';

/// Kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TokenKind {
    /// A word, including `true` and `r#word`.
    Ident,
    /// A number with its sign, including `inf`, `NaN` and bytes such as `b'x'`.
    Number,
    /// A string, including raw and byte strings. Its closing quote may be missing.
    Str,
    /// A character literal.
    Char,
    /// `(`, `[` or `{`.
    Open,
    /// `)`, `]` or `}`.
    Close,
    /// `,`
    Comma,
    /// `:`
    Colon,
    /// `..` or `..=`
    Dots,
    /// Anything else.
    Other,
}

/// A run of characters of a text that is neither blank nor comment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token {
    kind: TokenKind,
    start: u32,
    end: u32,
}

impl Token {
    /// The kind of the token.
    pub fn kind(self) -> TokenKind {
        self.kind
    }

    /// Its first byte.
    pub fn start(self) -> usize {
        self.start as usize
    }

    /// One past its last byte.
    pub fn end(self) -> usize {
        self.end as usize
    }

    /// The bytes of the token.
    pub fn range(self) -> Range<usize> {
        self.start()..self.end()
    }
}

/// Result of splitting a text.
#[derive(Debug, Default)]
pub(super) struct Lexed {
    pub(super) tokens: Vec<Token>,
    /// The bytes of the comments.
    pub(super) comments: Vec<(u32, u32)>,
    pub(super) faults: Vec<SyntaxError>,
}

/// The tokens of `text`, whose length fits into 32 bits.
pub(super) fn lex(text: &str) -> Lexed {
    let out = tokens(text, Vec::new());
    if !out.faults.iter().any(|fault| fault.torn) {
        return out;
    }
    // Lines with a missing quote are read again, guessing the place of the quote.
    let mut torn: Vec<Range<usize>> = Vec::new();
    for fault in out.faults.iter().filter(|fault| fault.torn) {
        // A long line may have many of them.
        if torn.last().is_none_or(|line| line.end < fault.range.start) {
            torn.push(line_around(text, fault.range.start));
        }
    }
    tokens(text, torn)
}

/// The bytes of the line that contains `at`, without its `\n`.
fn line_around(text: &str, at: usize) -> Range<usize> {
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    start..text[at..].find('\n').map_or(text.len(), |len| at + len)
}

/// The tokens of a text in which the lines `torn` lack a quote.
fn tokens(text: &str, torn: Vec<Range<usize>>) -> Lexed {
    let out = Lexed { tokens: Vec::with_capacity(text.len() / 5), ..Lexed::default() };
    let mut lexer = Lexer {
        text,
        at: 0,
        out,
        searched: None,
        endless: None,
        comment_open: false,
        torn,
        mended: 0,
        line: 0..0,
        begin: 0,
        marks: conflict::marks(text),
    };
    // The parser reports the mark.
    lexer.at = if text.starts_with(MARK) { MARK.len_utf8() } else { 0 };
    loop {
        lexer.skip_blank();
        lexer.begin = lexer.at;
        let Some(first) = lexer.peek() else { return lexer.out };
        let kind = lexer.token(first);
        let start = lexer.begin;
        debug_assert!(lexer.at > start, "every token has a length");
        if let (TokenKind::Colon, Some(before)) = (kind, lexer.out.tokens.last_mut())
            && literal::is_number_word(&text[before.range()])
        {
            // `inf` is a number, but also a valid name.
            before.kind = TokenKind::Ident;
        }
        lexer.out.tokens.push(Token { kind, start: short(start), end: short(lexer.at) });
    }
}

/// The closing `'` is searched within this many characters.
const LONGEST_QUOTE: usize = 200;

/// An offset in a text whose length was checked.
pub(super) fn short(offset: usize) -> u32 {
    u32::try_from(offset).unwrap_or(u32::MAX)
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
    out: Lexed,
    /// The start of the last search for the end of a string, and its result.
    searched: Option<(usize, Option<usize>)>,
    /// Raw strings with at least this many `#` have no end.
    endless: Option<usize>,
    /// True once a comment had no end; later comments end at the first `*/`, if there is one.
    comment_open: bool,
    /// The lines with a missing quote, and the number of lines already passed or repaired.
    torn: Vec<Range<usize>>,
    mended: usize,
    /// The line whose end was searched last, from the place of that search on.
    line: Range<usize>,
    /// The start of the current token.
    begin: usize,
    /// The marks of merges that were not passed yet, the last one first.
    marks: Vec<Marks>,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn take_while(&mut self, accept: impl Fn(char) -> bool) {
        let rest = self.rest();
        self.at += rest.find(|c| !accept(c)).unwrap_or(rest.len());
    }

    fn fault(&mut self, fault: SyntaxError) {
        self.out.faults.push(fault);
    }

    fn skip_blank(&mut self) {
        loop {
            self.take_while(is_blank);
            let start = self.at;
            if self.rest().starts_with("//") {
                self.take_while(|c| c != '\n');
                // The line break is not part of the comment.
                self.at -= usize::from(self.text[start..self.at].ends_with('\r'));
            } else if self.rest().starts_with("/*") {
                self.block_comment();
            } else if !self.mark() {
                return;
            }
            self.out.comments.push((short(start), short(self.at)));
        }
    }

    /// Passes a mark of a merge as a comment: the line above the first version, or everything below that version.
    fn mark(&mut self) -> bool {
        // Marks inside strings were not passed.
        while self.marks.last().is_some_and(|marks| marks.rest.start < self.at) {
            self.marks.pop();
        }
        let Some(marks) = self.marks.last() else { return false };
        if self.at == marks.first.start {
            self.at = marks.first.end;
            let fault = SyntaxError::new(marks.first.clone(), "a merge left two versions of this place");
            let help = "keep one version, and remove the other lines from `<<<<<<<` to `>>>>>>>`";
            self.fault(SyntaxError { code: Code::Conflict, ..fault.help(help) });
            return true;
        }
        let passed = self.at == marks.rest.start;
        if passed {
            self.at = marks.rest.end;
        }
        passed
    }

    fn block_comment(&mut self) {
        let start = self.at;
        if self.comment_open {
            self.at = self.line_end(start);
            return;
        }
        let bytes = self.text.as_bytes();
        let (mut at, mut depth) = (start, 0);
        while let Some(pair) = bytes.get(at..at + 2) {
            match pair {
                b"/*" => depth += 1,
                b"*/" => depth -= 1,
                _ => {
                    at += 1;
                    continue;
                }
            }
            at += 2;
            if depth == 0 {
                self.at = at;
                return;
            }
        }
        // Treats only the first line as a comment, so that the rest is read.
        self.comment_open = true;
        self.at = self.line_end(start);
        let fault = SyntaxError::new(start..start + 2, "this comment has no end").help("write `*/` where it ends");
        self.fault(SyntaxError { unfinished: true, ..fault });
    }

    /// The end of the line that contains `at`. A long line is searched once.
    fn line_end(&mut self, at: usize) -> usize {
        if self.line.is_empty() || !(self.line.start..=self.line.end).contains(&at) {
            self.line = at..self.text[at..].find('\n').map_or(self.text.len(), |i| at + i);
        }
        let line = self.line.end;
        if self.text[at..line].ends_with('\r') { line - 1 } else { line }
    }

    fn token(&mut self, first: char) -> TokenKind {
        let single = |lexer: &mut Self, kind| {
            lexer.at += first.len_utf8();
            kind
        };
        match first {
            '(' | '[' | '{' => single(self, TokenKind::Open),
            ')' | ']' | '}' => single(self, TokenKind::Close),
            ',' => single(self, TokenKind::Comma),
            ':' => single(self, TokenKind::Colon),
            '"' => self.string(),
            '\'' => self.character(),
            '.' if self.rest().starts_with("..") => {
                self.at += if self.rest().starts_with("..=") { 3 } else { 2 };
                TokenKind::Dots
            }
            '0'..='9' | '+' | '-' | '.' => self.number(),
            c if c == '_' || unicode_ident::is_xid_start(c) => self.word(),
            _ => single(self, TokenKind::Other),
        }
    }

    /// A string, starting at its quote.
    fn string(&mut self) -> TokenKind {
        let start = self.at;
        if self.is_torn() && self.mend() {
            return TokenKind::Str;
        }
        let close = self.closing_quote(start + 1);
        // A string over several lines must be followed by something that may follow a string.
        let good = close.filter(|&close| !self.text[start..close].contains('\n') || self.may_follow(close + 1));
        match good {
            Some(close) => {
                self.at = close + 1;
                let literal = &self.text[start..self.at];
                if literal.contains('\\') && !literal::is_good(literal) {
                    let help = "after `\\` comes one of `\\ \" n r t 0`, or `u{…}`; write `\\\\` for `\\` itself";
                    self.fault(SyntaxError::new(start..self.at, "this text has a wrong escape").help(help));
                }
            }
            None => {
                let end = self.line_end(start);
                self.at = start + 1 + torn(&self.text[start + 1..end]);
                let fault = SyntaxError::new(start..self.at, "a closing quote is missing");
                self.fault(SyntaxError { torn: true, ..fault });
            }
        }
        TokenKind::Str
    }

    /// Returns true if a quote is missing in this line and was not found yet.
    fn is_torn(&mut self) -> bool {
        while self.torn.get(self.mended).is_some_and(|line| line.end < self.at) {
            self.mended += 1;
        }
        self.torn.get(self.mended).is_some_and(|line| line.start <= self.at)
    }

    /// Reads a string whose opening or closing quote is missing, if there is one here: a string followed by text like
    /// the fields of a node, or a quote in the position of a closing one.
    fn mend(&mut self) -> bool {
        let start = self.at;
        let end = self.line_end(start);
        let line = &self.text[start + 1..end];
        let mut from = self.begin;
        let first = line.trim_start().chars().next();
        if first.is_none_or(|c| matches!(c, ',' | ':' | ')' | ']' | '}')) {
            // The words before the quote belong to the string.
            while let Some(before) = self.out.tokens.last()
                && before.end() == from
                && matches!(before.kind, TokenKind::Ident | TokenKind::Number | TokenKind::Other)
            {
                from = before.start();
                self.out.tokens.pop();
            }
            self.at = start + 1;
        } else {
            let content = line.find('"').map_or(line, |end| &line[..end]);
            let end = torn(content);
            let rest = content[end..].trim_start();
            let word = rest.trim_start_matches([',', ')', ']', '}', ' ']);
            let name = word.len() - word.trim_start_matches(|c: char| c == '_' || c.is_ascii_alphanumeric()).len();
            let field = rest.starts_with(':') || (name > 0 && word[name..].trim_start().starts_with(':'));
            let between = rest.starts_with(',') && word.is_empty() && content.len() < line.len();
            if !field && !between {
                return false;
            }
            self.at = start + 1 + end;
        }
        self.begin = from;
        self.mended += 1;
        let fault = SyntaxError::new(from..self.at, "a quote is missing");
        self.fault(SyntaxError { torn: true, ..fault });
        true
    }

    /// The closing quote of a string that begins at `from`. The text is scanned once for all searches: if two searches
    /// reach the same byte, and it does not follow a `\`, both find the same quote.
    fn closing_quote(&mut self, from: usize) -> Option<usize> {
        let bytes = self.text.as_bytes();
        let mut at = from;
        while let Some(&byte) = bytes.get(at) {
            if let Some((begin, found)) = self.searched
                && begin < at
                && found.is_none_or(|found| at <= found)
                && bytes[at - 1] != b'\\'
            {
                return found;
            }
            match byte {
                b'"' => break,
                b'\\' => at += 2,
                _ => at += 1,
            }
        }
        let found = (at < bytes.len()).then_some(at);
        self.searched = Some((from, found));
        found
    }

    /// Returns true if a string may end before `at`.
    fn may_follow(&self, at: usize) -> bool {
        let rest = self.text[at..].trim_start_matches(is_blank);
        rest.is_empty() || rest.starts_with([',', ':', ')', ']', '}', '/'])
    }

    fn character(&mut self) -> TokenKind {
        let start = self.at;
        let line = self.rest();
        // RON also allows an unescaped quote, `'''`, and an unescaped newline.
        let from = if line.starts_with("'''") || line.starts_with("'\n'") { 2 } else { 1 };
        let mut escaped = false;
        let close = line[from..].char_indices().take(LONGEST_QUOTE).find(|&(_, c)| {
            let ends = (c == '\'' && !escaped) || c == '\n';
            escaped = c == '\\' && !escaped;
            ends
        });
        let Some((len, _)) = close.filter(|&(len, c)| c == '\'' || (from, len) == (1, 0)) else {
            self.at += 1;
            return TokenKind::Other;
        };
        self.at += from + len + 1;
        if !literal::is_good(&self.text[start..self.at]) {
            let fault = SyntaxError::new(start..self.at, "between `'` stands a single character");
            self.fault(fault.help("texts stand in double quotes, `\"text\"`"));
        }
        TokenKind::Char
    }

    fn number(&mut self) -> TokenKind {
        let start = self.at;
        let (len, good) = literal::number_len(self.rest());
        if len == 0 {
            self.at += 1;
            return TokenKind::Other;
        }
        self.at += len;
        if !good {
            self.fault(SyntaxError::new(start..self.at, "this is no number").help("write it as `1.5`, `-2` or `1e-3`"));
        }
        TokenKind::Number
    }

    fn word(&mut self) -> TokenKind {
        let rest = self.rest();
        for prefix in ["br", "r"] {
            if let Some(raw) = rest.strip_prefix(prefix)
                && raw.trim_start_matches('#').starts_with('"')
            {
                return self.raw_string(prefix.len());
            }
        }
        if rest.starts_with("b\"") {
            self.at += 1;
            return self.string();
        }
        if rest.starts_with("b'") {
            self.at += 1;
            let kind = self.character();
            return if kind == TokenKind::Char { TokenKind::Number } else { kind };
        }
        if rest.starts_with("r#") {
            self.at += 2;
            self.take_while(|c| matches!(c, '.' | '+' | '-') || unicode_ident::is_xid_continue(c));
            return if self.text[..self.at].ends_with('#') { TokenKind::Other } else { TokenKind::Ident };
        }
        let start = self.at;
        self.take_while(unicode_ident::is_xid_continue);
        if literal::is_number_word(&self.text[start..self.at]) { TokenKind::Number } else { TokenKind::Ident }
    }

    fn raw_string(&mut self, prefix: usize) -> TokenKind {
        let start = self.at;
        let raw = &self.rest()[prefix..];
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        let body = start + prefix + hashes + 1;
        // With more `#`, the search would fail too.
        let search = self.endless.is_none_or(|endless| hashes < endless);
        let close = format!("\"{}", "#".repeat(hashes));
        match search.then(|| self.text[body..].find(&close)).flatten() {
            Some(len) => self.at = body + len + close.len(),
            None => {
                self.endless = Some(self.endless.map_or(hashes, |endless| endless.min(hashes)));
                let end = self.line_end(body);
                self.at = body + torn(&self.text[body..end]);
                let fault = SyntaxError::new(start..self.at, "a closing quote is missing");
                self.fault(SyntaxError { torn: true, ..fault });
            }
        }
        TokenKind::Str
    }
}

/// Length of the part of a line that belongs to a string whose closing quote is missing.
fn torn(rest: &str) -> usize {
    let mut depth = 0_usize;
    let end = rest.char_indices().find(|&(at, c)| match c {
        '(' | '[' | '{' => {
            depth += 1;
            false
        }
        ')' | ']' | '}' if depth > 0 => {
            depth -= 1;
            false
        }
        ')' | ']' | '}' => true,
        ',' | ':' => depth == 0,
        '/' => rest[at..].starts_with("//"),
        _ => false,
    });
    rest[..end.map_or(rest.len(), |(at, _)| at)].trim_end().len()
}

/// The white space of RON.
pub(super) fn is_blank(c: char) -> bool {
    matches!(
        c,
        ' ' | '\t' | '\n' | '\r' | '\x0B' | '\x0C' | '\u{85}' | '\u{200E}' | '\u{200F}' | '\u{2028}' | '\u{2029}'
    )
}
