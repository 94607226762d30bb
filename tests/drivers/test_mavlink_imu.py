"""An autopilot in another process, over UDP and TCP: samples, answers, and faults."""

import json
import os
import re
import socket
import subprocess
from collections import deque
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from threading import Thread
from time import monotonic
from typing import Any

import numpy as np
import pytest

pytest.importorskip("fastcrc")
pytest.importorskip("pymavlink")

from can_wires import until_the_end
from processes import HANGS, RUN, simulated, wait_for_samples
from pymavlink.dialects.v20 import all as dialect

from fieldcal.core.errors import DeviceError, DeviceSilent, InputError
from fieldcal.core.samples import Block, concat
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.mavlink_imu import MavlinkImu
from fieldcal.sim_device.device import VirtualDevice
from fieldcal.sim_device.mavlink_packing import HIGHRES, messages
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.pty_port import PtyPort

BIAS, SCALE = np.array([0.2, -0.3, 0.1]), np.array([1.006, 0.992, 1.008])
CONCEALED = ["--acc-bias=0.2,-0.3,0.1", "--acc-scale=1.006,0.992,1.008"]


def autopilot(url: str, *options: str) -> AbstractContextManager[tuple[str, str]]:
    """Run a virtual autopilot; yields what to open, and its control socket."""
    return simulated("--mavlink", url, "--rate", "200", *options)


def order(control: str, **request: Any) -> None:
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(control)
        line.sendall(json.dumps(request).encode() + b"\n")
        assert b"error" not in line.recv(4096)


def taken(imu: MavlinkImu, seconds: float) -> Block:
    """So much device time of samples."""
    blocks: list[Block] = []
    for block in imu.blocks():
        blocks.append(block)
        if block.t[-1] - blocks[0].t[0] >= seconds:
            break
    return concat(blocks)


def assert_silent(imu: MavlinkImu, why: str) -> None:
    """It is silent, and says why once the autopilot has had its turn to answer."""
    deadline, said = monotonic() + HANGS, ""
    while not re.search(why, said):
        assert monotonic() < deadline, said
        with pytest.raises(DeviceSilent) as silent:
            list(imu.blocks(0.5))
        said = str(silent.value)


def opened(url: str) -> MavlinkImu:
    imu = open_driver(url)
    assert isinstance(imu, MavlinkImu)
    return imu


@pytest.mark.parametrize(
    "place",
    [
        "udpin:127.0.0.1:0",
        pytest.param("tcpin:127.0.0.1:0", marks=pytest.mark.thorough),
        "pty",
    ],
)
def test_same_truth_over_udp_tcp_and_a_serial_port(place: str) -> None:
    with autopilot(place, "--speed", "15", "--seed", "3", *CONCEALED) as (where, _):
        for message, within in (("HIGHRES_IMU", 2e-3), ("RAW_IMU", 6e-3)):
            with opened(f"mavlink:{where}?message={message}&rate=100") as imu:
                block = taken(imu, 5.0)
                assert imu.rate == pytest.approx(100, rel=0.02)
                assert imu.says[-1] == "asked for 100 Hz, got 100 Hz"
                assert imu.health.bad == imu.health.gaps == 0
            at_home = BIAS + SCALE * [0.0, -9.81, 0.0]
            mean = block.acc.mean(axis=0)
            np.testing.assert_allclose(mean, at_home, atol=within + 5e-3)
            # HIGHRES_IMU has the barometer's, which says nothing of the sensor
            known = message == "RAW_IMU"
            assert np.all(np.isfinite(block.temperature) == known)
            assert imu.notes["thermometer"] == ("imu" if known else "barometer")
            said = [text for text in imu.says if "barometer" in text]
            assert len(said) == (not known)


