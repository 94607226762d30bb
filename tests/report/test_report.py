"""The report: what it packs, calculates, says, and never lets through."""

import base64
import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from bench import TILT, five_positions
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from fieldcal.cli import main
from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.core.samples import Array, Block
from fieldcal.report import EarlierCalibration, ReportMaterial, gather, packing, render
from fieldcal.report.agreement import correlation_matrix
from fieldcal.report.blocks import Figure
from fieldcal.report.gravity_norm import missing_coupling, norm_errors
from fieldcal.report.packing import MISSING, PIECE, ChannelTable, pack, quantise
from fieldcal.report.residuals import measured_angles, window_residuals
from fieldcal.report.stillness import motion_by_second
from fieldcal.sim_device.profile import Profile
from fieldcal.windows.cells import CellAccumulator

HOSTILE = "</script><script>hacked=1</script><img src=x onerror=hacked=1>\"'&{{7*7}}"


def unquantised(packed: dict[str, str]) -> Array:
    """Values back from `quantised`, (n,), as the page reads them."""
    q = np.frombuffer(base64.b64decode(packed["q"]), "<u2")
    scale = np.frombuffer(base64.b64decode(packed["scale"]), "<f4").reshape(-1, 2)
    piece = np.arange(len(q)) // PIECE
    offset, step = scale.astype(float)[piece].T
    return np.where(q == MISSING, np.nan, offset + step * q)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = five_positions(tmp_path_factory.mktemp("report") / "bench-7")
    given = ["--angles=0.001", "--squareness=1e-5", "--tilt=angle_offset"]
    assert main(["solve", str(folder), *given]) == 0
    return folder


@pytest.fixture(scope="module")
def material(bench: Path) -> ReportMaterial:
    return gather(bench)


