"""The documentation's examples are run, on a session of a virtual device."""

import doctest
from pathlib import Path

import pytest
from bench import five_positions

DOCS = Path(__file__).parent.parent / "docs"


@pytest.fixture
def bench_7(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder to stand in, with a session of five positions on a tilted base."""
    monkeypatch.chdir(tmp_path)
    five_positions(tmp_path / "bench-7")


@pytest.mark.usefixtures("bench_7")
@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda p: p.stem)
def test_examples_of_the_documentation(page: Path) -> None:
    failed, tried = doctest.testfile(str(page), module_relative=False)
    assert failed == 0
    assert tried or ">>>" not in page.read_text()
