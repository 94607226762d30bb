"""Whether anybody bears witness to a result for which positions were left out.

The position that disagrees with all others may be the only honest one: a gauge that is
long spoils all but the level position alike. What is left can only be trusted where a
lie would need most of it, so that half of it alone determines everything,

    kept >= 2 needed,   needed = ceil(parameters / numbers in a window)            (1)

or where a position that was not fitted agrees.
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
    """Say so in a sentence, with the remedy where it is not so."""
    out = left_out(found)
    says = (
        f"{out} position{'s' if out > 1 else ''} disagreed and had no weight;"
        f" {_kept(found)} others were used, and {_needed(found)} determine everything"
    )
    if has_witnesses(found):
        return says
    return (
        f"{says}: with fewer than {2 * _needed(found)} it may be the others that are"
        " wrong; take positions again, add positions, or let one verify (--verify)"
    )


def _kept(found: Calibration) -> int:
    return len(found.info.get("bad_position", ())) - left_out(found)


def _needed(found: Calibration) -> int:
    """A window of known angles gives three numbers, one of unknown angles a length."""
    of_acc = [name for name in found.names if not name.startswith("gyr")]
    return -(-len(of_acc) // (1 if found.method == "scalar" else 3))
