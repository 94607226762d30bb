"""Sessions and motions that were once wrong, and that the model no longer gets wrong.

Run it after each change of the model, its causes or its search: a mend that is lost
shows here within minutes, and in new campaigns once in a hundred sessions.
"""

from __future__ import annotations

from typing import NamedTuple

from benchmarks.in_motion.pairs import CALIBRATION, compared, pulls
from benchmarks.never_wrong import Options, draw_and_judge


class Session(NamedTuple):
    """A session of `never_wrong`, and how it was wrong."""

    seed: int
    names: tuple[str, ...]
    was: str
    of_all: bool = False
    """Whether it is of a campaign that draws from all mistakes."""


class Motion(NamedTuple):
    """A motion of `in_motion`, and how what was said of it was wrong."""

    seed: int
    number: int
    was: str


SESSIONS = (
    Session(
        75100700,
        ("slips in its mount", "engine at times"),
        "5.2 sigma: a slip left out of a fit by length",
        of_all=True,
    ),
    Session(
        75150079,
        ("table kicked", "resampled"),
        "63 sigma: the instant of a knock was not on the grid",
    ),
    Session(
        75160108,
        ("ground gives way", "slips in its mount"),
        "54 sigma: two causes stood for one",
    ),
    Session(
        75150008,
        ("held by hand", "table kicked"),
        "5.3 sigma: a knock in a still window, smeared since others were held by hand",
    ),
    Session(
        75101003,
        ("two days joined",),
        "14.8 sigma: a restart beside axes that are not square",
        of_all=True,
    ),
    Session(
        75101024,
        ("bias of gyr tracked", "rates with few digits"),
        "20 sigma: rates that are all zero at rest, bias removed",
        of_all=True,
    ),
    Session(
        75220002,
        ("device restarted",),
        "12 sigma: a restart after which the gyroscopes' biases were the same",
    ),
    Session(
        75221021,
        ("device restarted",),
        "13.8 sigma in some processes: the jump was carried with any of three sizes",
    ),
    Session(
        98650030,
        ("gyr zeroed at each stop",),
        "61 sigma: a mean over a second, subtracted at each stop, leaves little",
    ),
    Session(
        75300001,
        ("gravity's direction alone",),
        "24 sigma: a direction of gravity in the place of accelerations",
    ),
    Session(
        75300209,
        ("calibrates itself",),
        "7.8 sigma: a scale factor that steps with the biases",
    ),
    Session(
        75300233,
        ("calibrates itself",),
        "6.7 sigma: a scale factor that steps, for which a K2 was taken",
    ),
    Session(
        75305601,
        ("supply falls",),
        "20.7 sigma: scale factors that fall with the supply",
    ),
    Session(
        75101459,
        ("calibrates itself", "resampled"),
        "27 sigma: a jump in one window, for which all were taken to be in a hand",
        of_all=True,
    ),
    Session(
        75280182,
        ("device exchanged",),
        "151 sigma: another device with similar biases and 33 times the noise",
    ),
    Session(
        75102019,
        ("calibrates itself",),
        "5.9 sigma: a search that took too many causes was no reason against it",
        of_all=True,
    ),
    Session(
        75102784,
        ("sun",),
        "5.7 sigma: heated from the first minute on, by a course that no effect had",
        of_all=True,
    ),
    Session(
        75102926,
        ("sun",),
        "6.5 sigma: heated from the last position but one on, scale factors too",
        of_all=True,
    ),
    Session(
        75102950,
        ("table kicked",),
        "18 sigma: a base that is kicked amid a position whose angles nobody knows",
        of_all=True,
    ),
    Session(
        75102241,
        ("slips in its mount",),
        "123 sigma: a step of the bias has the square of an angle, a linear turn not",
        of_all=True,
    ),
)

MOTIONS = (
    Motion(34400, 43, "a filter of second order for a long delay"),
    Motion(34600, 36, "a delay beside a filter that was none"),
    Motion(34800, 26, "a delay for a filter of second order"),
    Motion(34800, 38, "scale factors 4.7 sigma off beside increments"),
)


def main() -> None:
    """Print what is said of each now."""
    for case in SESSIONS:
        options = Options(limit=400.0, only="" if case.of_all else case.names[0])
        bench, names, one = draw_and_judge(case.seed, options, case.names)
        what = "GO" if one.go else f"NO-GO ({one.caught})"
        print(
            f"{'WRONG' if one.wrong else 'ok   '} {case.seed} {bench.places},"
            f" {', '.join(names)}: {what}, {one.off:.1f} sigma; was {case.was}",
            flush=True,
        )
    for motion in MOTIONS:
        drawn, found, _ = compared(motion.number, motion.seed)
        named = {d.id for d in found.differences} - CALIBRATION
        off = max(map(abs, pulls(drawn, found)), default=0.0)
        right = named == {drawn.kind} and off < 4.5
        print(
            f"{'ok   ' if right else 'WRONG'} {motion.seed} #{motion.number}"
            f" {drawn.kind}: {', '.join(sorted(named))}, at most {off:.1f} sigma; was"
            f" {motion.was}",
            flush=True,
        )
