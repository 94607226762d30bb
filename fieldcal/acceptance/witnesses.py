"""Whether a result from which positions were left out can be trusted.

The position that disagrees with all others may be the only right one: a gauge that is
too long spoils all positions but the level one. The remaining positions are trusted if
half of them would determine all parameters,

    kept >= 2 needed,   needed = ceil(parameters / numbers in a window)            (1)

so that most of them would have to be wrong, or if a position that was not fitted
agrees.
"""

from __future__ import annotations

from fieldcal.calibration import Calibration
from fieldcal.model import thresholds


def rejected_positions(found: Calibration) -> int:
    """Number of positions that were given no weight."""
    return sum(
        chance > thresholds.CERTAIN for chance in found.info.get("bad_position", ())
    )


def has_witnesses(found: Calibration) -> bool:
    """Whether half of the positions that were used would determine everything, (1)."""
    return _kept(found) >= 2 * _needed(found)


def witness_sentence(found: Calibration) -> str:
    """Sentence with the numbers of positions left out and used, and the remedy."""
    out = rejected_positions(found)
    verb = "were" if out > 1 else "was"
    says = (
        f"{out} position{'s' if out > 1 else ''} disagreed and {verb} not used;"
        f" {_kept(found)} others were used, and {_needed(found)} of them would"
        " determine all parameters"
    )
    if has_witnesses(found):
        return says
    return (
        f"{says}: with fewer than {2 * _needed(found)} the others may be the wrong"
        " ones; repeat positions, add positions, or record a verification position"
        " (--verify)"
    )


def _kept(found: Calibration) -> int:
    return len(found.info.get("bad_position", ())) - rejected_positions(found)


def _needed(found: Calibration) -> int:
    """Positions needed: each gives 3 numbers, or 1 if its angles are unknown."""
    of_acc = [name for name in found.names if not name.startswith("gyr")]
    return -(-len(of_acc) // (1 if found.method == "scalar" else 3))
