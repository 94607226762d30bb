"""Positions of a plan that a session does not hold, and how they are taken.

A run that was stopped, and a recording of which only a part is left, lack some.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

from fieldcal.core.errors import SessionInUse
from fieldcal.core.sentences import join_words
from fieldcal.run.resuming import is_decided, is_finished
from fieldcal.session.folder import Session
from fieldcal.session.lock import refuse_in_use
from fieldcal.session.marks import taken_windows
from fieldcal.session.recorder import SAMPLES

VERIFYING = "the one that verifies"
"""What the position is called that is not fitted, behind others."""


def untaken_positions(session: Session) -> tuple[list[str], list[str]]:
    """Positions that have no window, and those of whose window no sample is left.

    Each by its number, from 1, and its name. The position that verifies comes last
    among those without a window, where the run was to take one.
    """
    untaken, lost = [], []
    for i, place in enumerate(session.positions):
        number, window = f"{i + 1}", session.windows[i]
        label = number + (
            f" ({place.name})" if place.name != f"position {number}" else ""
        )
        if window is None:
            untaken.append(label)
        elif not len(session.block.between(*window)):
            lost.append(label)
    wanted = _run_table(session).get("verify")
    if wanted and len(session.positions) not in taken_windows(session.marks()):
        untaken.append(VERIFYING)
    return untaken, lost


def untaken_sentence(session: Session) -> str:
    """Which positions are missing, and how to take them; empty if none is.

    A run whose result is there has said already what to take besides.
    """
    untaken, lost = untaken_positions(session)
    said = []
    if lost:
        said.append(f"no sample is left of {_listed(lost)}")
    if untaken and not _run_table(session):
        what = "each" if len(untaken) > 1 else "it"
        said.append(
            f"{_listed(untaken)} {'have' if len(untaken) > 1 else 'has'} no window:"
            f" state start_s and end_s of {what} in session.toml"
        )
    elif untaken:
        verb = "were" if len(untaken) > 1 else "was"
        of = "" if untaken == [VERIFYING] else " of the plan"
        said.append(f"{_listed(untaken)}{of} {verb} not taken")
    elif not lost and _run_table(session) and not is_finished([*session.marks()]):
        said.append("the run has not come to its result")
    goes_on = _run_table(session) and (session.folder / SAMPLES).exists()
    if not said or not goes_on or is_decided(session):
        return "; ".join(said)
    return f"{'; '.join(said)}: {_way_on(session)}"


def _listed(labels: Sequence[str]) -> str:
    if [*labels] == [VERIFYING]:
        return "the position that verifies"
    return f"position{'s' if len(labels) > 1 else ''} {join_words(labels)}"


def _run_table(session: Session) -> Mapping[str, object]:
    """Table [run] of a session that was recorded by a run; empty otherwise."""
    found = session.about.raw.get("run", {})
    return found if isinstance(found, Mapping) else {}


def _way_on(session: Session) -> str:
    """How a run goes on, also with that of a further device; it may do so already."""
    folder, further = session.folder, _run_table(session).get("further", ())
    if isinstance(further, list) and session.about.device.get("address") in further:
        folder = folder.absolute().parent
    try:
        refuse_in_use(session.folder)
    except SessionInUse:
        return "it is being recorded"
    return f"fieldcal run --resume {shlex.quote(str(folder))} goes on with the run"
