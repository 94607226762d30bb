"""The evidence of a set of causes: exact, from one Gram matrix.

`gram` eliminates columns and gives ln Z, `sizing` finds the likeliest sizes of a set,
and `sets` keeps the sets that were evaluated. Which sets are tried is not decided here.
"""
