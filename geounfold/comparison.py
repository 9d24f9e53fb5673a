"""Every flattener on the same surfaces: one tidy table."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from geounfold.errors import GeounfoldError, OptionError
from geounfold.flattening import FLATTENERS, Flattening, flatten, measures
from geounfold.mesh import Floats, Ints, TriMesh, as_trimesh

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
    "iterations",
    "stop",
    "seconds",
    "note",
    "error",
)


def compare(
    surfaces: TriMesh | tuple[Floats, Ints] | Mapping[str, TriMesh | tuple[Floats, Ints]],
    flatteners: str | Iterable[str] = "all",
    options: Mapping[str, Any] | None = None,
) -> pd.DataFrame:
    """Flatten surfaces by several methods and measure what each did to them.

    Parameters
    ----------
    surfaces : TriMesh, (V, F) or a mapping of names to them
        What to flatten; a single surface is named ``surface``.
    flatteners : str or names
        ``all``, one name of FLATTENERS or several.
    options : mapping, optional
        Options of some flatteners, by their names.

    Returns
    -------
    DataFrame
        One row per surface and flattener, with the columns of COLUMNS: ``area_error`` is E_s and
        ``edge_strain`` a root mean square; ``area_distortion`` and ``angle_distortion`` are 1 and
        ``symmetric_dirichlet`` is 4 for an isometry (inf with a flipped triangle); ``seconds`` is
        wall time.  A method that failed is a row without figures, and ``error`` says why.

    Raises
    ------
    OptionError
        A flattener that does not exist.

    Examples
    --------
    >>> import numpy as np
    >>> V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> table = compare((V, np.array([[0, 1, 2], [0, 2, 3]])), ["spring", "arap"])
    >>> table[["flattener", "flips", "error"]].to_numpy().tolist()
    [['spring', 0, ''], ['arap', 0, '']]
    """
    names = _names(flatteners)
    if options is not None:
        _names(options)
    named = surfaces if isinstance(surfaces, Mapping) else {"surface": surfaces}
    rows = [
        _row(label, as_trimesh(mesh), name, (options or {}).get(name))
        for label, mesh in named.items()
        for name in names
    ]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    return table.astype({"flips": "Int64", "iterations": "Int64"})


def _names(flatteners: str | Iterable[str]) -> list[str]:
    """Return the names of flatteners, each of them known."""
    if flatteners == "all":
        return list(FLATTENERS)
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
        "iterations": flat.iterations,
        "stop": str(flat.stop),
        "note": flat.note,
    }
