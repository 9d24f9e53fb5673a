"""Flatten a surface: one contract, a table of methods."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geounfold.errors import FlatteningError, OptionError, check_one_of
from geounfold.flattening._problem import Problem, collapsed, make_problem, upright
from geounfold.flattening._repair import one_to_one
from geounfold.flattening._result import Flattening, Stop
from geounfold.flattening._start import check_disk
from geounfold.flattening._start import tutte as _tutte
from geounfold.flattening.arap import ArapOptions, arap
from geounfold.flattening.harmonic import HarmonicOptions, harmonic
from geounfold.flattening.isomap import IsomapOptions, isomap
from geounfold.flattening.lscm import LscmOptions, lscm
from geounfold.flattening.mds import MdsOptions, mds
from geounfold.flattening.scaf import ScafOptions, scaf
from geounfold.flattening.slim import SlimOptions, slim
from geounfold.flattening.spring import SpringOptions, spring
from geounfold.flattening.spring_dynamic import SpringDynamicOptions, spring_dynamic
from geounfold.flattening.ufo import UfoOptions, ufo
from geounfold.geometry.mesh import Floats, Ints, TriMesh, as_trimesh

__all__ = [
    "FLATTENERS",
    "ArapOptions",
    "Flattener",
    "Flattening",
    "HarmonicOptions",
    "IsomapOptions",
    "LscmOptions",
    "MdsOptions",
    "ScafOptions",
    "SlimOptions",
    "SpringDynamicOptions",
    "SpringOptions",
    "Stop",
    "UfoOptions",
    "check_flattener_options",
    "flatten",
    "tutte",
]


@dataclass(frozen=True)
class Flattener:
    """A method of the table.

    Attributes
    ----------
    name : str
        Key in FLATTENERS.
    function : callable
        ``function(problem, start, options) -> Flattening``.
    intrinsic : bool
        Whether it uses edge lengths only, so that other rest lengths can be given.
    options : type
        Class of its options, a frozen dataclass that checks itself.
    keeps : str
        What it keeps, exactly if the surface allows that: ``lengths``, ``angles`` or ``nothing``.
    free : bool
        Whether all code that it calls is free software; if not, it runs only if the user names it.
    """

    name: str
    function: Callable[[Problem, Floats | None, Any], Flattening]
    intrinsic: bool
    options: type
    keeps: str = "lengths"
    free: bool = True


#: The methods by name.
FLATTENERS: dict[str, Flattener] = {
    f.name: f
    for f in (
        Flattener("spring", spring, True, SpringOptions),
        Flattener("spring_dynamic", spring_dynamic, True, SpringDynamicOptions),
        Flattener("arap", arap, False, ArapOptions),
        Flattener("lscm", lscm, False, LscmOptions, "angles"),
        Flattener("slim", slim, False, SlimOptions),
        Flattener("scaf", scaf, False, ScafOptions, free=False),  # calls Triangle
        Flattener("mds", mds, False, MdsOptions),
        Flattener("ufo", ufo, True, UfoOptions),
        Flattener("isomap", isomap, False, IsomapOptions),
        Flattener("harmonic", harmonic, False, HarmonicOptions, "nothing"),
    )
}


def flatten(
    mesh: TriMesh | tuple[Floats, Ints],
    method: str = "spring",
    *,
    start: ArrayLike | None = None,
    rest: ArrayLike | None = None,
    options: Any = None,
    repair: bool = True,
) -> Flattening:
    """Lay a surface flat, one-to-one.

    Parameters
    ----------
    mesh : TriMesh or (V, F)
        A surface of disk topology, holes allowed: one component, (n, 3) vertices, faces
        oriented alike.  The longest border loop is the outer one.
    method : str
        Key in FLATTENERS.
    start : (n, 2) array, optional
        Flat positions to start from, mirrored back if they are mirrored; by default the method's
        own start, which is Tutte's embedding for most.
    rest : (k,) array, optional
        Length that each edge of ``geometry.unique_edges(F)`` should have when flat, in the
        vertices' unit; by default its length in the mesh.  Only for intrinsic methods.
    options : dataclass, optional
        The method's options; by default its defaults.
    repair : bool
        Whether an answer with folded triangles or an overlapping border is repaired; if that fails,
        an error is raised.  False returns it unchanged, with ``flips`` and ``overlaps`` counted.

    Returns
    -------
    Flattening
        Flat positions in the mesh's unit and vertex order, centred at zero, never mirrored.  With
        ``repair`` the map is proved to be one-to-one by exact predicates: every triangle is
        counter-clockwise and no two border edges meet (Lipman 2014, arXiv 1310.0955).  ``note``
        names the repair: vertices around a few folded triangles were moved (Garanzha et al. 2021,
        arXiv 2102.03069); or, for methods that keep lengths, libigl's SLIM was run from Tutte's
        embedding instead.

    Raises
    ------
    MeshError
        The surface is no disk, or has degenerate faces or unused vertices.
    OptionError
        Unknown method, options of another method, a start or rest lengths of a wrong shape or
        value, or rest lengths for a method that cannot use them.
    FlatteningError
        The answer is not valid, has collapsed, or is not one-to-one and cannot be repaired.

    Examples
    --------
    >>> V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> flat = flatten((V, np.array([[0, 1, 2], [0, 2, 3]])))
    >>> flat.flips, flat.overlaps, str(flat.stop)
    (0, 0, 'converged')
    """
    check_one_of("flattener", method, FLATTENERS)
    check_flattener_options(method, options)
    flattener = FLATTENERS[method]
    chosen = flattener.options() if options is None else options
    problem = _problem(mesh, rest, flattener)
    begin = _checked_start(start, len(problem.mesh.V), problem.mesh.F)
    flat = flattener.function(problem, begin, chosen)
    isometric = flattener.keeps == "lengths"
    # libigl's ARAP may collapse without an error (issue 54 of its bindings).
    if isometric and collapsed(problem, flat.uv):
        raise FlatteningError(
            f"{method}: the flat map has collapsed: most edges have lost their length; take "
            "another method"
        )
    return one_to_one(problem, flat, isometric) if repair else flat


def check_flattener_options(name: str, options: object) -> None:
    """Raise OptionError unless options are None or those of a flattener in FLATTENERS."""
    wanted = FLATTENERS[name].options
    if options is not None and not isinstance(options, wanted):
        raise OptionError(
            f"flattener_options must be {wanted.__name__}, the options of {name}, or None, but is "
            f"{type(options).__name__}"
        )


def tutte(mesh: TriMesh | tuple[Floats, Ints], rest: ArrayLike | None = None) -> Floats:
    """Return Tutte's embedding of a disk, (n, 2): no triangle flips, lengths not kept.

    See ``flatten`` for the parameters and ``initial.tutte`` for the method.
    """
    return _tutte(_problem(mesh, rest, None))


def _problem(
    mesh: TriMesh | tuple[Floats, Ints], rest: ArrayLike | None, flattener: Flattener | None
) -> Problem:
    """Return the checked problem."""
    surface = as_trimesh(mesh)
    loops = check_disk(surface)
    if rest is None:
        return make_problem(surface, loops, None)
    if flattener is not None and not flattener.intrinsic:
        raise OptionError(f"{flattener.name} works on the mesh itself and cannot take rest lengths")
    wanted = np.asarray(rest, dtype=np.float64)
    edges = len(surface.V) + len(surface.F) + len(loops) - 2  # Euler
    if wanted.shape != (edges,):
        raise OptionError(f"rest must have shape ({edges},), one per edge, but has {wanted.shape}")
    if not (np.isfinite(wanted).all() and (wanted > 0).all()):
        raise OptionError("rest lengths must be finite and positive")
    return make_problem(surface, loops, wanted)


def _checked_start(start: ArrayLike | None, n: int, F: Ints) -> Floats | None:
    """Return the start centred and never mirrored, or None."""
    if start is None:
        return None
    uv = np.array(start, dtype=np.float64)
    if uv.shape != (n, 2) or not np.isfinite(uv).all():
        raise OptionError(f"start must be finite and of shape ({n}, 2), but has {uv.shape}")
    return upright(uv, F)
