"""A simulator that is a command: run, compared, patched, and run again.

    CMD {patch} {out}

is run without a shell, with the patch's file and that of its output in the places of
these words. At first the patch changes nothing. What a simulator that fails has said
is told, and nothing is kept of a round that was not finished.
"""

from __future__ import annotations

import shlex
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from fieldcal.against import patches
from fieldcal.against.result import Match
from fieldcal.against.sensor_model import SensorModel, patched
from fieldcal.core.errors import InputError
from fieldcal.core.shown import shown

Compare = Callable[[Path], tuple[Match, list[str]]]
"""What a file of a simulator differs in, and what the user must know of it."""

PATCH, OUT = "{patch}", "{out}"

SAID = 5
"""Last lines of a simulator that failed which are shown."""


@dataclass(frozen=True)
class SimulatorRun:
    """One run of the simulator.

    Attributes
    ----------
    patch : what it was run with; of the last, with what the format has nothing for
    match : how its output compares
    says : what the user must know of the output

    """

    patch: SensorModel
    match: Match
    says: tuple[str, ...]


def is_command(text: str) -> bool:
    """Whether what is compared with is a command, and no file."""
    return OUT in text


def rounds(
    command: str,
    compare: Compare,
    rate_hz: float,
    form: str,
    most: int,
    tell: Callable[[int, SimulatorRun], None],
) -> list[SimulatorRun]:
    """Run and patch until nothing differs, or `most` patches were tried.

    Where the format has nothing for what is left, a further patch would be the same.

    Parameters
    ----------
    command : with {out} in it, and {patch}
    compare : holds the recording against a file that the simulator wrote
    rate_hz : samples a second of the recording
    form : of the patch, in `patches.formats`
    most : patches
    tell : is called after each run with its number, from 0

    Raises
    ------
    InputError
        If the command fails, writes nothing, or what it writes cannot be compared.

    """
    if most < 0:
        raise InputError(f"--rounds {most}: name how many patches are tried, or 0")
    if PATCH not in command:
        raise InputError(
            f"{command}: has no {PATCH}, in the place of which the patch's file stands"
        )
    done: list[SimulatorRun] = []
    model = SensorModel(rate_hz=rate_hz)
    for number in range(most + 1):
        found, said = _run(command, compare, form, model)
        after = patched(found, model)
        left = {one.id for one in found.differences}
        last = not left & set(patches.patch_format(form).HOLDS)
        done.append(SimulatorRun(after if last else model, found, tuple(said)))
        tell(number, done[-1])
        if last:
            break
        model = after
    return done


def _run(
    command: str, compare: Compare, form: str, model: SensorModel
) -> tuple[Match, list[str]]:
    """How what the simulator makes with a patch compares, and what is said of it."""
    with TemporaryDirectory() as folder:
        ending = patches.patch_format(form).ENDING
        patch, out = Path(folder) / f"patch{ending}", Path(folder) / "out"
        patches.write(form, model, patch)
        places = {PATCH: str(patch), OUT: str(out)}
        _call([_placed(word, places) for word in _words(command)], command)
        if not out.exists():
            raise InputError(
                f"{command}: ended well and wrote nothing to {OUT}: let it write its"
                " recording to the file that stands there"
            )
        return compare(out)


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command)
    except ValueError as error:
        raise InputError(f"{command}: is no command: {error}") from None


def _placed(word: str, places: dict[str, str]) -> str:
    for name, path in places.items():
        word = word.replace(name, path)
    return word


def _call(words: list[str], command: str) -> None:
    """Run a command to its end."""
    try:
        done = subprocess.run(
            words, capture_output=True, text=True, errors="replace", check=False
        )
    except OSError as error:
        raise InputError(f"{command}: cannot be started: {error.strerror}") from None
    if done.returncode:
        said = [
            line for line in (done.stdout + done.stderr).splitlines() if line.strip()
        ]
        last = " | ".join(shown(line.strip()) for line in said[-SAID:])
        raise InputError(
            f"{command}: failed with exit code {done.returncode}; it said:"
            f" {last or 'nothing'}"
        )
