"""Our virtual device: tables of a device file, for fieldcal sim --profile.

    U = acc_bias + acc_scale f + effects,    W = gyr_bias + gyr_scale w + effects

What is not in the file is that of a device file's defaults. Instants count from when
the device is switched on. Source: `fieldcal.sim_device.profile_file`.
"""

from __future__ import annotations

from typing import Any

from fieldcal.against.sensor_model import TRIADS, SensorModel
from fieldcal.sim_device.effects import ids, kind
from fieldcal.sim_device.profile_file import FORMAT, profile_from_tables

WHAT = "the virtual device of fieldcal sim"
ENDING = ".toml"
HOLDS = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale", "noise", *ids())


def text(model: SensorModel) -> tuple[str, list[str]]:
    """The device file, and what the user must know."""
    import tomlkit

    tables: dict[str, Any] = {"format": FORMAT}
    if model.rate_hz == model.rate_hz:
        tables["sampling"] = {"rate_hz": float(f"{model.rate_hz:.9g}")}
    if model.calibration:
        tables["truth"] = {n: v.tolist() for n, v in model.calibration.items()}
    if model.noise:
        tables["noise"] = _noise(model)
    effects = {n: _known(n, v) for n, v in model.effects.items() if n in ids()}
    says = [one for name, values in effects.items() for one in _beyond(name, values)]
    effects = {n: v for n, v in effects.items() if any(v.values())}
    if effects:
        tables["effects"] = effects
    profile_from_tables(tables)  # what it refuses is not written
    return tomlkit.dumps(tables), says


def _beyond(name: str, values: dict[str, Any]) -> list[str]:
    """Take out what the virtual device cannot have, and say so."""
    takes, says = kind(name).NUMBERS, []
    for part in [p for p in values if p in takes]:
        if not takes[part].range.contains(float(values[part])):
            value = float(values.pop(part))
            says.append(
                f"toml: {name} {part} = {value:.4g} is left out, as the virtual device"
                f" has it {takes[part].range.description} only"
            )
    return says


def _noise(model: SensorModel) -> dict[str, list[float]]:
    """White noise by triad; what is random besides is an effect of its own."""
    out: dict[str, list[float]] = {}
    for triad in filter(model.knows_noise, TRIADS):
        out[triad] = [model.level(f"{triad[0]}{axis}") for axis in "xyz"]
        out[f"{triad}_instability"] = [0.0, 0.0, 0.0]
    return out


def _known(name: str, values: Any) -> dict[str, Any]:
    """Parameters that the virtual device has a word for."""
    one = kind(name)
    words = {*one.VECTOR, *one.NUMBERS, *one.WORDS}
    return {n: v for n, v in values.items() if n in words}
