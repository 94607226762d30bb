"""What the engine shows to whoever moves the device, and what it asks of them.

`protocol` says what an operator is; the terminal and the script are two. To add one,
write a class with its methods in a module here.
"""
