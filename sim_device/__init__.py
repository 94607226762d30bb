"""A device that is not ours: its own physics, sample by sample, from motion."""

from fieldcal.sim_device.device import VirtualDevice
from fieldcal.sim_device.profile import Profile

__all__ = ["Profile", "VirtualDevice"]
