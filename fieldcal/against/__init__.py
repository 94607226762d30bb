"""A recording held against a simulator's.

Each is a `side`, diagnosed by the one model; `pairing` asks both for the same causes,
`joint` weighs who has each, and `causes`, `offsets`, `lines_and_faults` and
`noise_levels` say what differs. `prediction` proves it on positions left out.
`comparison` puts it together.
"""

from fieldcal.against.comparison import compare, compare_sides
from fieldcal.against.result import Match

__all__ = ["Match", "compare", "compare_sides"]
