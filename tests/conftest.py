"""What every test needs: property tests that do not depend on the machine's speed.

And what many need, and nobody wants to wait for twice.
"""

import gc
import os
import shutil
import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from processes import Recalibrated, recalibrate

# as the commands do: threads for small matrices only wait for each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# hundreds of processes are started: each would compile what it imports anew
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# examples of a property are others in each run: few of them add up
settings.register_profile(
    "any machine",
    deadline=None,
    max_examples=25,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("all", settings.get_profile("any machine"), max_examples=100)
settings.load_profile("any machine")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Where faults are put in one by one, each test makes anew what tests share.

    The process made it before the fault was there, and what makes it would count as
    tested by the first of them alone.
    """
    if "MUTANT_UNDER_TEST" in os.environ and isinstance(item, pytest.Function):
        for value in vars(item.module).values():
            own = getattr(value, "__module__", "") == item.module.__name__
            if own and hasattr(value, "cache_clear"):
                value.cache_clear()


WAITING = (
    frozenset(
        [
            "test_can_imu",
            "test_end_to_end",
            "test_full_disk",
            "test_link_faults",
            "test_pytest_plugin",
            "test_replay",
            "test_resume",
            "test_serial_imu",
            "test_sim_keys",
            "test_terminal_run",
            "test_wires_meet",
            "test_write",
            "test_write_thermal",
        ]
    ),
    frozenset(
        [
            "test_companions",
            "test_crash_safety",
            "test_installing",
            "test_link_contract",
            "test_mavlink_imu",
            "test_operator_errors",
            "test_plan_file",
            "test_ports",
            "test_pulled_stick",
            "test_restart",
            "test_sim_serial",
            "test_write_killed",
        ]
    ),
)
"""Modules whose tests wait for devices in processes of their own: two groups that wait
about as long, as one alone would wait for longer than all others calculate."""

SPREAD = frozenset(
    [
        "test_adaptive",
        "test_any_recording",
        "test_diagnosis_contract",
        "test_diagnosis_odd_one",
        "test_diagnosis_one_axis",
        "test_diagnosis_second_device",
        "test_earth_norm",
        "test_in_motion",
        "test_levelled",
        "test_nested_windows",
        "test_omitted_effects",
        "test_twin",
    ]
)
"""Long modules whose tests have nothing in common that takes time to make.

They come last, one test at a time: no process is left with a long module when the
others have ended.
"""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that `make test-all` gives."""
    parser.addoption(
        "--all",
        action="store_true",
        help="run the tests marked thorough too: the whole catalogue, every seed",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Take as many examples of each property as usual, if all is wanted."""
    if config.getoption("--all"):
        settings.load_profile("all")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for no garbage among the tests: all of them stay to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        # what a test leaves is little: it may lie for longer
        gc.set_threshold(20_000)
        gc.enable()


def pytest_collection_modifyitems(
    config: pytest.Config, items: list[pytest.Item]
) -> None:
    """Leave out what is thorough, unless all is wanted."""
    if not config.getoption("--all"):
        left_out = [item for item in items if item.get_closest_marker("thorough")]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [i for i in items if not i.get_closest_marker("thorough")]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Share the tests out among processes, if there are several.

    What waits is two groups, which leave processors free. Of the others each module is
    one group, for what its tests have in common. The largest come first.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByModule(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            module = nodeid.partition("::")[0]
            if Path(module).stem in SPREAD:
                return nodeid
            name = Path(module).stem
            waits = [str(i) for i, some in enumerate(WAITING) if name in some]
            return waits[0] if waits else module

    return ByModule(config, log)


collect_ignore = ["example_project"]
"""A project of its own, which test_pytest_plugin runs."""


@pytest.fixture(autouse=True, scope="session")
def own_history(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the user's history of devices out of the tests, and the tests out of it."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("history")
        patch.setenv("FIELDCAL_HISTORY", str(folder / "history.sqlite"))
        patch.setenv("XDG_DATA_HOME", str(folder))
        yield


@pytest.fixture(scope="session")
def recalibrated(tmp_path_factory: pytest.TempPathFactory) -> Recalibrated:
    """A run of five positions on a tilted base."""
    base = tmp_path_factory.getbasetemp()
    shared_by_all = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    return recalibrate(shared_by_all / "recalibrated")


@pytest.fixture
def soon_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drivers in this process call a device silent after half of the usual time."""
    # not above: numpy reads at its import how many threads it may have
    from fieldcal.drivers.driver import Driver

    monkeypatch.setattr(Driver.blocks, "__defaults__", (1.5,))


SHARED = Path(__file__).parent.parent.parent / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of recordings and published figures beside the project."""
    if not SHARED.is_dir():
        pytest.skip(f"{SHARED.name}/ is not beside the project: no recordings to read")
    return SHARED


@pytest.fixture
def namespace() -> Iterator[tuple[str, ...]]:
    """A network of its own with multicast on its loopback."""
    name = f"fieldcal{os.getpid()}"
    if shutil.which("ip") is None:
        pytest.skip("no `ip` to make a network namespace with")
    made = subprocess.run(
        ["ip", "netns", "add", name], capture_output=True, check=False
    )
    if made.returncode:
        pytest.skip(f"no network namespace: {made.stderr.decode().strip()}")
    inside = ("ip", "netns", "exec", name)
    try:
        for command in ("ip link set lo up", "ip route add 224.0.0.0/4 dev lo"):
            subprocess.run([*inside, *command.split()], check=True)
        yield inside
    finally:
        subprocess.run(["ip", "netns", "del", name], check=True)


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Any]:
    """An engine on a virtual device of its own, which records."""
    from engine_bench import make

    from fieldcal.session.recorder import Recorder
    from fieldcal.sim_device import VirtualDevice
    from fieldcal.sim_device.in_process import InProcess

    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        yield make(recorder, InProcess(VirtualDevice(seed=3)))
