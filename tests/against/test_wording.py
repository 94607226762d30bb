"""Rows of the table that the terminal shows."""

from dataclasses import replace

import pytest

from fieldcal.against.result import (
    Difference,
    Direction,
    RealAndSimulated,
    SimulatorPrediction,
)
from fieldcal.against.wording import (
    difference_rows,
    paragraph,
    possible_difference,
)
from fieldcal.diagnosis.result import Quantity


def bump(at: float, push: float) -> Difference:
    parameters = {
        name: RealAndSimulated(q, None, q)
        for name, q in (
            ("at_s", Quantity(at, 0.01, "s")), ("push", Quantity(push, 0.1, "m/s^2"))
        )
    }  # fmt: skip
    return Difference("bump", "left_out", 1.0, parameters)


def test_what_happened_often_is_one_row_with_its_largest() -> None:
    quantity = Quantity(-0.002, 0.0001, "1")
    added = RealAndSimulated(None, Quantity(0.002, 0.0001, "1"), quantity)
    tied = Difference("quadratic", "added", 0.9, {"x": added}, ("cross_coupling",))
    first, second = difference_rows([bump(12.0, 1.0), bump(50.0, 3.0), tied])
    assert first == (
        "bump (2 times)", "left out",
        "push: real 3.00 ± 0.10 m/s², simulator none", "+3.00 ± 0.10 m/s²",
        "above 0.99",
    )  # fmt: skip
    assert second[0] == "quadratic, or cross coupling" and second[1] == "added"
    assert second[2] == "x: real none, simulator 0.00200 ± 0.00010"
    assert second[3:] == ("-0.00200 ± 0.00010", "0.90")


def test_what_one_of_the_two_cannot_show_is_not_said_to_differ_perhaps() -> None:
    """A simulator without gyroscopes has neither g-sensitivity nor none."""
    perhaps = replace(bump(12.0, 1.0), probability=0.75)
    assert "may differ, with a probability of 0.75" in possible_difference(perhaps)
    hidden = replace(perhaps, shown=False)
    said = possible_difference(hidden)
    assert said.endswith(
        "is not compared: nothing in the output of the simulator would show it"
    )
    said = possible_difference(replace(hidden, direction="added"))
    assert "in the output of the recording would show it" in said


def test_what_may_differ_is_not_nothing() -> None:
    predicted = SimulatorPrediction(1.0, 1.0, 1.0), SimulatorPrediction(1.0, 1.0, 1.0)
    perhaps = replace(bump(12.0, 1.0), probability=0.77)
    said = paragraph("consistent", [], predicted, possible=[perhaps])
    assert said.endswith("nothing differs for certain, but bump (P 0.77) may.")
    hidden = replace(perhaps, shown=False)
    for open_ones in ([], [hidden]):
        said = paragraph("consistent", [], predicted, possible=open_ones)
        assert said.endswith("nothing differs that these recordings can show.")


@pytest.mark.parametrize(
    ("direction", "expected"),
    [
        ("left_out", "That the simulator has nothing of bump is not certain (P 0.79)"),
        ("added", "That the recording has nothing of bump is not certain (P 0.79)"),
        ("resized", "That both have bump is not certain (P 0.79)"),
    ],
)
def test_a_direction_that_is_not_certain_is_said_so(
    direction: Direction, expected: str
) -> None:
    """A simulator may have so little of it that its output is as without it."""
    predicted = SimulatorPrediction(1.0, 1.0, 1.0), SimulatorPrediction(1.0, 1.0, 1.0)
    sure = replace(bump(12.0, 1.0), direction=direction)
    perhaps = replace(sure, direction_probability=0.79)
    assert expected in paragraph("left_out", [perhaps], predicted)
    assert "certain" not in paragraph("left_out", [sure], predicted)
    words = [difference_rows([one])[0][1] for one in (sure, perhaps)]
    assert words[1] == f"{words[0]}?"
    assert perhaps.to_json()["direction_probability"] == 0.79