class Tags(HTMLParser):
    """Start tags with their attributes, and the text of the page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data

    def named(self, tag: str) -> Iterator[dict[str, str | None]]:
        return (attributes for name, attributes in self.tags if name == tag)


values = hnp.arrays(
    float,
    st.integers(1, 200),
    elements=st.floats(-1e5, 1e5, width=32) | st.just(float("nan")),
)


@given(values)
def test_packed_values_come_back_to_within_half_a_step(x: Array) -> None:
    back = unquantised(quantise(x))
    assert (np.isnan(back) == np.isnan(x)).all()
    for first in range(0, len(x), packing.PIECE):
        part = x[first : first + packing.PIECE]
        known = part[np.isfinite(part)]
        if known.size:
            step = np.ptp(known) / packing.STEPS
            # the offset of a piece is a float of 32 bit
            allowed = step + 2e-7 * np.abs(known).max() + 1e-38
            off = back[first : first + len(part)] - part
            assert np.nanmax(np.abs(off)) <= allowed


def test_no_peak_of_a_long_recording_is_lost_and_the_edges_are_whole() -> None:
    rng = np.random.default_rng(0)
    n = 400_000
    t = 100.0 + np.arange(n) / 1000
    x = rng.standard_normal((n, 7))
    x[123_456, 2], x[200_000:201_000, 4] = 50.0, np.nan
    packed = pack(
        ChannelTable(t, x), packing.stretches_around([150.0, 151.0, 300.0], 3.0)
    )
    base = packed["base"]
    index = np.minimum((t - base["start"]) // base["dt"], base["n"] - 1).astype(int)
    for c in range(7):
        low, high = (unquantised(base[side][c])[index] for side in ("low", "high"))
        known = np.isfinite(x[:, c])
        assert (x[known, c] >= low[known] - 1e-3).all()
        assert (x[known, c] <= high[known] + 1e-3).all()
    assert unquantised(base["high"][2]).max() == pytest.approx(50.0, abs=1e-3)
    spans = [(p["start"], p["n"]) for p in packed["details"]]
    assert spans == [(pytest.approx(148.5), 4000), (pytest.approx(298.5), 3000)]
    size = len(json.dumps(packed))
    assert size < 1.02 * (packing.BASE_BYTES + packing.DETAIL_BYTES)


def test_a_short_recording_is_packed_sample_by_sample() -> None:
    t = np.cumsum(np.random.default_rng(1).uniform(0.001, 0.2, 5000))
    packed = pack(ChannelTable(t, np.sin(t)[:, None]), [])
    times = np.frombuffer(base64.b64decode(packed["base"]["times"]), "<u4")
    assert np.abs(packed["base"]["start"] + times * 1e-6 - t).max() < 1e-6
    assert "dt" not in packed["base"] and packed["details"] == []


@pytest.mark.thorough
def test_residuals_are_those_of_the_fit(material: ReportMaterial) -> None:
    found = window_residuals(material)
    assert found is not None and material.calibration is not None
    acc, sigma = found.channel[:, :3], found.sigma[:, :3]
    chi2 = float(((acc / sigma) ** 2).sum())
    # the fit weighs with correlations, which a device with white noise hardly has
    assert chi2 == pytest.approx(material.calibration.chi2, rel=0.2)
    gyr = found.channel[:, 3:] / found.sigma[:, 3:]
    assert 0.2 < float((gyr**2).mean()) < 3.0


def test_angles_shown_are_those_of_the_device_within_their_uncertainty(
    material: ReportMaterial,
) -> None:
    where = measured_angles(material)
    assert where is not None
    pulls = (where.measured - where.stated - np.array(TILT)) / where.sigma
    assert np.abs(pulls).max() < 4.0
    assert where.sigma.max() < 0.1


def test_correlations_are_a_correlation_matrix(material: ReportMaterial) -> None:
    assert material.calibration is not None
    r = correlation_matrix(material.calibration)
    assert np.allclose(np.diag(r), 1.0) and np.abs(r).max() < 1 + 1e-9


def test_the_page_has_every_section_and_needs_nothing_from_elsewhere(
    bench: Path,
) -> None:
    session = Path(shutil.copytree(bench, bench.parent / "whole"))
    one = Path(shutil.copytree(bench, bench.parent / "one"))
    held = tomlkit.parse((one / "session.toml").read_text()).unwrap()
    held["position"] = held["position"][:1]  # sooner diagnosed
    (one / "session.toml").write_text(tomlkit.dumps(held))
    main(["diagnose", str(one)])
    shutil.copy(one / "diagnosis.json", session)
    first = gather(bench)
    assert first.calibration is not None
    earlier = [EarlierCalibration("May", first.calibration)]
    page = Tags(render(gather(session, earlier)))
    ids = [a["id"] for a in page.named("section")]
    assert ids == [
        *("calibration", "gravity", "diagnosis", "positions", "recording", "residuals"),
        *("correlation", "stillness", "noise", "history", "provenance"),
    ]
    assert not [a for t, a in page.tags if t in ("link", "img", "iframe", "base")]
    assert not [a for a in page.named("script") if "src" in a]
    assert all(str(a["href"]).startswith("#") for a in page.named("a"))
    assert "url(" not in re.sub(r'"url\(#"', "", page.text)
    for figure in page.named("div"):
        if figure.get("role") == "img":
            assert len(str(figure["aria-label"])) > 40
    assert "SHA-256" in page.text and "fieldcal 0." in page.text


def test_a_session_without_anything_derived_still_gives_a_page(tmp_path: Path) -> None:
    bare = five_positions(tmp_path / "bare", {"position": []})
    page = Tags(render(gather(bare)))
    assert "not solved" in page.text and "no [[position]]" in page.text
    assert "correlation" not in [a["id"] for a in page.named("section")]


@pytest.mark.parametrize(
    "rows",
    [
        "t,ax,ay,az\n0,1,2,3\n",
        "t,gx,gy,gz,temperature\n0,1,2,3,\n1,1,2,3,\n2,,,,\n",
        "t,ax,ay,az\n" + "".join(f"{2.5 * i},0,-9.8,{i % 2}\n" for i in range(99)),
    ],
    ids=["one sample", "no accelerometer, no temperature", "slow and coarse"],
)
def test_odd_recordings_give_a_page(tmp_path: Path, rows: str) -> None:
    (tmp_path / "samples.csv").write_text(rows)
    window = "[[position]]\nstart_s = 0.0\nend_s = 240.0\n"
    (tmp_path / "session.toml").write_text(window)
    assert "Provenance" in render(gather(tmp_path))


def test_a_clock_of_dates_is_taken_off_the_charts(bench: Path, tmp_path: Path) -> None:
    shutil.copyfile(bench / "session.toml", tmp_path / "session.toml")
    rows = "".join(f"{1.7e9 + i / 50},0,-9.8,0\n" for i in range(3000))
    (tmp_path / "samples.csv").write_text("t,ax,ay,az\n" + rows)
    page = render(gather(tmp_path))
    spec = re.findall(r'<script type="application/json">(.*?)</script>', page)[0]
    chart = json.loads(spec)
    assert chart["x"]["label"] == "device time − 1700000000"
    assert chart["store"]["base"]["start"] == 0.0


def test_no_text_of_the_session_gets_out_of_its_place(
    bench: Path, tmp_path: Path
) -> None:
    session = Path(shutil.copytree(bench, tmp_path / "hostile"))
    toml = (session / "session.toml").read_text()
    toml = toml.replace('"bench unit 7"', json.dumps(HOSTILE))
    toml = toml.replace("[[position]]", f"[[position]]\nname = {json.dumps(HOSTILE)}")
    (session / "session.toml").write_text(toml)
    mark = {"event": "rejected", "at_s": 20.0, "text": HOSTILE, HOSTILE: HOSTILE}
    (session / "marks.jsonl").write_text(json.dumps(mark) + "\n")
    diagnosis = {"verdict": HOSTILE, "says": HOSTILE, "warnings": [HOSTILE]}
    mismatch = [{"channel": HOSTILE, "kind": "samples", "from_s": 9.0, "to_s": 9.1}]
    (session / "diagnosis.json").write_text(
        json.dumps(diagnosis | {"mismatch": mismatch})
    )
    result = json.loads((session / "result.json").read_text())
    result["warnings"] = [HOSTILE]
    (session / "result.json").write_text(json.dumps(result))
    text = render(replace(gather(session), earlier=_earlier(session)))
    clean, hostile = Tags(render(gather(bench))), Tags(text)
    assert not list(hostile.named("img")) and "hacked=1</script>" not in text
    run = [a for a in hostile.named("script") if a.get("type") != "application/json"]
    assert len(run) == 1
    assert set(dict(hostile.tags)) <= set(dict(clean.tags)) | {"details", "summary"}
    assert HOSTILE in hostile.text


def test_a_decision_by_limits_stands_on_top(bench: Path, tmp_path: Path) -> None:
    session = Path(shutil.copytree(bench, tmp_path / "decided"))
    result = json.loads((session / "result.json").read_text())
    checks = [
        {"name": "acc_bias", "ok": False, "says": "0.3 m/s^2 of 0.2"},
        {"name": "history", "ok": None, "says": "the first of this device"},
    ]
    result["decision"] = {
        "go": False,
        "reasons": ["Too much bias.", "few"],
        "checks": checks,
    }
    (session / "result.json").write_text(json.dumps(result))
    text = Tags(render(gather(session))).text
    assert "no-go" in text and "Too much bias; few." in text
    assert "not kept" in text and "not checked" in text
    result["decision"]["remedy"] = {"says": "take position 3 again: it disagrees"}
    (session / "result.json").write_text(json.dumps(result))
    text = Tags(render(gather(session))).text
    assert "Take position 3 again: it disagrees. Too much bias; few." in text


def test_what_nothing_is_left_to_check_is_not_to_be_applied(
    material: ReportMaterial,
) -> None:
    found = material.calibration
    assert found is not None and found.is_checked
    for chi2, dof, checked in ((0.0, 0, False), (np.nan, 0, True), (3.0, 2, True)):
        one = replace(found, chi2=chi2, dof=dof)
        text = Tags(render(replace(material, calibration=one))).text
        assert ("Apply it" in text) == checked == one.is_checked
        assert ("nothing is left to check these numbers" in text) != checked


def test_the_page_opens_with_what_to_do(material: ReportMaterial) -> None:
    found = material.calibration
    assert found is not None
    assert "Apply it: the numbers hold" in Tags(render(material)).text
    for off, says in (
        (0.0, "No change is needed"),
        (0.2, "Apply it: acc bias y differs"),
    ):
        nominal = {
            g: found.vector(g)[0]
            + (off * (np.arange(3) == 1) if g == "acc_bias" else 0)
            for g in ("acc_bias", "acc_scale", "gyr_bias")
        }
        about = material.session.about
        about = replace(
            about,
            nominal={**about.nominal, **nominal},
            raw={**about.raw, "nominal": {}},
        )
        session = replace(material.session, about=about)
        assert says in Tags(render(replace(material, session=session))).text


def test_a_parameter_that_was_given_exactly_is_not_what_changed_most(
    material: ReportMaterial,
) -> None:
    """It has no uncertainty that its change could be compared with."""
    found = material.calibration
    assert found is not None
    covariance = found.covariance.copy()
    given = found.names.index("acc_bias.x")
    covariance[given] = covariance[:, given] = 0.0
    about = material.session.about
    nominal = {g: found.vector(g)[0] for g in ("acc_bias", "acc_scale", "gyr_bias")}
    for moved in (0.0, 0.3):
        nominal["acc_bias"] = found.vector("acc_bias")[0] + [moved, 0.2, 0.0]
        session = replace(
            material.session,
            about=replace(
                about,
                nominal={**about.nominal, **nominal},
                raw={**about.raw, "nominal": {}},
            ),
        )
        exact = replace(found, covariance=covariance)
        page = render(replace(material, session=session, calibration=exact))
        assert "Apply it: acc bias y differs" in Tags(page).text


def test_the_norm_misses_gravity_by_bias_and_scale_before(
    material: ReportMaterial,
) -> None:
    """The virtual device's own numbers, along the force that it was given."""
    errors = norm_errors(material)
    assert errors is not None
    truth, g = Profile().truth, material.session.gravity
    alpha, beta = np.deg2rad(np.array([p.degrees for p in FIVE_POSITIONS]) + TILT).T
    f = np.column_stack(
        [-np.sin(alpha), -np.cos(alpha) * np.cos(beta), np.cos(alpha) * np.sin(beta)]
    )
    output = np.array(truth.acc_bias) + np.array(truth.acc_scale) * g * f
    expected = np.linalg.norm(output, axis=1) - g
    np.testing.assert_allclose(errors.before, expected, atol=3e-3)
    assert np.abs(errors.after).max() < 5 * errors.sigma.max() < 0.01
    assert material.windows is not None
    means = [a.sigma[:3].mean() for a in material.windows.averages]
    np.testing.assert_allclose(errors.sigma, means, rtol=0.4)
    assert "Gravity, before and after" in Tags(render(material)).text


