"""The calibration that an autopilot applies to its samples, and the next one.

An autopilot sends  U = (r - o) k  of the sensor's own output r, with the offset o and
the scale k among its parameters, axis by axis.                                 (1)
A recalibration from U finds  U = b + s f, so

    f = (U - b) / s = (r - (o + b / k)) (k / s)                                 (2)

and what to install is o' = o + b / k and k' = k / s; for a gyroscope without a
scale k = 1, and s stays out. The axes of o and k are the sensor's, so (2) needs a
board that is not mounted turned.

Symbols: o offset m/s^2 or rad/s, k scale, b bias, s scale factor, f specific force.
Frame: device axes. Source: parameter lists of ArduPilot (INS_*) and PX4 (CAL_*).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fieldcal.calibration import Nominal
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array
from fieldcal.drivers.mavlink_parameter_names import parameter_names


@dataclass(slots=True)
class InstalledCalibration:
    """Calibration that is installed on an autopilot, by its parameters.

    Attributes
    ----------
    autopilot : number of its program in the heartbeat
    instance : which of its sensors, from 0
    values : values received, by name of the parameter
    taken_out : whether the autopilot was told to use o = 0 and k = 1
    in_samples : all parameters as they were last read; these are applied to the
        samples. Unless `taken_out`, they are also in `values`.
    gyr_instance : number of the gyroscope's parameters; None where it is `instance`

    """

    autopilot: int
    instance: int
    values: dict[str, float] = field(default_factory=dict)
    taken_out: bool = False
    in_samples: dict[str, float] = field(default_factory=dict)
    gyr_instance: int | None = None

    @property
    def names(self) -> dict[str, tuple[str, ...]]:
        """Names of its parameters, as of `parameter_names`."""
        return parameter_names(self.autopilot, self.instance, self.gyr_instance)

    @property
    def missing(self) -> list[str]:
        """Parameters that have not been received, or are no finite number."""
        known = self.names.values()
        return [
            name
            for some in known
            for name in some
            if not np.isfinite(self.values.get(name, np.nan))
        ]

    @property
    def damage(self) -> str:
        """Error text for values that are impossible; empty if there are none."""
        scales = self.names.get("acc_scale", ())
        odd = {n: v for n, v in self.values.items() if not np.isfinite(v)}
        odd |= {n: v for n in scales if (v := self.values.get(n, 1.0)) <= 0}
        if not odd:
            return ""
        listed = ", ".join(f"{name} = {value:g}" for name, value in odd.items())
        return (
            f"the autopilot says {listed}, which no sensor can be scaled by: its"
            " installed calibration is damaged; set it anew, and record again"
        )

    @property
    def remark(self) -> str:
        """Remark for the operator, one sentence; empty if there is none."""
        if self.damage:
            return self.damage
        on = [n for n, v in self.values.items() if n.endswith("_ENABLE") and v]
        if not on:
            return ""
        return (
            f"{on[0]} = {self.values[on[0]]:g}: the autopilot corrects for temperature"
            " before it sends, so what is found holds near the temperature of this"
            " recording"
        )

    def vector(self, what: str) -> Array:
        """Return ``acc_offset``, ``acc_scale`` or ``gyr_offset``, (3,), nan unknown."""
        some = self.names.get(what, ("",) * 3)
        return np.array([self.values.get(name, np.nan) for name in some])

    def nominal(self, otherwise: Nominal) -> Nominal:
        """Return what counts where the samples do not determine a parameter.

        Samples of which o and k were taken out are r = o + f / k as far as is known:
        what is not determined stays as installed. `otherwise` is for other samples.
        """
        if not self.taken_out or self.missing or self.damage:
            return otherwise
        return replace(
            otherwise,
            acc_bias=tuple(self.vector("acc_offset").tolist()),
            acc_scale=tuple((1 / self.vector("acc_scale")).tolist()),
            gyr_bias=tuple(self.vector("gyr_offset").tolist()),
        )

    def parameters_after(
        self, acc_bias: Array, acc_scale: Array, gyr_bias: Array
    ) -> Mapping[str, float]:
        """Return the parameters to install after a recalibration, (2).

        Parameters
        ----------
        acc_bias, acc_scale, gyr_bias : (3,) as estimated from the samples, m/s^2, rad/s

        Raises
        ------
        InputError
            If a parameter is not known, or the board is mounted turned.

        """
        if self.damage:
            raise InputError(self.damage)
        known = self.names
        if self.missing or not known:
            lacking = ", ".join(self.missing) or "any parameter of this autopilot"
            raise InputError(
                f"what the autopilot has installed is not known, without {lacking}: "
                "let it answer parameter requests, and record again"
            )
        (mounting,) = known["rotation"]
        if self.values[mounting] != 0:
            raise InputError(
                f"{mounting} = {self.values[mounting]:g} turns the axes behind the "
                "installed calibration: set it to 0, and record again"
            )
        there = 0.0 if self.taken_out else 1.0
        k = self.vector("acc_scale") ** there
        new = {
            "acc_offset": there * self.vector("acc_offset") + acc_bias / k,  # (2)
            "acc_scale": k / acc_scale,
            "gyr_offset": there * self.vector("gyr_offset") + gyr_bias,
        }
        return {
            name: float(value)
            for what, values in new.items()
            for name, value in zip(known[what], values, strict=True)
        }

    def as_table(self) -> dict[str, Any]:
        """Table that a recording keeps."""
        apart = {} if self.gyr_instance is None else {"gyr_instance": self.gyr_instance}
        return {
            "autopilot": self.autopilot,
            "instance": self.instance,
            **apart,
            "parameters": {n: v for n, v in self.values.items() if np.isfinite(v)},
            "missing": self.missing,
            "taken_out": self.taken_out,
            "in_samples": self._in_samples(),
        }

    def _in_samples(self) -> dict[str, list[float]] | None:
        """Offsets and scales (1) that were applied to the samples; None if unknown."""
        known = self.names
        used = {
            what: [self.in_samples.get(n, np.nan) for n in known[what]]
            for what in known
        }
        if not known or not np.isfinite(np.concatenate([*used.values()])).all():
            return None
        if used.pop("rotation") != [0.0] or min(used["acc_scale"]) <= 0:
            return None  # the axes of the samples are not those of the parameters
        return used

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> InstalledCalibration:
        """Read the table that a recording keeps.

        Raises
        ------
        InputError
            If it is not such a table.

        """
        try:
            values = {str(k): float(v) for k, v in table["parameters"].items()}
            places = int(table["autopilot"]), int(table["instance"])
            gyr = table.get("gyr_instance")
            return cls(
                *places,
                values,
                bool(table["taken_out"]),
                gyr_instance=None if gyr is None else int(gyr),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                f"what the device had installed is not told in full ({error!r}): "
                "record again"
            ) from error


def identity_parameters(installed: InstalledCalibration) -> dict[str, float]:
    """Parameters of a calibration that changes nothing; empty if not all are known."""
    if installed.missing:
        return {}
    known = installed.names
    nothing = {"acc_offset": 0.0, "acc_scale": 1.0, "gyr_offset": 0.0}
    return {
        name: value for what, value in nothing.items() for name in known.get(what, ())
    }
