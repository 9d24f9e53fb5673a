"""Compare methods of unfolding on the same bodies."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from geounfold.backends.igl import boundary_loops
from geounfold.comparison.known_body import KnownBody
from geounfold.comparison.names import flattener_names, method_names
from geounfold.errors import GeounfoldError, InputError, OptionError
from geounfold.flattening import measures
from geounfold.flattening._border import border_of
from geounfold.geometry.mesh import Floats
from geounfold.mapping.carried import checked_points
from geounfold.methods import METHODS, SurfacePair
from geounfold.quality.neighbour_distances import NEIGHBOURS, epsilon
from geounfold.quality.truth import aligned_rms
from geounfold.unfolding.clock import Progress
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.result import Unfolding
from geounfold.unfolding.run import unfold

Blocks = Floats | pd.DataFrame | KnownBody

METHOD_COLUMNS = (
    *("body", "method", "flattener", "blocks"),
    *("epsilon_folded", "epsilon_truth", "epsilon_nothing", "rms", "rms_nothing"),
    *("stratigraphic_error", "injective", "torn", "unplaced", "extrapolated"),
    *("area_error", "edge_strain", "area_distortion", "angle_distortion"),
    *("symmetric_dirichlet", "flips", "overlaps", "iterations", "seconds", "cpu_seconds"),
    *("note", "error"),
)
"""Columns of the table of methods, in order."""

_COUNTS = ("blocks", "torn", "unplaced", "extrapolated", "flips", "overlaps", "iterations")


def compare_methods(
    bodies: Blocks | Mapping[str, Blocks],
    methods: str | Iterable[str] = "all",
    flatteners: str | Iterable[str] | None = None,
    *,
    truth: Floats | Mapping[str, Floats] | None = None,
    unfolding: UnfoldOptions | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Unfold bodies by several methods and measure each result.

    Parameters
    ----------
    bodies : (n, 3) array, DataFrame, simulated Body, or a mapping of names to these
        Block centroids.  A single body is called ``body``; a simulated one has its own name.
    methods : str or names
        ``all``, one name of METHODS or several.
    flatteners : str or names, optional
        ``all``, one name of FLATTENERS or several, for methods that flatten a surface; the other
        methods have one row.  Default: the flattener of ``unfolding``.
    truth : (n, 3) array or a mapping of names to these, optional
        True unfolded position of each block, row by row; simulated bodies bring their own.
    unfolding : UnfoldOptions, optional
        Options of all runs.  Each run sets its method and flattener and accepts an unproved map.
    progress : callable, optional
        Called with the name of each stage when it starts.

    Returns
    -------
    DataFrame
        One row per body, method and flattener, with the columns of METHOD_COLUMNS.

        ``epsilon_folded`` is the mean of epsilon(X, Y).  With a truth W, ``epsilon_truth`` is the
        mean of epsilon(W, Y), and ``rms`` is the distance from W after the best rotation and
        translation, in edges of a mean block.  ``epsilon_nothing`` and ``rms_nothing`` are the
        same figures for the folded body itself.  ``stratigraphic_error`` is the mean error of the
        stratigraphic coordinate (simulated bodies only).  ``torn`` counts blocks that lost a
        neighbour, ``extrapolated`` those outside the control mesh, and ``unplaced`` those without
        an image, which are left out of the figures above.

        The distortion (``area_error``, the thesis's E_s, to ``overlaps``) is that of one surface
        as the method maps it, seen from above: the mid surface, or the top if the method has no
        mid surface.  ``iterations`` sums the steps of all minimisations; ``seconds`` is wall time.
        If a method fails, its row has no figures and ``error`` gives the reason.

    Raises
    ------
    OptionError
        A method or flattener that does not exist, or a truth whose length is not its body's.
    """
    how = unfolding or UnfoldOptions()
    names = method_names(methods)
    flat = [how.flattener] if flatteners is None else flattener_names(flatteners)
    named = _named(bodies)
    truths = _truths(named, truth)
    rows = []
    for label, given in named.items():
        for name in names:
            for flattener in flat if METHODS[name].flattens else [how.flattener]:
                if progress is not None:
                    progress(f"{label} by {name}")
                chosen = replace(how, method=name, flattener=flattener, allow_uncertified=True)
                rows.append(_row(label, given, truths.get(label), chosen, progress))
    table = pd.DataFrame(rows, columns=list(METHOD_COLUMNS))
    kinds = {**dict.fromkeys(_COUNTS, "Int64"), "injective": "boolean"}
    return table.astype(kinds)


def _named(bodies: Blocks | Mapping[str, Blocks]) -> Mapping[str, Blocks]:
    """Return bodies by name."""
    if isinstance(bodies, Mapping):
        return bodies
    return {bodies.name if isinstance(bodies, KnownBody) else "body": bodies}


