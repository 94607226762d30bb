"""What a virtual device is: everything it conceals, where it stands, how it is held.

The tables and keys are those of a device file; where session.toml has a table, the
names are the same. Numbers are in SI units unless a name says otherwise. Triads are
x, y, z of the device's axes.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from fieldcal.core.errors import InputError
from fieldcal.core.grade import GRADES, Grade
from fieldcal.sim_device import earth
from fieldcal.sim_device.effect import SimulatedEffect
from fieldcal.sim_device.motion import mounting_axes
from fieldcal.sim_device.vocabulary import check_repeats

Triad = tuple[float, float, float]

ZERO: Triad = (0.0, 0.0, 0.0)
ONE: Triad = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Identity:
    """[device]: name, serial number, grade."""

    name: str = "virtual device"
    serial: str = "SIM-1"
    grade: Grade = "tactical"


@dataclass(frozen=True, slots=True)
class Sampling:
    """[sampling]: rate by the device's own clock, Hz."""

    rate_hz: float = 100.0


@dataclass(frozen=True, slots=True)
class Site:
    """[site]: where the device stands; `gravity` in m/s^2 overrides the ellipsoid's.

    A base may move over the Earth at a constant velocity, m/s.
    """

    latitude_deg: float = 50.45
    height_m: float = 170.0
    gravity: float | None = None
    north_m_s: float = 0.0
    east_m_s: float = 0.0

    @property
    def local_gravity(self) -> float:
        """Gravity at the site, m/s^2."""
        if self.gravity is not None:
            return self.gravity
        return earth.gravity(self.latitude_deg, self.height_m)


@dataclass(frozen=True, slots=True)
class MountingAxes:
    """[frame]: the device axis along each procedure axis."""

    mounting: tuple[str, str, str] = ("+x", "+y", "+z")


@dataclass(frozen=True, slots=True)
class FullScale:
    """[range]: full scale in m/s^2 and rad/s; beyond it the outputs are clipped."""

    acceleration: float | None = None
    angular_rate: float | None = None


@dataclass(frozen=True, slots=True)
class Truth:
    """[truth]: output = bias + scale * input, m/s^2 and rad/s."""

    acc_bias: Triad = (0.21, -0.30, 0.12)
    acc_scale: Triad = (1.006, 0.992, 1.008)
    gyr_bias: Triad = (0.011, -0.020, 0.006)
    gyr_scale: Triad = ONE


@dataclass(frozen=True, slots=True)
class NoiseFigures:
    """[noise]: random errors, m/s^2 and rad/s, each channel by itself.

    Attributes
    ----------
    acc, gyr : white noise, standard deviation of a sample
    acc_density, gyr_density : white noise by its density, per sqrt(Hz), instead
    acc_instability, gyr_instability : standard deviation of a Gauss-Markov bias
    instability_s : its correlation time, s
    acc_flicker, gyr_flicker : 1/f noise, by the constant level of its Allan deviation
    acc_walk, gyr_walk : rate random walk, per sqrt(s)
    temperature : of the thermometer, K

    """

    acc: Triad = (0.02, 0.02, 0.02)
    gyr: Triad = (0.002, 0.002, 0.002)
    acc_density: Triad | None = None
    gyr_density: Triad | None = None
    acc_instability: Triad = (1e-4, 1e-4, 1e-4)
    gyr_instability: Triad = (1e-5, 1e-5, 1e-5)
    instability_s: float = 200.0
    acc_flicker: Triad = ZERO
    gyr_flicker: Triad = ZERO
    acc_walk: Triad = ZERO
    gyr_walk: Triad = ZERO
    temperature: float = 0.02


