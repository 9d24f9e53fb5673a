"""The result of the sheet method for one body."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.methods.sheet.attempts import Trial
from geounfold.methods.sheet.finishes import Finish
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
    trials : tuple of Trial
        Every attempt to fit the mid surface; the blocks contradict the last one least.
    finish : Finish
        The finished control mesh that was taken.
    finishes : tuple of Finish
        All that were tried, in order.
    """

    medial: MedialSheet
    trials: tuple[Trial, ...]
    finish: Finish
    finishes: tuple[Finish, ...]

    @property
    def fitted(self) -> FittedSheet:
        """The mid surface and the half thickness."""
        return self.finish.fitted

    @property
    def horizons(self) -> Horizons:
        """Top and bottom as heights over the mid surface."""
        return self.finish.horizons

    @property
    def mesh(self) -> SheetMesh:
        """The control mesh and its shell."""
        return self.finish.mesh

    @property
    def sharpened(self) -> str:
        """What sharpened the sheet: lattice ``sites``, ``layers``, or nothing (empty)."""
        return self.finish.trial.sharpened
