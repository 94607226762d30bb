"""Sessions with something concealed in them, played by the virtual device.

Device, site, mounting, noise, position set, order and times are drawn at random; the
virtual device has its own physics, sample by sample. Noise figures are standard
deviations of one sample, m/s^2 and rad/s.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fieldcal.core.samples import Array, Block
from fieldcal.session import description_file
from fieldcal.session.description import Description
from fieldcal.sim_device import profile as device
from fieldcal.sim_device.profile import Profile
from fieldcal.sim_device.replay import HeldWindow, simulate
from fieldcal.sim_device.vocabulary import checked_effect

LADDER = (
    *((0, 0), (22.5, 0), (45, 0), (45, 5), (22.5, 5), (0, 5), (-22.5, 2.5)),
    *((-45, 5), (-45, 0)),
)
FACES = ((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90))
EDGES = (
    *((45, 0), (-45, 0), (0, 45), (0, -45), (135, 0), (-135, 0)),
    *((45, 35), (-45, 35), (135, -35), (-135, -35), (30, 60), (-30, -60)),
)
WIDE = (*FACES, *EDGES)
TWELVE = (*FACES, *EDGES[:3], *EDGES[6:8], EDGES[10])
TABLE = tuple(((0, 0), rate) for rate in (
    *((30, 0, 0), (-30, 0, 0), (0, 30, 0), (0, -30, 0), (0, 0, 30), (0, 0, -30)),
    *((30, 20, 0), (-20, 30, 0), (0, 30, 25), (0, -25, 30), (30, 0, -20), (20, 0, 30)),
    (15, 20, 25),
))  # fmt: skip
"""On a rate table: (alpha, beta) and the rate about the axes, deg/s."""

SETS: Mapping[str, Sequence[Any]] = {
    "ladder": LADDER,
    "twelve": TWELVE,
    "wide": WIDE,
    "static": ((20.0, 3.0),),
    "table": TABLE,
}
MOUNTINGS = (("+x", "+y", "+z"), ("+x", "-z", "+y"), ("-y", "+x", "+z"))

SIX = ("ax", "ay", "az", "gx", "gy", "gz")


@dataclass(frozen=True)
class Session:
    """What is played, and what the diagnosis is told.

    Attributes
    ----------
    label : what it is counted under
    profile : the device, with everything it conceals
    windows : where it is held
    place : name of the position set
    concealed : parameters by id, of what ought to be named
    angles : whether the diagnosis knows the angles
    attitudes : whether angles are told as one finite turn each
    speeds : whether of a rate table only the speed is known, and nothing where it rests
    gyroscopes, thermometer, host_clock : whether the samples have those columns
    off : by how much the nominal calibration is off
    added : what no effect in the catalogue makes, added to the samples
    channel : where that shows
    sigmas : size of what is concealed

    """

    label: str
    profile: Profile
    windows: tuple[HeldWindow, ...]
    place: str
    concealed: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    angles: bool = True
    attitudes: bool = False
    speeds: bool = False
    gyroscopes: bool = True
    thermometer: bool = True
    host_clock: bool = False
    off: Array = field(default_factory=lambda: np.zeros(3))
    added: Callable[[Session, Block], Block] | None = None
    channel: str = ""
    sigmas: float = np.nan

    def having(self, concealed: Mapping[str, Mapping[str, Any]]) -> Session:
        """The same with these effects concealed."""
        there = [e for e in self.profile.effects if e.id not in concealed]
        there += [checked_effect(name, given) for name, given in concealed.items()]
        profile = replace(self.profile, effects=tuple(there))
        return replace(self, profile=profile, concealed=concealed)

    def record(self, seed: int, noise: bool = True) -> Block:
        """The samples."""
        block = simulate(self.profile, self.windows, seed=seed, noise=noise)
        unknown = np.full(len(block), np.nan)
        host = unknown
        if self.host_clock:
            late = np.random.default_rng(seed).exponential(2e-3, len(block))
            host = 1e5 + block.t / self.profile.clock_rate + late
        warmth = block.temperature if self.thermometer else unknown
        block = replace(block, temperature=warmth, seq=unknown, t_host=host)
        if not self.gyroscopes:
            block = replace(block, gyr=np.full_like(block.gyr, np.nan))
        for one in self.profile.effects:
            if arrival := one.arrival(np.random.default_rng(seed)):
                block = _only(block, arrival(len(block)))
        return self.added(self, block) if self.added is not None else block

    def _told(self, w: HeldWindow) -> dict[str, Any]:
        """What session.toml says of a window."""
        table: dict[str, Any] = {"start_s": w.start, "end_s": w.end}
        if self.speeds:
            speed = float(np.rad2deg(np.linalg.norm(w.rate)))
            return table | ({"speed_deg_s": speed} if speed else {})
        if self.attitudes:
            turned = np.rad2deg(finite_turn(w.alpha, w.beta, w.gamma))
            table["rotation_vector_deg"] = turned.tolist()
        elif self.angles:
            alpha, beta, gamma = np.rad2deg([w.alpha, w.beta, w.gamma]).tolist()
            table |= {"alpha_deg": alpha, "beta_deg": beta}
            if gamma:
                table["gamma_deg"] = gamma
        if any(w.rate):
            table["rate_deg_s"] = [float(r) for r in np.rad2deg(w.rate)]
        return table

    @property
    def about(self) -> Description:
        """What session.toml says."""
        truth, off = self.profile.truth, self.off
        positions = [self._told(w) for w in self.windows]
        site = self.profile.site
        return description_file.parse_description(
            {
                "format": 1,
                "device": {"name": "concealed", "grade": self.profile.device.grade},
                "sampling": {"rate_hz": self.profile.sampling.rate_hz},
                "site": {
                    "latitude_deg": site.latitude_deg,
                    "height_m": site.height_m,
                    "north_m_s": site.north_m_s,
                    "east_m_s": site.east_m_s,
                },
                "frame": {"mounting": list(self.profile.frame.mounting)},
                "nominal": {
                    "acc_bias": (np.array(truth.acc_bias) + off).tolist(),
                    "acc_scale": (np.array(truth.acc_scale) * (1 + off / 10)).tolist(),
                    "gyr_bias": list(truth.gyr_bias),
                    "gyr_scale": list(truth.gyr_scale),
                },
                "position": positions,
            }
        )


def finite_turn(alpha: float, beta: float, gamma: float) -> Array:
    """About z, the turned x and the twice turned y, as one turn, (3,) rad."""
    return np.asarray(Rotation.from_euler("ZXY", [alpha, beta, gamma]).as_rotvec())


def _only(block: Block, kept: NDArray[np.bool_]) -> Block:
    """The samples that were not lost."""
    columns = (block.acc, block.gyr, block.temperature, block.seq, block.t_host)
    return Block.of(block.t[kept], *(column[kept] for column in columns))


def plain(
    rng: np.random.Generator, places: Sequence[str] = ("ladder", "twelve", "wide")
) -> Session:
    """Any device at any place in any of the position sets; nothing concealed."""
    place = str(rng.choice(list(places)))
    acc, gyr = 10 ** rng.uniform(-2.3, -1.3), 10 ** rng.uniform(-3.4, -2.6)
    rate = float(rng.choice([25.0, 50.0, 100.0, 200.0]))
    long = 900.0 if place == "static" else float(rng.choice([15.0, 25.0, 40.0]))
    of_window = np.sqrt(rate * min(long, 40.0))
    wander = float(rng.choice([0.0, 0.0, 0.3]))
    one = Profile(
        sampling=device.Sampling(rate),
        site=device.Site(float(rng.uniform(-65, 65)), float(rng.uniform(0, 1500))),
        frame=device.MountingAxes(MOUNTINGS[int(rng.integers(3))]),
        truth=device.Truth(
            acc_bias=_three(rng, 0.2),
            acc_scale=_three(rng, 0.01, 1.0),
            gyr_bias=_three(rng, 0.01),
            gyr_scale=device.ONE,
        ),
        noise=device.NoiseFigures(
            acc=(acc,) * 3,
            gyr=(gyr,) * 3,
            acc_instability=(wander * acc / of_window,) * 3,
            gyr_instability=(wander * gyr / of_window,) * 3,
        ),
        temperature=device.Climate(
            ambient_c=float(rng.uniform(-10, 35)),
            ramp_k_s=float(rng.choice([0.0, 0.0, 0.01, -0.01])),
            self_heating_k=float(rng.choice([0.0, 1.0, 4.0])),
            warm_up_s=float(rng.uniform(200, 900)),
        ),
        motion=device.Handling(turn_s=float(rng.uniform(2, 5))),
        effects=(checked_effect("earth_rate", {}),),
    )
    return Session(
        "nothing",
        one,
        _windows(rng, place, long, float(rng.uniform(6, 12))),
        place,
        thermometer=bool(rng.random() < 0.7),
        off=rng.normal(0, 0.05, 3),
    )


def _three(rng: np.random.Generator, sd: float, mean: float = 0.0) -> device.Triad:
    x, y, z = rng.normal(mean, sd, 3)
    return float(x), float(y), float(z)


def _windows(
    rng: np.random.Generator, place: str, long: float, gap: float
) -> tuple[HeldWindow, ...]:
    positions = list(SETS[place])
    if rng.random() < 0.5:
        positions = [positions[i] for i in rng.permutation(len(positions))]
    out, start = [], float(rng.uniform(2, 6))
    for p in positions:
        angles, rate = p if place == "table" else (p, (0.0, 0.0, 0.0))
        alpha, beta = np.deg2rad(angles)
        x, y, z = (float(r) for r in np.deg2rad(rate))
        out.append(
            HeldWindow(float(alpha), float(beta), start, start + long, (x, y, z))
        )
        start += long + gap
    return tuple(out)
