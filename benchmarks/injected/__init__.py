"""Known effects added to real recordings, and whether they are found.

    python -m benchmarks injected [--quick] [--all] [--only=NAME] [--untouched]

Every recording of `recorded` is diagnosed as it is. Then one known effect is added to
its samples and it is diagnosed again: nothing may be lost of what was said before, the
effect must be named (or be an alias of what is), and nothing else may be invented.
Effects are 10 and 20 standard deviations, as an oracle sees them that knows
everything but the size (`oracle`), against the scatter that the recording itself shows;
`samples` says what the two sizes are of faults that have none.

By default every effect is added to a third of the recordings, the sizes by turns; --all
takes every recording and both sizes, --quick one recording of each kind. --only takes
the effects or recordings whose name has NAME in it, --only=EFFECT@RECORDING one case.
--untouched says what the recordings are said to be as they are, and no more. What is
drawn depends on the names and the size alone.
"""

from __future__ import annotations

import os


def main() -> None:
    """Print the table."""
    # small matrices by the thousand: threads would only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from benchmarks.injected.run import run

    run()
