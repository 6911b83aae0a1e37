#!/usr/bin/env python3
"""Completes the web pages of the guide and checks their links.

    .ci/site.py SITE        SITE/docs has the pages that mdbook has made

Pages link to files of the repository outside docs/, such as scenes. These are copied to the same places relative to the
pages; of other Markdown files, to which mdbook links as .html, a page of plain text is made. Then every link and picture
must lead to a file, and every anchor to an element. The exit code is 1 if one does not.
"""

import html
import html.parser
import os
import pathlib
import shutil
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parent.parent


class Page(html.parser.HTMLParser):
    """The links and the anchors of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if value and (name, tag) in {("href", "a"), ("href", "link"), ("src", "img"), ("src", "script")}:
                self.links.append(value)
            if name == "id":
                self.anchors.add(value)


def copy(site, path):
    """Copies a file or folder of the repository that a page links to, if there is one."""
    relative = path.relative_to(site)
    source = ROOT / relative
    if path.exists() or relative.parts[0] == "docs":
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, path)
    elif source.is_file():
        shutil.copy(source, path)
    elif source.with_suffix(".md").is_file() and path.suffix == ".html":
        text = source.with_suffix(".md").read_text(encoding="utf-8")
        path.write_text(f'<!DOCTYPE html><meta charset="utf-8"><pre>{html.escape(text)}</pre>', encoding="utf-8")


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.glob("docs/**/*.html"))}
    assert len(pages) > 15, f"there are no pages in {site}/docs"
    broken, count = [], 0
    for path, page in pages.items():
        # A page for paths that do not exist, which may be shown anywhere.
        if path.name == "404.html":
            continue
        for link in page.links:
            address = urllib.parse.urlsplit(link)
            if address.scheme or address.netloc:
                continue
            count += 1
            linked = path
            if address.path:
                linked = pathlib.Path(os.path.normpath(path.parent / urllib.parse.unquote(address.path)))
                if not linked.is_relative_to(site):
                    broken.append(f"{path.name}: {link} is outside the site")
                    continue
                copy(site, linked)
            anchor = urllib.parse.unquote(address.fragment)
            if not linked.exists():
                broken.append(f"{path.name}: there is no {link}")
            elif anchor and linked in pages and anchor not in pages[linked].anchors:
                broken.append(f"{path.name}: there is no heading for {link}")
    print("\n".join(broken) or f"{len(pages)} pages, {count} links")
    sys.exit(1 if broken else 0)


main()
