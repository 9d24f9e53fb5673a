"""Options of a cross-check of meshes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.util import find_spec

from geounfold.errors import check_number, check_words

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
        Meshers, by their names in MESHERS; ``auto`` is tetwild, and tetgen if it is installed.
    interiors : tuple of str
        How the inside of a mesh is laid flat, by names in INTERIORS.
    edge : float
        Edge length that the meshers aim at, in blocks.
    envelope : float
        Largest distance of tetwild's border from the control mesh's, in blocks.
    volume_bound : float
        Relative difference of volumes above which there is a warning.
    border_bound : float
        Distance between borders, in blocks, above which there is a warning.
    position_bound : float
        Root mean square difference of the blocks' flat places, in blocks, above which there is a
        warning.
    seconds : float
        Wall time after which a mesher is stopped, with a note in its row.

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
            object.__setattr__(self, "meshers", _names("meshers", self.meshers, MESHERS))
        object.__setattr__(self, "interiors", _names("interiors", self.interiors, INTERIORS))
        numbers = ("edge", "envelope", "volume_bound", "border_bound", "position_bound", "seconds")
        for name in numbers:
            check_number(name, getattr(self, name), 0, low_open=True)

    def chosen(self) -> tuple[str, ...]:
        """Return the meshers to run."""
        if isinstance(self.meshers, str):
            return tuple(
                n for n, package in MESHERS.items() if n == "tetwild" or find_spec(package)
            )
        return self.meshers


def _names(option: str, given: str | tuple[str, ...], valid: Iterable[str]) -> tuple[str, ...]:
    """Return names, each of them valid and once; a text is one name."""
    names = (given,) if isinstance(given, str) else given
    check_words(option, names, valid)
    return tuple(dict.fromkeys(names))