@pytest.mark.parametrize(
    ("share", "fitted"), [(0.99, False), (0.1, False), (0.99, True)]
)
def test_cross_coupling_that_a_result_lacks_is_said(
    share: float, fitted: bool, material: ReportMaterial
) -> None:
    """Its ± and residuals are of a fit that had it; the calibrated norm lacks it."""
    found = material.calibration
    assert found is not None
    info = dict(found.info) | {"carried": {"causes": {"cross_coupling": share}}}
    renamed = ("cross_coupling.k12", *found.names[1:]) if fitted else found.names
    other = replace(found, info=info, names=renamed)
    remarks = missing_coupling(other)
    assert bool(remarks) == (share > 0.5 and not fitted)
    if remarks:
        page = Tags(render(replace(material, calibration=other))).text
        assert "this result has no coefficients of it" in page


def test_restlessness_is_told_by_the_quietest_tenth() -> None:
    """Noise that is twenty times as strong in a third of the time."""
    t = np.arange(6000) / 100
    loud = np.where((t > 20) & (t < 40), 20.0, 1.0)
    six = loud[:, None] * np.random.default_rng(4).standard_normal((6000, 6))
    cells = CellAccumulator()
    cells.add(Block.of(t, six[:, :3], six[:, 3:]))
    at, r = motion_by_second(cells.table)
    assert 1 < np.median(r[(at < 19) | (at > 41)]) < 3
    assert 15 < np.median(r[(at > 21) & (at < 39)]) < 60


