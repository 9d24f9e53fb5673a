"""GSTools' covariance models (an optional library), in and out of plain parts.

A part is a kind, a sill and three ranges. GSTools' correlation of a distance h is that of
``rescale * h / len_scale``: exponential ``exp(-x)``, gaussian ``exp(-x^2)``, spherical 0 from 1 on.
The ranges here leave 5 % of the covariance, of the spherical model none.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np

from geounfold.errors import InputError, MissingDependencyError, OptionError
from geounfold.geometry.mesh import Floats

Part = tuple[str, float, Sequence[float], float]
"""Kind, sill, three ranges and smoothness of a variogram structure. Only a Matern structure has a
smoothness s; its three lengths are those of x in x^s K_s(x), not ranges."""

_CLASSES = {
    "spherical": "Spherical",
    "exponential": "Exponential",
    "gaussian": "Gaussian",
    "matern": "Matern",
}
_LEFT = {
    "spherical": 1.0,
    "exponential": float(np.log(20)),
    "gaussian": float(np.sqrt(np.log(20))),
}
"""Argument of a model's correlation at its range."""


def library() -> ModuleType:
    """Return GSTools.

    Raises
    ------
    MissingDependencyError
        It is not installed.
    """
    try:
        import gstools
    except ImportError as error:
        raise MissingDependencyError(
            "this conversion needs GSTools: pip install gstools"
        ) from error
    found: ModuleType = gstools
    return found


def model_of(nugget: float, parts: Sequence[Part], axes: Floats) -> Any:
    """Return a GSTools model; of several structures a sum, which has one rotation and anisotropy.

    Parameters
    ----------
    nugget : float
        Nugget variance.
    parts : sequence of Part
        Structures.
    axes : (3, 3) float
        Directions of the ranges as rows.

    Raises
    ------
    OptionError
        Structures whose ranges are not in proportion: GSTools sums none of these.
    """
    gs = library()
    if not parts:
        return gs.Nugget(dim=3, nugget=nugget)
    shapes = np.array([np.divide(ranges, ranges[0]) for _, _, ranges, _ in parts])
    if not np.allclose(shapes, shapes[0], rtol=1e-9):
        raise OptionError(
            "GSTools sums only structures whose ranges are in proportion, but these are "
            + " and ".join(str(tuple(ranges)) for _, _, ranges, _ in parts)
        )
    out: Any = None
    for kind, sill, ranges, smoothness in parts:
        named = getattr(gs, _CLASSES[kind])
        more = {"nu": smoothness} if kind == "matern" else {}
        scale = named(dim=3, **more).rescale / _left(kind, smoothness)
        lengths = [scale * r for r in ranges]
        one = named(dim=3, var=sill, len_scale=lengths, angles=_angles(axes), **more)
        out = one if out is None else out + one
    out.nugget = nugget  # of a sum too
    return out


def parts_of(model: Any) -> tuple[float, list[Part], Floats]:
    """Return the nugget, the structures and the axes (3, 3) of a GSTools model.

    Raises
    ------
    InputError
        The model is not in three dimensions, or of a kind that geounfold does not have.
    """
    if model.dim != 3 or getattr(model, "latlon", False) or getattr(model, "temporal", False):
        raise InputError(f"the GSTools model must be in space and have dim=3, but is {model!r}")
    nugget, axes = float(model.nugget), np.eye(3)
    parts: list[Part] = []
    for one in getattr(model, "models", None) or [model]:
        if type(one).__name__ == "Nugget" or not one.var:
            continue
        kind = next((k for k, name in _CLASSES.items() if name == type(one).__name__), None)
        if kind is None:
            raise InputError(
                f"GSTools' {type(one).__name__} has no counterpart; geounfold has "
                f"{', '.join(_CLASSES.values())}"
            )
        smoothness = float(getattr(one, "nu", 1.0))
        scale = _left(kind, smoothness) / one.rescale
        ranges = tuple(float(scale * r) for r in one.len_scale_vec)
        parts.append((kind, float(one.var), ranges, smoothness))
        axes = _axes(*(float(a) for a in one.angles))
    return nugget, parts, axes


def _left(kind: str, smoothness: float) -> float:
    """Return the argument of a model's correlation at a structure's range.

    GSTools' Matern model is x^s K_s(x) with x = sqrt(s) h; its lengths here are those of x.
    """
    return float(1 / np.sqrt(smoothness)) if kind == "matern" else _LEFT[kind]


def _axes(a: float, b: float, c: float) -> Floats:
    """Return a model's axes as rows: the columns of Rx(c) Ry(b) Rz(a), angles in radians."""
    (ca, cb, cc), (sa, sb, sc) = (f([a, b, c]) for f in (np.cos, np.sin))
    z = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    x = np.array([[1, 0, 0], [0, cc, -sc], [0, sc, cc]])
    out: Floats = (x @ y @ z).T
    return out


def _angles(axes: Floats) -> list[float]:
    """Return the angles whose `_axes` these are."""
    M = axes.T
    b = float(np.arcsin(np.clip(M[0, 2], -1, 1)))
    if np.isclose(abs(M[0, 2]), 1):  # a and c turn about one axis: all of it is a's
        return [float(np.arctan2(M[1, 0], M[1, 1])), b, 0.0]
    return [float(np.arctan2(-M[0, 1], M[0, 0])), b, float(np.arctan2(-M[1, 2], M[2, 2]))]
