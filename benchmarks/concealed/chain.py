"""What can happen to samples on their way, done to columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.concealed.motion import Vector

Columns = dict[str, Vector]


def _bump(columns: Columns, v: Mapping[str, Any], rng: np.random.Generator) -> Columns:
    t = columns["t"]
    hit = (t >= v["at_s"]) & (t < v["at_s"] + v["for_s"])
    for axis in "xyz":
        columns[f"a{axis}"][hit] += v["acc"] * rng.standard_normal(int(hit.sum()))
    return columns


def _stuck(columns: Columns, v: Mapping[str, Any], rng: np.random.Generator) -> Columns:
    t = columns["t"]
    rows = np.flatnonzero((t >= v["from_s"]) & (t < v["to_s"]))
    columns[v["channel"]][rows] = columns[v["channel"]][rows[0]]
    return columns


def _quantised(
    columns: Columns, v: Mapping[str, Any], rng: np.random.Generator
) -> Columns:
    for kind in ("acc", "gyr"):
        if (lsb := v.get(kind)) is not None:
            for name in (f"{kind[0]}{axis}" for axis in "xyz"):
                columns[name] = np.round(columns[name] / lsb) * lsb
    return columns


def _clipped(
    columns: Columns, v: Mapping[str, Any], rng: np.random.Generator
) -> Columns:
    columns[v["channel"]] = np.clip(columns[v["channel"]], -v["limit"], v["limit"])
    return columns


def _dropped(
    columns: Columns, v: Mapping[str, Any], rng: np.random.Generator
) -> Columns:
    keep = rng.random(len(columns["t"])) >= v["fraction"]
    return {name: values[keep] for name, values in columns.items()}


def _skewed(
    columns: Columns, v: Mapping[str, Any], rng: np.random.Generator
) -> Columns:
    t = columns["t"]
    columns["t_host"] = columns["t_host"] - (t - t[0]) * 1e-6 * v["ppm"]
    return columns


def _decoded(
    columns: Columns, v: Mapping[str, Any], rng: np.random.Generator
) -> Columns:
    counts = np.round(columns[v["channel"]] / v["lsb"]).astype(np.int64)
    words = counts.astype(np.int16)
    if v["kind"] == "sign_extended":
        low = (words & 0xFF).astype(np.uint8).astype(np.int8)
        wrong = (words >> 8).astype(np.int32) * 256 + low
    elif v["kind"] == "swapped":
        wrong = words.byteswap().astype(np.int32)
    else:
        wrong = ((counts + v["headroom"]).astype(np.int16)).astype(np.int32)
        wrong = wrong - v["headroom"]
    columns[v["channel"]] = wrong * v["lsb"]
    return columns


def _mounted(
    columns: Columns, v: Mapping[str, Any], rng: np.random.Generator
) -> Columns:
    out = dict(columns)
    for letter in "ag":
        if f"{letter}x" not in columns:
            continue
        for axis, source in zip("xyz", v["axes"], strict=True):
            sign = -1.0 if source[0] == "-" else 1.0
            out[f"{letter}{axis}"] = sign * columns[f"{letter}{source[1]}"]
    return out


FAULTS = {
    "bump": _bump,
    "stuck": _stuck,
    "quantisation": _quantised,
    "saturation": _clipped,
    "dropped": _dropped,
    "clock_skew": _skewed,
    "decode_fault": _decoded,
    "mounting": _mounted,
}
