"""gstlearn: kriging systems and inverse distances, for neighbourhoods chosen by the caller.

gstlearn's own search has no largest number of samples per drill-hole, and its time grows with the
number of samples. Here every target is moved, with the samples chosen for it, to an island of its
own. Islands lie farther apart than the search reaches, so the library's nearest samples are the
chosen ones. Covariances depend on differences alone, so nothing else changes.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np

from geounfold.errors import BackendError, InputError, MissingDependencyError
from geounfold.geometry.mesh import Floats, Ints

ISLANDS = 16
"""Targets per call: the cost per target is least at this number, and offsets stay small."""

_BANDS = 400  # lines of the turning bands; a field's variance is then right to a few per cent

_KINDS = {
    "spherical": "SPHERICAL",
    "exponential": "EXPONENTIAL",
    "gaussian": "GAUSSIAN",
    "matern": "MATERN",
}

Part = tuple[str, float, Sequence[float], float]
"""Kind, sill, three ranges and smoothness of a variogram structure. Only a Matern structure has a
smoothness s; its three lengths are those of x in x^s K_s(x), not ranges."""


def library() -> ModuleType:
    """Return gstlearn.

    Raises
    ------
    MissingDependencyError
        It is not installed.
    """
    try:
        import gstlearn
    except ImportError as error:
        raise MissingDependencyError(
            "kriging needs gstlearn: pip install 'geounfold[geostat]'"
        ) from error
    found: ModuleType = gstlearn
    return found


def model_of(nugget: float, structures: Sequence[Part], axes: Floats) -> Any:
    """Return a gstlearn Model of structures whose ranges lie along axes (rows of (3, 3))."""
    gl = library()
    angles = _angles(axes)
    return _model(gl, _space(gl), nugget, structures, None, angles)


def parts_of(model: Any) -> tuple[float, list[Part], Floats]:
    """Return the nugget, the structures and the axes (3, 3) of a gstlearn Model.

    Raises
    ------
    InputError
        The model has several variables or dimensions other than three, structures of a kind that
        geounfold does not have, or structures that are turned differently.
    """
    if model.getNVar() != 1 or model.getNDim() != 3:
        raise InputError("the gstlearn model must have one variable and three dimensions")
    nugget, turns = 0.0, []
    parts: list[Part] = []
    for number in range(model.getNCov()):
        part = model.getCovAniso(number)
        key, sill = part.getType().getKey(), float(part.getSill(0, 0))
        if key == "NUGGET":
            nugget += sill
            continue
        kind = next((k for k, name in _KINDS.items() if name == key), None)
        if kind is None:
            raise InputError(
                f"gstlearn's {key} has no counterpart; geounfold has {', '.join(_KINDS.values())}"
            )
        smoothness = float(part.getParam())
        factor = 1 / np.sqrt(12 * smoothness) if kind == "matern" else 1.0
        ranges = tuple(factor * float(r) for r in part.getRanges())
        parts.append((kind, sill, ranges, smoothness))
        if len(set(ranges)) > 1:
            turns.append(np.asarray(part.getAnisoRotMat().toTL(), dtype=np.float64).T)
    axes = turns[0] if turns else np.eye(3)
    if not all(np.allclose(turn, axes, atol=1e-9) for turn in turns):
        raise InputError("the gstlearn model's structures are turned differently")
    return nugget, parts, axes


def _angles(axes: Floats) -> list[float]:
    """Return gstlearn's angles, degrees: axes are the columns of Rz(a) Ry(b) Rx(c)."""
    R = axes.T
    b = float(np.degrees(-np.arcsin(np.clip(R[2, 0], -1, 1))))
    if np.isclose(abs(R[2, 0]), 1):  # a and c turn about one axis: all of it is a's
        return [float(np.degrees(np.arctan2(-R[0, 1], R[1, 1]))), b, 0.0]
    a, c = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(R[2, 1], R[2, 2])
    return [float(np.degrees(a)), b, float(np.degrees(c))]


def krige(
    offsets: Floats,
    values: Floats,
    counts: Ints,
    nugget: float,
    structures: Sequence[Part],
    mean: float | None,
) -> tuple[Floats, Floats]:
    """Return kriging estimates of targets from the samples chosen for each.

    Parameters
    ----------
    offsets : (m, k, 3) float
        From each target to its samples, along the axes of the ranges.
    values : (m, k) float
        The samples' values.
    counts : (m,) int
        Number of samples of each target, at least 1: the first ones of its row.
    nugget : float
        Nugget variance.
    structures : sequence of Part
        The range is the distance at which 5 % of the covariance is left; of the spherical one, at
        which none is.
    mean : float, optional
        Known mean, for simple kriging; ordinary kriging if None.

    Returns
    -------
    estimate, variance : (m,) float
        Kriging estimate and variance; NaN for a target whose system cannot be solved.

    Raises
    ------
    BackendError
        gstlearn failed.
    MissingDependencyError
        gstlearn is not installed.
    """
    gl = library()
    space = _space(gl)
    model = _model(gl, space, nugget, structures, mean)
    estimate, deviation = np.full(len(counts), np.nan), np.full(len(counts), np.nan)
    with _silence():
        for rows in _batches(len(counts)):
            far = _reach(offsets[rows], counts[rows])
            nearest = gl.NeighMoving.create(False, offsets.shape[1], far)
            source, target = _islands(gl, offsets[rows], values[rows], counts[rows], 4 * far)
            if gl.kriging(source, target, model, nearest, True, True, False):
                raise BackendError("gstlearn's kriging failed")
            estimate[rows] = target.getColumn("Kriging.v.estim")
            deviation[rows] = target.getColumn("Kriging.v.stdev")
    # An unsolvable system comes back as estimate 0 without a deviation.
    return np.where(np.isnan(deviation), np.nan, estimate), deviation**2