@dataclass(frozen=True, slots=True)
class Climate:
    """[temperature]: temperature of the device's sensors over time.

    Attributes
    ----------
    ambient_c : of the air at the start, °C
    ramp_k_s : steady change of the air, K/s
    self_heating_k : rise by the device's own power in the end, K
    warm_up_s : time constant of that rise, s
    points : (s, °C) of the air instead of `ambient_c` and `ramp_k_s`, linear between

    """

    ambient_c: float = 21.0
    ramp_k_s: float = 0.0
    self_heating_k: float = 4.0
    warm_up_s: float = 900.0
    points: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Handling:
    """[motion]: duration of a turn, and the angles when the device is switched on."""

    turn_s: float = 4.0
    alpha_deg: float = 0.0
    beta_deg: float = 0.0
    gamma_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Profile:
    """Parameters of a virtual device; `effects` come beside bias, scale and noise."""

    device: Identity = Identity()
    sampling: Sampling = Sampling()
    site: Site = Site()
    frame: MountingAxes = MountingAxes()
    range: FullScale = FullScale()
    truth: Truth = Truth()
    noise: NoiseFigures = NoiseFigures()
    temperature: Climate = Climate()
    motion: Handling = Handling()
    effects: tuple[SimulatedEffect, ...] = field(default=())

    def __post_init__(self) -> None:
        check_repeats(self.effects)
        mounting_axes(self.frame.mounting, right_handed=True)
        _check_numbers(self)
        for one in self.effects:
            if one.NEEDS_EARTH and not self.feels_earth:
                raise InputError(
                    f"{one.id} shows in the Earth's rate only: make the device's grade "
                    "navigation, or give it earth_rate as well"
                )

    def having(self, *more: SimulatedEffect) -> Profile:
        """Return the same device with more effects."""
        return replace(self, effects=(*self.effects, *more))

    def every(self, id_: str) -> tuple[SimulatedEffect, ...]:
        """All effects of that id."""
        return tuple(e for e in self.effects if e.id == id_)

    def one(self, id_: str) -> SimulatedEffect | None:
        """Return the effect of that id, if the device has it."""
        return next((e for e in self.effects if e.id == id_), None)

    @property
    def in_order(self) -> tuple[SimulatedEffect, ...]:
        """The effects in the order in which they act."""
        return tuple(sorted(self.effects, key=lambda e: e.ORDER))

    @property
    def feels_earth(self) -> bool:
        """Whether its gyroscopes feel the Earth's rate."""
        told = any(e.FEELS_EARTH for e in self.effects)
        return told or self.device.grade == "navigation"

    @property
    def gravity(self) -> float:
        """True gravity where the device stands, m/s^2."""
        g = self.site.local_gravity
        for one in self.effects:
            g = one.gravity(g)
        return g

    @property
    def clock_rate(self) -> float:
        """Seconds of the device's clock in a true second."""
        return math.prod(one.clock_rate() for one in self.effects)

    def concealed(self) -> dict[str, Any]:
        """Everything that a recalibration should find out, as JSON."""
        effects: dict[str, list[dict[str, Any]]] = {}
        for one in self.effects:
            effects.setdefault(one.id, []).append(one.parameters)
        return {
            **{name: list(values) for name, values in asdict(self.truth).items()},
            "gravity": self.gravity,
            "grade": self.device.grade,
            "mounting": list(self.frame.mounting),
            "effects": {k: v[0] if len(v) == 1 else v for k, v in effects.items()},
        }


def _check_numbers(profile: Profile) -> None:
    """Refuse figures that no device has."""
    above = {
        "[sampling] rate_hz": profile.sampling.rate_hz,
        "[site] gravity": profile.site.local_gravity,
        "[motion] turn_s": profile.motion.turn_s,
        "[noise] instability_s": profile.noise.instability_s,
        "[temperature] warm_up_s": profile.temperature.warm_up_s,
        "[range] acceleration": profile.range.acceleration,
        "[range] angular_rate": profile.range.angular_rate,
    }
    for name, value in above.items():
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value:g} must be above 0")
    for name, value in asdict(profile.noise).items():
        for number in value if isinstance(value, tuple) else (value,):
            if number is not None and not (math.isfinite(number) and number >= 0):
                raise InputError(f"[noise] {name} = {number:g} must be 0 or more")
    if profile.device.grade not in GRADES:
        raise InputError(
            f"[device] grade = {profile.device.grade!r} is none of {', '.join(GRADES)}"
        )
    times = [t for t, _ in profile.temperature.points]
    if any(b <= a for a, b in zip(times, times[1:], strict=False)):
        raise InputError("[temperature] points must be in time order")