@pytest.mark.parametrize(
    ("program", "message", "warns"),
    [
        ("px4", "HIGHRES_IMU", 1),
        ("px4", "SCALED_IMU", 0),
        pytest.param("ardupilot", "RAW_IMU", 0, marks=pytest.mark.thorough),
    ],
)
def test_biases_that_a_filter_takes_out_meanwhile_are_told(
    program: str, message: str, warns: int
) -> None:
    place = f"tcpin:127.0.0.1:0?autopilot={program}"
    with autopilot(place, "--speed", "15") as (where, _):
        with opened(f"mavlink:{where}?message={message}&rate=100") as imu:
            taken(imu, 1.0)
            assert sum("message=SCALED_IMU has" in text for text in imu.says) == warns


@pytest.mark.parametrize(
    ("kind", "given", "name"),
    [
        ("ardupilot", "INS_ACCOFFS_X=0.5&INS_ACCSCAL_Y=1.02", "INS_ACCOFFS_X"),
        ("px4", "CAL_ACC0_XOFF=0.5&CAL_ACC0_YSCALE=1.02", "CAL_ACC0_XOFF"),
    ],
)
def test_installed_calibration_is_read_and_composed(
    kind: str, given: str, name: str
) -> None:
    options = ("--speed", "5", *CONCEALED)
    place = f"tcpin:127.0.0.1:0?autopilot={kind}&{given}"
    with autopilot(place, *options) as (where, _):
        with opened(f"mavlink:{where}") as imu:
            installed = imu.installed
            assert installed is not None and not installed.missing
            np.testing.assert_allclose(installed.vector("acc_offset"), [0.5, 0, 0])
            np.testing.assert_allclose(
                installed.vector("acc_scale"), [1, 1.02, 1], rtol=1e-6
            )
            assert json.loads(json.dumps(imu.notes))["installed"]["parameters"][name]
            before = taken(imu, 1.0).acc.mean(axis=0)
    # what the sensor conceals, seen through the installed calibration
    scale = SCALE * [1, 1.02, 1]
    bias = (BIAS - [0.5, 0, 0]) * [1, 1.02, 1]
    np.testing.assert_allclose(
        before, bias + scale * [0, -9.81, 0], atol=0.02, rtol=1e-3
    )
    new = installed.parameters_after(bias, scale, np.zeros(3))
    query = "&".join(f"{key}={value:.9g}" for key, value in new.items())
    place = f"tcpin:127.0.0.1:0?autopilot={kind}&{query}"
    with autopilot(place, *options) as (where, _), opened(f"mavlink:{where}") as imu:
        after = taken(imu, 1.0).acc.mean(axis=0)
    np.testing.assert_allclose(after, [0, -9.81, 0], atol=0.02)


def test_the_installed_calibration_is_taken_out_and_given_back() -> None:
    place = "tcpin:127.0.0.1:0?INS_ACCOFFS_X=0.5&INS_ACCSCAL_Y=1.02"
    with autopilot(place, "--speed", "5", *CONCEALED) as (where, _):
        with opened(f"mavlink:{where}?installed=identity") as imu:
            raw = taken(imu, 1.0).acc.mean(axis=0)
            assert imu.installed is not None
            new = imu.installed.parameters_after(BIAS, SCALE, np.zeros(3))
        np.testing.assert_allclose(raw, BIAS + SCALE * [0, -9.81, 0], atol=0.02)
        assert new["INS_ACCOFFS_X"] == 0.2
        assert new["INS_ACCSCAL_Y"] == pytest.approx(1 / 0.992)
        with opened(f"mavlink:{where}") as imu:
            assert imu.installed is not None
            np.testing.assert_allclose(imu.installed.vector("acc_offset"), [0.5, 0, 0])
            assert imu.installed.vector("acc_scale")[1] == pytest.approx(1.02)


def test_what_cannot_be_given_back_is_named() -> None:
    place = "tcpin:127.0.0.1:0?INS_ACCOFFS_X=0.5"
    with autopilot(place) as (where, control):
        imu = opened(f"mavlink:{where}?installed=identity&reconnect=0")
        order(control, stop={})
        with pytest.raises(DeviceError, match="hung up"):
            list(imu.blocks())
        with pytest.raises(DeviceError, match="by hand INS_ACCOFFS_X = 0.5"):
            imu.close()
        imu.close()


