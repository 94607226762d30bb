"""A lot against what it was drawn from."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from fieldcal.calibration import limits
from fieldcal.cli import main
from fieldcal.commands.lot import lot_findings
from fieldcal.core.errors import InputError
from fieldcal.fleet.capability import lot_parameter
from fieldcal.fleet.chart_limits import chart_limits, cusum_limit, ewma_limit
from fieldcal.fleet.control import WEIGHT, cusum, ewma
from fieldcal.fleet.lot import LotAnalysis, analyse_lot
from fieldcal.fleet.lot_yield import yield_sentence
from fieldcal.fleet.odd import benjamini_hochberg
from fieldcal.fleet.spread import estimate_distribution
from fieldcal.history import sessions
from fieldcal.history.database import Database
from fieldcal.history.sessions import StoredSession
from fieldcal.report.lot_page import render_lot_page

BOUNDS = limits.read("tactical")


def test_the_spread_is_that_of_units_without_their_errors() -> None:
    rng = np.random.default_rng(1)
    inside, ratio = 0, []
    for _ in range(60):
        sigma = rng.uniform(0.5, 2.0, 40)
        found = estimate_distribution(
            3 + rng.standard_normal(40) + sigma * rng.standard_normal(40), sigma
        )
        inside += found.low <= 1.0 <= found.high
        ratio.append((found.mean - 3) / found.mean_sigma)
    assert inside >= 52, "of 60 intervals of 95 %"
    assert 0.8 < np.std(ratio) < 1.25


@pytest.mark.statistical
def test_what_is_said_of_spread_and_capability_is_what_they_scatter_by() -> None:
    rng = np.random.default_rng(11)
    drawn = []
    for _ in range(50):
        sigma = rng.uniform(0.01, 0.03, 60)
        x = 0.05 + 0.02 * rng.standard_normal(60) + sigma * rng.standard_normal(60)
        drawn.append(
            lot_parameter("acc_bias.x", "m/s^2", np.arange(60), x, sigma, BOUNDS, 1)
        )
    for name in ("cp", "cpk"):
        value = np.array([getattr(one, name) for one in drawn])
        stated = np.array([getattr(one, f"{name}_sigma") for one in drawn])
        assert 0.75 < value.std() / np.median(stated) < 1.35, name
    value = np.array([one.distribution.spread for one in drawn])
    stated = np.array([one.distribution.spread_sigma for one in drawn])
    assert 0.8 < value.std() / np.median(stated) < 1.25
    square = np.array([one.distribution.mean_square_spread for one in drawn])
    assert np.mean(square) > np.mean(value**2), "what is not known of it is in it"


def test_without_errors_of_units_capability_is_as_uncertain_as_bissell_has_it() -> None:
    x = 0.1 + 0.05 * norm.ppf((np.arange(80) + 0.5) / 80)
    one = lot_parameter("acc_bias.x", "m/s^2", np.arange(80), x, np.full(80, 1e-9),
                     BOUNDS, 1)  # fmt: skip
    assert one.cpk is not None and one.cp is not None
    assert one.cpk_sigma == pytest.approx(
        np.sqrt(1 / (9 * 80) + one.cpk**2 / (2 * 79)), rel=0.03
    )
    assert one.cp_sigma == pytest.approx(one.cp / np.sqrt(2 * 79), rel=0.03)


def test_units_that_differ_by_their_errors_only_have_no_spread() -> None:
    rng = np.random.default_rng(2)
    found = estimate_distribution(0.1 * rng.standard_normal(300), np.full(300, 0.1))
    assert found.low == 0.0 and found.spread < 0.04


def test_units_far_better_known_than_they_differ_have_a_spread() -> None:
    rng = np.random.default_rng(12)
    found = estimate_distribution(0.1 * rng.standard_normal(80), np.full(80, 1e-9))
    assert found.low > 0.05 and found.spread == pytest.approx(0.1, rel=0.2)


def test_odd_units_widen_nothing() -> None:
    rng = np.random.default_rng(3)
    x, sigma = rng.standard_normal(200), np.full(200, 0.3)
    x += sigma * rng.standard_normal(200)
    clean = estimate_distribution(x, sigma)
    x[:6] += np.array([15, -20, 30, 12, -14, 18])
    found = estimate_distribution(x, sigma)
    assert found.spread == pytest.approx(clean.spread, rel=0.1)
    assert (found.typical_probability[:6] < 0.01).all()


@pytest.mark.parametrize(
    ("weight", "bound"), [(0.4, 3.054), (0.25, 2.998), (0.2, 2.962), (0.1, 2.814)]
)
def test_limits_are_those_of_published_tables(weight: float, bound: float) -> None:
    # Lucas and Saccucci, Technometrics 32 (1990), an average of 500 units
    assert ewma_limit(500.0, weight) == pytest.approx(bound, abs=0.01)


def test_limits_of_sums_are_those_of_published_tables() -> None:
    # Montgomery, Introduction to Statistical Quality Control, k = 1/2
    assert cusum_limit(168.0, 0.5) == pytest.approx(4.0, abs=0.03)
    assert cusum_limit(465.0, 0.5) == pytest.approx(5.0, abs=0.03)


@pytest.mark.statistical
def test_charts_alarm_as_seldom_as_they_are_meant_to() -> None:
    rng = np.random.default_rng(4)
    for chart, bound in (
        (ewma, ewma_limit(5000.0, WEIGHT)),
        (cusum, cusum_limit(5000.0)),
    ):
        alarms = sum(
            chart(rng.standard_normal(500), bound).alarm is not None for _ in range(200)
        )
        assert 0.03 * 200 < alarms < 0.17 * 200, "one in ten is expected"


@pytest.mark.parametrize("count", [30, 150])
def test_charts_about_a_lots_own_mean_alarm_as_often_as_stated(count: int) -> None:
    """Limits for a known mean are passed by one lot of a thousand, not one of ten."""
    rng = np.random.default_rng(21)
    bounds = chart_limits(count, 0, 0.1)
    alarms = np.zeros(2)
    for _ in range(400):
        x = rng.standard_normal(count)
        z = x - x.mean()
        charts = ewma(z, bounds[0]), cusum(z, bounds[1])
        alarms += [chart.alarm is not None for chart in charts]
    assert ((alarms > 0.06 * 400) & (alarms < 0.15 * 400)).all(), alarms


def test_limits_of_lots_just_simulated_and_just_not_agree() -> None:
    for chance in (0.01, 0.001):
        simulated = chart_limits(1900, 0, chance)
        known = chart_limits(2100, 0, chance)
        assert simulated == pytest.approx(known, rel=0.05)
        assert simulated[0] < known[0] and simulated[1] < known[1]


def test_half_a_lot_shifted_by_twice_its_spread_is_beyond_a_chart() -> None:
    rng = np.random.default_rng(22)
    x = 0.02 * rng.standard_normal(60)
    x[30:] += 0.04
    one = lot_parameter("acc_bias.x", "m/s^2", np.arange(60), x, np.full(60, 0.01),
                        BOUNDS, 20)  # fmt: skip
    chart = one.charts[1]
    assert chart.alarm is not None and chart.onset is not None


def test_a_sum_says_since_when() -> None:
    z = np.concatenate([np.tile([0.2, -0.2], 50), np.full(60, 0.8)])
    found = cusum(z, cusum_limit(1e4))
    assert found.alarm is not None and found.alarm < 130
    assert found.onset is not None and abs(found.onset - 100) < 5
    assert np.argmax(np.abs(found.values) > found.limit) == found.alarm


def test_false_discoveries_are_as_many_as_stated() -> None:
    rng = np.random.default_rng(5)
    wrong = right = 0
    for _ in range(200):
        z = rng.standard_normal(300)
        z[:15] += 5
        found = benjamini_hochberg(2 * norm.sf(np.abs(z)), 0.05)
        wrong, right = wrong + int(found[15:].sum()), right + int(found[:15].sum())
    assert wrong / (wrong + right) < 0.06 and right > 0.85 * 15 * 200


def units(
    count: int = 150, seed: int = 6, station: float = 0.0, drift: float = 0.0
) -> list[StoredSession]:
    """Units with a spread of 0.02 m/s^2 and errors of their own; two of them odd.

    `station` is what Q adds to gyr_bias.y, in spreads; `drift` what acc_bias.z changes
    by after unit 80.
    """
    rng = np.random.default_rng(seed)
    out = []
    for i in range(count):
        own: Mapping[str, tuple[float, float, str]] = {
            f"{group}.{axis}": (wide * float(rng.standard_normal()), wide / 2, unit)
            for group, wide, unit in (
                ("acc_bias", 0.02, "m/s^2"), ("gyr_bias", 1e-3, "rad/s"),
            )
            for axis in "xyz"
        }  # fmt: skip
        seen = {
            name: (x + sigma * float(rng.standard_normal()), sigma, unit)
            for name, (x, sigma, unit) in own.items()
        }
        place = "PQR"[i % 3]
        change = {"acc_bias.x": 0.3 * (i in (10, 90)),
                  "gyr_bias.y": 1e-3 * station * (place == "Q"),
                  "acc_bias.z": 0.02 * drift * (i > 80)}  # fmt: skip
        for name, more in change.items():
            x, sigma, unit = seen[name]
            seen[name] = (x + more, sigma, unit)
        out.append(
            StoredSession(
                f"/s/{i}", f"A{i}", {"station": place, "lot": "7"},
                f"2026-03-{1 + i // 24:02d}T{i % 24:02d}:00:00+00:00",
                go=i % 50 != 0, good=True, result={}, parameters=seen,
            )
        )  # fmt: skip
    return out


def of(some: list[StoredSession]) -> LotAnalysis:
    return analyse_lot(some, BOUNDS)


def test_a_lot_says_what_it_was_drawn_from() -> None:
    found = of(units(station=2.0))
    first = found.odd[:2]
    assert {(o.serial, o.parameter) for o in first} == {
        ("A10", "acc_bias.x"), ("A90", "acc_bias.x"),
    }  # fmt: skip
    assert len(found.odd) <= 4
    assert {(s.parameter, s.level) for s in found.shifts} == {("gyr_bias.y", "station")}
    (shift,) = found.shifts
    at = shift.labels.index("Q")
    difference = shift.values[at] - np.delete(shift.values, at).mean()
    assert difference == pytest.approx(2e-3, abs=4 * shift.sigmas[at])
    assert not found.alarms
    assert (found.good, found.judged) == (147, 150)
    assert 0.94 < found.yield_share[1] < 0.98 < found.yield_share[2] < 1.0
    about = found.parameters["acc_bias.y"].distribution
    assert about.low < 0.02 < about.high
    capable = found.parameters["acc_bias.y"].cpk or 0.0
    assert capable == pytest.approx(0.3 / 0.06, rel=0.25)


def test_a_base_that_stood_askew_makes_no_unit_odd() -> None:
    """It was that session's; a station whose base is tilted is still named."""
    rng, some = np.random.default_rng(8), []
    for i, one in enumerate(units()):
        tilt = 0.01 * rng.standard_normal() + 0.5 * (i == 40)
        tilt += 0.05 * (one.levels["station"] == "R")
        tilts = {"angle_offset.alpha0_deg": (tilt, 5e-3, "deg")}
        some.append(replace(one, parameters={**one.parameters, **tilts}))
    found = of(some)
    assert found.odd == of(units()).odd
    assert [(s.parameter, s.level) for s in found.shifts] == [
        ("angle_offset.alpha0_deg", "station")
    ]