def inverse_distance(offsets: Floats, values: Floats, counts: Ints, power: float) -> Floats:
    """Return means (m,) of samples weighted by a power of their inverse distance.

    Parameters as in `krige`. A target at a sample's position gets that sample's value.
    """
    gl = library()
    _space(gl)
    estimate = np.full(len(counts), np.nan)
    with _silence():
        for rows in _batches(len(counts)):
            far = _reach(offsets[rows], counts[rows])
            source, target = _islands(gl, offsets[rows], values[rows], counts[rows], 4 * far)
            if gl.inverseDistance(source, target, power, True, far):
                raise BackendError("gstlearn's inverse distances failed")
            estimate[rows] = target.getColumn("InvDist.v.estim")
    return estimate


def turning_bands(
    points: Floats, structures: Sequence[Part], axes: Floats, count: int, seed: int
) -> Floats:
    """Return simulated values (n, count) of mean 0 at points (n, 3), by turning bands.

    Parameters
    ----------
    points : (n, 3) float
    structures : sequence of Part
        Without a nugget; of none the values are 0.
    axes : (3, 3) float
        Directions of the ranges, as rows.
    count : int
    seed : int
        1 or more: the library takes 0 for the state of its generator.

    Raises
    ------
    BackendError
        gstlearn failed.
    """
    if not len(structures):
        return np.zeros((len(points), count))
    gl = library()
    model = _model(gl, _space(gl), 0.0, structures, 0.0, _angles(axes))
    with _silence():
        table = _table(gl, points, None)
        if gl.simtub(None, table, model, None, count, seed, _BANDS):
            raise BackendError("gstlearn's turning bands failed")
    names = [name for name in table.getAllNames() if name.startswith("Simu")]
    return np.column_stack([table.getColumn(name) for name in names])


def _space(gl: ModuleType) -> Any:
    """Return the three-dimensional space, after making it the library's default."""
    if gl.getDefaultSpaceDimension() != 3:
        gl.defineDefaultSpace(gl.ESpaceType.RN, 3)
    return gl.SpaceRN.create(3)


def _model(
    gl: ModuleType,
    space: Any,
    nugget: float,
    structures: Sequence[Part],
    mean: float | None,
    angles: Sequence[float] = (),
) -> Any:
    parts = [_part(*structure) for structure in structures]
    if nugget > 0 or not parts:
        parts.append(("NUGGET", nugget, [1.0, 1.0, 1.0], 1.0))
    name, sill, ranges, param = parts[0]
    kind = getattr(gl.ECov, name)
    model = gl.Model.createFromParam(
        kind, 1.0, sill, param, ranges, gl.MatrixSymmetric(), list(angles), space, True
    )
    for name, sill, ranges, param in parts[1:]:
        turned = (gl.MatrixSymmetric(), list(angles)) if angles else ()
        model.addCovFromParam(getattr(gl.ECov, name), 1.0, sill, param, ranges, *turned)
    if mean is None:
        model.setDriftIRF(0)
    else:
        model.setMean(mean)
    return model


def _part(
    kind: str, sill: float, ranges: Sequence[float], smoothness: float
) -> tuple[str, float, list[float], float]:
    """Return gstlearn's name, sill, ranges and third parameter of a structure.

    gstlearn's range of a Matern structure is sqrt(12 s) of its scale (measured with 1.11.1).
    """
    if kind != "matern":
        return _KINDS[kind], sill, list(ranges), 1.0
    factor = float(np.sqrt(12 * smoothness))
    return _KINDS[kind], sill, [factor * r for r in ranges], smoothness


def _reach(offsets: Floats, counts: Ints) -> float:
    """Return a little more than the largest distance of a sample from its target."""
    used = np.arange(offsets.shape[1]) < counts[:, None]
    far = float(np.sqrt((offsets**2).sum(axis=2)[used].max(initial=0.0)))
    return 1.01 * far if far > 0 else 1.0


def _batches(n: int) -> Iterator[slice]:
    return (slice(start, min(start + ISLANDS, n)) for start in range(0, n, ISLANDS))


def _islands(
    gl: ModuleType, offsets: Floats, values: Floats, counts: Ints, apart: float
) -> tuple[Any, Any]:
    """Return tables of a batch's samples and targets, each target on its island."""
    used = np.arange(offsets.shape[1]) < counts[:, None]
    centres = np.zeros((len(counts), 3))
    centres[:, 0] = apart * np.arange(len(counts))
    samples = (offsets + centres[:, None])[used]
    return _table(gl, samples, values[used]), _table(gl, centres, None)


def _table(gl: ModuleType, points: Floats, values: Floats | None) -> Any:
    table = gl.Db.create()
    for axis in range(3):
        table.addColumns(np.ascontiguousarray(points[:, axis]), f"x{axis}", gl.ELoc.X, axis)
    if values is not None:
        table.addColumns(np.ascontiguousarray(values), "v", gl.ELoc.Z, 0)
    return table


@contextmanager
def _silence() -> Iterator[None]:
    """Keep the library's messages off stdout; its return values carry the failures."""
    sys.stdout.flush()
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)
