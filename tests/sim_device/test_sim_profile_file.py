"""Device files: what is written is read back; what cannot be is said."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.sim_device import profile_file
from fieldcal.sim_device.effect import Range, SimulatedEffect
from fieldcal.sim_device.effects import catalogue
from fieldcal.sim_device.profile import (
    Climate,
    FullScale,
    Handling,
    Identity,
    MountingAxes,
    NoiseFigures,
    Profile,
    Sampling,
    Site,
    Truth,
)
from fieldcal.sim_device.vocabulary import parse

number = st.floats(-1e3, 1e3)
positive = st.floats(1e-9, 1e3)
triad = st.tuples(number, number, number)
sizes = st.tuples(*[st.floats(0, 10)] * 3)
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


def _within(limits: Range) -> st.SearchStrategy[float]:
    good = (v for v in (0.5, 0.01) if limits.contains(v))
    return positive if limits.contains(1e3) else st.just(next(good))


def of_id(id_: str) -> st.SearchStrategy[SimulatedEffect]:
    kind = catalogue()[id_]
    numbers = {n: _within(takes.range) for n, takes in kind.NUMBERS.items()}
    numbers |= dict.fromkeys(kind.VECTOR, number)
    return st.builds(
        kind,
        st.fixed_dictionaries(numbers),
        st.fixed_dictionaries(
            {n: st.from_regex(w.pattern, fullmatch=True) for n, w in kind.WORDS.items()}
        ),
    )


effects = st.lists(
    st.sampled_from(
        [i for i, kind in catalogue().items() if not kind.NEEDS_EARTH]
    ).flatmap(of_id),
    max_size=6,
    unique_by=lambda effect: effect.id,
)
profiles = st.builds(
    Profile,
    st.builds(Identity, words, words, st.sampled_from(["tactical", "navigation"])),
    st.builds(Sampling, positive),
    st.builds(Site, st.floats(-90, 90), number, st.none() | positive),
    st.builds(MountingAxes, st.sampled_from([("+x", "+y", "+z"), ("+x", "-z", "+y")])),
    st.builds(FullScale, st.none() | positive, st.none() | positive),
    st.builds(Truth, triad, triad, triad, triad),
    st.builds(NoiseFigures, sizes, sizes, st.none() | sizes, st.none() | sizes),
    st.builds(
        Climate,
        number,
        points=st.lists(number, unique=True, max_size=4).map(
            lambda times: tuple((t, 20.0) for t in sorted(times))
        ),
    ),
    st.builds(Handling, positive, number, number),
    effects.map(tuple),
)


@given(profiles)
def test_what_is_written_is_read_back(profile: Profile) -> None:
    import tomllib

    tables = tomllib.loads(profile_file.to_toml(profile))
    back = profile_file.profile_from_tables(tables)
    assert replace(back, effects=()) == replace(profile, effects=())
    by_id = {e.id: e.parameters for e in back.effects}
    assert by_id == {e.id: e.parameters for e in profile.effects}


def test_what_happens_twice_is_written_twice(tmp_path: Path) -> None:
    profile = Profile().having(parse("hum:ax=1,hz=5"), parse("hum:ax=1,hz=6"))
    path = tmp_path / "device.toml"
    path.write_text(profile_file.to_toml(profile))
    assert profile_file.read_profile(path) == profile
    assert path.read_text().count("[[effects.hum]]") == 2


def test_a_file_says_only_what_differs(tmp_path: Path) -> None:
    path = tmp_path / "device.toml"
    path.write_text(
        """
        [noise]
        acc = 0.01
        [truth]
        acc_bias = [0.1, 0, -1]
        [effects.mounting]
        axes = ["+x", "-z", "+y"]
        [effects.earth_rate]
        """
    )
    profile = profile_file.read_profile(path)
    assert profile.noise.acc == (0.01, 0.01, 0.01)
    assert profile.truth.acc_bias == (0.1, 0.0, -1.0)
    assert profile.truth.acc_scale == Truth().acc_scale
    mounting = profile.one("mounting")
    assert mounting is not None and mounting.words["axes"] == "+x-z+y"
    assert profile.feels_earth


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[nois]\n", r"no table \[nois\].*noise"),
        ("[noise]\nacce = 1\n", r"\[noise\] has no key 'acce'; it has acc"),
        ("[noise]\nacc = [1, 2]\n", "three numbers"),
        ("[noise]\nacc = -1\n", "must be 0 or more"),
        ("[sampling]\nrate_hz = 0\n", "rate_hz = 0 must be above 0"),
        ("[sampling]\nrate_hz = true\n", "must be a number"),
        ("[truth]\nacc_bias = [1, nan, 2]\n", "must be a number"),
        ("[device]\nname = 3\n", "must be text"),
        ("[device]\ngrade = 'toy'\n", "none of consumer, tactical, navigation"),
        ("[site]\nlatitude_deg = 100\n", "latitude"),
        ("[frame]\nmounting = ['+x', '+y']\n", "must be like"),
        ("[frame]\nmounting = ['+x', '+y', '-z']\n", "left-handed"),
        ("[temperature]\npoints = [[0, 1], [0, 2]]\n", "time order"),
        ("[temperature]\npoints = [1]\n", "must be like"),
        ("[effects.voodoo]\n", "no effect is called 'voodoo'"),
        ("[effects]\nhum = 3\n", "must be a table"),
        ("noise = 3\n", "must be a table"),
        ("format = 9\n", "this version reads 1"),
        ("= 3\n", "is not TOML"),
    ],
)
def test_a_file_that_is_wrong_is_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "device.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=f"(?s)device.toml: .*{says}"):
        profile_file.read_profile(path)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        profile_file.read_profile(tmp_path / "none.toml")
