"""`fieldcal noise`: estimate the random processes of a device at rest."""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from fieldcal.commands.keep_result import keep_result

if TYPE_CHECKING:
    from fieldcal.calibration.limits import GradeLimits
    from fieldcal.core.samples import Block
    from fieldcal.history.location import StoreLocation
    from fieldcal.noise import NoiseModel
    from fieldcal.noise.document import NoiseResult
    from fieldcal.noise.history_walk import EarlierBias
    from fieldcal.noise.recalibration import Recalibration
    from fieldcal.session.clock_steps import ClockStepRemover
    from fieldcal.session.folder import Session

RARE = ("history", "limits")

EXAMPLE = """\
  fieldcal noise bench-7/overnight
  fieldcal noise bench-7/monday bench-7/tuesday --json
  fieldcal noise bench-7/overnight --report noise.html
  fieldcal noise overnight.mcap
"""

JOINED_GAP_S = 3.0
"""Largest gap between windows that are joined into one stretch, s."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    what = "session folder of a device at rest, or a file; several count together"
    add("sessions", type=Path, nargs="+", metavar="SESSION", help=what)
    add("--json", action="store_true", help="print noise.json instead of the view")
    add(
        "--report",
        type=Path,
        metavar="FILE",
        help="write a page with the Allan deviation",
    )
    add(
        "--limits",
        type=Path,
        metavar="FILE",
        help="limits that set the date of recalibration",
    )
    add("--history", metavar="FILE", help="use this history")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    from fieldcal.commands.progress import show_work
    from fieldcal.session.file_writing import check_writable
    from fieldcal.session.noise_file import NOISE

    if args.report:
        check_writable(args.report)
    _check_distinct(args.sessions)
    with TemporaryDirectory(prefix="fieldcal-noise-") as place:
        sessions = [
            _open_session(path, Path(place) / str(i))
            for i, path in enumerate(args.sessions)
        ]
        _check_other_samples(args.sessions, sessions)
        names = [str(path) for path in args.sessions]
        with show_work(args, f"estimating the noise of {', '.join(names)}"):
            found = noise_result(sessions, args.limits, args.history, names)
    content = found.to_json()
    folder = next((s for s, p in zip(sessions, args.sessions, strict=True)
                   if p.is_dir()), None)  # fmt: skip
    for warning in dict.fromkeys(w for s in sessions for w in s.warnings):
        sys.stderr.write(f"fieldcal noise: {warning}\n")
    if args.json:
        sys.stdout.write(json.dumps(content, allow_nan=False) + "\n")
    else:
        from fieldcal.commands.noise_view import show_noise

        show_noise(found)
    path = keep_result(folder, NOISE, content) if folder else None
    if path and not args.json:
        sys.stdout.write(f"written: {path}\n")
    if args.report:
        from fieldcal.report.noise_page import render_noise_page
        from fieldcal.session.file_writing import write_atomically

        written = write_atomically(args.report, render_noise_page(found))
        (sys.stderr if args.json else sys.stdout).write(f"written: {written}\n")
    return 0


def _check_distinct(paths: Sequence[Path]) -> None:
    """Refuse a recording that is there twice: its noise would count as more.

    Raises
    ------
    InputError
        Naming it.

    """
    from fieldcal.core.errors import InputError

    places = [path.resolve() for path in paths]
    for i, place in enumerate(places):
        if place in places[:i]:
            raise InputError(f"{paths[i]}: is there twice: give each session once")


def _check_other_samples(paths: Sequence[Path], sessions: Sequence[Session]) -> None:
    """Refuse copies of a recording: its noise would count as more.

    Raises
    ------
    InputError
        Naming both.

    """
    from fieldcal.core.errors import InputError
    from fieldcal.session.recorded_part import same_recording

    if pair := same_recording([session.folder for session in sessions]):
        first, second = (paths[i] for i in pair)
        raise InputError(
            f"{second}: has the samples of {first}: give each recording once"
        )


def _open_session(path: Path, place: Path) -> Session:
    """The session of a folder, or of a file, which is imported into `place`.

    Raises
    ------
    InputError
        If the file needs options to be imported, or has several IMUs.

    """
    from fieldcal.commands import import_recording
    from fieldcal.core.errors import InputError
    from fieldcal.session.folder import Session

    if not path.is_file():
        return Session.open(path)
    parser = argparse.ArgumentParser()
    import_recording.add_arguments(parser)
    said = io.StringIO()
    try:
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(said),
        ):
            import_recording.run(parser.parse_args([str(path), "-o", str(place)]))
        sys.stderr.write(said.getvalue().replace(str(place), str(path)))
    except InputError as error:
        raise InputError(
            f"{error}; fieldcal import takes that, and fieldcal noise its folder"
        ) from error
    if not (place / "session.toml").is_file():
        raise InputError(
            f"{path}: has several IMUs; run fieldcal import on it, and fieldcal noise"
            " on the folder of one"
        )
    return Session.open(place)


def noise_result(
    sessions: Sequence[Session],
    limits: Path | None = None,
    history: StoreLocation | None = None,
    names: Sequence[str] = (),
) -> NoiseResult:
    """The noise of a device, from its recordings at rest.

    Parameters
    ----------
    sessions : recordings of the device
    limits, history : the user's files instead of the usual ones
    names : of the sessions, as the user gave them; their folders if there are none

    Raises
    ------
    InputError
        If the sessions are of several devices or rates, turned, or not long enough at
        rest.

    """
    from fieldcal.calibration import limits as bounds
    from fieldcal.noise import estimate_noise, reduce_recording
    from fieldcal.noise.alignment import gyrocompass_heading
    from fieldcal.noise.document import NoiseResult
    from fieldcal.noise.rest_check import refuse_turned

    _check_one_device(sessions)
    about = sessions[0].about
    grade = about.grade
    allowed = bounds.read(grade, limits)
    names = names or [str(s.folder) for s in sessions]
    reduced = [reduce_recording(_blocks_at_rest(s)) for s in sessions]
    for name, recording in zip(names, reduced, strict=True):
        refuse_turned(recording, name)
    model = estimate_noise(reduced, names)
    serial = str(about.device.get("serial", ""))
    recalibrate, since = _recalibration_times(model, allowed, serial, history)
    gyroscopes = [c.averaging for n, c in model.channels.items() if n[0] == "g"]
    compass = None
    if grade == "navigation" and gyroscopes and about.latitude_deg is not None:
        compass = gyrocompass_heading(gyroscopes, about.latitude)
    device = {k: str(about.device[k]) for k in ("name", "serial") if k in about.device}
    return NoiseResult(
        names,
        {**device, "grade": grade},
        model,
        recalibrate,
        since,
        compass,
    )


def _check_one_device(sessions: Sequence[Session]) -> None:
    from fieldcal.core.errors import InputError

    first = sessions[0]
    for other in sessions[1:]:
        one, two = (s.about.device.get("serial") for s in (first, other))
        if one and two and one != two:
            raise InputError(
                f"{other.folder}: is of device {two}, {first.folder} of {one}: give"
                " sessions of one device"
            )


def _blocks_at_rest(session: Session) -> Iterator[Block]:
    """Samples of the windows; all samples if the session has no windows."""
    from fieldcal.session.clock_steps import ClockStepRemover

    clock = ClockStepRemover()
    for block in session.blocks(clock):
        spans = _joined_windows(session, clock)
        if not spans:
            yield block
        for start, end in spans:
            part = block.between(start, end)
            if len(part):
                yield part


def _joined_windows(session: Session, clock: ClockStepRemover) -> list[list[float]]:
    """Windows in corrected times, s; those with a short gap between are joined."""
    windows = [w for w in session.windows if w]
    spans: list[list[float]] = []
    for start, end in sorted([clock.corrected(t) for t in w] for w in windows):
        if spans and start - spans[-1][1] <= JOINED_GAP_S:
            spans[-1][1] = max(spans[-1][1], end)
        else:
            spans.append([start, end])
    return spans


def _recalibration_times(
    model: NoiseModel,
    allowed: GradeLimits,
    serial: str,
    history: StoreLocation | None,
) -> tuple[Mapping[str, Recalibration], str]:
    """When each bias leaves the limit of the grade, and the start of that time."""
    from fieldcal.history.location import default_location
    from fieldcal.history.store import History
    from fieldcal.noise.recalibration import AVERAGED_S, recalibration_time

    runs = History(history or default_location()).runs(serial) if serial else ()
    out = {}
    for name, channel in model.channels.items():
        group = "acc_bias" if name[0] == "a" else "gyr_bias"
        usual = allowed.per_kelvin(group)
        earlier = _earlier_biases(runs, f"{group}.{name[1]}", usual)
        limit = float(getattr(allowed, f"{group}_sigma"))
        variance = channel.averaging.at(AVERAGED_S)[0] ** 2
        pair = channel.pair
        unseen = pair.walk / pair.left_out if math.isnan(pair.walk_sigma) else 0.0
        out[name] = recalibration_time(
            channel.drawn, channel.ramp, limit, variance, earlier, unseen
        )
    dates = [str(run.taken_at) for run in runs if run.taken_at]
    return out, dates[-1] if dates else datetime.now(UTC).isoformat()


def _earlier_biases(
    runs: Sequence[Any], name: str, per_kelvin: float
) -> list[EarlierBias]:
    """A bias by the calibrations that count as its family, one for each time."""
    from fieldcal.history.store import family_runs, recording_time
    from fieldcal.noise.history_walk import EarlierBias

    some = [one for one in family_runs(runs) if name in one.calibration.names]
    known = [one.temperature for one in some if one.temperature is not None]
    usual = sum(known) / len(known) if known else 0.0
    found: dict[float, EarlierBias] = {}
    for one in some:
        when = recording_time(one.taken_at)
        if when is None:
            continue
        value, sigma = one.calibration.value(name), one.calibration.uncertainty(name)
        apart = 0.0 if one.temperature is None else one.temperature - usual
        at = when.timestamp()
        found[at] = EarlierBias(at, value, sigma**2, per_kelvin * apart)
    return [found[at] for at in sorted(found)]
