"""Mistakes of a plan: session.toml says of a recording what is not so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.never_wrong.bench import SETS, Bench
from benchmarks.never_wrong.written import After, Rng, Written

ANGLES = ("alpha_deg", "beta_deg")


# -- the positions


def _stated(rows: list[dict[str, float]], bench: Bench) -> list[dict[str, float]]:
    """Those with angles, of which another mistake may have forgotten one."""
    return [row for row in rows[: bench.stated] if ANGLES[0] in row]


def _rows(written: Written) -> list[dict[str, float]]:
    return [dict(row) for row in written.about["position"]]


def _saying(written: Written, rows: list[dict[str, float]]) -> Written:
    return replace(written, about={**written.about, "position": rows})


def swapped(written: Written, bench: Bench, rng: Rng) -> Written:
    """Two positions are written down in the wrong order."""
    rows = _rows(written)
    i, j = rng.choice(bench.stated or len(rows), 2, replace=False)
    for key in ANGLES:
        if key in rows[i]:
            rows[i][key], rows[j][key] = rows[j][key], rows[i][key]
    return _saying(written, rows)


# -- the place and the device


def _site(written: Written, **more: Any) -> Written:
    site = {**written.about["site"], **more}
    site = {key: value for key, value in site.items() if value is not None}
    return replace(written, about={**written.about, "site": site})


def latitude_unsaid(written: Written, bench: Bench, rng: Rng) -> Written:
    """Nobody says where the bench is."""
    return _site(written, latitude_deg=None, height_m=None)


def only_gravity_said(written: Written, bench: Bench, rng: Rng) -> Written:
    """Gravity is stated as surveyed, and not where the bench is."""
    return _site(written, latitude_deg=None, height_m=None, gravity=bench.gravity)


def other_hemisphere(written: Written, bench: Bench, rng: Rng) -> Written:
    """The latitude has the wrong sign."""
    return _site(written, latitude_deg=-bench.latitude)


def level_unsaid(written: Written, bench: Bench, rng: Rng) -> Written:
    """Nobody says how level the base is, nor how well angles are set."""
    return _site(written, level_deg=None, angle_setting_deg=None)


def level_said_wrongly(written: Written, bench: Bench, rng: Rng) -> Written:
    """The base is said to be level to 0.01 degrees, however it stands."""
    return _site(written, level_deg=0.01)


def default_mounting(written: Written, bench: Bench, rng: Rng) -> Written:
    """The device is mounted otherwise, and nobody says so."""
    about = {**written.about, "frame": {"mounting": ["+x", "+y", "+z"]}}
    return replace(written, about=about)


def overlapping(written: Written, bench: Bench, rng: Rng) -> Written:
    """A window of the list begins before the one before it ends."""
    rows = _rows(written)
    i = int(rng.integers(1, len(rows)))
    rows.insert(i, {**rows[i - 1], "start_s": rows[i - 1]["start_s"] + 1.0})
    return replace(written, about={**written.about, "position": rows})


def listed_often(written: Written, bench: Bench, rng: Rng) -> Written:
    """Every window is listed 20 times."""
    rows = [dict(row) for row in written.about["position"] for _ in range(20)]
    return replace(written, about={**written.about, "position": rows})


def gravity_stated(written: Written, bench: Bench, rng: Rng) -> Written:
    """The gravity that is written down is off by 0.05 to 0.3 %."""
    off = rng.uniform(5e-4, 3e-3) * rng.choice([-1, 1])
    return _site(written, gravity=bench.gravity * (1 + off))


def angles_exchanged(written: Written, bench: Bench, rng: Rng) -> Written:
    """Alpha is written where beta belongs, and the other way round."""
    rows = _rows(written)
    for row in _stated(rows, bench):
        row["alpha_deg"], row["beta_deg"] = row["beta_deg"], row["alpha_deg"]
    return _saying(written, rows)


def angle_reversed(written: Written, bench: Bench, rng: Rng) -> Written:
    """One of the two angles is counted the other way."""
    rows, key = _rows(written), ANGLES[int(rng.integers(2))]
    for row in _stated(rows, bench):
        row[key] *= -1.0
    return _saying(written, rows)


def angles_in_radians(written: Written, bench: Bench, rng: Rng) -> Written:
    """Angles are written in radians."""
    rows = _rows(written)
    for row in _stated(rows, bench):
        row |= {key: float(np.deg2rad(row[key])) for key in ANGLES}
    return _saying(written, rows)


def angles_in_other_units(written: Written, bench: Bench, rng: Rng) -> Written:
    """Angles are written in gon, in mil (6400 to a turn) or in mrad."""
    rows = _rows(written)
    turn = float(rng.choice([400.0, 6400.0, 2e3 * np.pi]))
    for row in _stated(rows, bench):
        row |= {key: row[key] * turn / 360 for key in ANGLES}
    return _saying(written, rows)


def angles_as_slope(written: Written, bench: Bench, rng: Rng) -> Written:
    """Angles up to 60 degrees are written as a slope in per cent, as a level shows."""
    rows = _rows(written)
    for row in _stated(rows, bench):
        for key in ANGLES:
            if abs(row[key]) <= 60.0:
                row[key] = 100.0 * float(np.tan(np.deg2rad(row[key])))
    return _saying(written, rows)


def sign_forgotten(written: Written, bench: Bench, rng: Rng) -> Written:
    """An angle of one position is written with the other sign."""
    rows = _rows(written)
    places = [(row, k) for row in _stated(rows, bench) for k in ANGLES if row[k]]
    if places:
        row, key = places[int(rng.integers(len(places)))]
        row[key] *= -1.0
    return _saying(written, rows)


def other_plan(written: Written, bench: Bench, rng: Rng) -> Written:
    """The plan is another one: from the last to the first, from the second, or other.

    Its positions are as many.
    """
    rows, count = _rows(written), bench.stated
    plans = [name for name, held in SETS.items() if len(held) >= max(count, 1)]
    other = np.array(SETS[str(rng.choice(plans))], float)[:count]
    held = bench.angles[:count]
    kind = int(rng.integers(3))
    angles = (held[::-1], np.roll(held, -1, axis=0), other)[kind]
    for row, pair in zip(rows, angles, strict=False):
        row |= dict(zip(ANGLES, pair.tolist(), strict=True))
    return _saying(written, rows)


def one_forgotten(written: Written, bench: Bench, rng: Rng) -> Written:
    """A position of the plan was not taken: windows have the angles before theirs."""
    rows = _rows(written)
    first = int(rng.integers(bench.stated - 1)) if bench.stated else len(rows)
    for row, before in zip(rows[first + 1 : bench.stated], _rows(written)[first:],
                           strict=False):  # fmt: skip
        row |= {key: before[key] for key in ANGLES}
    if first + 1 < len(rows):
        del rows[first]
    return _saying(written, rows)


def begun_early(written: Written, bench: Bench, rng: Rng) -> Written:
    """Windows begin while the device is still being turned: one of them, or all."""
    rows, early = _rows(written), float(rng.uniform(0.75, bench.way - 0.5))
    one = int(rng.integers(1, len(rows)))
    for i in range(1, len(rows)) if rng.integers(2) else (one,):
        rows[i]["start_s"] -= early
    return _saying(written, rows)


def ended_late(written: Written, bench: Bench, rng: Rng) -> Written:
    """Windows end once the next turn has begun: one of them, or all."""
    rows, late = _rows(written), float(rng.uniform(0.75, bench.way - 0.5))
    one = int(rng.integers(len(rows) - 1))
    for i in range(len(rows) - 1) if rng.integers(2) else (one,):
        rows[i]["end_s"] += late
    return _saying(written, rows)


SAID: dict[str, After] = {
    "positions swapped": swapped,
    "angles exchanged": angles_exchanged,
    "an angle counted the other way": angle_reversed,
    "angles in radians": angles_in_radians,
    "angles in gon, mil or mrad": angles_in_other_units,
    "angles as a slope": angles_as_slope,
    "a sign forgotten": sign_forgotten,
    "plan of another session": other_plan,
    "a position forgotten": one_forgotten,
    "windows begun early": begun_early,
    "windows ended late": ended_late,
    "latitude not said": latitude_unsaid,
    "only gravity said": only_gravity_said,
    "other hemisphere": other_hemisphere,
    "level and angles not said": level_unsaid,
    "mounting not said": default_mounting,
    "windows overlapping": overlapping,
    "windows listed 20 times": listed_often,
    "gravity said wrongly": gravity_stated,
    "level said wrongly": level_said_wrongly,
}
