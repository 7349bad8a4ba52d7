//! Groups of nodes: in the text of a graph, nodes without a blank line between them, under a comment.
use shibo_graph::GraphNode;
use shibo_value::diagnostics::SourceMap;

/// Longer names of groups are cut, in characters.
const LONGEST: usize = 60;

/// The name of the group of a node: the first comment of its lines, up to a colon, semicolon or the end of the sentence.
/// `None` if the lines do not begin with a comment.
pub(super) fn group(node: &GraphNode, sources: &SourceMap) -> Option<String> {
    name(&sources.text(node.span.file), node.span.start)
}

/// The name of the group of a sub-graph that is used in the same text as a node.
pub(super) fn group_of_use(label: &str, beside: &GraphNode, sources: &SourceMap) -> Option<String> {
    let text = sources.text(beside.span.file);
    let key = format!("\"{label}\": ");
    let starts_line = |at: usize| text[..at].rsplit('\n').next().is_some_and(|line| line.trim().is_empty());
    let (at, _) =
        text.match_indices(&key).find(|(at, _)| starts_line(*at) && text[at + key.len()..].starts_with(['U', 'E']))?;
    name(&text, at)
}

fn name(text: &str, at: usize) -> Option<String> {
    let begin = text.get(..at)?.rfind('\n')?;
    let mut first = None;
    for line in text[..begin].rsplit('\n') {
        let line = line.trim();
        if line.is_empty() || line.ends_with('{') {
            break;
        }
        first = Some(line);
    }
    let comment = first?.strip_prefix("//")?.trim_start_matches('/').trim();
    let end = comment.find([':', ';']).or_else(|| comment.find(". ")).unwrap_or(comment.len());
    let name: String = comment[..end].trim_end_matches('.').chars().take(LONGEST).collect();
    (!name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_from_the_first_comment_of_the_lines() {
        let text = "(\n  nodes: {\n    // The grain: small cells.\n    \"a\": Perlin(size: 2),\n    // Smooth areas.\n    \
            \"b\": Remap(input: \"a\",\n      to: (0, 1)),\n\n    \"c\": Perlin(size: 1),\n    // Late\n    \"d\": Perlin(),\r\n\r\n    \
            // Folds. They run.\r\n    \"e\": Perlin(),\n  },\n)";
        let of = |node: &str| name(text, text.find(&format!("\"{node}\": ")).unwrap() + 5);
        assert_eq!(of("a").as_deref(), Some("The grain"));
        assert_eq!(of("b").as_deref(), Some("The grain"));
        assert_eq!([of("c"), of("d")], [None, None]);
        assert_eq!(of("e").as_deref(), Some("Folds"));
        assert_eq!(name("\"= 2\"", 0), None);
    }
}
