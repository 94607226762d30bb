"""Words as a sentence lists them."""

from __future__ import annotations

from fieldcal.core.sentences import join_words


def test_lists_read_as_sentences() -> None:
    assert join_words(["a"]) == "a" and join_words(["a", "b", "c"]) == "a, b and c"
    assert join_words(["a", "b"], "or") == "a or b" and join_words([]) == ""
