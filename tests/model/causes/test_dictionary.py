"""What a session may have: its groups, with their sizes and chances."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_sessions import LADDER, dictionary, ladder, nominal, rows_of

from fieldcal.core.frames import EARTH_RATE, earth_rate_at_home
from fieldcal.effects import catalogue
from fieldcal.model import priors, resolutions
from fieldcal.model.causes import columns, effect_causes, smooth
from fieldcal.model.causes.basis import Course, RowView
from fieldcal.model.causes.cause import CLOSURE, Cause, Group, triads_of
from fieldcal.model.causes.dictionary import Dictionary
from fieldcal.model.causes.effect_causes import units_of
from fieldcal.model.causes.flicker_series import FlickerSeries
from fieldcal.model.causes.wander import Wander
from fieldcal.model.system.window_rows import WindowSystem
from fieldcal.physics.effect import Sensor
from fieldcal.physics.experience import Experience
from fieldcal.physics.experience_rows import select_rows

UNIT = np.array([2.0, 2.0, 4.0, 10.0, 10.0, 20.0])


def made(
    x: Experience,
    channels: tuple[int, ...] = tuple(range(6)),
    turns: bool = False,
    wander: Wander | None = None,
) -> Dictionary:
    """A dictionary of outputs that are not in SI."""
    held = len(np.unique(x.position))
    used = np.tile(np.isin(np.arange(6), channels), (len(x), 1))
    since, common = np.array([x.since_turn]), np.zeros((held, 6))
    wander = wander or Wander.none()
    return Dictionary(x, used, since, common, UNIT, turns, wander)


def first(places: int, rows: int = 3, **known: Any) -> Experience:
    """The first positions of the ladder."""
    x = ladder(rows, **known)
    return select_rows(x, np.flatnonzero(x.position < places).tolist())


NAMES = ("ax", "ay", "az", "gx", "gy", "gz")
WHOLE = made(ladder())
CAUSES = {c.key: c for c in WHOLE.causes}


def always(d: Dictionary) -> dict[tuple[str, str], Group]:
    return {(g.cause, g.part): g for g in d.always}


def test_what_a_device_has_anyway() -> None:
    groups = always(WHOLE)
    assert list(groups) == [("bias", "acc"), ("bias", "gyr"), ("scale", "acc"),
                            ("earth", "")]  # fmt: skip
    for (cause, part), sizes in {
        ("bias", "acc"): 0.3 * UNIT[:3],
        ("bias", "gyr"): 0.02 * UNIT[3:],
        ("scale", "acc"): 0.01 * UNIT[:3],
        ("earth", ""): np.full(3, EARTH_RATE),
    }.items():
        one = groups[cause, part]
        np.testing.assert_allclose(one.typical, sizes)
        assert one.in_state and one.changes_together == (cause == "scale")
        assert one.fixed_size == (1.0 if cause == "earth" else None)
        np.testing.assert_allclose(one.prior_sigma(3.0), 3.0 * sizes)
    assert groups["bias", "gyr"].columns.tolist() == [WHOLE.bias + c for c in (3, 4, 5)]
    assert groups["scale", "acc"].columns.tolist() == [
        WHOLE.scale + c for c in (0, 1, 2)
    ]
    assert groups["earth", ""].columns.tolist() == [WHOLE.earth + c for c in (0, 1, 2)]


def test_a_table_that_turns_shows_the_scale_factors_of_gyroscopes() -> None:
    rate = np.zeros((27, 3))
    rate[4, 1] = 0.5
    assert ("scale", "gyr") in always(made(ladder(rate=rate)))


def test_the_earth_that_is_known_or_not_seen_is_no_cause() -> None:
    assert "earth" not in {g.cause for g in made(ladder(), (0, 1, 2)).always}
    base = earth_rate_at_home(0.8)
    assert "earth" not in {g.cause for g in made(ladder(base_rate=base)).always}
    acc = made(ladder(), (0, 1, 2))
    assert acc.earth == -1 and list(always(acc)) == [("bias", "acc"), ("scale", "acc")]
    gyr = always(made(ladder(), (3, 5)))
    assert list(gyr) == [("bias", "gyr"), ("earth", "")]
    np.testing.assert_allclose(gyr["bias", "gyr"].typical, [0.2, 0.4])


def test_without_angles_the_earth_turns_with_the_device() -> None:
    d = made(ladder(free=(2, 5)))
    assert d.unoriented.tolist() == [p in (2, 5) for p in range(9)]
    (one,) = (g for g in d.always if g.cause == "earth anyhow")
    np.testing.assert_allclose(one.typical[:3], EARTH_RATE / 3**0.5)
    np.testing.assert_allclose(one.typical[3:], [EARTH_RATE])
    assert one.part == "gyr" and one.fixed_size == 1.0 and not one.in_state
    assert not made(ladder(free=(2,)), (3, 4, 5)).unoriented.any(), "no force is seen"
    assert not dictionary(ladder()).unoriented.any()
    for free in (made(ladder(free=(2,)), (0, 1, 2)), made(first(1, free=(0,)))):
        assert "earth anyhow" not in {g.cause for g in free.always}


@pytest.mark.parametrize("turns", [False, True])
def test_instability_is_typical_of_each_output(turns: bool) -> None:
    d = made(ladder(), (0, 2, 3), turns)
    acc, gyr = 1e-3, 3e-5
    expected = [acc * 2, 0, acc * 4, gyr * 10, 0, 0, 5e-4 * turns]
    np.testing.assert_allclose(d.typical_instability, expected)
    assert CLOSURE == 6
    assert not made(first(2), turns=True).typical_instability.any(), (
        "of two windows nobody knows"
    )
    np.testing.assert_allclose(made(first(3)).typical_instability[0], acc * 2)


def test_of_few_windows_instability_is_within_them() -> None:
    x = first(2, rows=30)
    rows = rows_of(x, np.hstack([x.f, x.w]))
    wander = Wander.of(rows, UNIT)
    series = FlickerSeries.of(x.t, rows.length)
    assert wander.series is not None
    np.testing.assert_array_equal(wander.series.terms, series.terms)
    d = made(x, (0, 2, 3, 4, 5), wander=wander)
    groups = always(d)
    one, k = groups["flicker", "acc"], len(series.sizes)
    shape = 1e-3 * series.sizes
    np.testing.assert_allclose(one.typical, np.concatenate([2.0 * shape, 4.0 * shape]))
    np.testing.assert_allclose(groups["flicker", "gyr"].typical[:k],
                               3e-4 * series.sizes)  # fmt: skip
    assert len(groups["flicker", "gyr"].columns) == 3 * k
    assert not one.in_state and one.fixed_size is None
    at = one.columns[:k]
    (first_at,) = (n for n, b in d.bases if b.name == "flicker")
    np.testing.assert_array_equal(at, first_at + np.arange(k))
    # what goes on by the clock does so while the device is turned too
    timed = {b.name: b.timed for _, b in d.bases if isinstance(b, Course)}
    assert timed["flicker"] and timed["waves"] and not timed["window"]
    others = first(3, rows=30), first(2, rows=1)
    for y in others:
        few = rows_of(y, np.hstack([y.f, y.w]))
        assert Wander.of(few, UNIT).series is None


def test_a_prediction_has_bias_and_scale_factor_alone() -> None:
    plain = made(ladder(free=(2,))).calibration_only()
    assert {g.cause for g in plain.always} == {"bias", "scale"}
    assert {g.fixed_size for g in plain.always} == {priors.FREE_SIZE}


def test_columns_that_are_added_apart_are_not_in_the_other() -> None:
    d = made(ladder())
    own = d.independent_copy()
    width, count = d.width, len(d.bases)
    own.add_course("more", smooth.alpha, 8, False)
    assert own.width == width + 48 and len(own.bases) == count + 1
    assert d.width == width and len(d.bases) == count


def test_where_columns_are() -> None:
    d = WHOLE
    assert d.cosine_columns(2, 3).tolist() == [
        d.waves + 2 * d.span.count + i for i in range(3)
    ]
    assert len(d.cosine_columns(1)) == resolutions.COSINES
    assert d.window_columns(4).tolist() == [d.windows + 4 * 9 + i for i in range(9)]
    assert d.position_count == 9 and d.window_positions.tolist() == list(range(9))
    assert d.scale - d.bias == 6 and d.windows - d.small_rotation == 18
    assert d.waves - d.windows == 54


def test_rows_without_times_have_no_course() -> None:
    """A course would be a constant: as a bias is, and one of the force as a scale."""
    x = ladder(1)
    same = np.zeros(len(x))
    untimed = made(replace(x, t=same, since_start=same))
    kinds = {cause.key.partition(":")[0] for cause in untimed.causes}
    assert not kinds & {"time", "force and time"}
    assert {"force", "position", "window"} <= kinds
    assert {"time:ax", "time:acc", "force and time:ax"} <= CAUSES.keys()


def test_what_no_effect_makes_is_of_the_size_of_effects() -> None:
    acc, gyr = 0.02 * UNIT[:3], 1e-3 * UNIT[3:]
    both = np.concatenate([acc, gyr])
    for c, channel in enumerate(NAMES):
        for kind in ("alpha", "joints", "force", "temperature", "since turn"):
            cause = CAUSES[f"{kind}:{channel}"]
            assert (cause.kind, cause.chance) == (
                "unknown",
                priors.UNKNOWN_FUNCTION_CHANCE,
            )
            (group,) = cause.variants
            np.testing.assert_allclose(group.typical, both[c])
        whole = CAUSES[f"position:{channel}"].variants[0]
        assert whole.columns.tolist() == WHOLE.window_columns(c).tolist()
        np.testing.assert_allclose(whole.typical, both[c])
        each = CAUSES[f"window:{channel}"].variants
        assert [g.columns.tolist() for g in each] == [
            [w] for w in WHOLE.window_columns(c)
        ]
        assert [g.position for g in each] == list(range(9))
        fading = CAUSES[f"force and time:{channel}"].variants
        assert [len(g.columns) for g in fading] == ([12, 4] if c < 3 else [12])
        if c < 3:
            own = fading[0].columns[4 * c : 4 * c + 4]
            np.testing.assert_array_equal(fading[1].columns, own)
        for span, group in zip(priors.HALF_WAVES, CAUSES[f"time:{channel}"].variants,
                               strict=True):  # fmt: skip
            np.testing.assert_allclose(
                group.typical, both[c] * smooth.smooth_course_sizes(span)
            )
            assert group.shape == {"waves": span}
    for part, some in (("acc", range(3)), ("gyr", range(3, 6))):
        for span, group in zip(priors.HALF_WAVES, CAUSES[f"time:{part}"].variants,
                               strict=True):  # fmt: skip
            shape = smooth.smooth_course_sizes(span)
            at = [WHOLE.waves + c * WHOLE.span.count + i for c in some
                  for i in range(len(shape))]  # fmt: skip
            assert group.columns.tolist() == at
            sizes = np.concatenate([both[c] * shape for c in some])
            np.testing.assert_allclose(group.typical, sizes)


def test_every_group_says_of_what_it_is() -> None:
    for cause in WHOLE.causes:
        for group in cause.variants:
            assert group.cause == cause.name
            assert triads_of(group.part[:2] if group.part[:2] in NAMES else group.part
                             ) <= triads_of(cause.part.partition(",")[0])  # fmt: skip
            assert len(group.columns) == len(group.typical) > 0
            assert group.columns.max() < WHOLE.width and (group.typical > 0).all()


def keys_of(x: Experience, channels: tuple[int, ...] = (0, 1, 2, 3, 4, 5)) -> set[str]:
    return {c.name for c in made(x, channels).causes if c.kind != "effect"}


def test_what_a_session_cannot_show_is_not_offered() -> None:
    every = keys_of(ladder())
    assert {
        "alpha",
        "beta",
        "joints",
        "position",
        "window",
        "misset",
        "repeated_angle",
    } < every
    few = keys_of(first(3))
    assert few == {"time", "temperature", "since turn", "random_walk", "angle_setting",
                   "flicker"}  # fmt: skip
    assert "flicker" not in keys_of(first(2))
    four = keys_of(first(4))
    assert four == every
    free = keys_of(ladder(free=(2,)))
    assert every - free == {"alpha", "beta", "joints"}
    one_known = keys_of(ladder(free=range(1, 9)))
    assert "misset" in one_known and "angle_setting" not in one_known
    assert "angle_setting" in keys_of(ladder(free=range(2, 9)))
    witnessed = made(ladder(free=(2,)))
    causes = {c.key: c for c in witnessed.causes}
    others = [0, 1, 3, 4, 5, 6, 7, 8]
    assert [c.position for c in witnessed.causes if c.name == "misset"] == others
    worn = causes["repeated_angle"]
    assert all(2 not in g.moved_positions for g in worn.variants)
    *each, all_of_them = worn.variants  # a fixture may be worn throughout
    assert worn.single_errors_of(all_of_them) == tuple(each)
    assert all(worn.single_errors_of(one) == (one,) for one in each)
    changes = causes["force and time:ax"]  # a scale factor that changes, and more
    wide, narrow = changes.variants
    assert {*wide.columns} > {*narrow.columns}
    assert changes.single_errors_of(wide) == (wide,)
    np.testing.assert_array_equal(
        all_of_them.columns, np.concatenate([g.columns for g in each])
    )
    (scatter,) = causes["angle_setting"].variants  # where angles are set, not beside
    set_ = witnessed.small_rotation + np.arange(18).reshape(9, 2)[others].ravel()
    np.testing.assert_array_equal(scatter.columns, set_)
    still = ladder(warming=np.zeros(27))
    assert every - keys_of(still) == {"temperature"}
    never = replace(ladder(), since_turn=np.full(27, np.inf))
    assert every - keys_of(never) == {"since turn"}
    assert "angle_setting" not in keys_of(first(2))
    one = {c.key for c in made(ladder(), (0, 4)).causes if c.name == "time"}
    assert one == {"time:ax", "time:gy"}


def test_positions_that_were_set_elsewhere() -> None:
    causes = [c for c in WHOLE.causes if c.name == "misset"]
    assert sum(c.chance for c in causes) == pytest.approx(0.01)
    for p, cause in enumerate(causes):
        assert (cause.kind, cause.part, cause.position) == ("position", "", p)
        (group,) = cause.variants
        at = WHOLE.small_rotation + 2 * p
        assert group.columns.tolist() == [at, at + 1] and group.position == p
        np.testing.assert_allclose(group.typical, np.deg2rad(3.0))
        assert group.in_state
    (group,) = CAUSES["angle_setting"].variants
    typical = catalogue()["angle_setting"].params[0].typical
    np.testing.assert_allclose(group.typical, np.deg2rad(typical))
    every = WHOLE.small_rotation + np.arange(18)
    np.testing.assert_array_equal(group.columns, every)
    assert group.in_state and CAUSES["angle_setting"].kind == "random"


def test_biases_that_wander() -> None:
    effect = catalogue()["random_walk"]
    shape = WHOLE.span.walk()[: resolutions.COSINES]
    for part, some in (("acc", (0, 1, 2)), ("gyr", (3, 4, 5))):
        cause = CAUSES[f"random_walk:{part}"]
        assert cause.chance == effect.chance(WHOLE.x) and cause.kind == "random"
        (group,) = cause.variants
        sizes = [shape * effect.params[c].typical * UNIT[c] for c in some]
        np.testing.assert_allclose(group.typical, np.concatenate(sizes))
        at = np.concatenate([WHOLE.cosine_columns(c) for c in some])
        np.testing.assert_array_equal(group.columns, at)
        assert group.params == some and not group.in_state
        alone = CAUSES[f"random_walk:{part}, one axis"]
        assert alone.chance == pytest.approx(0.1 * cause.chance)
        assert [g.params for g in alone.variants] == [(c,) for c in some]
        assert [g.part for g in alone.variants] == [NAMES[c] for c in some]


def test_an_effect_in_counts_is_of_counts() -> None:
    """What adds to outputs is in their unit; what turns the force is not."""
    effects = catalogue()
    for key, unit in (("bias_drift:acc", 2.0), ("bias_drift:gyr", 10.0),
                      ("quadratic", 2.0), ("base_tilt", 1.0)):  # fmt: skip
        cause = CAUSES[key]
        group = cause.variants[0]
        typical = [effects[cause.name].params[j].typical for j in group.params]
        np.testing.assert_allclose(group.typical, unit * np.array(typical))
        assert group.in_state and group.effect is effects[cause.name]


def test_an_effect_is_offered_whole_and_by_output() -> None:
    variants = [g.params for g in CAUSES["cross_coupling"].variants]
    assert variants[0] == tuple(range(6))
    assert len(set(variants)) == len(variants) == 7, "of one output or of two"
    assert [len(v) for v in variants] == [6, 2, 2, 2, 4, 4, 4]
    turned = CAUSES["base_tilt"].variants
    assert [g.params for g in turned] == [(0, 1)]
    settling = CAUSES["settling:acc"].variants
    taus = {g.shape["tau_s"] for g in settling}
    assert len(settling) == 4 * len(taus), "all axes, or one"
    gyr = CAUSES["settling:gyr"].variants
    np.testing.assert_array_equal(gyr[0].params, (3, 4, 5))


def test_the_largest_columns_of_a_wide_group() -> None:
    typical = np.r_[np.linspace(5.0, 1.0, 70), np.linspace(0.5, 4.0, 30)]
    group = Group("time", "ax", np.arange(200, 300), typical)
    largest = np.sort(np.argsort(-typical)[:60])
    columns, sizes = group.leading
    np.testing.assert_array_equal(columns, 200 + largest)
    np.testing.assert_array_equal(sizes, typical[largest])
    few = Group("time", "ax", np.arange(60), typical[:60])
    np.testing.assert_array_equal(few.leading[0], np.arange(60))
    np.testing.assert_array_equal(few.leading[1], typical[:60])


def test_names_of_causes_and_triads() -> None:
    assert (
        Cause("a", "acc", 0.1, ()).key == "a:acc" and Cause("a", "", 0.1, ()).key == "a"
    )
    assert triads_of("ay") == triads_of("acc") == {"acc"}
    assert triads_of("gx") == {"gyr"} and triads_of("") == {"acc", "gyr"}


def test_chances_are_shared_among_variants_and_follow_changes() -> None:
    d = made(ladder())
    chances = [np.log(c.chance / len(c.variants)) for c in d.causes]
    np.testing.assert_allclose(d.cause_log_priors, chances)
    at = [c.key for c in d.causes].index("settling:acc")
    cause, width = d.causes[at], d.width
    shown = d.shown.copy()
    shown[5] = d.shown[5] = True
    (more, (new,)) = d.add_shapes(cause, cause.variants[3], [{"tau_s": 7.5}])
    assert d.causes[at] is more and more.variants[:-1] == cause.variants
    assert more.variants[-1] is new and new.shape == {"tau_s": 7.5}
    assert new.params == cause.variants[3].params
    assert new.columns.min() >= width and d.width > width
    assert d.shown.tolist() == [*shown, *[False] * (d.width - width)]
    assert d.cause_log_priors[at] == pytest.approx(
        np.log(cause.chance / len(more.variants))
    )
    assert len(d.typical) == d.width
    extra = Cause("extra", "", 0.5, (d.causes[0].variants[0],), "unknown")
    d.add_causes([extra])
    assert d.causes[-1] is extra and d.cause_log_priors[-1] == pytest.approx(
        np.log(0.5)
    )
    widths = {b.blocks.shape[1] for b in d.groups_by_width}
    assert len(widths) == len(d.groups_by_width)
    seen = sorted((int(c), int(v)) for b in d.groups_by_width
                  for c, v in zip(b.cause, b.variant, strict=True))  # fmt: skip
    assert seen == [(i, j) for i, c in enumerate(d.causes)
                    for j in range(len(c.variants))]  # fmt: skip
    for alike in d.groups_by_width:
        for i, j, block, typical in zip(
            alike.cause, alike.variant, alike.blocks[alike.block], alike.typical,
            strict=True,
        ):  # fmt: skip
            columns, sizes = d.causes[i].variants[j].leading
            np.testing.assert_array_equal(block, columns)
            np.testing.assert_array_equal(typical, sizes)


def test_the_first_linearisation_tells_which_columns_windows_show() -> None:
    x = ladder()
    d = dictionary(x)
    WindowSystem(rows_of(x, np.hstack([x.f, x.w])), d).linearised(nominal())
    assert d.shown[d.bias : d.bias + 6].all()
    assert d.shown[d.scale : d.scale + 3].all()
    assert not d.shown[d.scale + 3 : d.scale + 6].any(), "windows do not turn"
    assert d.shown[d.small_rotation : d.small_rotation + 2 * len(LADDER)].any()
    lever = next(c for c in d.causes if c.name == "lever_arm").variants[0]
    assert not d.shown[lever.columns].any()


def test_however_a_device_lies_the_earth_s_upright_rate_is_along_the_force() -> None:
    """Three rates in its axes, and one along up; nothing where angles are known."""
    x = ladder(free=(2, 5))
    found = columns.earth_rate_unoriented(
        RowView.of(x, np.array([x.since_turn]), nominal())
    )
    free = np.isin(x.position, (2, 5))
    assert not found[~free].any() and not found[:, :3].any()
    up = x.f[free] / np.linalg.norm(x.f[free], axis=1)[:, None]
    np.testing.assert_allclose(found[free][:, 3:, 3], up)
    np.testing.assert_allclose(found[free][:, 3:, :3], np.tile(np.eye(3), (6, 1, 1)))


def test_the_earth_turns_a_device_on_its_way_as_well() -> None:
    """What gyroscopes show there is no Earth's rate: the device is turned."""
    x = ladder(free=range(9))
    way = replace(x, w=np.full((27, 3), 0.4), position=np.full(27, -1))
    assert not way.earth_seen.any()
    assert replace(way, position=x.position).earth_seen.all()
    found = columns.earth_rate_unoriented(
        RowView.of(way, np.array([x.since_turn]), nominal())
    )
    np.testing.assert_allclose(found[:, 3:, :3], np.tile(np.eye(3), (27, 1, 1)))
    np.testing.assert_allclose(found[:, 3:, 3], x.f / 9.81)