def _truths(
    named: Mapping[str, Blocks], truth: Floats | Mapping[str, Floats] | None
) -> dict[str, Floats]:
    """Return the truths by body, each checked to have its body's length."""
    out = {name: body.truth for name, body in named.items() if isinstance(body, KnownBody)}
    if truth is not None and not isinstance(truth, Mapping):
        if len(named) != 1:
            raise OptionError("several bodies need a mapping of their names to their truths")
        truth = dict.fromkeys(named, truth)
    for name, W in (truth or {}).items():
        if name not in named:
            raise OptionError(f"there is a truth for {name}, but no such body")
        body = named[name]
        count = len(body.folded) if isinstance(body, KnownBody) else len(body)
        out[name] = checked_points(W)
        if len(W) != count:
            raise OptionError(f"{name} has {count} blocks, but its truth has {len(W)} rows")
    return out


def _row(
    label: str,
    given: Blocks,
    truth: Floats | None,
    options: UnfoldOptions,
    progress: Progress | None,
) -> dict[str, Any]:
    """Return one row of the table."""
    simulated = given if isinstance(given, KnownBody) else None
    points = given.folded if isinstance(given, KnownBody) else given
    row: dict[str, Any] = {
        "body": label,
        "method": options.method,
        "flattener": options.flattener if METHODS[options.method].flattens else "",
        "blocks": len(points),
        "note": "",
        "error": "",
    }
    clocks = time.perf_counter(), time.process_time()
    try:
        u = unfold(points, options, progress=progress)
        row |= _since(clocks)
        return {**row, **_block_figures(u, truth, simulated), **_surface_figures(u)}
    except GeounfoldError as error:
        return {**_since(clocks), **row, "error": f"{error}"}


def _since(clocks: tuple[float, float]) -> dict[str, float]:
    """Return the wall and processor time passed since both clocks were read."""
    wall, cpu = time.perf_counter() - clocks[0], time.process_time() - clocks[1]
    return {"seconds": wall, "cpu_seconds": cpu}


def _block_figures(u: Unfolding, truth: Floats | None, body: KnownBody | None) -> dict[str, Any]:
    """Return the figures of the blocks that have an image."""
    there = np.asarray(u.carried.placed, dtype=bool)
    X, Y = u.folded[there], u.points[there]
    iterations = sum(f.iterations for fit in u.fits for f in fit.flattenings.values())
    steps = [fit.notes.get("iterations", 0) for fit in u.fits]
    out: dict[str, Any] = {
        "epsilon_folded": u.quality.nmd.mean,
        "injective": u.injective,
        "torn": u.torn,
        "unplaced": int((~there).sum()),
        "extrapolated": int((there & ~u.carried.inside).sum()),
        "iterations": iterations + sum(s for s in steps if isinstance(s, int)),
        "note": "; ".join(w for fit in u.fits for w in fit.warnings),
    }
    if truth is not None and len(X) > NEIGHBOURS:
        W, side = truth[there], u.frame.scale
        out |= {
            "epsilon_truth": float(epsilon(W, Y).mean()),
            "epsilon_nothing": float(epsilon(W, X).mean()),
            "rms": aligned_rms(Y, W) / side,
            "rms_nothing": aligned_rms(X, W) / side,
        }
    if body is not None:
        off = np.abs(u.stratigraphic - body.stratigraphic)[there]
        out["stratigraphic_error"] = float(off.mean())
    return out


def _surface_figures(u: Unfolding) -> dict[str, Any]:
    """Return the distortion of the mid surface, or of the top if there is no mid surface."""
    pair: SurfacePair = u.surfaces.get("mid", u.surfaces["top"])
    V, F, uv = pair.folded.V, pair.folded.F, np.ascontiguousarray(pair.unfolded.V[:, :2])
    if not len(F):
        raise InputError("no part of the reference surface has an image")
    a, b = uv[F[:, 1]] - uv[F[:, 0]], uv[F[:, 2]] - uv[F[:, 0]]
    if (
        a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    ).sum() < 0:  # the surface was turned over with its body
        F = np.ascontiguousarray(F[:, ::-1])
    return {
        "area_error": measures.area_error(V, F, uv),
        "edge_strain": measures.edge_strain(V, F, uv),
        "area_distortion": measures.area_distortion(V, F, uv),
        "angle_distortion": measures.angle_distortion(V, F, uv),
        "symmetric_dirichlet": measures.symmetric_dirichlet(V, F, uv),
        "flips": measures.flips(F, uv),
        "overlaps": border_of(uv, tuple(boundary_loops(F))).overlaps,
    }
