"""Every driver with the virtual device in another process: a minute at 1 kHz, a turn.

Each must hear all 60 000 samples and find what the device conceals; a new driver or
wire format needs its line in `LINES`. Datagrams that a busy machine lost must be
counted to the last one.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from can_wires import until_the_end
from processes import SIM

from fieldcal.calibration import Calibration
from fieldcal.core.errors import DeviceSilent
from fieldcal.core.samples import Block, concat
from fieldcal.drivers import codec
from fieldcal.drivers.driver import Driver, LinkHealth, open_driver
from fieldcal.evaluation.observations import build_observations
from fieldcal.session import description_file
from fieldcal.sim_device.remote import RemoteDevice
from fieldcal.solve import solve
from fieldcal.windows import average

LINES = {
    "inertiallabs": ("--serial inertiallabs", "serial:{}?format=inertiallabs"),
    "mip": ("--serial mip", "serial:{}?format=mip"),
    "text": ("--serial text?checksum=xor", "serial:{}?format=text&checksum=xor"),
    "ubx": ("--serial ubx", "serial:{}?format=ubx"),
    "vectornav": ("--serial vectornav", "serial:{}?format=vectornav"),
    "vnimu": ("--serial vnimu", "serial:{}?format=vnimu&rate=1000"),
    "witmotion": ("--serial witmotion", "serial:{}?format=witmotion"),
    "xsens": ("--serial xsens", "serial:{}?format=xsens"),
    "can": ("--can slcan", "can:{}?interface=slcan&dbc=virtual"),
    "mavlink": ("--mavlink tcpin:127.0.0.1:0", "mavlink:{}?rate=1000"),
    "mavlink on a serial port": ("--mavlink pty", "mavlink:{}?rate=1000"),
    "mavlink over datagrams": ("--mavlink udpin:127.0.0.1:0", "mavlink:{}?rate=1000"),
    "mavlink in mg": (
        "--mavlink tcpin:127.0.0.1:0",
        "mavlink:{}?rate=1000&message=RAW_IMU",
    ),
}
MULTICAST = (
    "--can udp_multicast:239.74.163.2",
    "can:{}?interface=udp_multicast&dbc=virtual",
)
CONCEALED = ["--acc-bias=0.2,-0.3,0.1", "--acc-scale=1.006,0.992,1.008"]
CONCEALED += ["--gyr-bias=0.02,-0.01,0.03", "--latitude=50.45", "--height=170"]
WINDOWS = (0.0, 27.0), (33.0, 59.5)
"""Before and behind the turn, s of device time."""

SITE = {"latitude_deg": 50.45, "height_m": 170.0}
WHERE = [{"alpha_deg": 0.0, "beta_deg": 0.0}, {"alpha_deg": 45.0, "beta_deg": 5.0}]
ABOUT = description_file.parse_description({"site": SITE, "position": WHERE})
GROUPS = ("acc_bias", "acc_scale", "gyr_bias")


ALL = 60_000
HERE = Path(__file__).resolve()

HOST = """
import pickle, sys
from fieldcal.drivers.driver import open_driver
from test_link_contract import a_minute
out = sys.stdout.buffer
with open_driver(sys.argv[1]) as imu:
    out.write(b"listening\\n")
    out.flush()
    pickle.dump((a_minute(imu), imu.health), out)
