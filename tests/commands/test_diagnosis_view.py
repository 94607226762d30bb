"""What `fieldcal diagnose` shows: verdict, what to do, effects, a picture."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import pytest

from fieldcal.commands.diagnosis_view import show_diagnosis
from fieldcal.diagnosis.result import (
    CalibrationGroup,
    Diagnosis,
    FoundEffect,
    Mismatch,
    Quality,
    Quantity,
)
from fieldcal.diagnosis.wording.lines import effect_lines

SCREENS = Path(__file__).parent / "screens"

COUPLED = FoundEffect(
    "cross_coupling",
    {
        "k12": Quantity(-0.00798, 0.0001, "1"),
        "k21": Quantity(0.006041, 0.000024, "1"),
        "k23": Quantity(0.00003, 0.00036, "1"),
    },
    aliases=("bias_step",),
    evidence={"delta_chi2": 75818.0, "held_out_gain": 0.98},
    probability=0.93,
    moves={
        "acc_bias.y": Quantity(-0.031, 0.00083, "m/s^2"),
        "acc_scale.x": Quantity(1e-5, 2.5e-5, "1"),
    },
)
BUMPS = tuple(
    FoundEffect("bump", {"at_s": Quantity(t, 0.06, "s")}) for t in (48.23, 91.5)
)
WALK = FoundEffect("random_walk", {"ax": Quantity(4.7e-4, 9e-5, "m/s^2/sqrt(s)")})
EFFECTS = (*BUMPS, COUPLED, WALK)
NEXT = (
    "Take the position α = -45°, β = 0° too: it tells cross_coupling from bias_step"
    " (184 σ apart there).",
    "bump at positions 1, 4: Take the window again; nothing else is lost.",
    "cross_coupling: Solve with --cross: the coefficients go into the calibration.",
    "random_walk: Nothing takes it out.",
)
BEFORE = {"ax": 0.0115, "ay": 0.0307, "az": 0.0086, "gx": 1.2e-4, "gy": 1.1e-4}
AFTER = {"ax": 0.0009, "ay": 0.0008, "az": 0.001, "gx": 1.2e-4, "gy": 1.2e-4}
AMBIGUOUS = Diagnosis(
    verdict="ambiguous",
    probability=0.93,
    mismatch=(
        Mismatch(
            "ay", "position", tuple(range(9)), 3.0, 345.0,
            "force along the other axes", 0.0307, 254.0,
        ),
        Mismatch("az", "samples", (0,), 48.2, 48.4, "a bump in time", 0.2, 70.0),
    ),
    effects=EFFECTS,
    unit="m/s^2",
    before=Quality(0.0192, 47.9, 0.0251, BEFORE),
    after=Quality(0.00069, 0.98, 0.00076, AFTER),
    calibration={
        "acc_bias": CalibrationGroup(
            (-0.29974, 0.15088, 0.06897),
            (0.00085, 0.00083, 0.00083),
            (-0.03, -0.009, 0.019),
            "m/s^2",
        )
    },
    warnings=(),
    says="Something is left out, and it may be cross_coupling.",
    next=NEXT,
    lines=effect_lines(EFFECTS),
)  # fmt: skip
CONSISTENT = Diagnosis(
    "consistent", 0.87, (), (), "m/s^2",
    Quality(0.0007, 1.02, 0.00076, AFTER), Quality(0.0007, 1.02, 0.00076, AFTER),
    {}, (), "Recording and simulation agree.",
)  # fmt: skip


def screen(
    found: Diagnosis, width: int, details: bool = False, height: int | None = None
) -> str:
    out = io.StringIO()
    show_diagnosis(found, out=out, details=details, width=width, height=height)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


@pytest.mark.parametrize(
    ("name", "found", "width", "details"),
    [
        ("ambiguous-80", AMBIGUOUS, 80, False),
        ("ambiguous-120", AMBIGUOUS, 120, False),
        ("ambiguous-details-80", AMBIGUOUS, 80, True),
        ("consistent-80", CONSISTENT, 80, False),
    ],
)
def test_the_screen_is_as_kept(
    name: str, found: Diagnosis, width: int, details: bool
) -> None:
    kept = SCREENS / f"{name}.txt"
    assert screen(found, width, details) == kept.read_text(encoding="utf-8")


@pytest.mark.parametrize("width", [60, 80, 120])
def test_verdict_first_then_what_to_do_and_one_screen(width: int) -> None:
    shown = screen(AMBIGUOUS, width).splitlines()
    assert shown[0] == "AMBIGUOUS  probability 0.93 for all of it together"
    assert shown[1].startswith("→ Take the position α = -45°")
    assert max(map(len, shown)) <= width
    assert len(shown) <= (21 if width >= 80 else 30), "and a line for the prompt"


OTHERS = ("settling", "warm_up", "bias_drift", "gyro_scale", "quadratic")
OF_NINE = (
    *EFFECTS,
    *(FoundEffect(i, {"x": Quantity(0.1, 0.01, "1")}) for i in OTHERS),
)
MANY = replace(AMBIGUOUS, effects=OF_NINE, lines=effect_lines(OF_NINE))


@pytest.mark.parametrize("height", [20, 24, 50])
def test_what_is_shown_fits_the_screen_and_the_rest_is_counted(height: int) -> None:
    """The verdict is not pushed off the screen by effects, nor are any hidden."""
    shown = screen(MANY, 80, height=height).splitlines()
    assert shown[0] == "AMBIGUOUS  probability 0.93 for all of it together"
    assert len(shown) <= height - 3, "the file written, and the prompt"
    assert shown[-3].startswith("ax "), "the picture stays"
    there = [line.what for line in MANY.lines if any(line.what[:8] in s for s in shown)]
    missing = len(MANY.lines) - len(there)
    assert missing == {20: 6, 24: 2, 50: 0}[height]
    assert (f"{missing} more" in "\n".join(shown)) == bool(missing)
    assert screen(MANY, 80) == screen(MANY, 80, height=50), "what is no terminal"


def test_words_of_a_table_are_not_broken() -> None:
    """What a mismatch follows stands on a line or two, not each word on its own."""
    shown = screen(AMBIGUOUS, 80, details=True)
    assert "position: force along" in shown
