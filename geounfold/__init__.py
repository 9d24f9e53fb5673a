"""geounfold: take the folds out of an ore body, and put them back.

>>> import geounfold as gu
>>> body = gu.simulate("sim_case_1")
>>> flat = gu.unfold(body.folded)
>>> flat.outside_share
0.0
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from geounfold._version import __version__

if TYPE_CHECKING:
    from geounfold.blockmodel import (
        BlockModel,
        ModelFrame,
        axes_from_angles,
        block_model,
        regular_grid,
        transfer,
    )
    from geounfold.clusters import map_partitions
    from geounfold.comparison import compare
    from geounfold.control import ControlMesh
    from geounfold.drillholes import DrillHoles, read_drillholes
    from geounfold.errors import GeounfoldError, InputError
    from geounfold.estimation import (
        Estimation,
        Neighbourhood,
        Variogram,
        estimate,
        explore,
        fit_variogram,
    )
    from geounfold.estimator import Unfolder
    from geounfold.flattening import FLATTENERS, Flattening, flatten
    from geounfold.mapping import UnfoldingMap, load
    from geounfold.mesh import TetMesh, TriMesh
    from geounfold.options import UnfoldOptions
    from geounfold.pipeline import Unfolding, unfold
    from geounfold.quality import aligned_rms, epsilon, neighbours, nmd
    from geounfold.synthetic import simulate
    from geounfold.verification import CrossCheck, crosscheck

_HOMES = {
    "BlockModel": "blockmodel",
    "ModelFrame": "blockmodel",
    "axes_from_angles": "blockmodel",
    "block_model": "blockmodel",
    "regular_grid": "blockmodel",
    "transfer": "blockmodel",
    "compare": "comparison",
    "ControlMesh": "control",
    "CrossCheck": "verification",
    "crosscheck": "verification",
    "DrillHoles": "drillholes",
    "read_drillholes": "drillholes",
    "GeounfoldError": "errors",
    "InputError": "errors",
    "Estimation": "estimation",
    "Neighbourhood": "estimation",
    "Variogram": "estimation",
    "estimate": "estimation",
    "explore": "estimation",
    "fit_variogram": "estimation",
    "FLATTENERS": "flattening",
    "Flattening": "flattening",
    "flatten": "flattening",
    "UnfoldingMap": "mapping",
    "load": "mapping",
    "map_partitions": "clusters",
    "TetMesh": "mesh",
    "TriMesh": "mesh",
    "UnfoldOptions": "options",
    "Unfolder": "estimator",
    "Unfolding": "pipeline",
    "unfold": "pipeline",
    "aligned_rms": "quality",
    "epsilon": "quality",
    "neighbours": "quality",
    "nmd": "quality",
    "simulate": "synthetic",
}

__all__ = [
    "FLATTENERS",
    "BlockModel",
    "ControlMesh",
    "CrossCheck",
    "DrillHoles",
    "Estimation",
    "Flattening",
    "GeounfoldError",
    "InputError",
    "ModelFrame",
    "Neighbourhood",
    "TetMesh",
    "TriMesh",
    "UnfoldOptions",
    "Unfolder",
    "Unfolding",
    "UnfoldingMap",
    "Variogram",
    "__version__",
    "aligned_rms",
    "axes_from_angles",
    "block_model",
    "compare",
    "crosscheck",
    "epsilon",
    "estimate",
    "explore",
    "fit_variogram",
    "flatten",
    "load",
    "map_partitions",
    "neighbours",
    "nmd",
    "read_drillholes",
    "regular_grid",
    "simulate",
    "transfer",
    "unfold",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used, so that starting costs little."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted([*globals(), *_HOMES])
