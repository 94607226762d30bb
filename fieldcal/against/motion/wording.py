"""The alignment of two recordings of one motion, in a sentence."""

from __future__ import annotations

from fieldcal.against.result import Aligned
from fieldcal.diagnosis.wording.paragraph import with_uncertainty


def alignment_sentence(where: Aligned) -> str:
    """Delay, clock rate and axes with their ±."""
    turns = ", ".join(
        f"{with_uncertainty(angle)} about {axis}" for axis, angle in where.turn.items()
    )
    return (
        f"Over {where.compared_s:.0f} s of common motion the recording's clock is"
        f" {with_uncertainty(where.delay)} ahead of the simulator's at"
        f" {where.at_s:.0f} s and slower by {with_uncertainty(where.drift)}; its axes"
        f" are turned by {turns}."
    )
