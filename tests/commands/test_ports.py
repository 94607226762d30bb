"""`fieldcal ports`: what answers on a pty, at which rate and in which format."""

import json
import re

import numpy as np
import pytest
from talking import Say, talking
from wires import STREAMS, nmea

from fieldcal.cli import main
from fieldcal.core.errors import DeviceSilent
from fieldcal.drivers import probe as module
from fieldcal.drivers.column_guess import describe_lines, guess_text_options
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.named_guess import guess_named_options
from fieldcal.drivers.options import Options
from fieldcal.drivers.probe import baud_rates, probe_port
from fieldcal.drivers.protocols.text import TextCodec
from fieldcal.importing.headings.line_names import channels_by_name


def sample(name: str) -> Say:
    pieces = STREAMS[name](2000, np.random.default_rng(1)).pieces
    return lambda i: pieces[i % 2000]


@pytest.mark.parametrize("name", sorted(set(STREAMS) - {"text"}))
def test_a_format_is_told_by_its_frames(name: str) -> None:
    with talking(sample(name)) as port:
        found = probe_port(port, 0.5)
        assert found.format == name
        assert found.rate_hz > 0
        with open_driver(found.url) as imu:
            assert len(next(imu.blocks(3.0)))


def test_the_rate_is_that_of_the_samples_in_the_time_it_listened() -> None:
    pieces = STREAMS["mip"](100, np.random.default_rng(1)).pieces
    found = module._identify("/dev/x", 115200, b"".join(pieces), took=0.5)
    assert found is not None and found.rate_hz == pytest.approx(200, rel=0.03)
    assert (
        found.says == f"mip at 115200 baud, about {found.rate_hz:.0f} samples a second"
    )


def test_what_had_waited_in_the_port_is_no_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A pty keeps what was said before anybody listened, and says it all at once."""
    pieces = iter(STREAMS["mip"](1000, np.random.default_rng(1)).pieces)
    now = [0.0]

    class Backlog:
        waits = 40

        def read(self) -> bytes:
            if self.waits:
                self.waits -= 1
            else:
                now[0] += 1 / 48
            return next(pieces)

        def close(self) -> None:
            return

    monkeypatch.setattr(module, "monotonic", lambda: now[0])
    monkeypatch.setattr(module, "open_port", lambda port, baud: Backlog())
    found = probe_port("/dev/x", 1.0, [115200])
    assert found.rate_hz == pytest.approx(48, rel=0.05)


def packets(*names: str) -> Say:
    """An autopilot's heartbeats, every tenth of what it says, and these messages."""
    dialect = pytest.importorskip("pymavlink.dialects.v20.all")
    pytest.importorskip("fastcrc")
    vehicle = dialect.MAVLink(None, 1, 1)
    beat = dialect.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)
    numbers = [0, 0, -1000, 0, 0, 0, 0, 0, 0]

    def say(i: int) -> bytes:
        parts = [] if i % 10 else [beat]
        if "RAW_IMU" in names:
            parts.append(dialect.MAVLink_raw_imu_message(5000 * i, *numbers))
        if "SCALED_IMU2" in names:
            parts.append(dialect.MAVLink_scaled_imu2_message(5 * i, *numbers))
        return b"".join(part.pack(vehicle) for part in parts)

    return say


@pytest.mark.parametrize(
    ("sends", "query", "says"),
    [
        (("SCALED_IMU2", "RAW_IMU"), "&message=RAW_IMU", r"RAW_IMU about \d+ times"),
        ((), "", "no message of an IMU until it is asked"),
    ],
)
def test_an_autopilot_is_told_by_its_packets(
    sends: tuple[str, ...], query: str, says: str
) -> None:
    with talking(packets(*sends)) as port:
        found = probe_port(port, 0.5)
        assert found.format == "mavlink" and re.search(says, found.says)
        assert found.url == f"mavlink:{port}?baud={found.baud}{query}"
        with open_driver(f"serial:{port}?format=xsens") as imu:
            with pytest.raises(
                DeviceSilent, match=f"an autopilot's; try mavlink:{port}"
            ):
                next(imu.blocks(0.3))


