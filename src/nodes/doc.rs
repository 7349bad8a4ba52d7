//! Splits doc comments into blocks.

/// A block of a doc comment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Block {
    /// Text to wrap.
    Paragraph(String),
    /// An item of a list.
    Item(String),
    /// Verbatim lines.
    Code(Vec<String>),
}

/// Splits a doc comment.
pub(super) fn blocks(doc: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut fenced = false;
    // True if the next line continues the last block.
    let mut open = false;
    for line in doc.lines() {
        let trimmed = line.trim();
        if trimmed.starts_with("```") {
            fenced = !fenced;
            open = false;
            if fenced {
                blocks.push(Block::Code(Vec::new()));
            }
        } else if let (true, Some(Block::Code(lines))) = (fenced, blocks.last_mut()) {
            lines.push(line.to_owned());
        } else if trimmed.is_empty() {
            open = false;
        } else if let Some(item) = trimmed.strip_prefix("- ").or_else(|| trimmed.strip_prefix("* ")) {
            blocks.push(Block::Item(item.to_owned()));
            open = true;
        } else {
            match blocks.last_mut() {
                Some(Block::Paragraph(text) | Block::Item(text)) if open => {
                    text.push(' ');
                    text.push_str(trimmed);
                }
                _ => blocks.push(Block::Paragraph(trimmed.to_owned())),
            }
            open = true;
        }
    }
    blocks
}

/// First sentence, for lists.
pub(super) fn summary(doc: &str) -> String {
    let first = blocks(doc).into_iter().find_map(|block| match block {
        Block::Paragraph(text) => Some(text),
        _ => None,
    });
    let text = first.unwrap_or_default();
    match text.find(". ") {
        Some(end) => text[..=end].to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn docs_are_taken_apart() {
        let doc = "One\ntwo. Three\n\n- a\n  b\n- c\n\n```ron\n\"x\": Y(),\n\n  z\n```\nEnd";
        let expected = [
            Block::Paragraph("One two. Three".into()),
            Block::Item("a b".into()),
            Block::Item("c".into()),
            Block::Code(vec!["\"x\": Y(),".into(), String::new(), "  z".into()]),
            Block::Paragraph("End".into()),
        ];
        assert_eq!(blocks(doc), expected);
        assert_eq!(summary(doc), "One two.");
        assert_eq!(summary(""), "");
    }
}
