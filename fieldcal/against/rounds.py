"""Runs a simulator that is a command, compares, patches it, and runs it again.

    CMD {patch} {out}

is run without a shell; the two words are replaced by the paths of the patch and of the
output. The first patch changes nothing. If the simulator fails, its last lines are
shown. Nothing is kept of an unfinished round.
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
from fieldcal.against.sensor_model import SensorModel, patch_model
from fieldcal.core.errors import InputError
from fieldcal.core.escaping import escape_invisible

CompareOutput = Callable[[Path], tuple[Match, list[str]]]
"""Compares a simulator's file; returns the match, and notices for the user."""

PATCH_PLACEHOLDER, OUT_PLACEHOLDER = "{patch}", "{out}"

SHOWN_LINES = 5
"""Last lines of a failed simulator that are shown."""


@dataclass(frozen=True)
class SimulatorRun:
    """One run of the simulator.

    Attributes
    ----------
    patch : sensor model of the run; of the last one, with everything that is still to
        be changed, even if the format cannot hold it
    match : comparison of its output
    says : notices for the user

    """

    patch: SensorModel
    match: Match
    says: tuple[str, ...]


def is_command(text: str) -> bool:
    """Whether the simulator is given as a command and not as a file."""
    return OUT_PLACEHOLDER in text


def run_and_patch(
    command: str,
    compare: CompareOutput,
    rate_hz: float,
    form: str,
    most: int,
    tell: Callable[[int, SimulatorRun], None],
) -> list[SimulatorRun]:
    """Run and patch until nothing differs, or `most` patches were tried.

    It also ends if the format can hold none of the remaining differences.

    Parameters
    ----------
    command : with {out} in it, and {patch}
    compare : compares the recording with a file that the simulator wrote
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
    if PATCH_PLACEHOLDER not in command:
        raise InputError(
            f"{command}: has no {PATCH_PLACEHOLDER}, in the place of which the"
            " patch's file stands"
        )
    done: list[SimulatorRun] = []
    model = SensorModel(rate_hz=rate_hz)
    for number in range(most + 1):
        found, said = _run_and_compare(command, compare, form, model)
        after = patch_model(found, model)
        left = {one.id for one in found.differences}
        last = not left & set(patches.patch_format(form).HOLDS)
        done.append(SimulatorRun(after if last else model, found, tuple(said)))
        tell(number, done[-1])
        if last:
            break
        model = after
    return done


def _run_and_compare(
    command: str, compare: CompareOutput, form: str, model: SensorModel
) -> tuple[Match, list[str]]:
    """Run the simulator with a patch; returns the comparison and its notices."""
    with TemporaryDirectory() as folder:
        ending = patches.patch_format(form).ENDING
        patch, out = Path(folder) / f"patch{ending}", Path(folder) / "out"
        patches.write(form, model, patch)
        places = {PATCH_PLACEHOLDER: str(patch), OUT_PLACEHOLDER: str(out)}
        _run_command([_with_paths(word, places) for word in _words(command)], command)
        if not out.exists():
            raise InputError(
                f"{command}: ended well and wrote nothing to {OUT_PLACEHOLDER}: let it"
                " write its recording to the file that stands there"
            )
        return compare(out)


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command)
    except ValueError as error:
        raise InputError(f"{command}: is no command: {error}") from None


def _with_paths(word: str, places: dict[str, str]) -> str:
    for name, path in places.items():
        word = word.replace(name, path)
    return word


def _run_command(words: list[str], command: str) -> None:
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
        last = " | ".join(
            escape_invisible(line.strip()) for line in said[-SHOWN_LINES:]
        )
        raise InputError(
            f"{command}: failed with exit code {done.returncode}; it said:"
            f" {last or 'nothing'}"
        )