def test_lines_of_numbers_are_told_with_their_columns(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def line(i: int) -> bytes:
        return nmea(f"IMU,{5 * i},{i},0.1,-0.2,99.5,0.0001,0.6,-0.8,{24 + i % 2}.5")

    with talking(line) as port:
        assert main(["ports", "--probe", "--seconds", "0.5", "--json", port]) == 0
        shown = json.loads(capsys.readouterr().out)
        (entry,) = shown["ports"]
        answer = entry["answer"]
        assert answer["format"] == "text"
        assert answer["baud"] == baud_rates()[0]
        assert answer["url"].endswith(
            "&columns=t,seq,gx,gy,gz,ax,ay,az,temperature&t_unit=ms&acc_unit=g"
            "&gyr_unit=deg/s&prefix=IMU&checksum=xor"
        )
        with open_driver(answer["url"]) as imu:
            block = next(imu.blocks(3.0))
            assert np.linalg.norm(block.acc[0]) == pytest.approx(9.80665, abs=1e-3)


def test_rates_whose_unit_nothing_tells_are_said_to_be_open() -> None:
    with talking(lambda i: b"%d,0.01,-9.81,0.02,0.001,-.002,.003\n" % (5 * i)) as port:
        found = probe_port(port, 0.5)
    assert "gyr_unit" not in found.url and "add &gyr_unit=deg/s" in found.says


def two_imus(apart: float) -> Say:
    """Lines of two IMUs that lie side by side, with other biases, by turns."""
    rng = np.random.default_rng(6)
    at_rest = np.array([0.1, -0.2, 9.8, 0.01, -0.02, 0.005])
    other = apart * np.array([0.4, 0.3, -0.2, 0.02, -0.01, 0.01])
    noise = np.array([0.02] * 3 + [1e-3] * 3)
    rows = at_rest + noise * rng.standard_normal((1000, 6))
    rows[1::2] += other
    return lambda i: b"%.4f,%.4f,%.4f,%.5f,%.5f,%.5f\n" % tuple(rows[i % 1000])


def test_two_devices_on_one_port_are_said(capsys: pytest.CaptureFixture[str]) -> None:
    with talking(two_imus(1.0)) as port:
        assert main(["ports", "--probe", "--seconds", "0.5", "--json", port]) == 0
        (entry,) = json.loads(capsys.readouterr().out)["ports"]
    says = entry["answer"]["says"]
    assert entry["answer"]["mixed"] in says
    assert re.search(r"two devices seem to send on one port.*gx by 0\.02 rad/s", says)
    assert "give each a port, names or a frame of its own" in says
    with talking(two_imus(0.0)) as port:
        assert "two devices" not in probe_port(port, 0.5).says


@pytest.mark.parametrize("name", sorted(set(STREAMS) - {"text"}))
def test_one_device_of_any_format_is_not_said_to_be_two(name: str) -> None:
    data = b"".join(STREAMS[name](200, np.random.default_rng(1)).pieces)
    found = module._identify("/dev/x", 115200, data, took=1.0)
    assert found is not None and "two devices" not in found.says


def test_the_table_says_how_to_use_it(capsys: pytest.CaptureFixture[str]) -> None:
    with talking(sample("witmotion")) as port:
        assert main(["ports", "--probe", "--seconds", "0.5", port]) == 0
        shown = capsys.readouterr()
        assert f'to use it: --device "serial:{port}?format=witmotion&baud=' in shown.out
        assert "listening" in shown.err


def test_lines_that_nobody_knows_are_shown_with_what_to_do() -> None:
    """Raw counts, whose unit gravity at rest does not tell, and lines with words."""

    def counts(i: int) -> bytes:
        return b"%d;%d;0;-16700;40;2;-3;1\r\n" % (10 * i, 12 + i % 2)

    def labels(i: int) -> bytes:
        return b"ax=0.12 ay=-9.79 az=%d.5\r\n" % (i % 2)

    def words(i: int) -> bytes:
        return b"gravity is %d up\r\n" % (i % 2)

    with talking(counts) as port:
        says = probe_port(port, 0.3).says
        assert re.search(
            r"at \d+ baud lines of numbers come, such as '\d+;1[23];0;", says
        )
        assert "format=text&columns=" in says
        with open_driver(f"serial:{port}?format=witmotion") as imu:
            with pytest.raises(DeviceSilent, match="lines of numbers come, such as"):
                next(imu.blocks(0.3))
    with talking(words) as port:
        assert "reads numbers between separators only" in probe_port(port, 0.3).says
    with talking(labels) as port:
        with open_driver(f"serial:{port}?format=text") as imu:
            with pytest.raises(DeviceSilent, match=r"such as 'ax=0.12 ay=-9.79 az="):
                next(imu.blocks(0.3))


def test_lines_with_names_are_told_with_the_address_that_reads_them(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def line(i: int) -> bytes:
        return b"ms: %d, Accel: 0.12 -0.03 %.2f Gyro: 1 2 -3\r\n" % (
            5 * i,
            9.81 + 0.01 * (i % 2),
        )

    with talking(line) as port:
        assert main(["ports", "--probe", "--seconds", "0.5", "--json", port]) == 0
        (entry,) = json.loads(capsys.readouterr().out)["ports"]
        answer = entry["answer"]
        assert answer["format"] == "text"
        assert answer["url"].endswith(
            "&map=t=ms,ax=Accel[0],ay=Accel[1],az=Accel[2],gx=Gyro[0],gy=Gyro[1],"
            "gz=Gyro[2]&t_unit=ms&gyr_unit=deg/s"
        )
        with open_driver(answer["url"]) as imu:
            block = next(imu.blocks(3.0))
            np.testing.assert_allclose(block.gyr[0], np.deg2rad([1, 2, -3]))
            assert block.acc[0, :2].tolist() == [0.12, -0.03]


@pytest.mark.parametrize(
    ("line", "options"),
    [
        (
            "ax=0.12 ay=-0.03 az=9.81 gx=0.1 gy=0.0 gz=-0.2",
            "map=ax=ax,ay=ay,az=az,gx=gx,gy=gy,gz=gz&gyr_unit=deg/s",
        ),
        (
            "aX: 0.12, aY: -0.01, aZ: 1.01",
            "map=ax=aX,ay=aY,az=aZ&acc_unit=g",
        ),
        (
            "AccX: 0 g, AccY: 0 g, AccZ: 0.3 g, Temp: 25.3 C",
            "map=ax=AccX,ay=AccY,az=AccZ,temperature=Temp&acc_unit=g",
        ),
        (
            '{"ax":0.1,"ay":0,"az":9.8,"gx":0,"gy":0,"gz":0.01,"t":10%03d}',
            "map=ax=ax,ay=ay,az=az,gx=gx,gy=gy,gz=gz,t=t&t_unit=ms",
        ),
        (
            '{"imu":{"acc":[0,1,0],"gyr":[0,0,0]},"id":"a&b"}',
            "map=ax=imu.acc[0],ay=imu.acc[1],az=imu.acc[2],"
            "gx=imu.gyr[0],gy=imu.gyr[1],gz=imu.gyr[2]&acc_unit=g",
        ),
        ("mx: 1 ax: 0 ay: 0 az: 9.8 my: 2 mz: 3", "map=ax=ax,ay=ay,az=az"),
    ],
)
def test_names_and_gravity_at_rest_tell_the_options(line: str, options: str) -> None:
    text = "".join(f"{line % i if '%' in line else line}\r\n" for i in range(30))
    found = guess_named_options(text.encode(), 0.03, channels_by_name)
    assert found == options
    made = TextCodec(Options("", f"{found}&rate=100"))
    block = made.feed(text.encode(), 0.0)
    assert block is not None and made.health.bad == 0


@pytest.mark.parametrize(
    "line",
    [
        "x=1 y=2 z=9.8",
        "roll=1 pitch=2 yaw=3",
        "ax=120 ay=10 az=16384",
        "gx=1 gy=2 gz=3",
        "ax1=0 ay1=0 az1=9.8 ax2=0 ay2=0 az2=9.8",
        "ax=0 ay=9.8",
    ],
    ids=["no sensor", "angles", "counts", "rates", "two IMUs", "two axes"],
)
def test_names_that_leave_a_choice_name_no_device(line: str) -> None:
    text = f"{line}\r\n" * 30
    assert guess_named_options(text.encode(), 0.3, channels_by_name) is None
    assert "format=text&map=" in describe_lines(text.encode())
    tabs = text.replace(" ", "\t").encode()
    assert "format=text&map=" in describe_lines(tabs), "as a table in a terminal"


def test_silence_and_noise_and_no_port(capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(2)
    with talking(lambda i: b"") as port:
        said = probe_port(port, 0.1).says
        assert "nothing comes" in said and "a run opens it (--device can:…)" in said
    with talking(lambda i: rng.bytes(30)) as port:
        assert "no format that is known" in probe_port(port, 0.1).says
    assert "no such port" in probe_port("/dev/nowhere", 0.1).says
    assert main(["ports", "--probe", "/dev/nowhere", "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["ports"][0]["answer"]["url"] == ""


def test_without_a_probe_it_lists(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ports", "--json"]) == 0
    assert isinstance(json.loads(capsys.readouterr().out)["ports"], list)
    assert main(["ports"]) == 0


def test_the_wrong_format_is_told_by_the_driver() -> None:
    with talking(sample("witmotion")) as port:
        with open_driver(f"serial:{port}?format=text") as imu:
            with pytest.raises(DeviceSilent, match="no text bytes; try format=witm"):
                next(imu.blocks(0.3))


@pytest.mark.parametrize("separator", ["comma", "semicolon", "tab", "space"])
def test_separators_are_found(separator: str) -> None:
    mark = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}[separator]
    rows = [[0.01 * i, 0, 9.8, 0.1, 0, 0, 0] for i in range(20)]
    text = "".join(mark.join(map(str, row)) + "\r\n" for row in rows)
    found = guess_text_options(text.encode(), 0.2)
    assert found is not None
    assert found.startswith("columns=t,ax,ay,az,gx,gy,gz")


ACC, GYR = [0.1, -0.2, 9.75], [0.01, -0.02, 0.005]
MAG, YAW, TURNED = [22.0, -5.0, -43.0], [1.2, -0.6, 45.0], [0.995, 0.01, 0.02, 0.0975]


@pytest.mark.parametrize(
    ("row", "columns"),
    [
        ([*ACC, *GYR, *MAG], "ax,ay,az,gx,gy,gz,-,-,-"),
        ([*ACC, *GYR, *MAG, 31.0], "ax,ay,az,gx,gy,gz,-,-,-,temperature"),
        ([31.0, *MAG, *ACC, *GYR], "temperature,-,-,-,ax,ay,az,gx,gy,gz"),
        ([31.0, *ACC, *GYR], "temperature,ax,ay,az,gx,gy,gz"),
        ([*YAW, *ACC, *GYR], "-,-,-,ax,ay,az,gx,gy,gz"),
        ([*TURNED, *ACC, *GYR], "-,-,-,-,ax,ay,az,gx,gy,gz"),
        ([*ACC, *GYR, 31.0, 1013.0, 45.0], "ax,ay,az,gx,gy,gz,temperature,-,-"),
    ],
)
def test_an_attitude_or_a_magnetometer_is_taken_for_nothing_else(
    row: list[float], columns: str
) -> None:
    """A temperature that follows the position would pass for one of the biases."""
    rng = np.random.default_rng(4)
    small = np.isin(row, TURNED) | np.isin(row, GYR)
    noise = np.where(small, 1e-4, 0.01) * (np.array(row) != 31.0)
    rows = row + noise * rng.standard_normal((200, len(row)))
    text = "".join(",".join(f"{x:.4f}" for x in each) + "\n" for each in rows)
    assert guess_text_options(text.encode(), 2.0) == f"columns={columns}"


@pytest.mark.parametrize(
    ("steps", "seconds", "query"),
    [([1] * 50 + [3] + [1] * 50, 1.0, "seq"), ([1] * 50 + [2] + [1] * 50, 0.1, "t"),
     ([10] * 100, 1.0, "t")],
    ids=["a counter with a loss", "ms with a late sample", "ms"],
)  # fmt: skip
def test_a_counter_that_lost_a_sample_is_no_time(
    steps: list[int], seconds: float, query: str
) -> None:
    counts = np.cumsum(steps)
    text = "".join(f"{count},0.1,0.2,9.8,0,0.01,0\n" for count in counts)
    found = guess_text_options(text.encode(), seconds)
    unit = "&t_unit=ms" if query == "t" else ""
    assert found == f"columns={query},ax,ay,az,gx,gy,gz{unit}"


def test_rates_of_hundreds_at_rest_are_thousandths_of_a_degree() -> None:
    text = "".join(f"{10 * i},12,-8,1001,420,-710,{90 + i % 9}\n" for i in range(50))
    found = guess_text_options(text.encode(), 0.5)
    assert found is not None and found.endswith("&acc_unit=mg&gyr_unit=mdeg/s")
    block = TextCodec(Options("", f"{found}&rate=100")).feed(text.encode(), 0.0)
    assert block is not None
    assert block.gyr[0, 1] == pytest.approx(-0.71 * np.pi / 180)


def test_words_are_no_numbers() -> None:
    assert guess_text_options(b"login: \nPassword: \n" * 20, 1.0) is None
    assert guess_text_options(b"", 1.0) is None