def test_a_lot_that_drifts_says_since_when() -> None:
    found = of(units(drift=1.5))
    assert {a.parameter for a in found.alarms} == {"acc_bias.z"}
    (since,) = {a.since for a in found.alarms if a.since}
    assert 70 <= int(since[1:]) <= 95


def test_a_unit_without_a_station_hides_no_shift_of_the_others() -> None:
    some = units(station=2.0)
    some[7] = replace(some[7], levels={"lot": "7"})
    (shift,) = of(some).shifts
    assert (shift.parameter, shift.level) == ("gyr_bias.y", "station")
    assert set(shift.labels) == {"P", "Q", "R", "not stated"}
    at = {label: i for i, label in enumerate(shift.labels)}
    off = shift.values[at["Q"]] - shift.values[[at["P"], at["R"]]].mean()
    assert off == pytest.approx(2e-3, abs=4 * shift.sigmas[at["Q"]])


@pytest.mark.statistical
def test_a_lot_in_control_is_said_to_be() -> None:
    calm = []
    for seed in range(10, 16):
        some = [s for s in units(80, seed) if s.serial not in ("A10", "A90")]
        calm.append(of(some).in_control)
    assert sum(calm) >= 4, "odd units and charts have five in a hundred each"


def test_the_last_good_session_of_a_unit_counts() -> None:
    some = units(8)
    again = StoredSession("/s/again", "A0", {}, "2026-05-01", error="is broken")
    later = units(8, seed=9)[1]
    found = of([*some, again, later])
    assert found.sessions == 10 and found.failed == 1 and len(found.units) == 8
    assert found.units[0].folder == "/s/0"
    with pytest.raises(InputError, match="a lot needs 5"):
        of(some[:4])


