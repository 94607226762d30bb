"""What a recording in motion has beside what a simulator says of the same motion.

Where the simulator follows the motion of the recording, its specific force and rate are
the reference at every moment: what is found is what the device has beyond it. Of what
the simulator has itself that is the difference, with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from fieldcal.against.joint import differs
from fieldcal.against.motion.correlation import aligned
from fieldcal.against.motion.following import Following, follow
from fieldcal.against.motion.proof import proof
from fieldcal.against.motion.wording import aligned_as
from fieldcal.against.offsets import DETERMINED
from fieldcal.against.result import (
    Aligned,
    Difference,
    Facts,
    Match,
    Pair,
    verdict_of,
)
from fieldcal.against.wording import paragraph
from fieldcal.core.samples import CHANNELS, UNITS, Array, Block, Index
from fieldcal.diagnosis.findings.calibrated import GROUPS
from fieldcal.diagnosis.result import Mismatch, Quantity
from fieldcal.effects import catalogue
from fieldcal.model import priors, thresholds
from fieldcal.model.causes.cause import Group
from fieldcal.model.causes.followed import TURN
from fieldcal.model.evidence.gram import Eliminated
from fieldcal.model.posterior.probabilities import Standing
from fieldcal.model.rows.motion import Reference
from fieldcal.model.rows.thermometer import Thermometer
from fieldcal.physics.recording import grids_of
from fieldcal.session.description import Description

PPM = 1e6


def compared_in_motion(
    real: tuple[Block, Description], sim: Block, names: tuple[str, str]
) -> Match:
    """Say what a simulator that follows a recording's motion leaves out of it.

    Parameters
    ----------
    real : all samples, SI, and what session.toml says
    sim : samples of the simulator, or of a better sensor, by a clock of its own
    names : what errors and warnings call them

    Raises
    ------
    InputError
        If they show no common motion, or too little of it.

    """
    block, about = real
    found = follow(block, about, Reference(sim), aligned(block, sim, names))
    standing = found.posterior.standing()
    wide, _ = found.inferred.search.opened(found.set)
    state = _sized(found, wide)
    free = _sized(found, _freed(found, wide))
    every = (
        *_effects(found, standing, state),
        *_calibration(found, free),
        *_axes(found, state),
    )
    differences = tuple(sorted(every, key=lambda d: -d.probability))
    verdict = verdict_of(differences)
    shown = proof(found)
    predicted = shown.before, shown.after
    where = _aligned(found, state)
    says = paragraph(verdict, differences, predicted, "Stretches")
    return Match(
        verdict,
        _probability(found, differences),
        differences,
        (),
        *predicted,
        _facts_of_the_device(block, found, free),
        _facts(sim),
        tuple(_warnings(found, names)),
        f"{says} {aligned_as(where)}",
        where,
    )


def _sized(found: Following, sizes: Array) -> Eliminated:
    """The set of causes with other sizes."""
    before = found.set.state
    return Eliminated.of(before.rows, before.columns, sizes)


def _freed(found: Following, sizes: Array) -> Array:
    """Sizes with those of bias and scale factor as of what is to be found."""
    wide, first = sizes.copy(), 0
    for group in found.dictionary.always:
        some = slice(first, first := first + len(group.columns))
        if group.fixed is None:
            wide[some] = group.sizes(priors.FREE)
    return wide


def _probability(found: Following, differences: Sequence[Difference]) -> float:
    if differences:
        return float(np.prod([d.probability for d in differences]))
    return found.posterior.nothing


def _estimates(state: Eliminated, columns: Index) -> tuple[Array, Array, Array]:
    """Values, covariance and sizes before the rows, of some columns."""
    at = np.array([int(np.flatnonzero(state.columns == c)[-1]) for c in columns])
    return state.estimate[at], state.inverse[np.ix_(at, at)], state.sizes[at]


def _effects(
    found: Following, standing: Sequence[Standing], state: Eliminated
) -> Iterator[Difference]:
    """Causes that are likelier there than not."""
    for one in standing:
        pairs: dict[str, Pair] = {}
        for _, group in one.members:
            for name, q in _quantities(group, state).items():
                pairs[name] = Pair.of(q, None)
        yield Difference(
            one.name,
            "left_out",
            one.probability,
            pairs,
            tuple(n for n in one.aliases if n in catalogue()),
            tuple(_where(found, one, state)),
            explained=one.name in catalogue(),
        )


def _quantities(group: Group, state: Eliminated) -> dict[str, Quantity]:
    """Numbers of a cause, as far as the rows determine them."""
    effect = group.effect
    if effect is None:
        return {}
    value, covariance, before = _estimates(state, group.columns)
    sigma = np.sqrt(np.diag(covariance))
    out = {
        effect.params[j].name: Quantity(float(v), float(s), effect.params[j].unit)
        for j, v, s, b in zip(group.params, value, sigma, before, strict=True)
        if s**2 < thresholds.DETERMINED * b**2
    }
    for shape in effect.shapes:
        at = float(group.shape[shape.name])
        unsure = min(group.unsure, at) if np.isfinite(group.unsure) else None
        out[shape.name] = Quantity(at, unsure, shape.unit)
    return out


def _where(found: Following, one: Standing, state: Eliminated) -> Iterator[Mismatch]:
    """Channels in which a cause shows, and what it follows there."""
    inferred, system = found.inferred, found.fit.system
    wanted = np.zeros(system.dictionary.width, dtype=bool)
    for _, group in one.members:
        wanted[group.columns] = True
    estimate = np.zeros(len(wanted))
    np.add.at(estimate, state.columns, state.estimate)
    effect = catalogue().get(one.name)
    rows = found.rows
    for part in system.linearised(inferred.state, wanted):
        made = part.design @ (estimate * wanted)[part.columns]
        square = float(made @ made)
        if square > thresholds.IN_CHANNEL:
            yield Mismatch(
                channel=CHANNELS[part.channel],
                kind=effect.seen_in if effect else "time",
                positions=(),
                from_s=float(rows.t[0, 0]),
                to_s=float(rows.t[-1, -1]),
                covariate=effect.covariate if effect else one.name,
                rms=float(np.sqrt(np.mean((made / part.weight) ** 2))),
                sigma=float(np.sqrt(square)),
            )


def _calibration(found: Following, state: Eliminated) -> Iterator[Difference]:
    """Bias and scale factor of both triads against what the reference says."""
    for name, group, known in _groups(found, state):
        value, covariance, _ = _estimates(state, group.columns)
        inner = np.ix_(known, known)
        probability = differs(value[known], covariance[inner], group.typical[known])
        if probability >= thresholds.NAMED:
            told = _told(found, state, name, group, known)
            nominal = 1.0 if name.endswith("scale") else 0.0
            pairs = {
                axis: Pair.of(q, Quantity(nominal, 0.0, q.unit))
                for axis, q in told.items()
            }
            yield Difference(name, "resized", probability, pairs)


def _groups(found: Following, state: Eliminated) -> Iterator[tuple[str, Group, Index]]:
    """Groups of the calibration, each with which of its columns are determined."""
    for name in GROUPS:
        part, _, cause = name.partition("_")
        always = found.dictionary.always
        group = next((g for g in always if g.cause == cause and g.part == part), None)
        if group is None:
            continue
        _, covariance, before = _estimates(state, group.columns)
        sigma = np.sqrt(np.diag(covariance))
        free = (sigma < DETERMINED[name]) & (
            sigma**2 < thresholds.DETERMINED * before**2
        )
        if free.any():
            yield name, group, np.flatnonzero(free)


def _told(
    found: Following, state: Eliminated, name: str, group: Group, known: Index
) -> dict[str, Quantity]:
    """Values of a group of the calibration by axis."""
    d, nominal = found.dictionary, found.fit.nominal
    bias = group.cause == "bias"
    axes = group.columns - (d.bias if bias else d.scale)
    base = nominal.bias if bias else nominal.scale
    value, covariance, _ = _estimates(state, group.columns)
    return {
        "xyz"[int(axes[i]) % 3]: Quantity(
            float(base[axes[i]] + value[i]),
            float(np.sqrt(covariance[i, i])),
            GROUPS[name],
        )
        for i in known
    }


def _turn(found: Following, state: Eliminated) -> tuple[Array, Array]:
    """The turn from the reference's axes to the device's, (3,) rad, and its sigmas."""
    rows, first = found.rows, found.dictionary.turn
    _, covariance, _ = _estimates(state, first + np.arange(3))
    turn = Rotation.from_matrix(rows.alignment.rotation)
    return turn.as_rotvec(), np.sqrt(np.diag(covariance))


def _axes(found: Following, state: Eliminated) -> Iterator[Difference]:
    """Axes that are turned against the reference's."""
    angle, sigma = _turn(found, state)
    probability = differs(angle, np.diag(sigma**2), np.full(3, TURN))
    if probability >= thresholds.NAMED and (sigma < TURN).all():
        pairs = {axis: Pair.of(q, None) for axis, q in _angles(angle, sigma).items()}
        yield Difference("misalignment", "left_out", probability, pairs)


