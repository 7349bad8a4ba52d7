//! Splits doc comments into blocks.

/// A block of a doc comment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DocBlock {
    /// Text to wrap.
    Paragraph(String),
    /// An item of a list.
    Item(String),
    /// Verbatim lines.
    Code(Vec<String>),
}

/// Splits a doc comment.
pub fn blocks(doc: &str) -> Vec<DocBlock> {
    let mut blocks: Vec<DocBlock> = Vec::new();
    let mut fenced = false;
    // True if the next line continues the last block.
    let mut open = false;
    for line in doc.lines() {
        let trimmed = line.trim();
        if trimmed.starts_with("```") {
            fenced = !fenced;
            open = false;
            if fenced {
                blocks.push(DocBlock::Code(Vec::new()));
            }
        } else if let (true, Some(DocBlock::Code(lines))) = (fenced, blocks.last_mut()) {
            lines.push(line.to_owned());
        } else if trimmed.is_empty() {
            open = false;
        } else if let Some(item) = trimmed.strip_prefix("- ").or_else(|| trimmed.strip_prefix("* ")) {
            blocks.push(DocBlock::Item(item.to_owned()));
            open = true;
        } else {
            match blocks.last_mut() {
                Some(DocBlock::Paragraph(text) | DocBlock::Item(text)) if open => {
                    text.push(' ');
                    text.push_str(trimmed);
                }
                _ => blocks.push(DocBlock::Paragraph(trimmed.to_owned())),
            }
            open = true;
        }
    }
    blocks
}

/// First sentence, for lists.
pub fn summary(doc: &str) -> String {
    let first = blocks(doc).into_iter().find_map(|block| match block {
        DocBlock::Paragraph(text) => Some(text),
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
    fn splits_docs_into_blocks() {
        let doc = "One\ntwo. Three\n\n- a\n  b\n- c\n\n```ron\n\"x\": Y(),\n\n  z\n```\nEnd";
        let expected = [
            DocBlock::Paragraph("One two. Three".into()),
            DocBlock::Item("a b".into()),
            DocBlock::Item("c".into()),
            DocBlock::Code(vec!["\"x\": Y(),".into(), String::new(), "  z".into()]),
            DocBlock::Paragraph("End".into()),
        ];
        assert_eq!(blocks(doc), expected);
        assert_eq!(summary(doc), "One two.");
        assert_eq!(summary(""), "");
    }
}
