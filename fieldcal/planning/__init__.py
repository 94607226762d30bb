"""Steps of a procedure, and the choice of positions.

`steps` are what plans yield and the engine carries out; `planner` and `aliasing` judge
sets of positions before they are taken. Nothing here touches a device, a clock or a
screen. A procedure itself is a file in the folder ``procedures/``.
"""
