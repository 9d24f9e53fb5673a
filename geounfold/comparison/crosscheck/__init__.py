"""Cross-check of the control mesh against other meshes of the same border.

The control mesh is made of prisms, which fix the map of its inside.  Here other meshers fill its
folded border.  Our map flattens the border; the inside follows by a rule that does not use the
prisms.  Volumes, borders, elements and the blocks' unfolded positions are compared.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from geounfold.backends.blas import one_thread
from geounfold.comparison.crosscheck._meshes import border, figures, fill, without_unused
from geounfold.comparison.crosscheck._options import INTERIORS, MESHERS, CrossCheckOptions
from geounfold.comparison.crosscheck._places import Carrier, Follower
from geounfold.comparison.crosscheck._result import PRISM, CrossCheck, MeshFigures, PlaceFigures
from geounfold.errors import BackendError, GeounfoldError, OptionError
from geounfold.geometry.measures import enclosed_volume, tet_volumes
from geounfold.geometry.mesh import Floats, TetMesh, TriMesh
from geounfold.methods import PointwiseMap, no_mesh

if TYPE_CHECKING:
    from geounfold.unfolding.result import Unfolding

__all__ = [
    "INTERIORS",
    "MESHERS",
    "PRISM",
    "CrossCheck",
    "CrossCheckOptions",
    "MeshFigures",
    "PlaceFigures",
    "crosscheck",
]

Progress = Callable[[str], None]


@one_thread()
def crosscheck(
    unfolding: Unfolding,
    options: CrossCheckOptions | None = None,
    *,
    progress: Progress | None = None,
    **changes: Any,
) -> CrossCheck:
    """Check an unfolding's control mesh against other meshes of its border.

    Each mesher fills the folded border of the control mesh (without its shell).  Our map gives the
    unfolded positions of the border's vertices, the inside follows harmonically or as rigidly as
    possible, and the blocks are carried by barycentric coordinates.  The control mesh is put
    through the same rules, which separates the effect of the rule from that of the mesh.

    Parameters
    ----------
    unfolding : Unfolding
        The result of ``unfold``.
    options : CrossCheckOptions, optional
        Defaults if not given.
    progress : callable, optional
        Called with the name of each stage when it starts.
    **changes
        Fields of CrossCheckOptions, by name.

    Returns
    -------
    CrossCheck
        If a mesher fails, crashes or is not installed, its row gives the reason.  TetGen's mesh is
        the same in every run, bit for bit; fTetWild's is not, since its random numbers cannot be
        seeded.

    Raises
    ------
    OptionError
        An option outside its valid values, or a method without a control mesh.

    Examples
    --------
    >>> import geounfold as gu
    >>> u = gu.unfold(gu.simulate("slab", blocks=1000).folded)
    >>> check = gu.crosscheck(u, meshers="tetwild", interiors="harmonic")
    >>> [mesh.mesh for mesh in check.meshes], check.warnings
    (['prism', 'tetwild'], [])
    """
    chosen = replace(options or CrossCheckOptions(), **changes)
    run = _Run(unfolding, chosen, progress or (lambda _: None))
    run.mesh(PRISM)
    for name in chosen.chosen():
        run.mesh(name)
    hulls = [(f.hull.mesh, f.hull.blocks_volume) for f in unfolding.fits if f.hull is not None]
    cube = unfolding.frame.scale**3
    whole = len(hulls) == len(unfolding.fits)
    volume = sum(enclosed_volume(mesh.V, mesh.F) for mesh, _ in hulls) * cube
    return CrossCheck(
        options=chosen,
        block=unfolding.frame.scale,
        volume=enclosed_volume(run.surface.V, run.surface.F) * cube,
        hull_volume=volume if whole else np.nan,
        blocks_volume=sum(blocks for _, blocks in hulls) * cube if whole else np.nan,
        meshes=tuple(run.meshes),
        places=tuple(run.places),
        differences=run.differences,
        points=run.points,
        grids=run.grids,
    )


class _Run:
    """A cross-check in progress."""

    def __init__(
        self, unfolding: Unfolding, options: CrossCheckOptions, progress: Progress
    ) -> None:
        self._options, self._progress = options, progress
        self._frame = unfolding.frame
        if isinstance(unfolding.map, PointwiseMap):
            raise OptionError(no_mesh(unfolding.options.method, "there is none to cross-check"))
        self._control = unfolding.map.control
        self.surface: TriMesh = border(self._control.folded)
        self._rows = np.flatnonzero(unfolding.carried.inside)
        self._count = len(unfolding.folded)
        self._points = self._frame.to_work(unfolding.folded[self._rows])
        self._world = unfolding.folded[self._rows]
        self._ours = unfolding.points[self._rows] / self._frame.scale
        self._same: dict[str, Floats] = {}
        self.meshes: list[MeshFigures] = []
        self.places: list[PlaceFigures] = []
        self.differences: dict[str, Floats] = {}
        self.points: dict[str, Floats] = {}
        self.grids: dict[str, TetMesh] = {}

    def mesh(self, name: str) -> None:
        """Make a mesh and compare it; a failure becomes a row with its reason."""
        self._progress(f"{name} mesh")
        try:
            mesh, seconds = (
                (self._control.folded, 0.0)
                if name == PRISM
                else fill(name, self.surface, self._options)
            )
            mesh = without_unused(mesh)
            found = figures(name, mesh, self.surface, self._frame.scale, seconds)
        except GeounfoldError as error:
            self.meshes.append(MeshFigures(name, error=f"{error}"))
            return
        self.meshes.append(found)
        self.grids[name] = mesh.with_vertices(self._frame.to_world(mesh.V))
        follower, carrier = Follower(mesh, self._control), Carrier(mesh, self._points)
        for interior in self._options.interiors:
            self._progress(f"{name} mesh, {interior}")
            self.places.append(self._placed(name, interior, follower, carrier))

    def _placed(
        self, name: str, interior: str, follower: Follower, carrier: Carrier
    ) -> PlaceFigures:
        """Return how far this mesh's positions of the blocks are from the map's."""
        started = time.perf_counter()
        try:
            if not carrier.found.any():
                raise BackendError("the mesh holds no block")
            image, steps = follower.unfolded(interior)
        except GeounfoldError as error:
            return PlaceFigures(name, interior, error=f"{error}")
        there = carrier.carry(image)
        seconds = time.perf_counter() - started
        apart = there - self._ours
        distance = np.linalg.norm(apart, axis=1)
        key = f"{name}_{interior}"
        self.differences[key] = self._spread(distance)
        self.points[key] = self._spread(there * self._frame.scale)
        if name == PRISM:
            self._same[interior] = there
        known = np.flatnonzero(carrier.found)
        worst = known[np.argmax(distance[known])]
        same = self._same.get(interior)
        return PlaceFigures(
            mesh=name,
            interior=interior,
            blocks=len(known),
            outside=len(carrier.found) - len(known),
            rms=_rms(distance[known]),
            p95=float(np.percentile(distance[known], 95)),
            max=float(distance[worst]),
            along_layers=_rms(np.linalg.norm(apart[known, :2], axis=1)),
            across_layers=_rms(apart[known, 2]),
            worst=tuple(self._world[worst].tolist()),
            rms_same_interior=(
                np.nan if same is None else _rms(np.linalg.norm((there - same)[known], axis=1))
            ),
            inverted=int(np.count_nonzero(tet_volumes(image.V, image.T) <= 0)),
            steps=steps,
            seconds=seconds,
        )

    def _spread(self, values: Floats) -> Floats:
        """Return the values of the points compared as a column over all points, NaN elsewhere."""
        out = np.full((self._count, *values.shape[1:]), np.nan)
        out[self._rows] = values
        return out


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
