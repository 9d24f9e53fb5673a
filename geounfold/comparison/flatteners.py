"""Compare flatteners on the same surfaces; `compare` also leads to the comparison of methods."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import pandas as pd

from geounfold.comparison.known_body import KnownBody
from geounfold.comparison.methods import Blocks, compare_methods
from geounfold.comparison.names import flattener_names
from geounfold.errors import GeounfoldError, OptionError
from geounfold.flattening import Flattening, flatten, measures
from geounfold.geometry.mesh import Floats, Ints, TriMesh, as_trimesh
from geounfold.io.selection import read_where
from geounfold.io.tables.points import chosen_rows
from geounfold.unfolding.clock import Progress
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.run import unfold

Surface = TriMesh | tuple[Floats, Ints]

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
"""Columns of the table of flatteners, in order."""

_ORDER = ("top", "bottom", "mid")  # of a body's surfaces in the table


def compare(
    points_or_mesh: Blocks | Surface | Mapping[str, Blocks] | Mapping[str, Surface],
    flatteners: str | Iterable[str] | None = None,
    options: Mapping[str, Any] | None = None,
    *,
    methods: str | Iterable[str] | None = None,
    truth: Floats | Mapping[str, Floats] | None = None,
    unfolding: UnfoldOptions | None = None,
    progress: Progress | None = None,
    where: str | None = None,
) -> pd.DataFrame:
    """Compare flatteners on the same surfaces, or methods of unfolding on the same bodies.

    Parameters
    ----------
    points_or_mesh : (n, 3) array, DataFrame, simulated Body, TriMesh, (V, F) or a mapping
        Block centroids of a body, whose top, bottom and mid surface are flattened; or one surface
        (named ``surface`` in the table); or a mapping of names to surfaces.  With ``methods``, a
        body or a mapping of names to bodies.
    flatteners : str or names, optional
        ``all`` (those that are free software throughout), one name of FLATTENERS or several.
        Default: ``all`` for surfaces; with ``methods``, the flattener of ``unfolding``.
    options : mapping, optional
        Options of flatteners, by the flattener's name; only for surfaces.
    methods : str or names, optional
        ``all``, one name of METHODS or several.  If given, bodies are compared, and the table is
        that of `comparison.methods.compare_methods`.
    truth : (n, 3) array or mapping, optional
        With ``methods``: the true unfolded position of each block.
    unfolding : UnfoldOptions, optional
        Options by which the body's surfaces are found.  An uncertified control mesh is accepted,
        since only the surfaces are needed.
    progress : callable, optional
        Called with the name of each stage when it starts.
    where : str, optional
        Chooses rows of a DataFrame, such as ``"ROCK=ORE and AU>0.2"``.

    Returns
    -------
    DataFrame
        One row per surface and flattener, with the columns of COLUMNS.  ``area_error`` is E_s and
        ``edge_strain`` a root mean square.  For an isometry ``area_distortion`` and
        ``angle_distortion`` are 1 and ``symmetric_dirichlet`` is 4 (inf if a triangle is flipped).
        ``overlaps`` counts pairs of border edges whose images intersect; ``seconds`` is wall time.
        If a flattener fails, or its result is not one-to-one and cannot be repaired, its row has
        no figures and ``error`` gives the reason.

    Raises
    ------
    OptionError
        A flattener or method that does not exist; options of unfolding with given surfaces; a
        truth without ``methods``; surfaces or flatteners' options with ``methods``.
    InputError
        Points that form no body; see ``unfold``.

    Examples
    --------
    >>> import numpy as np
    >>> V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> table = compare((V, np.array([[0, 1, 2], [0, 2, 3]])), ["spring", "arap"])
    >>> table[["flattener", "flips", "error"]].to_numpy().tolist()
    [['spring', 0, ''], ['arap', 0, '']]
    """
    if where is not None:
        if not isinstance(points_or_mesh, pd.DataFrame):
            raise OptionError("where chooses rows by columns: give the blocks as a DataFrame")
        kept = chosen_rows(read_where(where), points_or_mesh, "the blocks")
        points_or_mesh = points_or_mesh.loc[kept]
    if methods is not None:
        bodies = _bodies(points_or_mesh, options)
        return compare_methods(
            bodies, methods, flatteners, truth=truth, unfolding=unfolding, progress=progress
        )
    if truth is not None:
        raise OptionError("a truth is compared with unfolded blocks: choose methods")
    names = flattener_names("all" if flatteners is None else flatteners)
    if options is not None:
        flattener_names(options)
    rows = []
    for label, mesh in _surfaces(points_or_mesh, unfolding, progress).items():
        for name in names:
            if progress is not None:
                progress(f"{label} surface by {name}")
            rows.append(_row(label, as_trimesh(mesh), name, (options or {}).get(name)))
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    return table.astype(dict.fromkeys(("flips", "overlaps", "iterations"), "Int64"))


def _bodies(given: Any, options: Mapping[str, Any] | None) -> Blocks | Mapping[str, Blocks]:
    """Return the bodies given; raise OptionError if they are surfaces."""
    if options is not None:
        raise OptionError(
            "options of flatteners apply to surfaces only: leave them out with methods"
        )
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
    """Return surfaces by name: those given, or top, bottom and mid of the body given."""
    if isinstance(given, TriMesh | tuple):
        given = {"surface": given}
    if not isinstance(given, Mapping):
        chosen = replace(unfolding or UnfoldOptions(), allow_uncertified=True)
        points = given.folded if isinstance(given, KnownBody) else given
        pairs = unfold(points, chosen, progress=progress).surfaces
        return {name: pairs[name].folded for name in _ORDER if name in pairs}
    if unfolding is not None:
        raise OptionError("options of unfolding need a body's points, but surfaces are given")
    surfaces: Mapping[str, Surface] = given
    return surfaces


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
