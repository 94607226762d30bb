"""What everything speaks: samples, frames, gravity, positions and errors.

Everything above may import it; it imports nothing of fieldcal, does no I/O and knows no
clock. Values are SI, angles in rad. What only one room needs stays in that room.
"""
