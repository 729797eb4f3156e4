"""Check every link within a site: its page, file or picture is there, and so is its anchor."""

import sys
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from legbench.cli.output import note


@dataclass(slots=True)
class Page:
    """Anchors of a page, and what it links to."""

    anchors: set[str] = field(default_factory=set)
    links: list[str] = field(default_factory=list)


class Reader(HTMLParser):
    """Reader of one page."""

    def __init__(self) -> None:
        super().__init__()
        self.page = Page()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take in the identifiers and links of an element."""
        for name, value in attrs:
            if value and name in ("id", "name"):
                self.page.anchors.add(value)
            elif value and name in ("href", "src"):
                self.page.links.append(value)


def read(path: Path) -> Page:
    """Read a page of a site."""
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    return reader.page


def broken_links(site: Path) -> list[str]:
    """Links of a site that lead nowhere, each with its page; links to other sites are not followed.

    Args:
        site: folder of the site.
    """
    pages = {path.resolve(): read(path) for path in sorted(site.rglob("*.html"))}
    broken = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            wanted = unquote(parts.fragment)
            missing = not target.exists()
            missing |= bool(wanted) and target in pages and wanted not in pages[target].anchors
            if missing:
                broken.append(f"{path.relative_to(site.resolve())}: {link}")
    return broken


def main() -> int:
    """Check a site; 1 if a link of it is broken."""
    site = Path(sys.argv[1])
    broken = broken_links(site)
    for line in broken:
        note(line)
    count = sum(len(read(path).links) for path in site.rglob("*.html"))
    print(f"{count} links, {len(broken)} of them broken")
    return int(bool(broken))


if __name__ == "__main__":
    sys.exit(main())
