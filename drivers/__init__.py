"""Drivers: from the bytes of a link to samples in SI units, one link a file.

To add one, write drivers/<scheme>_imu.py with a subclass of `driver.Driver`; a wire
format is a file in ``protocols/``. A driver decodes and stamps; it corrects, averages
and guesses nothing.
"""
