"""The documents lead to one another: every page is in the index, every link within them exists."""

import re
import unicodedata
from pathlib import Path

import pytest
from docs_blocks import FENCED, ROOT, pages
from docs_links import broken_links

PAGES = [*pages(), ROOT / "CHANGELOG.md"]
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]+))?\)")
HEADING = re.compile(r"^#{1,4} (.+)$", re.MULTILINE)
LARGEST_PICTURE = 500_000
"""Largest size of the picture on the first screen [bytes]."""


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as a repository browser makes them."""
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    plain = [unicodedata.normalize("NFKC", heading).lower() for heading in HEADING.findall(text)]
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


def test_every_page_is_in_the_index() -> None:
    index = ROOT / "docs" / "index.md"
    trees = re.findall(r"```\{toctree\}\n(.*?)```", index.read_text(encoding="utf-8"), re.DOTALL)
    named = re.findall(r"^(?:.*<)?([\w./-]+)>?$", "\n".join(trees), re.MULTILINE)
    listed = {(index.parent / f"{name}.md").resolve() for name in named}
    assert {page.resolve() for page in PAGES} - listed == {index.resolve()}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page: Path) -> None:
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    broken = []
    for path, anchor in LINK.findall(text):
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            broken.append(f"{path}#{anchor}" if anchor else path)
    assert broken == []


def test_the_first_screen_shows_a_picture_that_moves() -> None:
    picture = (ROOT / "docs" / "jumping.gif").read_bytes()
    assert picture.startswith(b"GIF89a")
    assert b"NETSCAPE2.0" in picture
    assert len(picture) <= LARGEST_PICTURE
    first = (ROOT / "README.md").read_text(encoding="utf-8")[:1000]
    assert "docs/jumping.gif" in first
    assert "legbench render" in first


def test_a_broken_link_of_a_site_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<a href="b.html#here">1</a><a href="b.html#there">2</a><a href="c.html">3</a>'
        '<a href="https://example.org/x">4</a><a href="#top">5</a><h1 id="top">6</h1>'
    )
    (tmp_path / "b.html").write_text('<p id="here">')
    assert broken_links(tmp_path) == ["a.html: b.html#there", "a.html: c.html"]
