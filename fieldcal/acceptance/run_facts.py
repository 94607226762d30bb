"""What happened during a run: losses on the link, restarts, insisted positions.

These facts are in the marks of the session and in the times of its samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fieldcal.core.sampling import shows_losses
from fieldcal.session.folder import Session
from fieldcal.session.marks import insisted_positions
from fieldcal.windows import Average


def link_counts(
    session: Session, windows: Sequence[Average], marks: Sequence[Mapping[str, Any]]
) -> dict[str, int]:
    """Samples and missing samples in the windows; frames of the whole run, and refused.

    Gaps between the used pieces of a window do not count as missing. Nothing is said of
    missing samples if the times show none.
    """
    samples = missing = 0
    block, gaps, shown = session.block, session.about.excluded_spans, True
    period = float(np.median(np.diff(block.t))) if len(block) > 1 else np.nan
    for window in windows:
        t = block.between(window.start, np.nextafter(window.end, np.inf)).t
        samples += len(t)
        shown &= shows_losses(t)
        if len(t) > 1 and period > 0:
            lost = np.maximum(np.rint(np.diff(t) / period) - 1, 0)
            for start, end in gaps:
                lost[(t[:-1] >= np.nextafter(start, -np.inf)) & (t[1:] <= end)] = 0
            missing += int(lost.sum())
    bad = sum(int(m.get("bad", 0)) for m in marks if m.get("event") == "link")
    counts = {"samples": samples, "bad": bad, "taken": len(block)}
    return counts | ({"missing": missing} if shown else {})


def insistence_doubts(marks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences about positions that were accepted although they looked wrong."""
    return [
        f"position {number + 1} was accepted by the operator although {text}"
        for number, text in sorted(insisted_positions(marks).items())
    ]


def restart_warnings(marks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Warnings that the windows come from before and after a restart of the device."""
    taken: list[int] = []
    said = []
    for mark in marks:
        if mark.get("event") == "window":
            taken.append(int(mark["position"]))
        elif mark.get("event") == "rejoined" and taken:
            said.append(
                f"the recording was interrupted after position {taken[-1] + 1}: if the"
                " device lost power meanwhile, its bias may have changed; record all"
                " positions without a restart"
            )
    counted = sum(int(m.get("restarts", 0)) for m in marks if m.get("event") == "link")
    if counted:
        times = "once" if counted == 1 else f"{counted} times"
        said.append(
            f"the device restarted {times} during the run, and its bias may differ from"
            " start to start: record all positions without a restart"
        )
    return said
