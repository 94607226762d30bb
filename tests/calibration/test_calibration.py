"""Calibrations applied, compared, written and read back."""

import copy
import json
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from observed import BIAS, COUPLING, SCALE, G, observe, outputs

from fieldcal.calibration import Calibration, Nominal, compare
from fieldcal.calibration.document import schema
from fieldcal.commands.compare import comparison_document, comparison_table
from fieldcal.core.errors import InputError
from fieldcal.core.positions import FIVE_POSITIONS, SIX_FACES, WIDE_POSITIONS
from fieldcal.core.samples import Array, Block
from fieldcal.solve import solve

NAMES = (
    *(f"acc_bias.{x}" for x in "xyz"), *(f"acc_scale.{x}" for x in "xyz"),
    *(f"cross_coupling.k{ij}" for ij in ("12", "13", "21", "23", "31", "32")),
    *(f"gyr_bias.{x}" for x in "xyz"),
)  # fmt: skip
VALUES = np.array(
    [*BIAS, *SCALE, *(COUPLING[i, j] for i in range(3) for j in range(3) if i != j),
     0.011, -0.032, 0.0021]
)  # fmt: skip
UNITS = ("m/s^2",) * 3 + ("1",) * 9 + ("rad/s",) * 3


def made(covariance: Array | None = None, **changes: Any) -> Calibration:
    cov = (
        np.diag(np.linspace(1, 2, 15) ** 2 * 1e-8) if covariance is None else covariance
    )
    about: dict[str, Any] = {
        "method": "joint", "names": NAMES, "values": VALUES, "covariance": cov,
        "units": UNITS, "chi2": 7.1, "dof": 7, "rms": 9e-4,
    }  # fmt: skip
    return Calibration(**(about | changes))


def random_block(n: int, seed: int = 0) -> Block:
    rng = np.random.default_rng(seed)
    return Block.of(
        np.arange(n) / 100, 9 * rng.standard_normal((n, 3)), rng.standard_normal((n, 3))
    )


@pytest.mark.parametrize("n", [0, 1, 7, 40_000])
def test_apply_takes_out_what_the_device_puts_in(n: int) -> None:
    true = random_block(n)
    m = np.diag(SCALE) + COUPLING
    raw = Block.of(true.t, BIAS + true.acc @ m.T, VALUES[12:] + true.gyr)
    back = made().apply(raw)
    np.testing.assert_allclose(back.acc, true.acc, atol=1e-12)
    np.testing.assert_allclose(back.gyr, true.gyr, atol=1e-12)
    np.testing.assert_array_equal(back.t, true.t)


def test_what_was_not_determined_stays_nominal() -> None:
    raw = random_block(5)
    nominal = Nominal(gyr_scale=(2.0, 2.0, 4.0))
    back = made().apply(raw, nominal)
    np.testing.assert_allclose(back.gyr, (raw.gyr - VALUES[12:]) / [2, 2, 4])
    assert np.isnan(made().gyroscopes()[1].diagonal()).all()


def test_a_sensor_that_was_not_measured_stays_unknown() -> None:
    raw = Block.of(np.arange(3.0), np.ones((3, 3)))
    assert np.isnan(made().apply(raw).gyr).all()


def test_uncertainty_of_samples_is_that_of_many_calibrations() -> None:
    rng = np.random.default_rng(2)
    half = rng.standard_normal((15, 15))
    cov = 1e-8 * half @ half.T
    raw = random_block(6, seed=5)
    stated = made(cov).uncertainty_of(raw)
    drawn = [
        made(cov, values=VALUES + np.linalg.cholesky(cov) @ rng.standard_normal(15))
        .apply(raw).six
        for _ in range(1000)
    ]  # fmt: skip
    np.testing.assert_allclose(np.std(drawn, axis=0), stated, rtol=0.08)


def test_comparison_is_a_fair_test() -> None:
    rng = np.random.default_rng(3)
    half = rng.standard_normal((15, 15))
    cov = 1e-8 * half @ half.T
    factor = np.linalg.cholesky(cov)

    def draw() -> Calibration:
        return made(cov, values=VALUES + factor @ rng.standard_normal(15))

    found = [compare(draw(), draw()) for _ in range(700)]
    assert np.mean([c.chi2 for c in found]) == pytest.approx(15, rel=0.04)
    assert np.mean([c.chance < 0.05 for c in found]) == pytest.approx(0.05, abs=0.02)
    assert np.std([c.z for c in found]) == pytest.approx(1, abs=0.03)


def test_what_both_know_exactly_is_the_same_or_has_changed() -> None:
    """And a combination without uncertainty does not spoil the others."""
    cov = 1e-8 * np.eye(15)
    cov[3, 3] = 0.0
    moved = VALUES.copy()
    moved[0] += 1e-4
    same = compare(made(cov, values=moved), made(cov))
    assert same.z[3] == 0 and same.changed == () and same.dof == 14
    assert same.chi2 == pytest.approx(0.5)  # (1e-4)^2 / 2e-8
    moved[3] -= 1e-9
    other = compare(made(cov, values=moved), made(cov))
    assert other.z[3] == -np.inf and other.changed == (NAMES[3],)
    assert other.chi2 == np.inf and other.chance == 0.0
    assert comparison_document(other)["chi2"] is None
    said = comparison_table(other)
    assert "inf" not in said and f"both have {NAMES[3]} exactly" in said
    line = next(row for row in said.splitlines() if row.startswith(NAMES[3]))
    assert line.split()[1:] == ["1e-09", "0", "exact", "changed"]
    unknown = compare(made(0 * cov), made(0 * cov))
    assert "all together: the same" in comparison_table(unknown)
    cov[3:5, 3:5] = 1e-8  # both off by the same amount
    alike = VALUES.copy()
    alike[3:5] += 2e-4
    assert compare(made(cov, values=alike), made(cov)).chi2 == pytest.approx(2.0)


