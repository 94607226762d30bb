"""The benchmark's sessions are what they say: size, seeds, judgement."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealed import kinds
from benchmarks.concealed.draws import size
from benchmarks.concealed.judging import judged
from benchmarks.concealed.others import OUTSIDE, example
from benchmarks.concealed.tables import GROUPS, groups
from fieldcal.core.positions import specific_forces, unknown_axis_speeds
from fieldcal.diagnosis import diagnose
from fieldcal.effects import catalogue
from fieldcal.sim_device.effects import ids, kind
from fieldcal.sim_device.profile_file import profile_from_tables


def test_every_id_that_positions_show_is_concealed_in_some_kind() -> None:
    moving = {name for name in catalogue() if kind(name).EXAMPLE.in_motion}
    assert set(catalogue()) - moving <= set(kinds())
    assert moving & set(kinds()) == {"bandwidth"}, "which turns show as well"
    assert {f"outside: {name}" for name in OUTSIDE} <= set(kinds())


@pytest.mark.parametrize("name", ids())
def test_an_effect_without_a_draw_of_its_own_is_drawn_from_its_example(
    name: str,
) -> None:
    session = example(name, np.random.default_rng(4))
    assert session.label == name and set(session.concealed) == {name}
    assert name in {one.id for one in session.profile.effects}
    shown = kind(name).EXAMPLE
    for part, table in shown.device.items():
        there = getattr(session.profile, part)
        made = getattr(profile_from_tables(shown.device), part)
        assert all(getattr(there, key) == getattr(made, key) for key in table)


@pytest.mark.parametrize("name", ["quadratic", "gyro_scale", "hum"])
def test_the_size_is_the_one_asked_for(name: str) -> None:
    session = kinds()[name][0](np.random.default_rng(5))
    assert 10 <= session.sigmas <= 30
    assert size(session) == pytest.approx(session.sigmas, rel=0.02)


def test_a_seed_gives_one_recording() -> None:
    one, two = (kinds()["pair"][0](np.random.default_rng(3)) for _ in range(2))
    assert one.concealed == two.concealed
    assert np.array_equal(one.record(7).six, two.record(7).six)
    assert not np.array_equal(one.record(7).six, two.record(8).six)


def test_attitudes_told_as_one_turn_are_those_of_the_angles() -> None:
    session = kinds()["any attitude"][0](np.random.default_rng(1))
    told = session.about.positions
    plain = replace(session, attitudes=False).about.positions
    np.testing.assert_allclose(
        specific_forces(told, 9.8), specific_forces(plain, 9.8), atol=1e-6
    )


def test_a_table_of_known_speed_tells_nothing_else() -> None:
    session = kinds()["nothing, speeds"][0](np.random.default_rng(1))
    positions = session.about.positions
    speed, _ = unknown_axis_speeds(positions)
    assert (speed > 0).sum() == len(positions) - 2
    assert not any(p.oriented or p.rate for p in positions)


@pytest.mark.thorough
def test_a_pier_without_gyroscopes_is_named() -> None:
    session = kinds()["pier, no gyroscopes"][0](np.random.default_rng(1))
    block = session.record(1)
    assert np.isnan(block.gyr).all()
    told = diagnose(block, session.about)
    assert judged(session, 1, told, 0.0).right


@pytest.mark.thorough
def test_a_bump_is_judged_by_name_and_by_number() -> None:
    session = kinds()["bump"][0](np.random.default_rng(2))
    told = diagnose(session.record(2), session.about)
    one = judged(session, 2, told, 0.0)
    assert one.right and not one.aliased and not one.extra
    assert set(one.pulls) == {"bump.at_s", "bump.for_s"}
    assert "100.0 %" in groups([one])
    other = judged(session.having({"stuck": _stuck()}), 2, told, 0.0)
    assert not other.right and other.extra == ("bump",)
    knock = {"base_step": {"about_x_deg": 0.1, "about_z_deg": 0.0, "at_s": 60.0}}
    assert not judged(session.having(knock), 2, told, 0.0).extra
    assert sum(belongs(one) for belongs in GROUPS.values()) == 1


ONCE_MISSED = [
    ("warm_up", 91_019_001),  # what fades was taken off the way twice
    ("warm_up", 91_019_004),  # what wanders in a single window made up for it
    ("outside: fading coupling", 91_047_002),  # of one axis alone
    ("pair", 93_100_030),  # two on accelerometers, one on gyroscopes as well
    ("pair", 93_100_037),
    ("pair", 93_200_005),  # six of nine parameters made up for the other
]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("label", "seed"),
    [
        ONCE_MISSED[0],
        *(pytest.param(*one, marks=pytest.mark.thorough) for one in ONCE_MISSED[1:]),
    ],
)
def test_what_is_concealed_is_named(label: str, seed: int) -> None:
    session = kinds()[label][0](np.random.default_rng(seed))
    told = diagnose(session.record(seed), session.about)
    assert judged(session, seed, told, 0.0).right


def _stuck() -> dict[str, object]:
    return {"channel": "ax", "from_s": 1.0, "to_s": 2.0}


@pytest.mark.parametrize(
    "seed",
    [
        76000309,
        *(pytest.param(s, marks=pytest.mark.thorough) for s in (76000300, 76000304)),
    ],
)
def test_what_is_left_of_a_smoothing_is_no_effect_of_the_sensors(seed: int) -> None:
    """Known to 0.2 to 15 %: what is left was taken for a `bandwidth` of its own."""
    session = kinds()["smoothing"][0](np.random.default_rng(seed))
    told = diagnose(session.record(seed), session.about)
    assert judged(session, seed, told, 0.0).right, told.says
