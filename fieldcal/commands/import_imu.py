"""One IMU of a recording: it becomes a session, and the user reads what was taken."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldcal.commands.site import site_tables
from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0

if TYPE_CHECKING:
    from fieldcal.core.samples import Array
    from fieldcal.importing.recording import ImuStream, MeanScatter, Recording
    from fieldcal.importing.session.ingest import ImportedSession
    from fieldcal.windows.joined_rests import RestPeriod

CLOCK_SIGMA = 0.007
"""Relative error of a nominal sampling rate, 1 sigma: nothing where a crystal counts,
and 1 % where the IMU's own oscillator does, each as often. Such an oscillator is right
within 2 % (limit in Linux's driver of TDK's ICM-426xx, inv_icm42600_timestamp.c, 2020;
an LSM9DS1 of 476 Hz gave 469.6, github.com/FemmeVerbeek/Arduino_LSM9DS1 issue 17)."""

LEAST_S = 1.0
"""Shortest rest that is one, whatever --still says, s: shorter means have no error."""


def import_imu(
    args: argparse.Namespace, recording: Recording, stream: ImuStream, folder: Path
) -> ImportedSession:
    """Make a session of one IMU, and say what was taken and what is left to say.

    Raises
    ------
    InputError
        If the recording leaves a question, with its answers.

    """
    from fieldcal.commands.progress import show_work
    from fieldcal.importing.session.ingest import import_stream
    from fieldcal.importing.units.settled_units import settle_units

    about = _stated_tables(args, recording)
    reading = f"reading {recording.path}"
    with show_work(args, reading):
        guessed, bias = settle_units(recording, stream.name)
    if bias:
        about["nominal"] = {"acc_bias": bias}
    if guessed:
        about["guessed"] = guessed
        stream = next(s for s in recording.streams() if s.name == stream.name)
    if (scatter := recording.scatter()) is not None:
        return _import_means(args, recording, stream, folder, about, scatter)
    if args.sigma:
        raise InputError(
            f"{recording.path}: --sigma says how well the rows of a table of means are"
            " known, and this is none: leave --sigma out"
        )
    if recording.wanted.rate_hz:
        about["sampling"] = _counted_times(args, recording, folder)
    elif args.rate_sigma is not None:
        raise InputError(
            f"{recording.path}: --rate-sigma says how well the rate is known by which"
            " its times are counted, but it has times of its own: leave --rate-sigma"
            " out"
        )
    with show_work(args, reading):
        imported = import_stream(recording, stream.name, folder, about, args.still)
    sys.stderr.write(
        f"{folder}: {stream.sentence()}: {imported.facts.sentence()},"
        f" {_counted_rests(imported.rests, args.still)}\n"
    )
    _tell_taken(folder, guessed, imported)
    if imported.facts.left_out:
        rows = _counted(imported.facts.left_out, "row", "s")
        sys.stderr.write(f"{folder}: left out: {rows}\n")
    if not imported.rests:
        _tell_no_rests(args, about.get("units", {}), imported.facts.measured)
    _tell_of_rows(recording, folder, about, len(imported.rests))
    sys.stdout.write(f"{folder}\n")
    return imported


def _counted_rests(rests: Sequence[RestPeriod], still: float) -> str:
    """How many rests there are, of so many s or more where they are as long.

    Rests of a log that holds nothing else are as long as they are.
    """
    said = _counted(len(rests), "still stretch", "es")
    # the last sample of a rest begins no interval
    if rests and min(rest.end - rest.start for rest in rests) < 0.9 * still:
        return said
    return f"{said} of {max(still, LEAST_S):g} s or more"


def _tell_of_rows(
    recording: Recording, folder: Path, about: Mapping[str, Any], rests: int
) -> None:
    """Say where each row may be taken for a position, if there are few `rests`."""
    from fieldcal.importing.units.gravity_size import FEWEST_FACES

    gravity = float(about["site"].get("gravity", G0))
    few = rests < FEWEST_FACES and "units" not in about
    sigma = recording.row_sigma(gravity) if few else None
    if sigma is not None:
        sys.stderr.write(
            f"{folder}: |a| is gravity within {sigma:.2g} m/s^2 in all its rows: if it"
            " was turned slowly, or read a few times at each position, import it again"
            f" with --sigma {sigma:.2g}, which takes each row for a position\n"
        )


def _stated_tables(args: argparse.Namespace, recording: Recording) -> dict[str, Any]:
    """Tables of session.toml that the options state."""
    from fieldcal.session.units import UNSCALED

    name = recording.path.name.split(".")[0]
    about: dict[str, Any] = {"format": 1, **site_tables(args, name)}
    units = {"acceleration": args.acc_unit, "angular_rate": args.gyr_unit}
    if kept := {k: u for k, u in units.items() if u in UNSCALED}:
        about["units"] = kept
    return about


def _counted_times(
    args: argparse.Namespace, recording: Recording, folder: Path
) -> dict[str, float]:
    """Table [sampling] of times that are counted from a rate; says what that means."""
    rate = float(recording.wanted.rate_hz or 1.0)
    if args.rate_sigma is not None:
        return {"rate_hz": rate, "rate_sigma_hz": args.rate_sigma}
    sys.stderr.write(
        f"{folder}: its times are counted at {rate:g} Hz, which is taken for right"
        f" within {100 * CLOCK_SIGMA:g} %, as clocks of sensors are: the scale factors"
        " of gyroscopes that turns tell are no better; if the rate was measured, import"
        " it again with --rate-sigma, its ± in Hz\n"
    )
    return {"rate_hz": rate, "rate_sigma_hz": float(f"{CLOCK_SIGMA * rate:.4g}")}


def _tell_taken(
    folder: Path, guessed: Mapping[str, str], imported: ImportedSession
) -> None:
    """Say what was guessed, and what the import has to say."""
    for what, why in guessed.items():
        sys.stderr.write(f"{folder}: {what.replace('_', ' ')} taken as {why}\n")
    for sentence in imported.says:
        sys.stderr.write(f"{folder}: {sentence}\n")


def _tell_no_rests(
    args: argparse.Namespace, units: Mapping[str, str], measured: Collection[str]
) -> None:
    """Say what to do where no still stretch was found; `units` have no known size."""
    if units:
        sys.stderr.write(
            f"nothing says what a {' or '.join(sorted(set(units.values())))} is worth,"
            " so no still stretch was found: say how many make a g or deg/s, such as"
            " --acc-unit g --acc-lsb 2048 --gyr-unit deg/s --gyr-lsb 16.4, or write"
            " [nominal] scale factors and the positions into session.toml\n"
        )
    else:
        shorter = ", or try --still with a shorter time" if args.still > 1 else ""
        table = ", with speed_deg_s where a rate table turned it"
        alone = table if {*measured} == {"g"} else ""
        sys.stderr.write(
            f"write the positions into session.toml{alone}{shorter}; rests shorter than"
            " 1 s are none: hold each for 3 s or more, or import a table of their means"
            " with --sigma 0.005,0.0005\n"
        )


def _import_means(
    args: argparse.Namespace,
    recording: Recording,
    stream: ImuStream,
    folder: Path,
    about: dict[str, Any],
    scatter: MeanScatter,
) -> ImportedSession:
    """Make a session of a table of means."""
    from fieldcal.importing.session.ingest import import_stream
    from fieldcal.importing.tables.means import tables_of_means

    gravity = float(about["site"].get("gravity", G0))
    tables = tables_of_means(recording, stream.name, scatter, gravity, args.sigma)
    guessed = about.pop("guessed", {}) | tables.pop("guessed", {})
    about |= {"guessed": guessed} if guessed else {}
    never = float("inf")
    imported = import_stream(recording, stream.name, folder, about | tables, never)
    sys.stderr.write(
        f"{folder}: {stream.sentence()}:"
        f" {_counted(imported.facts.rows, 'position', 's')}, means only: nothing that"
        " goes on within a position or between two can be found\n"
    )
    _tell_taken(folder, guessed, imported)
    sys.stdout.write(f"{folder}\n")
    return imported


def report_instances(folder: Path, rests: dict[str, Array], gravity: float) -> None:
    """Report which of several IMUs in one log disagrees with the others."""
    from fieldcal.evaluation.instances import compare_instances

    found = compare_instances(rests, gravity)
    for one in found if any(one.out for one in found) else []:
        sys.stderr.write(f"{folder}: {one.sentence()}\n")


def _counted(number: int, what: str, ending: str) -> str:
    """Number with a noun, in the plural unless it is 1."""
    return f"{number} {what}{ending if number != 1 else ''}"