def test_comparison_names_what_changed_and_what_is_missing() -> None:
    moved = VALUES.copy()
    moved[1] += 0.01
    a = made(values=moved)
    rows = [i for i in range(15) if i != 4]
    b = made(
        np.diag(np.full(14, 1e-8)), names=tuple(NAMES[i] for i in rows),
        values=VALUES[rows], units=tuple(UNITS[i] for i in rows),
    )  # fmt: skip
    result = compare(a, b)
    assert result.changed == ("acc_bias.y",) and result.chance < 1e-6
    assert result.only_first == ("acc_scale.y",) and not result.only_second
    with pytest.raises(InputError, match="is in g here"):
        compare(made(units=("g",) * 15), made())
    empty = made(np.zeros((1, 1)), names=("x.y",), values=np.zeros(1), units=("1",))
    with pytest.raises(InputError, match="no parameter in common"):
        compare(made(), empty)


def results() -> list[Calibration]:
    rng = np.random.default_rng(4)
    noise = 1e-3 * rng.standard_normal((5, 3))
    gyr = 1e-5 * rng.standard_normal((5, 3))
    by_hand = observe(SIX_FACES, outputs(SIX_FACES))
    return [
        made(),
        solve(
            observe(
                FIVE_POSITIONS,
                outputs(FIVE_POSITIONS, offset_deg=(1, -1)) + noise,
                gyr=gyr,
            )
        ),
        solve(
            observe(WIDE_POSITIONS, outputs(WIDE_POSITIONS) + noise),
            method="five_position",
        ),
        solve(by_hand, method="scalar"),
        solve(by_hand, method="least_squares"),
    ]


def test_every_result_fits_its_schema_and_comes_back() -> None:
    jsonschema.Draft202012Validator.check_schema(schema())
    for calibration in results():
        text = json.dumps(calibration.to_json(), allow_nan=False)
        document = json.loads(text)
        jsonschema.validate(document, schema())
        back = Calibration.from_json(document)
        assert json.dumps(back.to_json()) == text
        assert back.names == calibration.names and back.units == calibration.units
        np.testing.assert_array_equal(back.values, calibration.values)
        np.testing.assert_array_equal(back.covariance, calibration.covariance)


def test_a_calibration_of_mixed_units_comes_back() -> None:
    mixed = made(
        np.eye(2), names=("warm_up.ax", "warm_up.tau_s"), values=np.array([0.1, 300.0]),
        units=("m/s^2", "s"),
    )  # fmt: skip
    assert Calibration.from_json(mixed.to_json()).units == ("m/s^2", "s")


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["format"], 2, "format 2"),
        (["format"], None, "format"),
        (["method"], "magic", "magic"),
        (["verdict"], "perhaps", "verdict"),
        (["warnings"], "none", "warnings"),
        (["parameters"], [], "parameters"),
        (["parameters", "acc_bias", "value"], [1.0, 2.0], "parameters.acc_bias.value"),
        (["parameters", "acc_bias", "value"], ["a", 1.0, 2.0], "acc_bias.value"),
        (["parameters", "acc_bias", "value"], [None, 1.0, 2.0], "acc_bias.x"),
        (["parameters", "acc_scale", "unit"], 1, "acc_scale.unit"),
        (["covariance", "matrix"], [[1.0]], "covariance.matrix"),
        (["covariance", "matrix"], "x", "covariance.matrix"),
        (["covariance", "matrix"], (-np.eye(15)).tolist(), "a negative variance"),
        (["covariance", "matrix"], [[10**400] * 15] * 15, "is not a table of numbers"),
        (["parameters", "acc_bias", "value"], [10**400, 1.0, 2.0], "too large"),
        (["parameters", "acc_bias", "value"], [np.inf, 1.0, 2.0], "too large"),
        (["parameters", "acc_bias", "names"], ["q", "y", "z"], "no component 'q'"),
        (["covariance", "names"], ["acc_bias.x"], "covariance.matrix"),
        (["fit", "dof"], 1.5, "fit.dof"),
        (["fit", "chi2"], True, "fit.chi2"),
        (["fit"], None, "fit"),
    ],
)
def test_a_broken_document_is_refused_by_key(
    path: list[str], value: Any, text: str
) -> None:
    document = copy.deepcopy(made().to_json())
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(InputError, match=text):
        Calibration.from_json(document)


@pytest.mark.parametrize("part", ["k19", "k11", "k1", "x", "s12"])
def test_a_matrix_has_the_entries_that_it_has(part: str) -> None:
    document = made().to_json()
    coupling = {"value": [1.0], "unit": "1", "names": [part]}
    document["parameters"]["cross_coupling"] = coupling
    with pytest.raises(InputError, match=f"no component '{part}': it may have k12,"):
        Calibration.from_json(document)


anything = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["value", "unit", "names", "matrix"]), inner)
    ),
    max_leaves=6,
)


@given(st.sampled_from(["parameters", "covariance", "fit", "warnings"]), anything)
def test_no_document_ends_in_anything_but_a_clear_error(key: str, junk: Any) -> None:
    document = made().to_json() | {key: junk}
    try:
        Calibration.from_json(document)
    except InputError as error:
        assert key in str(error)
    else:
        assert key == "warnings"


def test_gravity_of_another_place_shows_as_scale() -> None:
    u = outputs(WIDE_POSITIONS, g=G * 1.001)
    result = solve(observe(WIDE_POSITIONS, u), tilt="none")
    np.testing.assert_allclose(result.vector("acc_scale")[0], SCALE * 1.001, rtol=1e-6)