"""
"""A host in a process of its own, for what a network of its own keeps from this one."""


def a_minute(imu: Driver) -> Block:
    """Samples of a minute; of datagrams the very last may be lost."""
    got: list[Block] = []
    with suppress(DeviceSilent):
        for block in imu.blocks(20.0):
            got.append(block)
            if block.t[-1] - got[0].t[0] > 59.9985:
                break
    return concat(got)


@contextmanager
def device(sent: str, truth: Path, speed: str, *before: str) -> Iterator[str]:
    """A virtual device of a minute at 1 kHz with a turn in its midst; its address."""
    command = [*before, *SIM, *sent.split()]
    command += [*CONCEALED, "--rate", "1000", "--speed", speed, "--duration", "60"]
    command += ["--once", "--seed", "6", "--truth", str(truth)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as sim:
        assert sim.stdout
        place, control = (sim.stdout.readline().strip() for _ in range(2))
        with RemoteDevice(control) as remote:
            remote.ask(turn={"alpha_deg": 45, "beta_deg": 5, "at_s": 28.0})
        yield place


def heard(name: str, truth: Path) -> tuple[Block, LinkHealth]:
    """All that the device says in a minute."""
    sent, url = LINES[name]
    # datagrams that nobody takes are lost: there a device cannot wait for its host
    speed = "10" if "udp" in sent else "max"
    with device(sent, truth, speed) as place:
        with open_driver(f"{url.format(place)}&reconnect=0") as imu:
            if speed == "max":
                return until_the_end(imu), imu.health
            return a_minute(imu), imu.health


def calibrated(block: Block) -> Calibration:
    t0 = block.t[0]
    windows = [average(block.between(t0 + a, t0 + b)) for a, b in WINDOWS]
    return solve(build_observations(ABOUT, windows), method="two_position")


def pulls(found: Calibration, truth: dict[str, Any]) -> list[float]:
    result = found.to_json()["parameters"]
    return [
        (value - true) / sigma
        for group in GROUPS
        for value, true, sigma in zip(
            result[group]["value"], truth[group], result[group]["sigma"], strict=True
        )
    ]


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Calibration:
    """What a format finds that hardly rounds at all."""
    block, _ = heard("xsens", tmp_path_factory.mktemp("reference") / "truth.json")
    return calibrated(block)


def test_every_driver_and_every_wire_format_has_its_line() -> None:
    folder = Path(codec.__file__).parent
    drivers = {path.stem.removesuffix("_imu") for path in folder.glob("*_imu.py")}
    spoken = {url.partition(":")[0] for _, url in LINES.values()}
    assert spoken == drivers - {"replay"}
    assert set(codec.wire_formats()) <= set(LINES)


def one_a_link() -> list[Any]:
    """Parameters of a test: every line, those of formats that share a link at length.

    What each format puts into bytes is held against what it was in test_wires_meet, and
    a minute over CAN in test_can_imu.
    """
    few = ["witmotion", "mavlink"]
    more = (name for name in LINES if name not in few)
    return [*few, *(pytest.param(m, marks=pytest.mark.thorough) for m in more)]


@pytest.mark.parametrize("name", one_a_link())
def test_a_minute_at_1_khz_without_a_loss_and_the_truth_in_it(
    name: str, tmp_path: Path, reference: Calibration
) -> None:
    block, health = heard(name, tmp_path / "truth.json")
    datagrams = "datagrams" in name
    assert_whole_and_true(block, health, tmp_path / "truth.json", reference, datagrams)


@pytest.mark.thorough
def test_the_same_on_a_bus_of_datagrams(
    namespace: tuple[str, ...], tmp_path: Path, reference: Calibration
) -> None:
    sent, url = MULTICAST
    host = subprocess.Popen(
        [*namespace, sys.executable, "-c", HOST, url.format("239.74.163.2")],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, HERE.parents[:2]))},
    )
    assert host.stdout and host.stdout.readline() == b"listening\n"
    with device(sent, tmp_path / "truth.json", "5", *namespace):
        block, health = pickle.loads(host.communicate()[0])
    assert_whole_and_true(
        block, health, tmp_path / "truth.json", reference, datagrams=True
    )


def assert_whole_and_true(
    block: Block,
    health: LinkHealth,
    file: Path,
    reference: Calibration,
    datagrams: bool = False,
) -> None:
    # a first line of text without a checksum may be the end of one; none is lost here
    lost = ALL - len(block)
    assert lost == health.missing and len(block) == health.samples
    assert lost == 0 or datagrams
    assert lost or health.bad == health.skipped == health.gaps == 0
    assert health.repeated == health.restarts == 0
    assert np.all(np.diff(block.t) > 0)
    assert block.t[-1] - block.t[0] == pytest.approx(59.999, abs=1.1e-3)
    truth = json.loads(file.read_text())
    found = calibrated(block)
    assert np.abs(pulls(found, truth)).max() < 4.5
    # the same seed: from one to the other only the rounding of the format differs
    same = {g: v["value"] for g, v in reference.to_json()["parameters"].items()}
    assert np.abs(pulls(found, same)).max() < 1.0
