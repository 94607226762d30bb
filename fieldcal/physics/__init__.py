"""Base classes of effects, and what they are functions of.

`effect` holds the base classes, `shape` the parameters that outputs are not linear in,
`experience` what the sensors experience, `recording` what checks of the signal chain
look at. The effects themselves are in ``effects/``, one a file.
"""