@pytest.mark.thorough
def test_a_recording_keeps_what_is_installed(tmp_path: Path) -> None:
    place = "tcpin:127.0.0.1:0?INS_ACCOFFS_X=0.5&acc_unit=mm/s^2"
    with autopilot(place, "--speed", "20") as (where, _):
        command = [*RUN, "two_position", "--headless"]
        command += ["-o", str(tmp_path / "session")]
        command += ["--device", f"mavlink:{where}?message=RAW_IMU&rate=100"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as run:
            wait_for_samples(tmp_path / "session", run)
            run.terminate()
            _, said = run.communicate()
    assert "asked for 100 Hz, got 100 Hz" in said
    first = (tmp_path / "session" / "marks.jsonl").read_text().splitlines()[0]
    mark = json.loads(first)
    assert mark["event"] == "device" and mark["message"] == "RAW_IMU"
    assert mark["acc_unit"] == "mm/s^2"
    assert mark["rate_hz"] == pytest.approx(100, rel=0.01)
    assert mark["installed"]["parameters"]["INS_ACCOFFS_X"] == 0.5


def test_a_turned_board_is_not_composed() -> None:
    place = "tcpin:127.0.0.1:0?autopilot=px4&SENS_BOARD_ROT=2"
    with autopilot(place) as (where, _), opened(f"mavlink:{where}") as imu:
        assert imu.installed is not None
        assert imu.installed.values["SENS_BOARD_ROT"] == 2
        with pytest.raises(InputError, match="SENS_BOARD_ROT = 2 turns"):
            imu.installed.parameters_after(np.zeros(3), np.ones(3), np.zeros(3))


@pytest.mark.parametrize(
    ("has", "name", "cutoff"),
    [
        ("INS_TCAL1_ENABLE=1&INS_GYRO_FILTER=42", "INS_TCAL1_ENABLE", 42.0),
        ("autopilot=px4&TC_A_ENABLE=1&IMU_GYRO_CUTOFF=42", "TC_A_ENABLE", 42.0),
    ],
)
def test_filters_and_temperature_correction_are_recorded_and_said(
    has: str, name: str, cutoff: float
) -> None:
    with autopilot(f"tcpin:127.0.0.1:0?{has}") as (where, _):
        with opened(f"mavlink:{where}") as imu:
            taken(imu, 0.2)
            assert imu.says[0].startswith(f"{name} = 1: the autopilot corrects for")
            kept = imu.notes["installed"]["parameters"]
            assert cutoff in (kept.get("INS_GYRO_FILTER"), kept.get("IMU_GYRO_CUTOFF"))


def test_another_unit_is_told_from_gravity() -> None:
    place = "tcpin:127.0.0.1:0?acc_unit=mm/s^2"
    with autopilot(place, "--speed", "5") as (where, _):
        with opened(f"mavlink:{where}?message=RAW_IMU") as imu:
            block = taken(imu, 1.0)
            assert imu.notes["acc_unit"] == "mm/s^2"
    assert np.linalg.norm(block.acc.mean(axis=0)) == pytest.approx(9.81, abs=0.5)


def test_a_denied_rate_falls_back_and_says_so() -> None:
    with autopilot("tcpin:127.0.0.1:0?deny=1", "--speed", "5") as (where, _):
        with opened(f"mavlink:{where}?message=RAW_IMU&rate=40") as imu:
            taken(imu, 2.0)
            assert imu.says == [
                "40 Hz of RAW_IMU asked for: the autopilot denies it (denied), so the "
                "raw sensor stream was asked for instead",
                "asked for 40 Hz, got 40 Hz",
            ]
        with opened(f"mavlink:{where}?message=HIGHRES_IMU") as imu:
            assert_silent(imu, r"try message=RAW_IMU.*denies it")


def test_parameters_that_do_not_come_are_named() -> None:
    with autopilot("tcpin:127.0.0.1:0?mute=1") as (where, _):
        with opened(f"mavlink:{where}") as imu:
            assert "did not answer: INS_ACCOFFS_X" in imu.says[0]
            assert imu.installed is not None
            with pytest.raises(InputError, match="is not known, without"):
                imu.installed.parameters_after(np.zeros(3), np.ones(3), np.zeros(3))


def test_a_peer_that_closes_is_one_sentence() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]

        def hang_up() -> None:
            with suppress(OSError):
                call, _ = server.accept()
                call.close()

        peer = Thread(target=hang_up)
        peer.start()
        with pytest.raises(DeviceError, match="hung up: check"):
            open_driver(f"mavlink:tcp:127.0.0.1:{port}?reconnect=0")
        peer.join()
    with pytest.raises(DeviceError, match="check host and port"):
        open_driver(f"mavlink:tcp:127.0.0.1:{port}")