def test_flicker_is_noise_of_as_many_cosines_as_biases_wander_by() -> None:
    """It is there or not, and is no effect; cosine k has a variance as 1 / k."""
    for part, some in (("acc", (0, 1, 2)), ("gyr", (3, 4, 5))):
        cause = CAUSES[f"flicker:{part}"]
        assert (cause.kind, cause.reportable, cause.chance) == ("noise", False, 0.1)
        (group,) = cause.variants
        assert group.random and group.effect is None
        k = np.arange(1, resolutions.COSINES + 1)
        size = {"acc": 2e-3, "gyr": 1e-4}[part]
        sizes = [size * UNIT[c] / np.sqrt(k) for c in some]
        np.testing.assert_allclose(group.typical, np.concatenate(sizes))
        at = np.concatenate([WHOLE.cosine_columns(c) for c in some])
        np.testing.assert_array_equal(group.columns, at)
    quiet = {c.name.split()[0] for c in WHOLE.causes if not c.reportable}
    assert {"flicker", "sinking"} <= quiet <= {"flicker", "sinking", "leaning", "way"}


def test_what_rounding_has_in_common_is_in_all_windows_and_in_no_turn() -> None:
    x, size = ladder(), np.array([0.0, 0, 0, 2e-3, 0, 5e-4])
    held = len(np.unique(x.position))
    d = Dictionary(
        x, np.ones((len(x), 6), bool), np.array([x.since_turn]), np.zeros((held, 6)),
        UNIT, True, Wander.none(), size,
    )  # fmt: skip
    (group,) = [g for g in d.always if g.cause == "rounding"]
    assert not group.random and group.fixed_size == 1.0
    np.testing.assert_array_equal(group.prior_sigma(1.0), [2e-3, 5e-4])
    flat = rows_of(x, np.hstack([x.f, x.w]))
    for part in WindowSystem(flat, d).linearised(nominal()):
        (at,) = np.nonzero(part.columns == group.columns[0])
        there = part.design[:, at] / part.weight[:, None]
        assert bool(there.size and there.all()) == (part.channel == 3)
    timed = {one.name: one.timed for _, one in d.bases if isinstance(one, Course)}
    assert not timed["rounding"]


