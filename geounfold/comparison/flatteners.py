"""Every flattener on the same surfaces, or every method on the same bodies: one tidy table."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import pandas as pd

from geounfold.comparison.methods import Blocks, compare_methods
from geounfold.errors import GeounfoldError, OptionError
from geounfold.flattening import FLATTENERS, Flattening, flatten, measures
from geounfold.geometry.mesh import Floats, Ints, TriMesh, as_trimesh
from geounfold.synthetic import Body
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.run import Progress, unfold

Surface = TriMesh | tuple[Floats, Ints]

#: Columns of the table, in order.
COLUMNS = (
    "surface",
    "flattener",
    "vertices",
    "faces",
    "area_error",
    "edge_strain",
    "area_distortion",
    "angle_distortion",
    "symmetric_dirichlet",
    "flips",
    "overlaps",
    "iterations",
    "stop",
    "seconds",
    "note",
    "error",
)


_ORDER = ("top", "bottom", "mid")


def compare(
    points_or_mesh: Blocks | Surface | Mapping[str, Blocks] | Mapping[str, Surface],
    flatteners: str | Iterable[str] | None = None,
    options: Mapping[str, Any] | None = None,
    *,
    methods: str | Iterable[str] | None = None,
    truth: Floats | Mapping[str, Floats] | None = None,
    unfolding: UnfoldOptions | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Flatten surfaces by several flatteners, or unfold bodies by several methods, and measure.

    Parameters
    ----------
    points_or_mesh : (n, 3) array, DataFrame, simulated Body, TriMesh, (V, F) or a mapping
        A body given by its block centroids, whose top, bottom and mid surface are compared; or
        what to flatten, where a single surface is named ``surface``.  A tuple is a (V, F) pair.
        A mapping holds surfaces by their names or, with ``methods``, bodies.
    flatteners : str or names, optional
        ``all`` (those that are free software throughout; the default for surfaces), one name of
        FLATTENERS or several.  With ``methods`` the default is the one in ``unfolding``.
    options : mapping, optional
        Options of some flatteners, by their names; for surfaces alone.
    methods : str or names, optional
        ``all``, one name of METHODS or several: whole bodies are compared, see
        ``contest.compare_methods`` for this table.
    truth : (n, 3) array or mapping, optional
        With ``methods``: where the blocks truly lay.
    unfolding : UnfoldOptions, optional
        How the body's surfaces are found; defaults without.  An uncertified control mesh is no
        obstacle, since surfaces alone are needed.
    progress : callable, optional
        Called with every stage's name as it starts.

    Returns
    -------
    DataFrame
        One row per surface and flattener, with the columns of COLUMNS: ``area_error`` is E_s and
        ``edge_strain`` a root mean square; ``area_distortion`` and ``angle_distortion`` are 1 and
        ``symmetric_dirichlet`` is 4 for an isometry (inf with a flipped triangle); ``overlaps``
        counts the pairs of border edges whose images meet; ``seconds`` is wall time.  A method
        that failed, or whose answer is not one-to-one and cannot be repaired, is a row without
        figures, and ``error`` says why.

    Raises
    ------
    OptionError
        A flattener or a method that does not exist, options of unfolding where surfaces are
        given, a truth without methods, or surfaces or flatteners' options with them.
    InputError
        Points that are no body; see ``unfold``.

    Examples
    --------
    >>> import numpy as np
    >>> V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> table = compare((V, np.array([[0, 1, 2], [0, 2, 3]])), ["spring", "arap"])
    >>> table[["flattener", "flips", "error"]].to_numpy().tolist()
    [['spring', 0, ''], ['arap', 0, '']]
    """
    if methods is not None:
        bodies = _bodies(points_or_mesh, options)
        return compare_methods(
            bodies, methods, flatteners, truth=truth, unfolding=unfolding, progress=progress
        )
    if truth is not None:
        raise OptionError("a truth is compared with unfolded blocks: choose methods")
    names = _names("all" if flatteners is None else flatteners)
    if options is not None:
        _names(options)
    rows = []
    for label, mesh in _surfaces(points_or_mesh, unfolding, progress).items():
        for name in names:
            if progress is not None:
                progress(f"{label} surface by {name}")
            rows.append(_row(label, as_trimesh(mesh), name, (options or {}).get(name)))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    return table.astype(dict.fromkeys(("flips", "overlaps", "iterations"), "Int64"))


def _bodies(given: Any, options: Mapping[str, Any] | None) -> Blocks | Mapping[str, Blocks]:
    """Return bodies as they were given, or raise OptionError where they are surfaces."""
    if options is not None:
        raise OptionError("flatteners' options are for surfaces; leave them out with methods")
    for one in given.values() if isinstance(given, Mapping) else [given]:
        if isinstance(one, TriMesh | tuple):
            raise OptionError("methods unfold whole bodies: give their points, not a surface")
    bodies: Blocks | Mapping[str, Blocks] = given
    return bodies


def _surfaces(
    given: Any,
    unfolding: UnfoldOptions | None,
    progress: Progress | None,
) -> Mapping[str, Surface]:
    """Return named surfaces: those given, or top, bottom and mid of the body given."""
    if isinstance(given, TriMesh | tuple):
        given = {"surface": given}
    if not isinstance(given, Mapping):
        chosen = replace(unfolding or UnfoldOptions(), allow_uncertified=True)
        points = given.folded if isinstance(given, Body) else given
        pairs = unfold(points, chosen, progress=progress).surfaces
        return {name: pairs[name].folded for name in _ORDER if name in pairs}
    if unfolding is not None:
        raise OptionError("options of unfolding need a body's points, but surfaces are given")
    surfaces: Mapping[str, Surface] = given
    return surfaces


def _names(flatteners: str | Iterable[str]) -> list[str]:
    """Return the names of flatteners, each of them known."""
    if flatteners == "all":
        return [name for name, flattener in FLATTENERS.items() if flattener.free]
    names = [flatteners] if isinstance(flatteners, str) else list(flatteners)
    unknown = [name for name in names if name not in FLATTENERS]
    if unknown or not names:
        given = ", ".join(unknown) or "none"
        raise OptionError(f"unknown flatteners: {given}; choose from {', '.join(FLATTENERS)}, all")
    return names


def _row(label: str, mesh: TriMesh, name: str, options: Any) -> dict[str, Any]:
    """Return one row of the table."""
    row: dict[str, Any] = {
        "surface": label,
        "flattener": name,
        "vertices": len(mesh.V),
        "faces": len(mesh.F),
        "stop": "",
        "note": "",
        "error": "",
    }
    started = time.perf_counter()
    try:
        flat = flatten(mesh, name, options=options)
    except GeounfoldError as err:
        return {**row, "seconds": time.perf_counter() - started, "error": f"{err}"}
    return {**row, "seconds": time.perf_counter() - started, **_figures(flat)}


def _figures(flat: Flattening) -> dict[str, Any]:
    """Return the measured columns of a row."""
    V, F, uv = flat.mesh.V, flat.mesh.F, flat.uv
    return {
        "area_error": measures.area_error(V, F, uv),
        "edge_strain": measures.edge_strain(V, F, uv),
        "area_distortion": measures.area_distortion(V, F, uv),
        "angle_distortion": measures.angle_distortion(V, F, uv),
        "symmetric_dirichlet": measures.symmetric_dirichlet(V, F, uv),
        "flips": flat.flips,
        "overlaps": flat.overlaps,
        "iterations": flat.iterations,
        "stop": str(flat.stop),
        "note": flat.note,
    }
