"""What an effect is, and what it is a function of.

`effect` holds the base classes, `shape` the parameters that outputs are not linear in,
`experience` what the sensors experience, `recording` what checks of the signal chain
look at. The effects themselves are in ``effects/``, one a file.
"""