def test_what_came_before_a_peer_closed_is_heard() -> None:
    """Also if it went before it had answered anything."""
    block = VirtualDevice(Profile(), seed=2).take(100)
    packing = dialect.MAVLink(None, 1, 1)
    said = b"".join(m.pack(packing) for m in messages(dialect, HIGHRES, block))
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]

        def talk() -> None:
            call, _ = server.accept()
            with call:
                call.sendall(said)

        peer = Thread(target=talk)
        peer.start()
        with opened(f"mavlink:tcp:127.0.0.1:{port}?reconnect=0") as imu:
            heard = until_the_end(imu)
        peer.join()
    np.testing.assert_allclose(heard.acc, block.acc, atol=1e-6)
    assert len(heard) == len(block)


def test_a_link_that_comes_back_goes_on_with_a_gap() -> None:
    with autopilot("tcpin:127.0.0.1:0") as (where, control):
        with opened(f"mavlink:{where}?rate=200") as imu:
            first = taken(imu, 0.2)
            order(control, fault={"hangup_s": 0.3})
            later = taken(imu, 1.0)
            while imu.health.gaps == 0:
                later = taken(imu, 0.2)
            assert imu.health.gaps == 1
    assert later.t[-1] - first.t[-1] > 0.3


def test_silence_and_spoilt_bytes() -> None:
    with autopilot("udpin:127.0.0.1:0") as (where, control):
        with opened(f"mavlink:{where}?rate=200") as imu:
            taken(imu, 0.2)
            order(control, fault={"flip_bits": 40, "garbage_bytes": 300})
            block = taken(imu, 1.0)
            assert imu.health.skipped > 0
            assert np.all(np.abs(np.linalg.norm(block.acc, axis=1) - 9.8) < 1)
            order(control, fault={"silence_s": 30.0})
            with pytest.raises(DeviceSilent, match="went silent for 0.5 s"):
                list(imu.blocks(0.5))


def test_a_host_that_goes_leaves_nothing_to_the_next() -> None:
    port = PtyPort()
    for said in (b"first", b"second"):
        host = os.open(port.address, os.O_RDWR | os.O_NOCTTY)
        port.write(deque([said * 2]))
        assert os.read(host, len(said)) == said  # and half of it is left unread
        os.close(host)
        port.write(deque([b"nobody hears this"]))
    port.close()


def test_nobody_there_on_udp() -> None:
    with pytest.raises(DeviceError, match="not a byte came"):
        open_driver("mavlink:udpout:127.0.0.1:9")


@pytest.mark.parametrize(
    ("address", "says"),
    [
        ("", "name a link"),
        ("udp:14550", "needs host and port"),
        ("udp:127.0.0.1:0?message=ATTITUDE", "is none of HIGHRES_IMU"),
        ("tcp:127.0.0.1:1?message=SCALED_IMU&instance=1", "no option 'instance'"),
    ],
)
def test_addresses_that_say_nothing(address: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        open_driver(f"mavlink:{address}")