@pytest.mark.parametrize("name", ["mount_slip", "base_step"])
def test_a_vector_is_along_one_axis_or_has_all_its_components(name: str) -> None:
    """About the bolt or the edge of a table, or about no axis in particular."""
    every = {v.params for c in WHOLE.causes if c.name == name for v in c.variants}
    components = tuple(range(len(catalogue()[name].params)))
    assert every == {components, *((j,) for j in components)}


def test_sizes_of_parameters_are_in_the_unit_of_what_they_change() -> None:
    """Whatever unit they have themselves; of inputs in SI, whatever the outputs are."""
    effects = catalogue()
    acc, gyr = UNIT[0], UNIT[3]
    for name, expected in {
        "gyro_scale": [gyr] * 3,
        "gyro_cross_coupling": [gyr] * 6,
        "gyro_products": [gyr] * 9,
        "time_delay": [1.0],
        "bandwidth": [1.0, 1.0],
        "second_order": [1.0, 1.0],
        "increments": [1.0, 1.0],
        "g_sensitivity": [gyr] * 9,
        "quadratic": [acc] * 3,
        "bias_step": [acc] * 3 + [gyr] * 3,
        "mount_slip": [1.0] * 3,
        "lever_arm": [1.0] * 3,
        "random_walk": [1.0] * 6,
    }.items():
        found = units_of(WHOLE, effects[name])
        np.testing.assert_array_equal(found, expected, name)
    for effect in effects.values():
        if isinstance(effect, Sensor) and effect.params:
            rows = effect_causes._rows_in_motion()
            changes = effect.design(rows, effect_causes._any_shape(effect))
            assert changes.any(axis=(0, 1)).all(), effect.id


