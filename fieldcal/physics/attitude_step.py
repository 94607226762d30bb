"""An effect that turns what is felt, from an instant on."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.rotation import cross_matrix, rotation_matrices
from fieldcal.core.samples import Array
from fieldcal.physics.effect import NO_SHAPE, Separable
from fieldcal.physics.experience import Experience
from fieldcal.physics.shape import Shape, knocks
from fieldcal.physics.step import step_course


class AttitudeStep(Separable):
    """An effect that turns force and rate about some axes, from an instant on.

    Its parameters are the angles about these, in degrees. The design is linear in them;
    outputs of a state have the whole rotation, of which 0.15 mg are of second order at
    one degree.
    """

    turns_device: ClassVar[bool] = False
    """Whether it turns the device in space, so that a turn to another position begins
    from where the force then points."""

    shapes = (Shape("at_s", "s", -np.inf, np.inf, "instant"),)
    seen_in = "time"
    one_vector = True
    of_inputs = True

    @abstractmethod
    def axes(self, x: Experience) -> Array:
        """Axes of the turn in those of the device, (n, 3, k); zero where it is none."""

    def rate(self, x: Experience) -> Array:
        """Rate that is turned, rad/s, (n, 3)."""
        return x.w

    def applies(self, x: Experience) -> bool:
        """Where the angles of more than one position are known, or one was knocked."""
        known = np.unique(x.position[at_rest_in_known_position(x)])
        return len(known) > 1 or bool(knocks(x).any())

    def acts_on(self, x: Experience) -> bool:
        """In any position: on the rows after it there, and on the turn that follows."""
        return bool((x.position >= 0).any())

    def course(self, x: Experience, shape: Mapping[str, float] = NO_SHAPE) -> Array:
        """0 before the instant, 1 after it."""
        return step_course(x, shape["at_s"])

    def pattern(self, x: Experience) -> Array:
        """Change of the outputs for a degree about each axis, (n, 6, k)."""
        axes, felt = self.axes(x), (x.f, self.rate(x))
        turned = [cross_matrix(v) @ axes for v in felt]
        out: Array = np.deg2rad(1.0) * np.concatenate(turned, axis=1)
        return out

    def change_of_outputs(
        self, x: Experience, values: Array, shape: Mapping[str, float] = NO_SHAPE
    ) -> Array:
        """Change of the outputs by the whole rotation, (n, 6)."""
        back = np.swapaxes(rotation_matrices(self.axes(x) @ np.deg2rad(values)), -1, -2)
        felt = (x.f, self.rate(x))
        turned = np.hstack([(back @ v[:, :, None])[:, :, 0] - v for v in felt])
        return turned * self.course(x, shape)[:, None]


def at_rest_in_known_position(x: Experience) -> NDArray[np.bool_]:
    """Rows at rest in a known position, (n,)."""
    held: NDArray[np.bool_] = x.oriented & (x.position >= 0)
    return held
