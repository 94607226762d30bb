"""What each effect does to a recording: the virtual device with it less without it.

Effects of the signal chain leave nothing to subtract; of them the samples are shown.
"""

from __future__ import annotations

import io
from functools import cache
from typing import Any

from fieldcal.core.positions import WIDE_POSITIONS
from fieldcal.core.samples import Array, Block
from fieldcal.physics.effect import Effect
from fieldcal.sim_device.effects import kind
from fieldcal.sim_device.profile import Climate, Profile, Sampling
from fieldcal.sim_device.replay import simulate
from fieldcal.sim_device.vocabulary import parse

GIVEN: dict[str, float | str] = {
    "tau_s": 8.0,
    "hz": 0.5,
    "at_s": 34.0,
    "for_s": 2.0,
    "sigma_deg": 0.3,
    "relative": 0.003,
    "psi_deg": 30.0,
    "amplitude_deg": 0.1,
    "seconds": 0.05,
    "limit": 7.0,
    "from_s": 3.0,
    "to_s": 9.0,
    "fraction": 0.2,
    "ppm": 2000.0,
    "ratio": 3.0,
    "channel": "ax",
    "kind": "low_byte_signed",
    "acc": 0.05,
    "gyr": 0.005,
}
"""What is given for parameters that have no typical size, for the pictures only."""

WINDOW, PAUSE = 12.0, 8.0
"""Length of the windows and of the turns between them, s."""

COLOURS = ("#1f77c9", "#d9601a", "#1a9a7c")
GREY = "#808890"


def windows() -> list[tuple[float, float, float, float]]:
    """Five positions to both sides with turns between them: angles, from, to."""
    each = WINDOW + PAUSE
    return [
        (p.alpha or 0.0, p.beta or 0.0, 2.0 + i * each, 2.0 + i * each + WINDOW)
        for i, p in enumerate(WIDE_POSITIONS)
    ]


def given(effect: Effect) -> str:
    """The effect with parameters of typical size, as the virtual device takes it."""
    taken = kind(effect.id)
    typical = {p.name: p.typical for p in effect.params}
    names = [n for n in taken.VECTOR if n in typical] or list(taken.VECTOR)
    parts = [f"{n}={_size(n, typical, i):.3g}" for i, n in enumerate(names[:6])]
    needed = [n for n, takes in taken.NUMBERS.items() if takes.default is None]
    needed += [n for n, takes in taken.WORDS.items() if takes.default is None]
    values = {**taken.EXAMPLE.given, **GIVEN}
    parts += [f"{n}={values[n]}" for n in needed]
    parts = parts or [f"{n}={v}" for n, v in taken.EXAMPLE.given.items()]
    return f"{effect.id}:{','.join(parts)}"


def _size(name: str, typical: dict[str, float], i: int) -> float:
    size = float(typical.get(name, GIVEN.get(name, 0.0)))
    # unlike sizes, so that the lines can be told apart
    return size * (1.0, -0.6, 0.35)[i % 3]


@cache
def _plain(earth: bool) -> Profile:
    return Profile(
        sampling=Sampling(50.0),
        temperature=Climate(ambient_c=15.0, ramp_k_s=0.1, self_heating_k=0.0),
        effects=(parse("earth_rate:"),) if earth else (),
    )


@cache
def _without(earth: bool) -> Block:
    return simulate(_plain(earth), windows(), seed=4, noise=False)


def picture(effect: Effect) -> str:
    """The picture of an effect, SVG."""
    earth = kind(effect.id).NEEDS_EARTH
    profile = _plain(earth).having(parse(given(effect)))
    if profile.clock_rate != 1:
        return _clock(profile)
    block = simulate(profile, windows(), seed=4, noise=False)
    plain = _without(earth)
    n = min(len(block), len(plain))
    more = block.six[:n] - plain.six[:n]
    if more.any():
        return _drawn(block.t[:n], more)
    block = simulate(profile, windows(), seed=4)
    return _raw(block.t, block.six)


def _clock(profile: Profile) -> str:
    block = simulate(profile, windows(), seed=4)
    late = (block.t_host - block.t) - (block.t_host[0] - block.t[0])
    figure, axes = _axes(1)
    axes[0].plot(block.t, 1e3 * late, color=COLOURS[0], lw=1.2)
    axes[0].set_ylabel("host less device, ms")
    return _text(figure, axes)


def _drawn(t: Array, six: Array) -> str:
    figure, axes = _axes(2)
    for ax, first, unit in zip(axes, (0, 3), ("m/s²", "rad/s"), strict=True):
        for i in range(3):
            ax.plot(t, six[:, first + i], color=COLOURS[i], lw=1.2, label="xyz"[i])
        ax.set_ylabel(f"{'acc' if first == 0 else 'gyro'} added, {unit}")
    axes[0].legend(ncols=3, frameon=False, labelcolor=GREY, loc="upper right")
    return _text(figure, axes)


def _raw(t: Array, six: Array) -> str:
    figure, axes = _axes(1)
    part = (t > 2.0) & (t < 14.0)
    axes[0].plot(t[part], six[part, 0], ".", ms=2.5, color=COLOURS[0])
    axes[0].set_ylabel("ax, m/s²")
    axes[0].set_xlim(2, 14)
    return _text(figure, axes, shaded=False)


def _axes(rows: int) -> tuple[Any, list[Any]]:
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(
        rows, 1, figsize=(7.2, 1.25 + 1.35 * rows), sharex=True, squeeze=False
    )
    return figure, [row[0] for row in axes]


def _text(figure: Any, axes: list[Any], shaded: bool = True) -> str:
    """The figure as SVG, legible on light and on dark."""
    from matplotlib import pyplot, rc_context

    for ax in axes:
        ax.patch.set_alpha(0)
        ax.tick_params(colors=GREY, labelsize=8)
        ax.yaxis.label.set_color(GREY)
        ax.yaxis.label.set_size(8)
        ax.grid(color=GREY, alpha=0.2)
        for spine in ax.spines.values():
            spine.set_color(GREY)
            spine.set_alpha(0.5)
        for *_, start, end in windows() if shaded else []:
            ax.axvspan(start, end, color=GREY, alpha=0.1, lw=0)
    axes[-1].set_xlabel("device time, s", color=GREY, size=8)
    out = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "fieldcal"}):
        figure.savefig(
            out,
            format="svg",
            transparent=True,
            bbox_inches="tight",
            metadata={"Date": None},
        )
    pyplot.close(figure)
    return out.getvalue()