def test_a_cause_whose_size_is_known_has_it_in_all_its_variants() -> None:
    cause = CAUSES["settling:acc"]
    found = cause.with_size(0.3)
    assert cause.with_size(None) is cause and found.key == cause.key
    assert len(found.variants) == len(cause.variants) > 1
    for one, before in zip(found.variants, cause.variants, strict=True):
        assert one.fixed_size == 0.3 and before.fixed_size is None
        assert one.columns is before.columns and one.shape == before.shape


def test_walks_have_as_many_cosines_as_each_output_wanders_by() -> None:
    """Of each set of outputs: a cosine k of a walk is a k-th as large."""
    modes = resolutions.COSINES + np.array([0, 7, 3, 1, 9, 0])
    d = made(ladder(), wander=replace(Wander.none(), modes=modes))
    params = catalogue()["random_walk"].params
    seen = set()
    for key, some in (("random_walk:acc", (0, 1, 2)), ("random_walk:gyr", (3, 4, 5))):
        (cause,) = [c for c in d.causes if c.key == key]
        for group in cause.variants:
            assert set(group.params) <= {*some}
            at = [d.cosine_columns(c, modes[c]) for c in group.params]
            np.testing.assert_array_equal(group.columns, np.concatenate(at))
            shape = d.span.walk()
            sizes = [shape[: modes[c]] * params[c].typical * UNIT[c]
                     for c in group.params]  # fmt: skip
            np.testing.assert_allclose(group.typical, np.concatenate(sizes))
            seen.add(group.params)
    assert {(0, 1, 2), (3, 4, 5)} <= seen


