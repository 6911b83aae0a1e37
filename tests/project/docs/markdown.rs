//! What the tests need to know of Markdown.

/// A block of code: the word after the fence, its first line in the file, and its text.
pub(crate) struct Code {
    pub(crate) language: String,
    pub(crate) line: usize,
    pub(crate) text: String,
}

/// The fenced blocks of a text.
pub(crate) fn code_blocks(text: &str) -> Vec<Code> {
    let mut blocks: Vec<Code> = Vec::new();
    let mut is_open = false;
    for (i, line) in text.lines().enumerate() {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            if !is_open {
                blocks.push(Code { language: language.trim().to_owned(), line: i + 2, text: String::new() });
            }
            is_open = !is_open;
        } else if is_open {
            let block = blocks.last_mut().expect("a block is open");
            block.text += line;
            block.text.push('\n');
        }
    }
    blocks
}

/// The text with empty lines in place of blocks of code and of comments.
pub(crate) fn without_code(text: &str) -> String {
    let mut is_open = false;
    let mut kept = String::new();
    for line in text.lines() {
        let is_fence = line.trim_start().starts_with("```");
        is_open ^= is_fence;
        if !is_open && !is_fence && !line.starts_with("<!--") {
            kept += line;
        }
        kept.push('\n');
    }
    kept
}

/// The text of a line with nothing in place of its inline code.
pub(crate) fn without_inline_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join("")
}

/// The targets of the links and pictures of a text, each with the number of its line.
pub(crate) fn links(text: &str) -> Vec<(usize, String)> {
    let mut links = Vec::new();
    for (i, line) in without_code(text).lines().enumerate() {
        // The text of a link may be inline code.
        for part in line.split("](").skip(1) {
            let target = part.split(')').next().expect("a first part");
            links.push((i + 1, target.to_owned()));
        }
    }
    links
}

/// The anchors of the headings of a text, as GitHub and mdBook make them.
pub(crate) fn anchors(text: &str) -> Vec<String> {
    let mut anchors: Vec<String> = Vec::new();
    for line in without_code(text).lines().filter(|line| line.starts_with('#')) {
        let heading = line.trim_start_matches('#').trim();
        let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let anchor = kept.collect::<String>().to_lowercase().replace(' ', "-");
        let same = anchors.iter().filter(|other| **other == anchor).count();
        anchors.push(if same == 0 { anchor } else { format!("{anchor}-{same}") });
    }
    anchors
}

/// How many words a text has.
pub(crate) fn words(text: &str) -> usize {
    text.split_whitespace().filter(|word| word.chars().any(char::is_alphanumeric)).count()
}

#[test]
fn markdown_is_understood() {
    let text = "# One `two`\n[![a](p.png)](b.md#c) `](no)`?\n```toml\n# x\n[d](e)\n```\n## One two\n";
    assert_eq!(anchors(text), ["one-two", "one-two-1"]);
    assert_eq!(links(text)[..2], [(2, "p.png".to_owned()), (2, "b.md#c".to_owned())]);
    let blocks = code_blocks(text);
    assert_eq!((blocks.len(), blocks[0].line), (1, 4));
    assert_eq!((&*blocks[0].language, &*blocks[0].text), ("toml", "# x\n[d](e)\n"));
    assert_eq!(words("- **Two** words, — `x` 3"), 4);
    assert_eq!(without_inline_code("a `b` c"), "a  c");
}
