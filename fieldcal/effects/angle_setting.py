"""Each position's angles are a little off, at random.

    f_p = A(alpha_p + a_p, beta_p + b_p) f_base,    a_p, b_p ~ N(0, sigma^2)

No equation, but a direction: the scatter from position to position lies along
df/dalpha and df/dbeta and leaves |f| alone. It widens the intervals. Source: model of
this project; 0.02 to 0.5 deg by eye and hand.

>>> AngleSetting().unit("sigma_deg")
'deg'
"""

from __future__ import annotations

from fieldcal.physics.effect import Param, Scatter


class AngleSetting(Scatter):
    """Random error of each position's angles."""

    kind = "motion"
    params = (Param("sigma_deg", "deg", 0.5),)
    covariate = "scatter from position to position along df/dalpha and df/dbeta"
    decided_by = "the same positions taken again: what is random does not come back"
    cure = (
        "Use stops or pins instead of the eye, and tell solve how well the "
        "angles are set (--angles)."
    )
    source = "model of this project; 0.02 to 0.5 deg by eye and hand"
