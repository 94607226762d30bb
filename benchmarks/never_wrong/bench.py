"""A bench, a device and an operator, drawn at random."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks._own_axes import own_axes
from benchmarks.never_wrong.acting import Acting
from benchmarks.never_wrong.beside import Beside
from benchmarks.never_wrong.device import Device

Floats = NDArray[np.float64]

EARTH = 7.2921150e-5

SETS: dict[str, tuple[tuple[float, float], ...]] = {
    "two": ((0, 0), (45, 5)),
    "five": ((0, 0), (22.5, 0), (22.5, 2.5), (45, 2.5), (45, 5)),
    "wide": ((-45, -5), (-45, 5), (0, 0), (45, -5), (45, 5)),
    "six_faces": ((0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90)),
    "twelve": (
        (0, 0), (180, 0), (90, 0), (-90, 0), (0, 90), (0, -90),
        (45, 45), (135, -45), (-45, 45), (-135, -45), (45, 0), (0, 135),
    ),
}  # fmt: skip

SETTING = {"two": 5e-3, "five": 5e-3, "wide": 1e-2, "six_faces": 5e-2, "twelve": 5e-2}
"""How well angles are set at worst, deg: a fixture that turns by 5 degrees gives a
scale factor within the limits of the grade only where it sets them so well."""

FACES = ((180, 0), (90, 0), (0, 90), (-90, 0), (0, -90))
"""Where a device is laid by hand beside a fixture that turns it a little: gravity is
the witness of what angles cannot prove, and these need not be known."""

BY_HAND = 2.0
"""How well it then lies, deg."""

WITNESSES = {"two": 5, "five": 3, "wide": 3}
"""How many of them sets of positions need that nothing else bears witness to."""

MOUNTINGS = (
    ("+x", "+y", "+z"),
    ("+x", "-z", "+y"),
    ("-y", "-x", "-z"),
    ("+y", "+z", "+x"),
)


@dataclass(frozen=True)
class Bench:
    """What is there, and what is written down of it.

    Attributes
    ----------
    places : positions, a name of `POSITION_SETS`
    faces : positions behind these in which the device is laid by hand
    latitude, height : of the site, deg and m
    tilt : about z and about x, rad
    joints : whether that is what the joints' angles are off by, and not the base
    level_deg, angles_deg : what is said of level and angles, None where nothing is
    off : (n, 2) what each position's angles are off by, rad
    hold, way : s in a position, and from one to the next
    rate : samples a second
    mounting : of the device
    acc_bias, acc_scale, gyr_bias, gyr_scale : (3,) of the device
    device : what else it has
    acc_noise, gyr_noise : rms of a sample
    grain : what accelerations are rounded to, m/s^2; 0 for none
    imported : whether angles are unknown, and the session is no recalibration
    acting : what else acts
    grade : what the device is said to be
    skew : rad by which the axes of the two joints are not square
    creep, creeps_s : rad by which a joint goes too far in a turn, and T, s, of its way
        back
    beside : a second device that is heard in the same stream, if there is one

    """

    places: str
    faces: int
    latitude: float
    height: float
    tilt: tuple[float, float]
    joints: bool
    level_deg: float | None
    angles_deg: float | None
    off: Floats = field(repr=False)
    hold: float
    way: float
    rate: float
    mounting: tuple[str, str, str]
    acc_bias: Floats
    acc_scale: Floats
    gyr_bias: Floats
    gyr_scale: Floats
    device: Device
    acc_noise: float
    gyr_noise: float
    grain: float
    imported: bool
    acting: Acting = Acting()
    grade: str = "tactical"
    skew: float = 0.0
    creep: float = 0.0
    creeps_s: float = 1.0
    beside: Beside | None = None

    @property
    def angles(self) -> Floats:
        """Angles that are asked for, (n, 2) deg."""
        return np.array([*SETS[self.places], *FACES[: self.faces]], float)

    @property
    def stated(self) -> int:
        """How many positions have angles that are written down."""
        return 0 if self.imported else len(SETS[self.places])

    @property
    def windows(self) -> Floats:
        """Start and end of each position, (n, 2) s."""
        start = 2.0 + (self.hold + self.way) * np.arange(len(self.angles))
        return np.column_stack([start, start + self.hold])

    @property
    def gravity(self) -> float:
        """Normal gravity of the place, m/s^2 (Somigliana, free air)."""
        s = np.sin(np.deg2rad(self.latitude)) ** 2
        g = (
            9.7803253359
            * (1 + 0.00193185265241 * s)
            / np.sqrt(1 - 0.00669437999013 * s)
        )
        return float(g - 3.086e-6 * self.height)

    @property
    def truth(self) -> dict[str, float]:
        """Parameters of the device by full name, at the end of the last position."""
        come = self.device.come_to(float(self.windows[-1, 1]))
        groups = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale")
        found = {g: getattr(self, g) + come.get(g, 0.0) for g in groups}
        if (turned := self.acting.askew) is not None:  # a matrix in the fixture's axes
            gyr = (np.diag(found["gyr_scale"]) + self.device.coupled[1]) @ turned
            found["gyr_scale"] = np.diag(gyr)
        if not self.stated:
            acc, gyr = self.device.coupled
            upper, axes = own_axes(np.diag(found["acc_scale"]) + acc)
            seen = (np.diag(found["gyr_scale"]) + gyr) @ axes.T
            found |= {"acc_scale": np.diag(upper), "gyr_scale": np.diag(seen)}
        return {
            f"{group}.{axis}": float(values[i])
            for group, values in found.items()
            for i, axis in enumerate("xyz")
        }


@dataclass(frozen=True)
class Samples:
    """What was recorded: t (n,) s, acc and gyr (n, 3), m/s^2 and rad/s."""

    t: Floats
    acc: Floats
    gyr: Floats

    def within(self, start: float, end: float) -> NDArray[np.bool_]:
        """Whether each sample lies in a span."""
        return (self.t >= start) & (self.t <= end)


def drawn(rng: np.random.Generator) -> Bench:
    """A sound bench: everything that is written down is so."""
    places = str(rng.choice(list(SETS)))
    imported = places == "twelve"
    faces = WITNESSES.get(places, 0)
    most = SETTING[places]
    said = float(np.exp(rng.uniform(np.log(most / 10), np.log(most))))
    level = float(np.exp(rng.uniform(np.log(0.003), np.log(0.05))))
    wide = 0.5 if places in ("five", "wide", "six_faces") else level
    acc_noise = float(np.exp(rng.uniform(np.log(3e-4), np.log(2e-2))))
    off = rng.normal(0, said, (len(SETS[places]), 2))
    off = np.vstack([off, rng.normal(0, BY_HAND, (faces, 2))])
    return Bench(
        places=places,
        faces=faces,
        latitude=float(rng.uniform(-65, 65)),
        height=float(rng.uniform(0, 1500)),
        tilt=tuple(np.deg2rad(rng.normal(0, wide, 2)).tolist()),
        joints=places != "two" and bool(rng.integers(2)),
        level_deg=level if places == "two" else None,
        angles_deg=said,
        off=np.deg2rad(off),
        hold=float(rng.uniform(15, 30)),
        way=float(rng.uniform(4, 10)),
        rate=float(rng.choice([50.0, 100.0])),
        mounting=MOUNTINGS[int(rng.integers(len(MOUNTINGS)))],
        acc_bias=rng.normal(0, 0.08, 3),
        acc_scale=1 + rng.normal(0, 3e-3, 3),
        gyr_bias=rng.normal(0, 5e-3, 3),
        gyr_scale=1 + rng.normal(0, 3e-3, 3),
        device=Device.drawn(rng),
        acc_noise=acc_noise,
        gyr_noise=acc_noise * float(rng.uniform(0.05, 0.3)),
        grain=float(rng.choice([0.0, 0.0, 1e-3, 9.80665 / 4096])),
        imported=imported,
    )


def wrongly_set(bench: Bench, off: Floats) -> Bench:
    """The same with angles set otherwise, (n, 2) rad more."""
    return replace(bench, off=bench.off + off)
