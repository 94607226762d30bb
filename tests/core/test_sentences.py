"""Words as a sentence lists them."""

from __future__ import annotations

from fieldcal.core.sentences import join


def test_lists_read_as_sentences() -> None:
    assert join(["a"]) == "a" and join(["a", "b", "c"]) == "a, b and c"
    assert join(["a", "b"], "or") == "a or b" and join([]) == ""
