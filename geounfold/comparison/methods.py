"""Methods of whole bodies on the same bodies: one tidy table."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from geounfold.backends.igl import boundary_loops
from geounfold.errors import GeounfoldError, InputError, OptionError
from geounfold.flattening import FLATTENERS, measures
from geounfold.flattening._border import border_of
from geounfold.geometry.mesh import Floats
from geounfold.mapping.carried import checked_points
from geounfold.methods import METHODS, SurfacePair
from geounfold.quality.neighbour_distances import NEIGHBOURS, epsilon
from geounfold.quality.truth import aligned_rms
from geounfold.synthetic import Body
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.result import Unfolding
from geounfold.unfolding.run import Progress, unfold

Blocks = Floats | pd.DataFrame | Body

#: Columns of the table of methods, in order.
METHOD_COLUMNS = (
    *("body", "method", "flattener", "blocks"),
    *("epsilon_folded", "epsilon_truth", "epsilon_nothing", "rms", "rms_nothing"),
    *("stratigraphic_error", "injective", "torn", "unplaced", "extrapolated"),
    *("area_error", "edge_strain", "area_distortion", "angle_distortion"),
    *("symmetric_dirichlet", "flips", "overlaps", "iterations", "seconds", "cpu_seconds"),
    *("note", "error"),
)
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
    """Unfold bodies by several methods and measure what came of them.

    Parameters
    ----------
    bodies : (n, 3) array, DataFrame, simulated Body, or a mapping of names to these
        Block centroids; one without a name is called ``body``, or by a simulated body's name.
    methods : str or names
        ``all``, one name of METHODS or several.
    flatteners : str or names, optional
        ``all``, one name of FLATTENERS or several, for the methods that lay a surface flat; the
        others have one row.  Default: the flattener of ``unfolding``.
    truth : (n, 3) array or a mapping of names to these, optional
        Where the blocks truly lay, row by row; simulated bodies know theirs.
    unfolding : UnfoldOptions, optional
        Options of all runs; their method and flattener change, and unproved answers are taken.
    progress : callable, optional
        Called with every stage's name as it starts.

    Returns
    -------
    DataFrame
        One row per body, method and flattener, with the columns of METHOD_COLUMNS.

        ``epsilon_folded`` is the mean of epsilon(X, Y); with a truth, ``epsilon_truth`` is that of
        epsilon(W, Y) and ``rms`` the distance from W after the best proper motion, in the edge of
        a mean block; ``epsilon_nothing`` and ``rms_nothing`` are those of leaving the blocks where
        they are.  ``stratigraphic_error`` is the mean error of the stratigraphic coordinate, for
        simulated bodies.  ``torn`` blocks lost a neighbour, ``unplaced`` ones have no image (and
        do not count in the figures before), ``extrapolated`` ones lie where the map was continued.

        The distortion (``area_error``, the thesis's E_s, to ``overlaps``) is that of one surface
        of the body as the method carried it, seen from above: the mid surface, or the top where
        there is none.  ``iterations`` are the steps of all that was minimised; ``seconds`` is wall
        time.  A method that failed is a row without figures, and ``error`` says why.

    Raises
    ------
    OptionError
        A method or a flattener that does not exist, or a body without a truth of its length.
    """
    how = unfolding or UnfoldOptions()
    names = _names("methods", methods, list(METHODS), list(METHODS))
    free = [name for name, flattener in FLATTENERS.items() if flattener.free]
    flat = (
        [how.flattener]
        if flatteners is None
        else _names("flatteners", flatteners, list(FLATTENERS), free)
    )
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


def _names(kind: str, given: str | Iterable[str], valid: list[str], every: list[str]) -> list[str]:
    """Return names, each of them valid."""
    if given == "all":
        return every
    names = [given] if isinstance(given, str) else list(given)
    unknown = [name for name in names if name not in valid]
    if unknown or not names:
        words = ", ".join(unknown) or "none"
        raise OptionError(f"unknown {kind}: {words}; choose from {', '.join(valid)}, all")
    return names


def _named(bodies: Blocks | Mapping[str, Blocks]) -> Mapping[str, Blocks]:
    if isinstance(bodies, Mapping):
        return bodies
    return {bodies.name if isinstance(bodies, Body) else "body": bodies}


def _truths(
    named: Mapping[str, Blocks], truth: Floats | Mapping[str, Floats] | None
) -> dict[str, Floats]:
    """Return the truths there are, each of its body's length."""
    out = {name: body.truth for name, body in named.items() if isinstance(body, Body)}
    if truth is not None and not isinstance(truth, Mapping):
        if len(named) != 1:
            raise OptionError("several bodies need a mapping of their names to their truths")
        truth = dict.fromkeys(named, truth)
    for name, W in (truth or {}).items():
        if name not in named:
            raise OptionError(f"there is a truth for {name}, but no such body")
        body = named[name]
        count = len(body.folded) if isinstance(body, Body) else len(body)
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
    simulated = given if isinstance(given, Body) else None
    points = given.folded if isinstance(given, Body) else given
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
        return {**row, **_of_blocks(u, truth, simulated), **_of_surface(u)}
    except GeounfoldError as error:
        return {**_since(clocks), **row, "error": f"{error}"}


def _since(clocks: tuple[float, float]) -> dict[str, float]:
    wall, cpu = time.perf_counter() - clocks[0], time.process_time() - clocks[1]
    return {"seconds": wall, "cpu_seconds": cpu}


def _of_blocks(u: Unfolding, truth: Floats | None, body: Body | None) -> dict[str, Any]:
    """Return the figures of the blocks, over those that have an image."""
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


def _of_surface(u: Unfolding) -> dict[str, Any]:
    """Return what the map did to the mid surface (the top, where there is none)."""
    pair: SurfacePair = u.surfaces.get("mid", u.surfaces["top"])
    V, F, uv = pair.folded.V, pair.folded.F, np.ascontiguousarray(pair.unfolded.V[:, :2])
    if not len(F):
        raise InputError("no part of the reference surface has an image")
    a, b = uv[F[:, 1]] - uv[F[:, 0]], uv[F[:, 2]] - uv[F[:, 0]]
    if (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() < 0:  # turned over with its body
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
