"""Finishes: control meshes of a fitted sheet, tried in order until the judge calls one good.

The blocks judge the mid surface (see `attempts`).  The body's hull, carried through the finished
map, judges everything: it shows what the sheet left out, and horizons that were cut off.  Few
bodies need more than the first finish.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geounfold.body.working_frame import Frame
from geounfold.errors import ControlMeshError, FlatteningError
from geounfold.geometry.mesh import Bools, TriMesh
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.methods.sheet.attempts import Trial
from geounfold.methods.sheet.meshing.build import SheetMesh
from geounfold.methods.sheet.meshing.top_and_bottom import BOLD, CLOSE, Horizons
from geounfold.methods.sheet.mid_surface.fit import FittedSheet
from geounfold.quality.trust import Signs, grade, measure_signs, score

HORIZONS = {"close": CLOSE, "bold": BOLD}
"""How far top and bottom may depart from the half thickness, in blocks, by name."""


@dataclass(frozen=True, eq=False)
class Finish:
    """One finished control mesh, and what its judge measured.

    Attributes
    ----------
    trial : Trial
        The fit of the mid surface that it stands on.
    name : str
        How top and bottom were fitted: a name in HORIZONS.
    fitted : FittedSheet
        The sheet with parallel surfaces.
    horizons : Horizons
        Top and bottom.
    mesh : SheetMesh
        The control mesh and its shell.
    signs : Signs
        What the hull shows of it.
    """

    trial: Trial
    name: str
    fitted: FittedSheet
    horizons: Horizons
    mesh: SheetMesh
    signs: Signs

    @property
    def good(self) -> bool:
        """Whether nothing speaks against its layers."""
        return grade(self.signs) == "good"

    @property
    def order(self) -> tuple[float, int, float]:
        """Key by which finishes are compared: lower is better."""
        return (self.mesh.lost, *score(self.signs))

    def row(self) -> dict[str, object]:
        """Return its figures for the summary."""
        return {
            "fit": self.trial.name,
            "horizons": self.name,
            "blocks_lost": self.mesh.lost if np.isfinite(self.mesh.lost) else None,
            "word": grade(self.signs),
            **self.signs.figures(),
        }


Build = Callable[[Trial, float], tuple[FittedSheet, Horizons, SheetMesh]]
"""``build(trial, misfit)``: the finished sheet on a fit of the mid surface."""


def finish_in_turn(
    trials: tuple[Trial, ...],
    build: Build,
    hull: tuple[TriMesh, Bools | None],
    frame: Frame,
    side: float,
) -> tuple[Finish, tuple[Finish, ...]]:
    """Return the best finish, and all that were tried.

    Parameters
    ----------
    trials : tuple of Trial
        The fits of the mid surface; the last one was taken, and is finished first.
    build : callable
        See `Build`.
    hull : (TriMesh, (m,) bool or None)
        The body's hull, working units, and which of its faces are at fault walls.
    frame : Frame
        Working frame.
    side : float
        Longest side of a block, or of a cell of merged blocks, working units.

    Raises
    ------
    ControlMeshError, FlatteningError
        No finish succeeded; the error is the first one's.

    Notes
    -----
    Another fit of the mid surface is finished only if the one before could not be.  Finishing all
    of them took up to 8 times as long and made none of 12 poor bodies good.
    """
    found: list[Finish] = []
    failed: list[Exception] = []
    for trial in reversed(trials):
        for name, misfit in HORIZONS.items():
            try:
                fitted, horizons, mesh = build(trial, misfit)
            except (ControlMeshError, FlatteningError) as error:
                failed.append(error)
                break
            over = UnfoldingMap(frame, *mesh.over_mid)
            signs = measure_signs(hull[0], over, side, walls=hull[1])
            found.append(Finish(trial, name, fitted, horizons, mesh, signs))
            if found[-1].good or not np.isfinite(mesh.lost):
                break
        if found:
            return min(found, key=lambda finish: finish.order), tuple(found)
    raise failed[0]