def _angles(angle: Array, sigma: Array) -> dict[str, Quantity]:
    degrees, unsure = np.rad2deg(angle).tolist(), np.rad2deg(sigma).tolist()
    return {
        axis: Quantity(v, s, "deg")
        for axis, v, s in zip("xyz", degrees, unsure, strict=True)
    }


def _aligned(found: Following, state: Eliminated) -> Aligned:
    """Where the two stand beside each other."""
    rows = found.rows
    _, covariance, _ = _estimates(state, found.dictionary.clock + np.arange(2))
    delay, drift = np.sqrt(np.diag(covariance)).tolist()
    return Aligned(
        delay=Quantity(rows.alignment.delay, delay, "s"),
        drift=Quantity(PPM * rows.alignment.drift, PPM * drift, "ppm"),
        turn=_angles(*_turn(found, state)),
        at_s=rows.alignment.middle,
        compared_s=len(rows) * rows.step,
    )


def _facts(block: Block) -> Facts:
    """What a recording is made of."""
    grids = np.nan_to_num(grids_of(block))
    steps = [float(grids[c : c + 3].max()) or np.nan for c in (0, 3)]
    return Facts(
        rate_hz=1 / float(np.median(np.diff(block.t))),
        step_acc=steps[0],
        step_gyr=steps[1],
        start_s=float(block.t[0]),
        start_c=Thermometer.of(block).start_c,
        noise={},
    )


def _facts_of_the_device(block: Block, found: Following, state: Eliminated) -> Facts:
    """The same with the noise of its samples, and its calibration."""
    per_row, bands = found.rows.t.shape[1], found.fit.bands
    part = float(np.sqrt(0.5 / np.sum(found.rows.frequency >= bands.edges[-2])))
    noise: dict[str, Quantity] = {}
    for c, levels in found.fit.levels.items():
        level = float(np.sqrt(np.exp(levels[-1]) * per_row))
        noise[CHANNELS[c]] = Quantity(level, level * part, UNITS[c])
    calibration = {
        name: _told(found, state, name, group, known)
        for name, group, known in _groups(found, state)
    }
    return replace(_facts(block), noise=noise, calibration=calibration)


def _warnings(found: Following, names: tuple[str, str]) -> Iterator[str]:
    """What limits the comparison."""
    lost = np.flatnonzero(~found.rows.reference.observed)
    if len(lost):
        channels = ", ".join(CHANNELS[c] for c in lost)
        yield (
            f"{names[1]}: says nothing of {channels}, which are taken as constant:"
            " what moves there counts as noise"
        )
