"""Operators: they move the device, show the state of the run and return wishes.

`protocol` defines the interface; `terminal` and `script` implement it. To add an
operator, write a class with the same methods in a module here.
"""
