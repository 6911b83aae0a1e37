//! Checks of the tags of an XML text before it is parsed, for texts that would take the parser much time or memory.
//!
//! The parser compares each attribute of an element to all others, and stores a list of all namespaces for each element
//! that declares one.

use super::limits::MOST_ATTRIBUTES;

/// The first problem with the tags of a text, and its byte offset. Invalid XML is not detected here.
pub(super) fn problem(text: &str) -> Option<(usize, String)> {
    let bytes = text.as_bytes();
    let mut at = 0;
    while let Some(start) = find(text, at, "<") {
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        let begins = |(opening, _): &&(&str, &str)| bytes[start..].starts_with(opening.as_bytes());
        at = match skipped.iter().find(begins) {
            Some((opening, end)) => find(text, start + opening.len(), end)? + end.len(),
            None => {
                let (end, attributes, has_namespace) = tag(bytes, start + 1);
                if attributes > MOST_ATTRIBUTES {
                    return Some((start, format!("an element has more than {MOST_ATTRIBUTES} attributes")));
                }
                if has_namespace {
                    return Some((start, "namespaces of XML are not read".into()));
                }
                end
            }
        };
    }
    None
}

fn find(text: &str, from: usize, what: &str) -> Option<usize> {
    text.get(from..)?.find(what).map(|at| from + at)
}

/// The end of a tag, the number of its quoted values, and whether it declares a namespace.
fn tag(bytes: &[u8], start: usize) -> (usize, usize, bool) {
    let (mut at, mut attributes, mut has_namespace) = (start, 0, false);
    while let Some(&byte) = bytes.get(at) {
        at += 1;
        match byte {
            b'>' => break,
            b'"' | b'\'' => {
                attributes += 1;
                at += bytes[at..]
                    .iter()
                    .position(|&other| other == byte)
                    .map_or(bytes.len() - at, |end| end + 1);
            }
            _ if byte.is_ascii_whitespace() => has_namespace |= bytes[at..].starts_with(b"xmlns"),
            _ => {}
        }
    }
    (at, attributes, has_namespace)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_counted_where_they_are_some() {
        let element = |count: usize| format!("<a b='>' c=\"'<\"{}/>", " d=\"e\"".repeat(count - 2));
        assert_eq!(problem(&element(MOST_ATTRIBUTES)), None);
        let told = format!("an element has more than {MOST_ATTRIBUTES} attributes");
        assert_eq!(problem(&format!("é <a/>{}", element(MOST_ATTRIBUTES + 1))), Some((7, told)));
        let many = element(99);
        for hidden in [format!("<!--{many}-->"), format!("<![CDATA[{many}]]>"), format!("<?a {many}?>")] {
            assert_eq!(problem(&format!("<r>{hidden}</r>")), None, "{hidden}");
            assert!(problem(&format!("<r>{hidden}{many}</r>")).is_some());
        }
    }

    #[test]
    fn namespaces_are_refused() {
        let told = || "namespaces of XML are not read".to_owned();
        assert_eq!(problem("<a>\n<b xmlns:c='d'/></a>"), Some((4, told())));
        assert_eq!(problem("<a\txmlns='d'/>"), Some((0, told())));
        assert_eq!(problem("<a b=' xmlns=1' xml='d'/>"), None);
    }

    #[test]
    fn what_does_not_end_is_no_problem() {
        for text in ["", "<", "<a", "<a b='", "<!--", "<![CDATA[", "<?", "<!-", "<a b=\"é"] {
            assert_eq!(problem(text), None, "{text}");
        }
    }
}