def test_a_unit_without_a_result_is_in_the_yield_and_a_broken_folder_is_not() -> None:
    failed = StoredSession("/s/f", "A99", {"lot": "7"}, error="its samples are cut")
    again = StoredSession("/s/g", "A1", {"lot": "7"}, error="was sent again, broken")
    nobody = StoredSession("/s/n", error="is not TOML")
    found = of([*units(8), failed, again, nobody])
    assert (found.judged, found.good, found.unmeasured) == (9, 7, 1)
    assert found.failed == 3
    said = yield_sentence(found)
    assert said.startswith("7 of 9: 77.8 % (95 %: ")
    assert said.endswith("; 1 NO-GO or not good, 1 without a result")
    assert found.to_json()["yield"]["of_them_without_result"] == 1


@pytest.mark.parametrize(
    ("query", "said"),
    [
        (["lot=8"], r"lot=8: .* has no session of it; of lot it has 7"),
        (["lot=7", "lot=8"], "lot is given twice"),
        (["since=2026-05", "until=2026-04"], "exchange the two"),
        (["serial=A1", "since=2031"], "no session meets serial=A1 since=2031"),
    ],
)
def test_a_query_that_finds_nothing_says_why(
    query: list[str],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    store = Database(tmp_path / "h")
    for one in units(6):
        store.run(lambda db, one=one: sessions.store_session(db, one), write=True)  # type: ignore[misc]
    assert main(["lot", *query, "--history", str(tmp_path / "h")]) == 2
    assert re.search(said, " ".join(capsys.readouterr().err.split()))


def test_a_result_with_a_newer_error_is_a_result() -> None:
    some = units(8)
    some[3] = replace(some[3], error="its samples have changed and cannot be read")
    assert of(some).failed == 0


def test_units_of_unknown_time_are_in_no_chart() -> None:
    drifting = units(drift=1.5)
    unknown = [
        replace(s, taken_at=None, serial=f"U{i}", folder=f"/u/{i}")
        for i, s in enumerate(units(5, seed=9))
    ]
    found = of([*unknown, *drifting])
    assert found.untimed == found.to_json()["units_of_unknown_time"] == 5
    (since,) = {a.since for a in found.alarms if a.since}
    assert since[0] == "A" and 70 <= int(since[1:]) <= 95
    assert all(
        len(c.values) == 150 for p in found.parameters.values() for c in p.charts
    )
    assert "5 units of unknown time: not in the control charts" in lot_findings(found)
    assert "5 units of unknown time" in render_lot_page(found, "everything")
    alone = of(unknown)
    assert not alone.alarms and render_lot_page(alone, "everything")


def test_the_page_says_of_each_finding_which_unit_and_what_to_do() -> None:
    some = units(drift=1.5)
    some[10] = replace(some[10], serial="", folder="/s/folder of ten")
    text = render_lot_page(of(some), "lot 7")
    assert "no serial number" in text and "Measure again: folder of ten" in text
    assert "147 of 150: 98.0 %" in text and "3 NO-GO or not good" in text
    assert re.search(r"The mean changes at about A(7|8)\d: ask what changed", text)
    assert "1 drift" in text and "charts in control" in text


def test_serial_numbers_alike_but_for_case_are_told() -> None:
    some = units(8)
    some[3] = replace(some[3], serial="sn-1")
    some[5] = replace(some[5], serial="SN-1")
    found = of(some)
    assert len(found.units) == 8
    (said,) = (line for line in lot_findings(found) if "upper and lower case" in line)
    assert "SN-1 and sn-1" in said and "SN-1 and sn-1" in render_lot_page(found, "7")
    assert not any("lower case" in line for line in lot_findings(of(units(8))))


def test_a_spread_within_the_errors_has_a_bound_of_cpk() -> None:
    rng = np.random.default_rng(31)
    x = 0.01 * rng.standard_normal(12)
    one = lot_parameter("acc_bias.x", "m/s^2", np.arange(12), x, np.full(12, 0.02),
                        BOUNDS, 1)  # fmt: skip
    assert one.cpk is None and one.cpk_at_least is not None
    margin = 0.3 - abs(one.distribution.mean)
    assert one.cpk_at_least == pytest.approx(margin / 3 / one.distribution.high)
    assert one.cpk_text.startswith("> ")


def test_numbers_of_a_fine_device_do_not_run_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = Database(tmp_path / "h")

    def put(db: object) -> None:
        for one in units(40):
            fine = {
                name: (x * 1e-4, sigma * 1e-4, unit)
                for name, (x, sigma, unit) in one.parameters.items()
            }
            one = replace(one, parameters=fine)
            sessions.store_session(db, one)  # type: ignore[arg-type]

    data.run(put, write=True)
    assert main(["lot", "--history", str(tmp_path / "h")]) in (0, 1)
    text = capsys.readouterr().out
    for axis in "xyz":
        line = re.search(rf"^gyr_bias\.{axis} .*rad/s.*$", text, re.M)
        assert line
        mean, wide = re.split(r" {2,}", line[0])[1:3]
        for number in (*mean.split(" ± "), wide.split(" ")[0]):
            assert abs(float(number)) < 1e-5


def test_the_command_reads_the_store_and_writes_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = Database(tmp_path / "h")

    def put(db: object) -> None:
        for one in units(station=2.0):
            sessions.store_session(db, one)  # type: ignore[arg-type]

    data.run(put, write=True)
    own, page = ["--history", str(tmp_path / "h")], tmp_path / "lot.html"
    assert main(["lot", "lot=7", *own, "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["units"] == 150 and said["yield"]["good"] == 147
    assert [s["level"] for s in said["shifts"]] == ["station"]
    assert main(["lot", *own, "--report", str(page)]) == 1
    text = capsys.readouterr().out
    assert "odd: A10, acc_bias.x is off by" in text and "shifted by station" in text
    html = page.read_text()
    assert "A90" in html and "Process capability" in html and "EWMA" in html
    for wrong in (["lot=8"], ["colour=red"], ["--fdr", "2"]):
        assert main(["lot", *wrong, *own]) == 2
