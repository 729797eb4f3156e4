"""The page in a real browser: nothing complains, nothing is asked for, everything fits."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import Browser, browser, chromium

WIDTHS = (1280, 390)
SMALLEST_TEXT = 8.0
"""Smallest text of a figure that counts as readable [px]."""
MEASURE = """
[...document.querySelectorAll('.panel svg')].map(svg => {
  const box = svg.getBoundingClientRect();
  const sizes = [...svg.querySelectorAll('text')].map(text =>
    parseFloat(getComputedStyle(text).fontSize) * box.width / svg.viewBox.baseVal.width);
  return [box.left, box.right, box.height, Math.min(...sizes, 99)];
})
"""
"""Left and right end, height and smallest text of every panel [px]."""

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        chromium() is None, reason="no chromium is installed: apt-get install chromium"
    ),
]


@pytest.fixture
def page(reported: tuple[Path, dict[str, Any]]) -> Path:
    return reported[0]


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


@pytest.mark.parametrize("width", WIDTHS)
def test_the_page_opens_without_a_complaint_or_a_request(
    tab: Browser, page: Path, width: int
) -> None:
    visit = tab.open(page, width)
    assert visit.complaints == []
    assert visit.urls == [page.as_uri()]


@pytest.mark.parametrize("width", WIDTHS)
def test_figures_lie_within_the_window_and_are_readable(
    tab: Browser, page: Path, width: int
) -> None:
    tab.open(page, width)
    assert tab.ask("innerWidth") == width
    assert tab.ask("document.documentElement.scrollWidth") <= width
    panels = tab.ask(MEASURE)
    assert len(panels) == 29
    for left, right, height, text in panels:
        assert 0.0 <= left < right <= width
        assert right - left >= 70.0
        assert height >= 70.0
        assert text >= SMALLEST_TEXT


@pytest.mark.parametrize("width", WIDTHS)
def test_open_folds_stay_within_the_window(tab: Browser, page: Path, width: int) -> None:
    tab.open(page, width)
    folds = "document.querySelectorAll('details')"
    tab.ask(f"{folds}.forEach(each => {{ each.open = true; }})")
    assert tab.ask(f"{folds}.length") >= 6
    assert tab.ask("document.documentElement.scrollWidth") <= width


def test_a_page_that_complains_and_asks_is_noticed(tab: Browser, tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text('<img src="missing.png"><script>console.error("no")</script>', encoding="utf-8")
    visit = tab.open(bad, 1280)
    assert (tmp_path / "missing.png").as_uri() in visit.urls
    assert len(visit.complaints) >= 2
