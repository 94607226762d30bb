"""A virtual twin of the device that made a recording, and its proof.

`device` makes the virtual device that a diagnosis describes, `schedule` has it held as
the session held the real one, `rerun` replays the session on it and compares.
"""

from fieldcal.twin.agreement import ReplayResult
from fieldcal.twin.rerun import replay_session

__all__ = ["ReplayResult", "replay_session"]
