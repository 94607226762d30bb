"""What could have made the rows: causes, their groups and their columns.

A session's dictionary holds the columns of everything that it may show: the effects of
the catalogue, random walks and loosely set angles, smooth functions without physics. No
effect is known by name; a new kind of cause is a module that yields `cause.Cause`.
"""
