"""From samples to rows: block means of the windows, with their noise.

Everything here reads samples and knows no cause and no parameter: noise, lines that
shake a window, the temperature, the instant at which the device came to rest. A measure
that is taken of samples before anything is fitted belongs here.
"""
