"""A calibration goes onto an autopilot, and can always be taken back.

`proposal` composes it with what is installed; `transaction` writes it with a copy of
the old set on disk first. Only here are parameters of a device changed.
"""
