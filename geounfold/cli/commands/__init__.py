"""One module for each command, with a function `run`: check, read, compute, write together.

`run` gets the parsed arguments and the `Console`. It checks paths and options before it reads
points, and errors that the user can mend before it computes.
"""
