#!/usr/bin/env python3
"""Lists sentences of more than 35 words in the text that users read.

Without arguments: the help texts, error messages, warnings and progress lines in src/, taken from string literals and
from the documentation of command-line arguments. With arguments: the prose of these Markdown files.

    benches/sentences.py                      # help texts and messages
    benches/sentences.py README.md docs/*.md  # documentation

A sentence ends at a full stop, a question mark or an exclamation mark followed by a space, or at the end of the text.
Numbers and names that are formatted into a message count as one word each. Prints file, line, number of words and the sentence; exits with 1 if it lists any.
"""

import pathlib
import re
import sys

MOST_WORDS = 35

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Comments, characters and string literals of Rust, in this order of precedence.
TOKENS = re.compile(
    r"""(?P<comment>//[^\n]*)"""
    r"""|(?P<raw>r(?P<hashes>\#*)"(?P<raw_text>.*?)"(?P=hashes))"""
    r"""|(?P<string>"(?P<text>(?:[^"\\]|\\.)*)")"""
    r"""|'(?:\\u\{[^}]*\}|\\.|[^\\'])'""",
    re.DOTALL,
)


def sentences(text):
    """The sentences of a text, each on one line."""
    text = " ".join(text.split())
    return [part.strip() for part in re.split(r"(?<=[.?!])\s+", text) if part.strip()]


def words(sentence):
    """The number of words; placeholders and numbers count, punctuation alone does not."""
    return sum(1 for word in sentence.split() if any(c.isalnum() for c in word))


def literals(source):
    """The string literals outside tests and comments, with their lines."""
    source = source.split("#[cfg(test)]")[0]
    for token in TOKENS.finditer(source):
        text = token["text"] if token["string"] else token["raw_text"]
        if text is None:
            continue
        if token["string"]:
            text = re.sub(r"\\\n\s*", "", text).replace("\\n", "\n").replace('\\"', '"')
        if text.startswith("<"):
            continue  # markup, not prose
        text = re.sub(r"\{[^{}]*\}", "0", text)
        yield source.count("\n", 0, token.start()) + 1, text


def help_texts(source):
    """The documentation of arguments and subcommands, which clap shows as help, with their lines."""
    lines = source.split("#[cfg(test)]")[0].split("\n")
    block, start, is_field = [], 0, re.compile(r"\s+(#\[|(pub(\([a-z]+\))? )?\w+: |\w+(\(|,))")
    for number, line in enumerate(lines, 1):
        doc = re.match(r"\s+/// (.*)", line)
        if doc:
            start = start or number
            block.append(doc[1])
            continue
        if block and is_field.match(line):
            yield start, " ".join(block)
        block, start = [], 0


def prose(markdown):
    """The paragraphs, items and cells of a Markdown file, with their lines."""
    is_code, block, start = False, [], 0
    for number, line in enumerate(markdown.split("\n") + [""], 1):
        fence = line.lstrip().startswith("```")
        if fence:
            is_code = not is_code
        begins = re.match(r"\s*([-*#>]|\d+\.)\s", line)
        if fence or is_code or not line.strip() or begins or line.startswith("|"):
            if block:
                yield start, " ".join(block)
            block, start = [], 0
        if fence or is_code or not line.strip() or set(line) <= set("|-: "):
            continue
        if line.startswith("|"):
            yield from ((number, cell) for cell in line.strip("|").split("|"))
            continue
        start = start or number
        block.append(re.sub(r"^\s*([-*#>]|\d+\.)\s+", "", line))


def texts(arguments):
    """All texts to check, as (path, line, text)."""
    for name in arguments:
        path = pathlib.Path(name)
        yield from ((path, line, text) for line, text in prose(path.read_text(encoding="utf-8")))
    if arguments:
        return
    for path in sorted(ROOT.glob("src/**/*.rs")):
        if "tests" in path.parts or path.name == "tests.rs":
            continue
        source = path.read_text(encoding="utf-8")
        yield from ((path.relative_to(ROOT), line, text) for line, text in literals(source))
        if "cli" in path.parts:
            yield from ((path.relative_to(ROOT), line, text) for line, text in help_texts(source))


def main():
    found = 0
    for path, line, text in texts(sys.argv[1:]):
        for sentence in sentences(text):
            if words(sentence) > MOST_WORDS:
                found += 1
                print(f"{path}:{line}: {words(sentence)} words: {sentence}")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
