"""Installs a calibration on an autopilot; the old parameters can be restored.

`proposal` composes it with what is installed; `transaction` writes it with a copy of
the old set on disk first. Only here are parameters of a device changed.
"""
