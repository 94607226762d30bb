"""A device that is not ours: its own physics, sample by sample, from motion.

Its physics is written apart from everything that estimates, so that a sign error on one
side shows. An effect is a file of `effects`; a wire format is wire_<name>.py.
"""

from fieldcal.sim_device.device import VirtualDevice
from fieldcal.sim_device.profile import Profile

__all__ = ["Profile", "VirtualDevice"]
