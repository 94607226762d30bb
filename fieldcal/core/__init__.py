"""Samples, frames, gravity, positions and errors, which all other packages use.

Every other package may import it. It imports no other package of fieldcal, does no I/O
and reads no clock. Values are SI, angles in rad. What only one package needs stays in
that package.
"""
