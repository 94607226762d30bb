"""Whether a result from which positions were left out can be trusted.

The position that disagrees with all others may be the only right one: a gauge that is
too long spoils all positions but the level one. The remaining positions are trusted if
half of them would determine all parameters,

    kept >= 2 needed,   needed = ceil(parameters / numbers in a window)            (1)

so that most of them would have to be wrong, or if a position that was not fitted
agrees.
"""

from __future__ import annotations

from fieldcal.acceptance.check import Check
from fieldcal.calibration import Calibration
from fieldcal.model import thresholds
from fieldcal.solve.doubtful_position import DoubtfulPosition


def rejected_positions(calibration: Calibration) -> int:
    """Number of positions that were given no weight."""
    return sum(
        chance > thresholds.CERTAIN
        for chance in calibration.info.get("bad_position", ())
    )


def has_witnesses(calibration: Calibration) -> bool:
    """Whether half of the positions that were used would determine everything, (1)."""
    return _kept(calibration) >= 2 * _needed(calibration)


def witness_sentence(calibration: Calibration) -> str:
    """Sentence with the numbers of positions left out and used, and the remedy."""
    out = rejected_positions(calibration)
    verb = "were" if out > 1 else "was"
    says = (
        f"{out} position{'s' if out > 1 else ''} disagreed and {verb} not used;"
        f" {_kept(calibration)} others were used, and {_needed(calibration)} of them"
        " would determine all parameters"
    )
    if has_witnesses(calibration):
        return says
    return (
        f"{says}: with fewer than {2 * _needed(calibration)} the others may be the"
        " wrong ones; repeat positions, add positions, or record a verification"
        " position (--verify)"
    )


def _kept(calibration: Calibration) -> int:
    return len(calibration.info.get("bad_position", ())) - rejected_positions(
        calibration
    )


def _needed(calibration: Calibration) -> int:
    """Positions needed: each gives 3 numbers, or 1 if its angles are unknown."""
    of_acc = [name for name in calibration.names if not name.startswith("gyr")]
    return -(-len(of_acc) // (1 if calibration.method == "scalar" else 3))


def check_doubtful_position(calibration: Calibration, verified: bool) -> list[Check]:
    """Report a doubtful position; NO-GO if too few others confirm the result."""
    doubt = DoubtfulPosition.from_json(calibration.info.get("doubtful_position"))
    checks = [Check("positions", None, doubt.sentence)] if doubt else []
    if verified or not rejected_positions(calibration):
        return checks
    return [
        *checks,
        Check("witnesses", has_witnesses(calibration), witness_sentence(calibration)),
    ]
