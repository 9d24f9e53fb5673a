"""The result of the sheet method for one body."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.methods.sheet.attempts import Trial
from geounfold.methods.sheet.meshing.build import SheetMesh
from geounfold.methods.sheet.meshing.top_and_bottom import Horizons
from geounfold.methods.sheet.mid_surface.fit import FittedSheet
from geounfold.methods.sheet.mid_surface.medial_points import MedialSheet


@dataclass(frozen=True, eq=False)
class SheetResult:
    """Every stage of the sheet method, in working units.

    Attributes
    ----------
    medial : MedialSheet
        First guess of the mid surface.
    fitted : FittedSheet
        The mid surface and the half thickness.
    horizons : Horizons
        Top and bottom as heights over the mid surface.
    mesh : SheetMesh
        The control mesh and its shell.
    trials : tuple of Trial
        Every attempt to fit the mid surface; the last one was taken.
    """

    medial: MedialSheet
    fitted: FittedSheet
    horizons: Horizons
    mesh: SheetMesh
    trials: tuple[Trial, ...]

    @property
    def sharpened(self) -> str:
        """What sharpened the sheet: lattice ``sites``, ``layers``, or nothing (empty)."""
        return self.trials[-1].sharpened
