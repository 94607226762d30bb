"""A recording as a device."""

import gzip
import json
from pathlib import Path

import can
import numpy as np
import pytest
from wires import STREAMS

from fieldcal.cli import main
from fieldcal.core.errors import DeviceError, InputError, SessionError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers import playback
from fieldcal.drivers.driver import open_driver
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.can_packing import frames


def everything(url: str) -> Block:
    blocks = []
    with open_driver(url) as imu:
        with pytest.raises(DeviceError, match="has ended after"):
            for block in imu.blocks():
                blocks.append(block)
        assert imu.health.samples == sum(map(len, blocks))
    return concat(blocks)


def csv(path: Path, n: int, rate: float) -> Path:
    rows = [f"{i / rate},{i},0,9.8,0,0,0" for i in range(n)]
    path.write_text("t,ax,ay,az,gx,gy,gz\n" + "\n".join(rows) + "\n")
    return path


def test_a_session_in_its_units(tmp_path: Path) -> None:
    csv(tmp_path / "samples.csv", 500, 100)
    (tmp_path / "session.toml").write_text(
        'format = 1\n[units]\nacceleration = "g"\nangular_rate = "deg/s"\n'
        "[site]\nlatitude_deg = 50.0\nheight_m = 0.0\n"
    )
    block = everything(f"replay:{tmp_path}?speed=max")
    np.testing.assert_allclose(block.acc[:, 0], np.arange(500) * 9.80665)
    np.testing.assert_array_equal(block.t, np.arange(500) / 100)


class Clock:
    """A clock that goes on while somebody sleeps, and a microsecond when looked at."""

    def __init__(self) -> None:
        self.now = 7.0

    def monotonic(self) -> float:
        self.now += 1e-6
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


def test_a_samples_file_at_the_speed_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, clock = csv(tmp_path / "samples.csv", 1001, 100), Clock()
    for name in ("monotonic", "sleep"):
        monkeypatch.setattr(playback, name, getattr(clock, name))
    assert len(everything(f"replay:{path}?speed=50")) == 1001
    assert clock.now - 7.0 == pytest.approx(10.0 / 50, rel=0.05)
    with open_driver(f"replay:{path}?speed=0.01") as imu:
        first = imu.receive(0.0)
        assert first is not None and len(first) == 1
        assert imu.receive(0.01) is None


@pytest.mark.parametrize("name", sorted(STREAMS))
@pytest.mark.parametrize("packed", [False, True])
def test_bytes_of_a_port(tmp_path: Path, name: str, packed: bool) -> None:
    stream = STREAMS[name](300, np.random.default_rng(0))
    data = b"".join(stream.pieces)
    path = tmp_path / ("port.log.gz" if packed else "port.bin")
    path.write_bytes(gzip.compress(data) if packed else data)
    query = f"&{stream.query}" if stream.query else ""
    block = everything(f"replay:{path}?format={name}&speed=max{query}")
    np.testing.assert_allclose(block.six, stream.samples.six, rtol=1e-6, atol=1e-9)


def test_the_autopilots_stream(shared: Path) -> None:
    path = shared / "real" / "autopilot_streams" / "vectornav.bin.gz"
    assert len(everything(f"replay:{path}?format=vectornav&speed=max")) == 343


def test_what_cannot_be_replayed(tmp_path: Path) -> None:
    (tmp_path / "noise.bin").write_bytes(bytes(1000))
    with pytest.raises(InputError, match="no such session or log"):
        open_driver(f"replay:{tmp_path}/nothing")
    with pytest.raises(InputError, match="say what bytes these are"):
        open_driver(f"replay:{tmp_path}/noise.bin")
    with pytest.raises(InputError, match="holds no sample"):
        open_driver(f"replay:{tmp_path}/noise.bin?format=mip")
    with pytest.raises(SessionError):
        open_driver(f"replay:{tmp_path}")
    with pytest.raises(InputError, match="speed"):
        open_driver(f"replay:{tmp_path}/noise.bin?format=mip&speed=0")


@pytest.mark.parametrize("damage", ["cut", "changed"])
def test_a_damaged_compression_is_said(tmp_path: Path, damage: str) -> None:
    packed = bytearray(gzip.compress(np.random.default_rng(0).bytes(50_000)))
    if damage == "cut":
        del packed[len(packed) // 2 :]
    else:
        packed[20:40] = b"\xff" * 20
    (tmp_path / "port.bin.gz").write_bytes(packed)
    with pytest.raises(InputError, match=r"port.bin.gz: .*damaged or cut off"):
        open_driver(f"replay:{tmp_path}/port.bin.gz?format=mip")


def test_samples_without_a_clock_need_a_rate(tmp_path: Path) -> None:
    lines = b"0.1,0.2,9.8\r\n" * 40
    (tmp_path / "port.txt").write_bytes(lines)
    url = f"replay:{tmp_path}/port.txt?format=text&columns=ax,ay,az&speed=max"
    with pytest.raises(InputError, match="have no time of the device: add rate="):
        open_driver(url)
    assert len(everything(f"{url}&rate=100")) > 30


def test_a_log_of_a_can_bus_plays_through_the_same_code(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    packed = frames(VirtualDevice(Profile(), seed=2).take(400))
    with can.Logger(path) as log:
        for i, frame in enumerate(packed):
            message = can.Message(
                timestamp=i / 300, arbitration_id=frame.identifier, data=frame.data
            )
            message.is_extended_id = False
            log(message)
    block = everything(f"replay:{path}?dbc=virtual&speed=max")
    assert len(block) == 400
    np.testing.assert_array_equal(
        block.six, everything(f"can:{path}?dbc=virtual&speed=max").six
    )


def test_a_log_of_an_autopilot_plays_through_the_same_code(shared: Path) -> None:
    path = shared / "real" / "autopilot_streams" / "autopilot_12_positions.tlog.gz"
    url = f"replay:{path}?message=RAW_IMU&speed=max"
    assert len(everything(url)) == 16917
    with open_driver(url) as imu:
        next(imu.blocks())
        assert imu.grain.cut and imu.notes["acc_unit"] == "mg"


def test_a_recorded_session_is_taken_through_a_procedure_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The arrivals in it are of long ago; they are the clock while it plays."""
    run = ["run", "two_position", "--headless", "--no-report", "--level=0.001"]
    run += ["--angles=0.001", "--squareness=1e-5", "--latitude=45"]
    virtual = ["--virtual=--can slcan", "--speed", "20", "-o", str(tmp_path / "first")]
    assert main([*run, *virtual, "--seconds=12"]) == 0
    url = f"replay:{tmp_path / 'first'}?speed=20"
    with open_driver(url) as imu:
        assert imu.grain.acc == pytest.approx(1e-4)
    # a rest that is seen a little later leaves less of its window
    again = [*run, "--device", url, "--seconds=10"]
    assert main([*again, "-o", str(tmp_path / "second")]) == 0
    first, second = (
        json.loads((tmp_path / name / "result.json").read_text())["parameters"]
        for name in ("first", "second")
    )
    for group in ("acc_bias", "acc_scale"):
        off = np.subtract(first[group]["value"], second[group]["value"])
        assert np.all(np.abs(off) < 4 * np.array(first[group]["sigma"]))
    # a recording that was too short does not come back
    capsys.readouterr()
    longer = [*run, "--device", url.replace("=20", "=max"), "--seconds=3600"]
    assert main([*longer, "-o", str(tmp_path / "third")]) == 3
    said = capsys.readouterr().err
    assert "has ended after" in said and "once it is back" not in said
