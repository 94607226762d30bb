"""Samples, frames, gravity, positions and errors, which all other rooms use.

Everything above may import it; it imports nothing of fieldcal, does no I/O and knows no
clock. Values are SI, angles in rad. What only one room needs stays in that room.
"""
