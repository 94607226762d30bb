"""A device that is not ours: its own physics, sample by sample, from motion."""
