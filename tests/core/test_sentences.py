"""Words as a sentence lists them."""

from __future__ import annotations

from fieldcal.core.sentences import degrees_of_freedom, join_words


def test_lists_read_as_sentences() -> None:
    assert join_words(["a"]) == "a" and join_words(["a", "b", "c"]) == "a, b and c"
    assert join_words(["a", "b"], "or") == "a or b" and join_words([]) == ""


def test_one_degree_of_freedom_is_one() -> None:
    said = [degrees_of_freedom(n) for n in (0, 1, 2)]
    assert said == [
        "0 degrees of freedom",
        "1 degree of freedom",
        "2 degrees of freedom",
    ]
