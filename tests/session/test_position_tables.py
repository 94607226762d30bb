"""Tables of positions: what is written is the position that is read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.core.positions import Position
from fieldcal.session.description_file import parse_description, with_added_positions
from fieldcal.session.position_tables import parse_positions, position_table
from fieldcal.session.schemas import schema_fault, validator

degrees = st.floats(-180, 180).map(lambda angle: round(angle, 6))
rates = st.tuples(*[st.floats(-400, 400).map(lambda rate: round(rate, 6))] * 3)
names = st.text("abc αβ°,=-12", min_size=1, max_size=20).filter(
    lambda n: n.strip() == n
)


@st.composite
def positions(draw: st.DrawFn) -> Position:
    """Positions of all kinds that a session can state."""
    name = draw(names)
    kind = draw(
        st.sampled_from(["free", "spun", "angles", "three", "measured", "rate"])
    )
    if kind in ("free", "spun"):
        speed, sigma = draw(st.floats(1, 300)), draw(st.floats(0, 1))
        spun = np.deg2rad([round(speed, 6), round(sigma, 6)]) * (kind == "spun")
        return Position(name, speed=float(spun[0]), speed_sigma=float(spun[1]))
    gamma = draw(degrees) if kind in ("three", "measured") else 0.0
    position = Position.deg(draw(degrees), draw(degrees), name, gamma=gamma)
    if kind == "measured":
        return replace(
            position, sigma=float(np.deg2rad(round(draw(st.floats(0.01, 9)), 6)))
        )
    if kind == "rate":
        x, y, z = np.deg2rad(draw(rates)).tolist()
        return replace(position, rate=(x, y, z))
    return position


def numbers(position: Position) -> list[float]:
    """All its numbers; nan where it has none."""
    values = (position.alpha, position.beta, position.gamma, position.sigma)
    moving = (*(position.rate or [np.nan] * 3), position.speed, position.speed_sigma)
    return [np.nan if v is None else v for v in (*values, *moving)]


@given(st.lists(positions(), min_size=1, max_size=4))
def test_what_is_written_is_read(taken: list[Position]) -> None:
    tables = [position_table(one) for one in taken]
    assert schema_fault({"position": tables}, validator("session")) == ""
    read, windows = parse_positions(tables)
    assert [p.name for p in read] == [p.name for p in taken]
    assert windows == (None,) * len(taken)
    for one, again in zip(taken, read, strict=True):
        np.testing.assert_allclose(numbers(again), numbers(one), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize(
    "position", [Position("a face"), Position.deg(10.0, 20.0, gamma=30.0)]
)
def test_an_added_position_keeps_what_is_known_of_it(position: Position) -> None:
    """A face without angles is not home, and a third angle is not lost."""
    about = with_added_positions(parse_description({}), [position])
    (added,) = about.positions
    assert added.oriented == position.oriented
    assert added.all_degrees == position.all_degrees


@pytest.mark.parametrize("key", ["alpha_deg", "beta_deg", "gamma_deg"])
def test_an_angle_beyond_two_turns_is_in_another_unit(key: str) -> None:
    plain = {"alpha_deg": -720.0, "beta_deg": 720.0, "gamma_deg": 0.0}
    assert parse_positions([plain])[0][0].oriented
    with pytest.raises(InputError) as refused:
        parse_positions([plain, plain | {key: -785.398}])
    said = str(refused.value)
    assert f"number 2 {key} = -785.398 is more than two turns" in said
    assert "-45° if it is in mrad" in said and "-706.9° if it is in gon" in said
