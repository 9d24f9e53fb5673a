"""Tetrahedra laid flat all at once, with the least strain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.backends.igl import upright
from geounfold.backends.slim_scaf import SlimTets
from geounfold.errors import BackendError, FlatteningError, check_number, check_whole
from geounfold.geometry.mesh import Floats, TetMesh, TriMesh
from geounfold.mapping.control_mesh import ControlMesh, Datum
from geounfold.methods.contract import BodyFit, PreparedBody, SurfacePair
from geounfold.methods.ufo import AnchoredSheet, anchor


@dataclass(frozen=True, kw_only=True)
class VolumetricOptions:
    """Options of ``volumetric``.

    Parameters
    ----------
    max_iter : int
        Largest number of steps; one takes about 60 microseconds per tetrahedron.
    tol : float
        Displacement, in blocks: iteration stops if a step moves no vertex farther.
    weight : float
        Weight of the mean square distance (blocks) of top and bottom from their planes.

    Raises
    ------
    OptionError
        A value out of its range.
    """

    max_iter: int = 6
    tol: float = 1e-3
    weight: float = 100.0

    def __post_init__(self) -> None:
        check_whole("volumetric_options.max_iter", self.max_iter, 1)
        check_number("volumetric_options.tol", self.tol, 0, low_open=True)
        check_number("volumetric_options.weight", self.weight, 0, low_open=True)


def fit_volumetric(body: PreparedBody) -> BodyFit:
    """Return the map of least volumetric strain between flat top and bottom.

    The prisms over the mid surface start from ``ufo`` and its map.  They deform so that the
    symmetric Dirichlet energy, summed over their tetrahedra by folded volume, is least: libigl's
    SLIM (Rabinovich et al. 2017), which inverts no tetrahedron.  A penalty draws the mesh's top and
    bottom to the planes at their mean heights; along these planes they are free.

    The energy weighs every strain alike, so shear is kept small: a layer is bent back like a beam,
    whereas flexural slip shears it.

    Raises
    ------
    SplitError, FlatteningError
        The mid surface could not be fitted or flattened, the start has inverted tetrahedra, or
        libigl fails.
    """
    chosen: VolumetricOptions = body.options
    anchored = anchor(body)
    with body.stage("volumetric"):
        start = anchored.control(Datum("mid", 0.0, 0.0))
        flat, steps, moved = _relaxed(start, anchored, chosen)
        unfolded = start.unfolded.with_vertices(flat)
        control = ControlMesh(anchored.folded, unfolded, start.stratigraphic)
        surfaces = _surfaces(anchored, flat.reshape(*anchored.height.shape, 3))
    notes: dict[str, object] = {
        "iterations": steps,
        "moved_last": moved,
        "converged": moved <= chosen.tol,
        "energy": [_energy(anchored.folded, V) for V in (start.unfolded.V, flat)],
    }
    warnings: tuple[str, ...] = ()
    if moved > chosen.tol:
        warnings = (
            f"volumetric stopped after {steps} steps with vertices still moving by {moved:.3g} "
            "blocks",
        )
    mesh = anchored.sheet.mesh
    flattenings = {"mid": mesh.flattenings["mid"]}
    return BodyFit(
        body.hull,
        body.split,
        control,
        None,
        surfaces,
        flattenings,
        anchored.sheet,
        notes,
        warnings=warnings,
    )


def _relaxed(
    start: ControlMesh, anchored: AnchoredSheet, options: VolumetricOptions
) -> tuple[Floats, int, float]:
    """Return the flat vertices (v, 3), the steps taken, and how far the last one moved any."""
    T, V = start.folded.T, start.unfolded.V
    bad = int(np.count_nonzero(~upright(V, T)))
    if bad:
        raise FlatteningError(
            f"volumetric: {bad} tetrahedra are inverted where the reference surface was laid "
            "flat; try another --flattener"
        )
    layers, n = anchored.height.shape
    held = np.concatenate([np.arange(n), np.arange(n) + (layers - 1) * n])
    planes = np.repeat([anchored.height[0].mean(), anchored.height[-1].mean()], n)
    step, moved, count = SlimTets(start.folded.V, T), np.inf, 0
    while count < options.max_iter and moved > options.tol:
        wanted = np.column_stack([V[held, :2], planes])
        try:
            after = step(V, held, wanted, options.weight)
        except BackendError as error:
            raise FlatteningError(f"volumetric: {error}; use another --method") from error
        moved, V, count = float(np.linalg.norm(after - V, axis=1).max()), after, count + 1
    return V, count, moved


def _energy(folded: TetMesh, V: Floats) -> float:
    """Return the symmetric Dirichlet energy, its mean over the folded volume; 6 without strain."""
    before, after = (W[folded.T[:, 1:]] - W[folded.T[:, :1]] for W in (folded.V, V))
    stretch = np.linalg.svd(np.linalg.solve(before, after), compute_uv=False)
    return float(np.average((stretch**2 + stretch**-2).sum(axis=1), weights=np.linalg.det(before)))


def _surfaces(anchored: AnchoredSheet, flat: Floats) -> dict[str, SurfacePair]:
    """Return mid, top and bottom in both spaces; ``flat`` (layers, n, 3) along the normals."""
    heights = {"mid": np.zeros_like(anchored.low), "top": anchored.high, "bottom": anchored.low}
    mesh, out = anchored.sheet.mesh, {}
    for name, height in heights.items():
        pair: TriMesh = anchored.mid.with_vertices(_along(anchored.height, flat, height))
        how = mesh.flattenings["mid"] if name == "mid" else None
        out[name] = SurfacePair(mesh.surfaces[name][0], pair, how)
    return out


def _along(heights: Floats, flat: Floats, at: Floats) -> Floats:
    """Return places (n, 3) at heights (n,) between the layers at ``heights`` (layers, n)."""
    n = np.arange(len(at))
    low = np.clip((heights <= at).sum(axis=0) - 1, 0, len(heights) - 2)
    below, above = heights[low, n], heights[low + 1, n]
    share = ((at - below) / (above - below))[:, None]
    return np.asarray(flat[low, n] + share * (flat[low + 1, n] - flat[low, n]))
