"""The catalogue of effects that a simulation can leave out, one a file."""