def _earlier(session: Path) -> tuple[EarlierCalibration, ...]:
    found = gather(session).calibration
    return (EarlierCalibration(HOSTILE, found),) if found else ()


leaf = (
    st.none()
    | st.booleans()
    | st.integers(-9, 9)
    | st.floats(allow_nan=False)
    | st.text(max_size=8)
)
row = st.lists(leaf, max_size=3)
anything = leaf | row | st.dictionaries(st.text(max_size=4), leaf | row, max_size=3)
KEYS = (
    *("verdict", "says", "warnings", "mismatch", "effects", "fit", "calibration"),
    *("candidates", "curves", "next", "twin"),
)
ITEM = st.dictionaries(
    st.sampled_from(["id", "channel", "x", "before", "after", "parameters", "sigma",
                     "value", "aliases", "evidence", "from_s", "positions", "why"]),
    anything,
)  # fmt: skip


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(st.sampled_from(KEYS), anything | ITEM | st.lists(ITEM)))
def test_a_diagnosis_of_any_shape_gives_a_section(
    material: ReportMaterial, document: dict[str, Any]
) -> None:
    from fieldcal.report.diagnosis import diagnosis_section

    section = diagnosis_section(replace(material, diagnosis=document))
    assert section is not None and section.blocks
    for block in section.blocks:
        if isinstance(block, Figure):
            json.dumps(block.chart.to_json(), allow_nan=False)


