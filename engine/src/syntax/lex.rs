//! From text to tokens.
use super::fault::SyntaxError;
use super::literal;
use std::ops::Range;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TokenKind {
    /// A word, `true` and `r#word` included.
    Ident,
    /// A number with its sign; `inf`, `NaN` and bytes such as `b'x'` too.
    Number,
    /// A string, raw and byte strings included. Its closing quote may be missing.
    Str,
    /// A character.
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

/// A piece of a text that is neither blank nor comment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token {
    kind: TokenKind,
    start: u32,
    end: u32,
}

impl Token {
    /// What it is.
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

    /// Where it is.
    pub fn range(self) -> Range<usize> {
        self.start()..self.end()
    }
}

/// What a text consists of.
#[derive(Debug, Default)]
pub(super) struct Lexed {
    pub(super) tokens: Vec<Token>,
    /// Where the comments are.
    pub(super) comments: Vec<(u32, u32)>,
    pub(super) faults: Vec<SyntaxError>,
}

/// The tokens of `text`, whose length fits into 32 bits.
pub(super) fn lex(text: &str) -> Lexed {
    let out = tokens(text, Vec::new());
    if !out.faults.iter().any(|fault| fault.torn) {
        return out;
    }
    // Lines in which a quote is missing are read again, with guesses which one it is.
    let line =
        |fault: &SyntaxError| text[fault.range.start..].find('\n').map_or(text.len(), |len| fault.range.start + len);
    let mut torn: Vec<usize> = out.faults.iter().filter(|fault| fault.torn).map(line).collect();
    torn.dedup();
    tokens(text, torn)
}

/// The tokens of a text of which the lines that end at `torn` lack a quote.
fn tokens(text: &str, torn: Vec<usize>) -> Lexed {
    let out = Lexed { tokens: Vec::with_capacity(text.len() / 5), ..Lexed::default() };
    let mut lexer =
        Lexer { text, at: 0, out, searched: None, endless: None, comment_open: false, torn, mended: 0, begin: 0 };
    // The parser complains of it.
    lexer.at = if text.starts_with(super::parse::MARK) { super::parse::MARK.len_utf8() } else { 0 };
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
            // `inf` is a number, and also a name.
            before.kind = TokenKind::Ident;
        }
        lexer.out.tokens.push(Token { kind, start: short(start), end: short(lexer.at) });
    }
}

/// So many characters after a `'` the other one is looked for.
const LONGEST_QUOTE: usize = 200;

/// An offset in a text whose length was checked.
pub(super) fn short(offset: usize) -> u32 {
    u32::try_from(offset).unwrap_or(u32::MAX)
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
    out: Lexed,
    /// Where the last search for the end of a string began, and what it found.
    searched: Option<(usize, Option<usize>)>,
    /// Raw strings with at least so many `#` have no end.
    endless: Option<usize>,
    /// Whether a comment had no end; the later ones end at the first `*/`, and perhaps there is none.
    comment_open: bool,
    /// Where the lines end in which a quote is missing, and how many of them lie behind or have been mended.
    torn: Vec<usize>,
    mended: usize,
    /// Where the token begins that is being read.
    begin: usize,
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
                // The end of the line is not part of the comment.
                self.at -= usize::from(self.text[start..self.at].ends_with('\r'));
            } else if self.rest().starts_with("/*") {
                self.block_comment();
            } else {
                return;
            }
            self.out.comments.push((short(start), short(self.at)));
        }
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
        // Only its line is a comment, so that the rest is read.
        self.comment_open = true;
        self.at = self.line_end(start);
        let fault = SyntaxError::new(start..start + 2, "this comment has no end").help("write `*/` where it ends");
        self.fault(SyntaxError { unfinished: true, ..fault });
    }

    /// Where the line of `at` ends.
    fn line_end(&self, at: usize) -> usize {
        let line = self.text[at..].find('\n').map_or(self.text.len(), |i| at + i);
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

    /// A string from its quote on.
    fn string(&mut self) -> TokenKind {
        let start = self.at;
        if self.is_torn() && self.mend() {
            return TokenKind::Str;
        }
        let close = self.closing_quote(start + 1);
        // One that goes on into other lines must be followed by what may follow a string.
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
                self.at = start + 1 + torn(&self.text[start + 1..self.line_end(start)]);
                let fault = SyntaxError::new(start..self.at, "a closing quote is missing");
                self.fault(SyntaxError { torn: true, ..fault });
            }
        }
        TokenKind::Str
    }

    /// Whether a quote is missing in this line, and was not found yet.
    fn is_torn(&mut self) -> bool {
        while self.torn.get(self.mended).is_some_and(|&end| end < self.at) {
            self.mended += 1;
        }
        self.torn.get(self.mended).is_some_and(|&end| !self.text[self.at..end].contains('\n'))
    }

    /// Reads a string whose opening or closing quote is missing, if that is what is here: one that goes on like the fields of a node,
    /// or whose quote stands like a closing one.
    fn mend(&mut self) -> bool {
        let start = self.at;
        let line = &self.text[start + 1..self.line_end(start)];
        let mut from = self.begin;
        let first = line.trim_start().chars().next();
        if first.is_none_or(|c| matches!(c, ',' | ':' | ')' | ']' | '}')) {
            // The words before it belong to the text.
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

    /// The quote that ends a string that begins at `from`. The text between two searches is looked at once: if both come
    /// by the same byte that does not follow a `\`, both find the same.
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

    /// Whether a string may end before `at`.
    fn may_follow(&self, at: usize) -> bool {
        let rest = self.text[at..].trim_start_matches(is_blank);
        rest.is_empty() || rest.starts_with([',', ':', ')', ']', '}', '/'])
    }

    fn character(&mut self) -> TokenKind {
        let start = self.at;
        let line = self.rest();
        // RON also knows the quote itself, unescaped: '''.
        let from = if line.starts_with("'''") { 2 } else { 1 };
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
        // With more `#` an end is not found either.
        let search = self.endless.is_none_or(|endless| hashes < endless);
        let close = format!("\"{}", "#".repeat(hashes));
        match search.then(|| self.text[body..].find(&close)).flatten() {
            Some(len) => self.at = body + len + close.len(),
            None => {
                self.endless = Some(self.endless.map_or(hashes, |endless| endless.min(hashes)));
                self.at = body + torn(&self.text[body..self.line_end(body)]);
                let fault = SyntaxError::new(start..self.at, "a closing quote is missing");
                self.fault(SyntaxError { torn: true, ..fault });
            }
        }
        TokenKind::Str
    }
}

/// How much of the rest of a line belongs to a string whose closing quote is missing.
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

/// What RON takes for white space.
pub(super) fn is_blank(c: char) -> bool {
    matches!(
        c,
        ' ' | '\t' | '\n' | '\r' | '\x0B' | '\x0C' | '\u{85}' | '\u{200E}' | '\u{200F}' | '\u{2028}' | '\u{2029}'
    )
}
