"""Many sessions: trees of them in parallel, effects that they share, and whole lots.

`outcome` makes of one session what the store keeps; `workers` does that for many, and
loses none where a process dies. `reduced` is what a session says of effects that it may
share with others, `levels` weighs which of them share it. `lot` is what units differ
by, with `spread`, `control`, `odd` and `shifts`. Nothing here estimates a session: that
is done as `fieldcal solve` and `fieldcal diagnose` do it.
"""
