"""What an operator sees: a run on the virtual device, in this process, in pictures.

Engine, procedure and console are those of `fieldcal run`; only the link is missing, so
that the pictures are the same wherever the site is built.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console, RenderableType
from rich.text import Text

from fieldcal.calibration import Calibration, limits
from fieldcal.commands.decision_view import show_decision
from fieldcal.commands.run_results import first_result
from fieldcal.commands.table import show_calibration
from fieldcal.core.positions import FIVE_POSITIONS
from fieldcal.history.store import History
from fieldcal.planning.steps import Hold
from fieldcal.procedures.five_position import plan
from fieldcal.run.engine import Engine
from fieldcal.run.movers import ManualMover
from fieldcal.run.operator.protocol import OperatorView, Wish
from fieldcal.run.operator.terminal import ConsoleOperator
from fieldcal.run.wait_reason import WaitReason
from fieldcal.session import description_file
from fieldcal.session.recorder import Recorder
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.in_process import InProcess
from fieldcal.sim_device.vocabulary import parse

WIDTH, HEIGHT = 80, 24
"""Of the terminal, in characters."""

CONCEALED = ("base_tilt:about_x_deg=1,about_z_deg=-1", "earth_rate:")

TABLES = {
    "format": 1,
    "site": {
        "latitude_deg": 50.45,
        "height_m": 170.0,
        "angle_setting_deg": 0.001,
        "angles_from": "certificate 4711",
    },
    "position": [
        {"alpha_deg": round(p.degrees[0], 6), "beta_deg": round(p.degrees[1], 6)}
        for p in FIVE_POSITIONS
        if p.degrees
    ],
}

MOMENTS: dict[str, Callable[[OperatorView], bool]] = {
    "turning": lambda v: (
        v.phase == "turning"
        and v.hold.index == 1
        and v.arrival is not None
        and 8 < v.arrival.alpha_deg < 18
    ),
    "averaging": lambda v: (
        v.phase == "averaging" and v.hold.index == 2 and v.elapsed > 20
    ),
}
"""What is pictured of the console, and when."""


class Filmed:
    """An operator at a console whose arm is the virtual device's own."""

    def __init__(self, driver: InProcess) -> None:
        self._driver = driver
        console = Console(
            file=io.StringIO(), width=WIDTH, height=HEIGHT, force_terminal=True
        )
        self._console = ConsoleOperator(
            "fieldcal · five_position", FIVE_POSITIONS, ManualMover(), console
        )
        self.pictures: dict[str, str] = {}

    def place(self, hold: Hold) -> None:
        """Ask, and turn there."""
        self._console.place(hold)
        self._driver.place(hold.position)

    def tell(self, text: str) -> None:
        """Show a sentence."""
        self._console.tell(text)

    def alarm(self, reason: WaitReason, waited: float = 0.0) -> None:
        """Ring for what is waited for."""
        self._console.alarm(reason, waited)

    def show(self, view: OperatorView) -> None:
        """Show the state, and keep a picture of the moments that are wanted."""
        self._console.show(view)
        for name, wanted in MOMENTS.items():
            if name not in self.pictures and wanted(view):
                self.pictures[name] = _picture(self._console.screen())

    def wish(self) -> Wish | None:
        """Nothing is asked for."""
        return None


@cache
def screens() -> dict[str, str]:
    """Pictures of a run by what they show, SVG: turning, averaging, result."""
    device = VirtualDevice(Profile(effects=tuple(map(parse, CONCEALED))), seed=7)
    driver = InProcess(device)
    operator = Filmed(driver)
    with TemporaryDirectory() as place:
        folder = Path(place) / "first"
        about = description_file.parse_description(TABLES)
        with Recorder(folder, TABLES) as recorder:
            found = Engine(driver, operator, about, recorder).run(plan(about))
        history = History(Path(place) / "history.sqlite")
        found = first_result(found, folder, limits.read(about.grade), history)
    return {**operator.pictures, "result": _result(found, device)}


def _result(found: Calibration, device: VirtualDevice) -> str:
    out = io.StringIO()
    with redirect_stdout(out):
        show_calibration(found, device.concealed())
        show_decision(found)
    return _picture(Text(out.getvalue().rstrip()), width=110)


def _picture(shown: RenderableType, width: int = WIDTH) -> str:
    """A terminal with something on it, SVG, in fonts that the reader has."""
    console = Console(file=io.StringIO(), width=width, record=True)
    console.print(shown)
    svg = console.export_svg(title="fieldcal", unique_id="screen")
    return re.sub(r"@font-face \{.*?\}", "", svg, flags=re.DOTALL)
