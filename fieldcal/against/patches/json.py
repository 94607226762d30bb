"""Plain JSON: every change, with its equation, for a simulator of one's own.

    U = bias + matrix f + noise,    W = bias + matrix w + noise                      (1)

and each effect by its parameters and the equation of the catalogue. What is not in the
file is to stay as it is; under "assumed" are elements of bias and matrix that neither
recording nor simulator shows, with the value of a perfect sensor. Instants count from
the first sample. Device axes, SI units.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from fieldcal.against.patches import assumed_sentence
from fieldcal.against.sensor_model import LINEAR, TRIADS, SensorModel
from fieldcal.effects import catalogue

WHAT = "plain JSON, with equations"
ENDING = ".json"
HOLDS = ("acc_bias", "acc_scale", "gyr_bias", "gyr_scale", "noise", *catalogue())

EQUATION = "acc = bias + matrix f + noise, gyr = bias + matrix w + noise"


def text(model: SensorModel) -> tuple[str, list[str]]:
    """The object, and what the user must know."""
    out: dict[str, Any] = {"format": 1, "equation": EQUATION}
    for what, value in (("rate_hz", model.rate_hz), ("start_c", model.start_c)):
        if value == value:
            out[what] = value
    bias = {t: model.group(f"{t}_bias").tolist() for t in _changed(model, "bias")}
    matrix = {t: model.matrix(t).tolist() for t in _changed(model, "scale")}
    held = [f"{t}_bias" for t in bias]
    held += [i for t in matrix for i in (f"{t}_scale", *TRIADS[t])]
    unknown = model.assumed(held)
    noise = {
        triad: [model.level(f"{triad[0]}{axis}") for axis in "xyz"]
        for triad in TRIADS
        if any(c[0] == triad[0] for c in model.noise)
    }
    out |= {
        k: v for k, v in (("bias", bias), ("matrix", matrix), ("noise", noise)) if v
    }
    if unknown:
        out["assumed"] = unknown
    effects = {
        name: {**values, "equation": equation(name)}
        for name, values in model.effects.items()
        if name not in LINEAR
    }
    if effects:
        out["effects"] = effects
    return json.dumps(out, indent=2, allow_nan=False) + "\n", assumed_sentence(
        unknown, "the matrix"
    )


def _changed(model: SensorModel, group: str) -> list[str]:
    """Triads of which a group, or what stands in its matrix, is to be changed."""
    return [
        triad
        for triad, inside in TRIADS.items()
        if f"{triad}_{group}" in model.calibration
        or (group == "scale" and set(inside) & set(model.effects))
    ]


def equation(name: str) -> str:
    """The equation of an effect: the second paragraph of its file."""
    module = sys.modules[type(catalogue()[name]).__module__]
    paragraphs = (module.__doc__ or "").split("\n\n")
    return " ".join(" ".join(paragraphs[1:2]).split())
