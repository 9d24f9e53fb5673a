"""What can be chosen for a cross-check of meshes."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from geounfold.errors import OptionError

MESHERS = {"tetwild": "pytetwild", "tetgen": "tetgen"}
"""Meshers by name, and the package of each; tetgen (AGPL) comes with the extra ``tetgen``."""

INTERIORS = ("harmonic", "arap")
"""How the inside of a mesh follows its boundary: harmonic over the folded shape, or as rigid as
possible."""


@dataclass(frozen=True, kw_only=True)
class CrossCheckOptions:
    """Options of a cross-check.

    Parameters
    ----------
    meshers : tuple of str or "auto"
        Names in MESHERS; ``auto``: tetwild, and tetgen where it is installed.
    interiors : tuple of str
        Names in INTERIORS.
    edge : float
        Length of edges aimed at, in blocks.
    envelope : float
        How far tetwild's border may lie from the control mesh's, in blocks.
    volume_bound : float
        Relative difference of volumes from which on there is a warning.
    border_bound : float
        Distance of borders, in blocks, likewise.
    position_bound : float
        Root mean square difference of the blocks' flat places, in blocks, likewise.
    seconds : float
        Wall time after which a mesher is stopped; its row says so.

    Raises
    ------
    OptionError
        An unknown name, or a number that is not positive.
    """

    meshers: tuple[str, ...] | str = "auto"
    interiors: tuple[str, ...] = INTERIORS
    edge: float = 3.0
    envelope: float = 0.1
    volume_bound: float = 0.01
    border_bound: float = 0.5
    position_bound: float = 0.25
    seconds: float = 600.0

    def __post_init__(self) -> None:
        if self.meshers != "auto":
            object.__setattr__(self, "meshers", _names(self.meshers, MESHERS, "mesher"))
        object.__setattr__(self, "interiors", _names(self.interiors, INTERIORS, "interior"))
        numbers = ("edge", "envelope", "volume_bound", "border_bound", "position_bound", "seconds")
        for name in numbers:
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise OptionError(f"crosscheck: {name} must be positive, but is {value}")

    def chosen(self) -> tuple[str, ...]:
        """Return the meshers to run."""
        if isinstance(self.meshers, str):
            return tuple(
                n for n, package in MESHERS.items() if n == "tetwild" or find_spec(package)
            )
        return self.meshers


def _names(given: str | tuple[str, ...], valid: object, kind: str) -> tuple[str, ...]:
    """Return names, each of them known and there at least one."""
    names = (given,) if isinstance(given, str) else tuple(given)
    known = list(valid)  # type: ignore[call-overload]
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        what = ", ".join(map(str, unknown)) or "none"
        raise OptionError(f"unknown {kind}: {what}; choose from {', '.join(known)}")
    return tuple(dict.fromkeys(names))
