"""A window that was cut counts as far as the device was held on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from session_folders import CALM, FACES, places, recorded, write_session

from fieldcal.cli import main
from fieldcal.core.samples import Block
from fieldcal.evaluation.undisturbed_span import undisturbed_span
from fieldcal.sim_device.vocabulary import checked_effect
from fieldcal.windows import Average

T = np.arange(0.0, 30.0, 0.01)
FORCE = np.array([0.0, -9.8, 0.0])


def felt(turned: float, before: float, after: float) -> Block:
    """A device that lies at 30 s in all, but for some degrees outside two instants."""
    away = (before > T) | (after < T)
    angle = np.deg2rad(turned) * away
    acc = 9.8 * np.column_stack([np.sin(angle), -np.cos(angle), 0 * T])
    return Block.of(T, acc, np.zeros((len(T), 3)))


@pytest.mark.parametrize(
    ("turned", "calm", "counts"),
    [
        (0.5, (3.0, 20.0), (0.0, 30.0)),  # knocked twice, and held on
        (0.5, (1.5, 28.5), (1.5, 28.5)),  # of what is left nothing can be said
        (10.0, (3.0, 20.0), (3.0, 20.0)),  # not there yet, and gone before the end
    ],
)
def test_a_window_goes_on_where_the_force_stays(
    turned: float, calm: tuple[float, float], counts: tuple[float, float]
) -> None:
    block = felt(turned, *calm)
    mean = np.r_[FORCE, np.zeros(3)]
    one = Average(mean, np.eye(6), 20.0, 100, *calm)
    assert undisturbed_span(block, (0.0, 30.0), one) == counts
    assert undisturbed_span(block, None, one) == calm
    blind = replace(one, mean=np.r_[np.full(3, np.nan), np.zeros(3)])
    assert undisturbed_span(block, (0.0, 30.0), blind) == calm, "without accelerometers"


@pytest.mark.thorough
def test_a_knock_amid_the_first_window_is_seen_by_both_parts_of_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One part alone is a position that is off, whose bias nothing else contradicts."""
    knock = checked_effect(
        "base_step", {"about_x_deg": 0.0, "about_z_deg": 0.05, "at_s": 17.0}
    )
    profile = replace(CALM, effects=(*CALM.effects, knock))
    held = places(FACES)
    assert held[0]["start_s"] < 17.0 < held[0]["end_s"] - 2
    write_session(tmp_path / "s", recorded(profile, held, 7), held)
    main(["solve", str(tmp_path / "s"), "--json", "--angles", "0.002"])
    said = json.loads(capsys.readouterr().out)
    assert any("its mean is that of the calm part" in w for w in said["warnings"])
    assert said["carried"]["causes"]["base_step"] > 0.9
    for name in ("acc_bias", "acc_scale", "gyr_bias"):
        found = said["parameters"][name]
        off = np.array(found["value"]) - getattr(profile.truth, name)
        assert (np.abs(off) < 2.5 * np.array(found["sigma"])).all(), name
