"""Signals, units and options: what is taken, and what is said about what is not."""

from pathlib import Path

import numpy as np
import pytest
from can_wires import DBC, KEYED, decode, stream

from fieldcal.core.errors import InputError
from fieldcal.drivers.can_map import COLUMNS, read_map
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.options import Options


@pytest.fixture(scope="module")
def dbc(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("can") / "imu.dbc"
    path.write_text(DBC)
    return path


def test_without_a_map_the_names_tell() -> None:
    parts = read_map(Options("can", "dbc=virtual"))
    assert [part.name for part in parts] == ["Acceleration", "AngularRate", "Status"]
    assert {c for part in parts for c in part.channels} == set(COLUMNS)
    assert all("seq" in part.channels for part in parts)


def test_a_unit_can_be_stated_with_a_factor(dbc: Path) -> None:
    rows = stream(10)
    plain, _ = decode(dbc, f"map={KEYED}", rows)
    stated, _ = decode(dbc, f"map={KEYED}&acc_unit=mg&gyr_unit=2*mrad/s", rows)
    np.testing.assert_allclose(stated.acc, plain.acc / 1000)
    np.testing.assert_allclose(stated.gyr, np.rad2deg(plain.gyr) * 2e-3)


@pytest.mark.parametrize(
    ("query", "says"),
    [
        ("", "name the DBC file of the device with dbc=FILE"),
        ("dbc=nowhere.dbc", "nowhere.dbc: cannot be read: No such file"),
        ("dbc={broken}", "is no DBC file that can be understood"),
        ("dbc={dbc}&map=ax", "must be like ax=Frame.Signal"),
        ("dbc={dbc}&map=a=Force.ax", "must be like ax=Frame.Signal, with one of ax"),
        ("dbc={dbc}&map=ax=Force.x", "no signal Force.x for ax; there are Force.ax"),
        ("dbc={dbc}&map=ax=seq", "is in several frames; write one of Force.seq"),
        ("dbc={dbc}&map=seq=seq", "say which signals are the channels with map=ax="),
        ("dbc={dbc}&map=ax=Climate.level", "unit 'furlong': state it with acc_unit="),
        ("dbc={dbc}&map=gx=Climate.bare", "has no unit: state it with gyr_unit=rad/s"),
        ("dbc={dbc}&map=gx=gx&gyr_unit=two*rad/s", "has the unit 'two*rad/s'"),
        ("dbc={dbc}&map=gx=gx&gyr_unit=0*rad/s", "has the unit '0*rad/s': state it"),
        ("dbc={dbc}&map=gx=gx&gyr_unit=nan*rad/s", "has the unit 'nan*rad/s'"),
        ("dbc={dbc}&map=gx=gx&gyr_unit=inf*rad/s", "has the unit 'inf*rad/s'"),
        ("dbc={dbc}&map=gx=gx,t=Climate.frozen", "Climate.frozen has the factor 0"),
        ("dbc={dbc}&map=gx=gx&first=Force", "first=Force is none of Rate"),
        ("dbc={dbc}&map=gx=gx&colour=red", "knows no option 'colour'"),
        ("dbc=virtual&interface=morse", "there is no interface 'morse'; there are"),
        ("dbc=virtual&interface=slcan&bitrate=1234", "Invalid bitrate"),
    ],
)
def test_bad_input_is_one_sentence(
    dbc: Path, tmp_path: Path, query: str, says: str
) -> None:
    broken = tmp_path / "broken.dbc"
    broken.write_text("BO_ nonsense")
    url = "can:loop://?" if "bitrate" in query else "can:can0?"
    with pytest.raises(InputError) as raised:
        open_driver(url + query.format(dbc=dbc, broken=broken))
    text = str(raised.value)
    assert says in text and "\n" not in text and raised.value.exit_code == 2
