"""Every error geounfold raises on purpose.

The command line prints the message as one line and leaves with ``exit_status``:
2 where the user's input or options are at fault, 1 for anything else.
"""

from __future__ import annotations


class GeounfoldError(Exception):
    """Base of all errors raised by geounfold; the message is one clear sentence."""

    exit_status = 1


class InputError(GeounfoldError):
    """The points, tables or files given cannot be used: what, where, what to do."""

    exit_status = 2


class OptionError(InputError):
    """An option has a value outside its valid ones, which the message lists."""


class OutputError(InputError):
    """An output cannot be written, or exists already and may not be replaced."""


class NoSheetError(InputError):
    """The body has no two opposite surfaces (a ball, a cube), so nothing to flatten."""


class MeshError(GeounfoldError):
    """A mesh is malformed: an index out of range, a wrong shape, a wrong topology."""


class HullError(GeounfoldError):
    """No closed hull could be made by the chosen method; the message names another."""


class SplitError(GeounfoldError):
    """The hull could not be split into a top and a bottom."""


class FlatteningError(GeounfoldError):
    """A surface could not be flattened, or the flattener returned an invalid answer."""


class ControlMeshError(GeounfoldError):
    """The control mesh is inverted or does not hold the blocks."""


class BackendError(GeounfoldError):
    """A library that geounfold calls failed."""


class MissingDependencyError(GeounfoldError):
    """An optional library, or a system library that a wheel needs, is absent."""
