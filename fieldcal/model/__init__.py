"""One linear-Gaussian model of all rows of a session, and what follows from it.

    y = h(state) + sum_k Phi_k(psi_k) u_k + e,    u_k ~ N(0, v_k^2 T_k^2),   e ~ N(0, R)

A *cause* is something that could have made the rows as they are: an effect of the
catalogue, what a device has anyway (bias, scale factor, instability), or a smooth
function that no physics is known for. Each of its *groups* is columns Phi_k at one
value of the shape psi_k, with typical sizes T_k and one free size v_k. What decides
between causes is the evidence of the rows, exact for every group (`evidence`), and the
chance that a session has a cause at all (`priors`). No effect is known by name here: to
add one, write its file in `effects/`.

From below: `rows` and `turns` reduce samples, `causes` have columns, `evidence` weighs
a set of causes, `system` linearises a session, `search` finds the best set, and
`posterior` states probabilities and numbers. `priors`, `thresholds` and `state` serve
all of them.
"""