def test_where_the_rate_of_the_earth_is_measured_each_position_may_be_aside() -> None:
    """By two turns of its own, and no others: columns of these positions alone."""
    x = ladder(free=(1, 4, 6))
    shown = np.isin(x.position, (1, 4, 6))
    x = replace(x, w=np.where(shown[:, None], [1e-5, -6e-5, 3e-5], 0.0))
    d = made(x)
    (group,) = [g for g in d.always if g.cause == "earth aside"]
    ((first_at, basis),) = [(n, b) for n, b in d.bases if b.name == "earth aside"]
    assert (group.columns - first_at).tolist() == [2, 3, 8, 9, 12, 13]
    assert group.part == "gyr" and group.fixed_size == priors.FREE_SIZE
    np.testing.assert_allclose(group.prior_sigma(priors.FREE_SIZE), 1.0)
    table = basis.evaluate(RowView.of(x, d.since, nominal()))
    np.testing.assert_array_equal(np.flatnonzero(table.any(axis=(0, 1))),
                                  group.columns - first_at)  # fmt: skip


def test_a_repeated_angle_of_another_dictionary_is_that_of_the_same_positions() -> None:
    """Angles of one joint differ in nothing but the positions in which they are set."""
    other = made(ladder())
    for group in CAUSES["repeated_angle"].variants:
        ((_, matched),) = other.match_members([(CAUSES["repeated_angle"], group)])
        assert matched.moved_positions == group.moved_positions
        assert matched.columns.tolist() == group.columns.tolist()
