"""What a screen reader and a keyboard find in the report."""

from __future__ import annotations

from collections import Counter
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import pytest
from observed import SHARED

from fieldcal.cli import main

VOID = {"meta", "link", "br", "img", "input", "hr"}

Attributes = dict[str, str | None]


class Page(HTMLParser):
    """Elements of a page in order, with the names of what they stand in."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, Attributes, tuple[str, ...]]] = []
        self.words: dict[int, str] = {}
        self._open: list[tuple[str, int]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        above = tuple(name for name, _ in self._open)
        self.elements.append((tag, dict(attrs), above))
        if tag not in VOID:
            self._open.append((tag, len(self.elements) - 1))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        for _, place in self._open:
            self.words[place] = self.words.get(place, "") + data

    def all(self, *tags: str) -> list[tuple[int, Attributes, tuple[str, ...]]]:
        return [
            (i, attributes, above)
            for i, (tag, attributes, above) in enumerate(self.elements)
            if tag in tags
        ]


@pytest.fixture(
    scope="module",
    params=["own", pytest.param("practice", marks=pytest.mark.thorough)],
)
def page(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Page:
    """The report of a run of ours, or of a session that was diagnosed too."""
    if request.param == "own":
        session = request.getfixturevalue("recalibrated").folder
    else:
        session = practice(tmp_path_factory.mktemp("page"))
    return Page((session / "report.html").read_text("utf-8"))


def practice(folder: Path) -> Path:
    source = SHARED / "practice" / "p05"
    if not source.is_dir():
        pytest.skip(f"the practice session is not here: {source}")
    session = folder / "p05"
    session.mkdir()
    for name in ("session.toml", "samples.csv.gz"):
        (session / name).write_bytes((source / name).read_bytes())
    main(["solve", str(session)])
    main(["diagnose", str(session)])
    assert main(["report", str(session)]) == 0
    return session


def test_the_page_can_be_read_without_seeing_it(page: Page) -> None:
    attributes = [a for _, a, _ in page.elements]
    ids = Counter(a["id"] for a in attributes if "id" in a)
    assert max(ids.values()) == 1, ids.most_common(1)
    for a in attributes:
        for name in ("aria-labelledby", "aria-describedby"):
            assert set((a.get(name) or "").split()) <= set(ids)
        if (a.get("href") or "").startswith("#"):
            assert (a["href"] or "")[1:] in ids
    (root,) = page.all("html")
    assert root[1]["lang"] == "en"
    for landmark in ("main", "header", "nav", "title", "h1"):
        assert len(page.all(landmark)) == 1, landmark
    levels = [int(page.elements[i][0][1]) for i, *_ in page.all("h1", "h2", "h3", "h4")]
    assert all(after <= before + 1 for before, after in pairwise(levels))


def test_every_plot_and_table_says_what_it_is(page: Page) -> None:
    plots = [a for a in (a for _, a, _ in page.elements) if a.get("role") == "img"]
    assert len(plots) >= 5
    for plot in plots:
        assert plot["tabindex"] == "0"
        said = plot["aria-label"] or ""
        assert len(said) > 60 and "Arrow keys move" in said
    tables = page.all("table")
    captions = [page.words[i].strip() for i, *_ in page.all("caption")]
    assert len(captions) == len(tables) and all(captions)
    for i, a, above in page.all("th"):
        assert a["scope"] in ("col", "row") and "table" in above, i
    for i, a, _ in page.all("a", "button", "summary"):
        assert page.words.get(i, "").strip() or a.get("aria-label")
