"""A live run: the engine carries out a plan on a device that a mover or person turns.

All waiting for devices and people is done here, on device time. Nothing here
calculates a calibration. What the operator sees is in ``operator/``.
"""