def test_numbers_that_differ_have_names_that_differ(material: ReportMaterial) -> None:
    """Biases beside a drift are those of the start, an effect's gain is not alone."""
    group = {"value": [0.1, 0.2, 0.3], "sigma": [0.01] * 3, "unit": "m/s^2"}
    document = {
        "effects": [{"id": "bias_drift", "evidence": {"delta_chi2": 90.0}}],
        "calibration": {"acc_bias": group},
        "candidates": [{"id": "bias_drift", "delta_chi2": 7.0, "chosen": True}],
    }
    page = Tags(render(replace(material, diagnosis=document))).text
    assert "without the effects (at the start); fieldcal solve states them" in page
    assert "Δχ² alone" in page and "ΔBIC alone" in page


def test_a_comparison_with_a_simulator_is_a_section(material: ReportMaterial) -> None:
    quantity = {"value": 0.1, "sigma": 0.002, "unit": "m/s^2"}
    found = {
        "verdict": "left_out",
        "against": "simulated.csv",
        "differences": [
            {
                "id": "acc_bias",
                "direction": "resized",
                "parameters": {"x": {"real": quantity, "difference": quantity}},
            },
            {"id": "mounting", "parameters": {"axes": {"difference": {"value": "+x"}}}},
        ],
        "prediction": {"before": {"rms_acc": 0.1, "chi2_per_dof": 40.0}},
    }
    page = render(replace(material, against=found))
    for said in ("Against a simulator", "simulated.csv", "acc bias", "0.1000", "40"):
        assert said in page
    assert "Against a simulator" not in render(material)


@pytest.mark.parametrize("found", [{}, {"differences": [{}, 3]}, {"prediction": []}])
def test_a_comparison_of_any_shape_gives_a_section(
    material: ReportMaterial, found: dict[str, Any]
) -> None:
    assert "Against a simulator" in render(replace(material, against=found))


def _luminance(colour: str) -> float:
    part = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def _contrast(one: str, other: str) -> float:
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
def test_colours_have_the_contrast_of_wcag_aa(scheme: int) -> None:
    css = files("fieldcal.report").joinpath("page/page.css").read_text("utf-8")
    block = re.findall(r":root \{(.*?)\}", css, re.DOTALL)[scheme]
    colour = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})\b", block))
    texts = [(a, b) for a in ("ink", "soft", "accent") for b in ("card", "page")]
    texts += [(t, f"{t}-bg") for t in ("good", "warn", "bad")]
    texts += [("ink", f"{t}-bg") for t in ("good", "warn", "bad")] + [("ink", "bar")]
    for ink, paper in texts:
        assert _contrast(colour[ink], colour[paper]) >= 4.5, (ink, paper)
    for tone in range(1, 7):
        assert _contrast(colour[f"t{tone}"], colour["card"]) >= 3.0, tone


def test_the_command_writes_where_it_is_told_and_says_what_is_missing(
    bench: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    page = tmp_path / "page.html"
    call = ["report", str(bench), "-o", str(page), "--earlier", str(bench)]
    assert main(call) == 0
    history = page.read_text("utf-8").partition("History of the device")[2]
    changes = history.partition("change ± 1σ")[2].partition("</table>")[0]
    assert changes.count(" ± ") == changes.count("<tr>") > 0
    assert main(["report", str(bench), "--earlier", str(tmp_path)]) == 2
    assert "no result there" in capsys.readouterr().err
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main([*call, "--pdf"]) == 2
    said = capsys.readouterr().err
    assert "install chromium" in said and len(said.splitlines()) == 1


def test_a_long_stretch_at_rest_shows_its_allan_deviation(tmp_path: Path) -> None:
    pytest.importorskip("allantools")
    rng = np.random.default_rng(3)
    t = np.arange(12_000) / 100
    six = rng.standard_normal((6, len(t))) * 0.01
    rows = "\n".join(
        ",".join(f"{v:.6g}" for v in row) for row in zip(t, *six, strict=True)
    )
    (tmp_path / "samples.csv").write_text(f"t,ax,ay,az,gx,gy,gz\n{rows}\n")
    window = "[[position]]\nstart_s = 0.0\nend_s = 120.0\n"
    (tmp_path / "session.toml").write_text(window)
    text = render(gather(tmp_path))
    assert "Allan deviation, accelerometers" in text
    # white noise of 0.01 at 100 Hz: 0.001 over 1 s
    shown = re.findall(r">(0\.00\d+) ± (0\.0000\d+) m/s²<", text)
    assert shown
    error, width = map(float, shown[0])
    assert error == pytest.approx(0.001, rel=0.1)
    # from the 119 differences of successive means, more as they overlap
    assert 0.03 < width / error < 0.12
