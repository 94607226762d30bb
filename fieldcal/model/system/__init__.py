"""The linearised system of a session: windows, turns and the way between them.

Rows of each kind are whitened and differentiated by the columns of the dictionary, and
summed to one Gram matrix; `fitted` shows a set's residuals in them. A new kind of row
is one module here, which adds to the same matrix.
"""
