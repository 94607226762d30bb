"""Whether a result can be trusted for which positions were left out.

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


def left_out(found: Calibration) -> int:
    """How many positions were given no weight."""
    return sum(
        chance > thresholds.CERTAIN for chance in found.info.get("bad_position", ())
    )


def has_witnesses(found: Calibration) -> bool:
    """Whether half of the positions that were used would determine everything, (1)."""
    return _kept(found) >= 2 * _needed(found)


def witnesses(found: Calibration) -> str:
    """How many positions were left out and used, with the remedy if too few are."""
    out = left_out(found)
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
    return len(found.info.get("bad_position", ())) - left_out(found)


def _needed(found: Calibration) -> int:
    """A window of known angles gives three numbers, one of unknown angles a length."""
    of_acc = [name for name in found.names if not name.startswith("gyr")]
    return -(-len(of_acc) // (1 if found.method == "scalar" else 3))
