"""What a recording in motion has beside what a simulator says of the same motion.

Where the simulator follows the motion of the recording, its specific force and rate are
the reference at every moment: what is found is what the device has beyond it. Of what
the simulator has itself that is the difference, with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

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
from fieldcal.model import thresholds
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
    rows = found.set.state
    state = Eliminated.of(rows.rows, rows.columns, wide)
    differences = tuple(
        sorted(
            [*_effects(found, standing, state), *_calibration(found, state),
             *_axes(found, state)],
            key=lambda d: -d.probability,
        )
    )  # fmt: skip
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
        _facts(block, found),
        _facts(sim, None),
        tuple(_warnings(found, names)),
        f"{says} {aligned_as(where)}",
        where,
    )


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
    d, nominal = found.dictionary, found.fit.nominal
    for name, unit in GROUPS.items():
        part, _, cause = name.partition("_")
        group = next((g for g in d.always if g.cause == cause and g.part == part), None)
        if group is None:
            continue
        axes = group.columns - (d.bias if cause == "bias" else d.scale)
        base = nominal.bias if cause == "bias" else nominal.scale
        value, covariance, before = _estimates(state, group.columns)
        sigma = np.sqrt(np.diag(covariance))
        known = np.flatnonzero(
            (sigma < DETERMINED[name]) & (sigma**2 < thresholds.DETERMINED * before**2)
        )
        if not len(known):
            continue
        probability = differs(
            value[known], covariance[np.ix_(known, known)], group.typical[known]
        )
        if probability < thresholds.NAMED:
            continue
        pairs = {
            "xyz"[int(axes[i]) % 3]: Pair.of(
                Quantity(float(base[axes[i]] + value[i]), float(sigma[i]), unit),
                Quantity(float(base[axes[i]]), 0.0, unit),
            )
            for i in known
        }
        yield Difference(name, "resized", probability, pairs)


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


def _facts(block: Block, found: Following | None) -> Facts:
    """What a recording is made of; of the device the noise of its samples as well."""
    steps = [
        float(np.nan_to_num(grids_of(block)[c : c + 3]).max()) or np.nan for c in (0, 3)
    ]
    noise: dict[str, Quantity] = {}
    if found is not None:
        per_row = found.rows.t.shape[1]
        for c, levels in found.fit.levels.items():
            level = float(np.sqrt(np.exp(levels[-1]) * per_row))
            count = np.sum(found.rows.frequency >= found.fit.bands.edges[-2])
            noise[CHANNELS[c]] = Quantity(
                level, level * float(np.sqrt(0.5 / count)), UNITS[c]
            )
    return Facts(
        rate_hz=1 / float(np.median(np.diff(block.t))),
        step_acc=steps[0],
        step_gyr=steps[1],
        start_s=float(block.t[0]),
        start_c=Thermometer.of(block).start_c,
        noise=noise,
    )


def _warnings(found: Following, names: tuple[str, str]) -> Iterator[str]:
    """What limits the comparison."""
    lost = np.flatnonzero(~found.rows.reference.observed)
    if len(lost):
        channels = ", ".join(CHANNELS[c] for c in lost)
        yield (
            f"{names[1]}: says nothing of {channels}, which are taken as constant:"
            " what moves there counts as noise"
        )
