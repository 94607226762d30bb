"""Gazebo: the <imu> element of an SDF sensor, with its noise.

Gazebo adds to each axis a normal number of mean <mean> and deviation <stddev>, and
rounds to steps of <precision> where the type is gaussian_quantized. A bias is written
as <mean>: <bias_mean> is given either sign by chance each time a world is loaded.
m/s^2, rad/s, sensor axes. Source: gz-sensors, GaussianNoiseModel.cc; SDFormat, imu.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fieldcal.against.sensor_model import SensorModel

WHAT = "Gazebo, the <imu> element of SDF"
ENDING = ".sdf"
HOLDS = ("acc_bias", "gyr_bias", "noise", "quantisation")

TRIADS = (("gyr", "angular_velocity"), ("acc", "linear_acceleration"))


def text(model: SensorModel) -> tuple[str, list[str]]:
    """The element, and what the user must know."""
    imu, says = Element("imu"), []
    for triad, name in TRIADS:
        if _says(model, triad):
            part = SubElement(imu, name)
            if not model.knows_noise(triad):
                says.append(
                    f"the noise of the simulator is not known: write its own <stddev>"
                    f" of {name} into each <noise>, or it is 0"
                )
            for i, axis in enumerate("xyz"):
                _noise(SubElement(part, axis), model, triad, i)
    indent(imu)
    says.append("put it into <sensor type='imu'> in the place of the <imu> there")
    if model.rate_hz == model.rate_hz:
        says.append(f"<update_rate> of the recording: {model.rate_hz:.6g}")
    return tostring(imu, encoding="unicode") + "\n", says


def _says(model: SensorModel, triad: str) -> bool:
    """Whether anything of a triad is to be changed."""
    noisy = any(name[0] == triad[0] for name in model.noise)
    stepped = triad in model.effects.get("quantisation", {})
    return noisy or stepped or f"{triad}_bias" in model.calibration


def _noise(axis: Element, model: SensorModel, triad: str, i: int) -> None:
    """One axis."""
    step = model.number("quantisation", triad)
    noise = SubElement(axis, "noise")
    noise.set("type", "gaussian_quantized" if step else "gaussian")
    values = {"mean": float(model.group(f"{triad}_bias")[i])}
    if model.knows_noise(triad):
        values["stddev"] = model.level(f"{triad[0]}{'xyz'[i]}")
    if step:
        values["precision"] = step
    for name, value in values.items():
        SubElement(noise, name).text = f"{value:.9g}"
