"""Tables in terminals that are too narrow for them: nothing of a number is cut off."""

import io

import numpy as np
import pytest
from rich.box import SIMPLE_HEAD
from rich.table import Table

from fieldcal.calibration import Calibration
from fieldcal.commands.console import EscapingConsole
from fieldcal.commands.table import show_calibration

FOUND = Calibration(
    "joint", ("acc_bias.x", "acc_scale.x"), np.array([0.2142, 1.00653]),
    np.diag([0.0171, 0.0021]) ** 2, ("m/s^2", "1"), 1.0, 1, 1e-3,
)  # fmt: skip

LIST = """\
Calibration
acc bias x
  value: 0.214 ± 0.017 m/s^2
acc scale factor x
  value: 1.0065 ± 0.0021
"""


def printed(table: Table, width: int) -> list[str]:
    out = io.StringIO()
    EscapingConsole(file=out, width=width).print(table)
    return [line.rstrip() for line in out.getvalue().splitlines()]


def table() -> Table:
    made = Table(title="Agreement", box=SIMPLE_HEAD)
    for name in ("channel", "follows", "rms", "± 1σ", "unit", "change"):
        made.add_column(name, no_wrap=name == "rms")
    made.add_row("ax", "one pattern through all", "0.00708", "0.00012", "m/s^2", "")
    made.add_row("ay", "what is left…", "0.0155", "0.0003", "m/s^2", "+3 σ")
    return made


def test_a_calibration_in_forty_columns_has_all_digits_and_units(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    show_calibration(FOUND)
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert lines[:5] == LIST.splitlines()
    monkeypatch.setenv("COLUMNS", "80")
    show_calibration(FOUND)
    assert "│ acc bias x         │  0.214 │" in capsys.readouterr().out


@pytest.mark.parametrize("width", range(30, 60))
def test_whatever_the_width_no_word_is_lost(width: int) -> None:
    words = (
        "ax one pattern through all 0.00708 0.00012 m/s^2 ay 0.0155 0.0003 +3".split()
    )
    shown = " ".join(printed(table(), width)).split()
    assert set(words) <= set(shown)


def test_a_table_that_fits_stays_one() -> None:
    wide = printed(table(), 80)
    assert "channel" in wide[2] and "change" in wide[2], "with the names in one line"
    assert "what is left…" in wide[5], "an ellipsis of its own is no cut"


def test_the_parts_of_a_value_stand_together() -> None:
    assert printed(table(), 40) == [
        "Agreement",
        "ax",
        "  follows: one pattern through all",
        "  rms: 0.00708 ± 0.00012 m/s^2",
        "ay",
        "  follows: what is left…",
        "  rms: 0.0155 ± 0.0003 m/s^2",
        "  change: +3 σ",
    ]


def test_a_unit_of_several_columns_stands_with_the_name() -> None:
    made = Table()
    for name in ("parameter", "this plan", "the paper's five", "unit"):
        made.add_column(name)
    made.add_row("acc_bias.x", "0.00017", "0.00087", "m/s²")
    assert printed(made, 30) == [
        "acc_bias.x (m/s²)",
        "  this plan: 0.00017",
        "  the paper's five: 0.00087",
    ]


def test_a_grid_without_names_is_left_alone() -> None:
    grid = Table.grid()
    grid.add_row("0.123456789", "0.987654321")
    assert len(printed(grid, 12)) == 1
