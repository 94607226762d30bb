"""Where a search begins beside the nominal state."""

from __future__ import annotations

import numpy as np
import pytest
from small_sessions import Session, ladder

from fieldcal.effects import catalogue
from fieldcal.model.search.starting_sets import sets_with_large_turns, visible_angle
from fieldcal.physics.effect import Sensor


@pytest.mark.parametrize("name", ["base_step", "mount_slip"])
def test_a_turn_whose_square_shows_is_tried_about_its_own_state(name: str) -> None:
    effect = catalogue()[name]
    assert isinstance(effect, Sensor)
    session = Session.of(ladder(), (name, "bias_step:acc"))
    (cause, _), x = session.dictionary.causes, session.dictionary.x
    at = {"at_s": float(np.median(x.t))}
    for times in (8.0, 0.1):
        size = times * np.rad2deg(
            visible_angle(session.search(0 * x.f[:, [0] * 6]).sets.gram)
        )
        values = np.r_[size, np.zeros(len(effect.params) - 1)]
        search = session.search(effect.change_of_outputs(x, values, at))
        found = list(sets_with_large_turns(search))
        if times < 1:
            assert not found
            continue
        (turned,) = found
        assert [m[0].key for m in turned.members] == [cause.key]
