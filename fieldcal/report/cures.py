"""What to do about each effect, once it is known to be there."""

from __future__ import annotations

CURES = {
    "cross_coupling": "Solve with --cross: the coefficients go into the calibration.",
    "gyro_cross_coupling": "Let solve use the turns (--turns yes), or a rate table.",
    "gyro_scale": "Let solve use the turns between the positions (--turns yes).",
    "quadratic": "Use the calibration that diagnose gives with it, and take the"
    " coefficients out of the forces.",
    "cubic": "Use the calibration that diagnose gives with it, or keep to small"
    " forces.",
    "scale_asymmetry": "Use the calibration that diagnose gives with it, and one scale"
    " factor for each sign.",
    "pendulous_products": "Use the calibration that diagnose gives with it; positions"
    " that load two axes at once sharpen it.",
    "g_sensitivity": "Take the coefficients times the measured force out of the rates.",
    "g2_sensitivity": "Take the coefficients times the squared force out of the rates.",
    "gyro_products": "Turn about one axis at a time, or calibrate on a rate table.",
    "base_tilt": "Level the base, or take positions with both joints turned and let"
    " solve estimate it (--tilt base_tilt).",
    "angle_offset": "Set the zeros of the joints anew, or let solve estimate them"
    " (--tilt angle_offset).",
    "angle_scale": "Check the protractor or the steps of the ladder against a level;"
    " use smaller angles meanwhile.",
    "angle_setting": "Use stops or pins instead of the eye, and tell solve how well"
    " the angles are set (--angles).",
    "gravity_error": "Give latitude and height of the site, or its surveyed gravity.",
    "earth_rate": 'Say grade = "navigation" and the latitude: it becomes the'
    " reference of the gyroscopes.",
    "heading_error": "Point the fixture north by two bearings instead of a compass, or"
    " tell solve how well (--heading).",
    "sway": "Put the device on firm ground, wait for the wind to drop, or average over"
    " whole periods.",
    "mounting": "Correct [frame] mounting, or the unit, by the drawing on the device.",
    "temperature_bias": "Wait until the temperature stands still, or record while it"
    " changes and apply the coefficients.",
    "temperature_scale": "Calibrate at the temperature of use, or apply the"
    " coefficients.",
    "thermal_hysteresis": "Change the temperature slowly, and calibrate in the"
    " direction in which the device is used.",
    "warm_up": "Switch the device on earlier: three times tau_s before the first"
    " window.",
    "bias_drift": "Take the first position again at the end, so that the drift can be"
    " estimated; calibrate shortly before use.",
    "bias_step": "Look for what happened at that instant (supply, range, a knock), and"
    " take the positions before it again.",
    "random_walk": "Nothing takes it out: average no longer than the Allan deviation"
    " falls, and calibrate shortly before use.",
    "settling": "Wait longer after each turn before the window begins.",
    "lever_arm": "Mount the device nearer to the axes of the turns, or turn slowly.",
    "vibration_rectification": "Switch the source of the vibration off, or put the"
    " device on a damper.",
    "hum": "Find the source by its frequency, and keep cables and engines away.",
    "bump": "Take the window again; nothing else is lost.",
    "time_delay": "Correct the times in the driver by the delay that was found.",
    "quantisation": "Choose a smaller range, or an output with more digits.",
    "saturation": "Choose a larger range, or positions that load the axis less.",
    "stuck": "Restart the device; if it comes back, the sensor is defective.",
    "dropped": "Lower the rate or raise the baud rate; look at cable and connectors.",
    "clock_skew": "Use the host's times over long stretches, or correct the rate by"
    " the ppm that were found.",
    "decode_fault": "Correct byte order, width or sign in the decoder.",
    "noise_level": "Compare with the data sheet; a single axis that is noisier points"
    " to a defect or to vibration along it.",
}
"""By the id of the effect."""
