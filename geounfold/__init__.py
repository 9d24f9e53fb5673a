"""geounfold: take the folds out of an ore body, and put them back.

>>> import geounfold as gu
>>> body = gu.simulate("sim_case_1")
>>> flat = gu.unfold(body.folded)
>>> flat.outside_share
0.0
"""

from __future__ import annotations

import logging
from importlib import import_module
from typing import TYPE_CHECKING, Any

from geounfold._version import __version__

if TYPE_CHECKING:
    from geounfold.body.block_model import BlockModel, regular_grid
    from geounfold.body.fill import FilledSolid
    from geounfold.body.model_frame import ModelFrame, axes_from_angles
    from geounfold.comparison.crosscheck import CrossCheck, crosscheck
    from geounfold.comparison.flatteners import compare
    from geounfold.drillholes import DrillHoles, read_drillholes
    from geounfold.errors import GeounfoldError, InputError, NotFittedError, OptionError
    from geounfold.estimation import (
        Estimation,
        Neighbourhood,
        Variogram,
        decluster,
        estimate,
        explore,
        fit_variogram,
        transfer,
    )
    from geounfold.flattening import FLATTENERS, Flattening, flatten
    from geounfold.gain import Assessment, HolesStudy, assess, study_holes
    from geounfold.geometry.mesh import TetMesh, TriMesh
    from geounfold.io.block_sizes import block_model
    from geounfold.io.solids import fill
    from geounfold.mapping.control_mesh import ControlMesh
    from geounfold.mapping.domain_map import DomainMap, load_domains
    from geounfold.mapping.mesh_map import UnfoldingMap, load
    from geounfold.modelling import HolesBody, body_from_holes
    from geounfold.quality.neighbour_distances import epsilon, neighbours, nmd
    from geounfold.quality.truth import aligned_rms
    from geounfold.report.of_unfolding import report
    from geounfold.synthetic import simulate
    from geounfold.synthetic.faulted import simulate_faulted
    from geounfold.unfolding.dask_map import map_partitions
    from geounfold.unfolding.domains import Domains, unfold_domains
    from geounfold.unfolding.options import UnfoldOptions
    from geounfold.unfolding.result import Unfolding
    from geounfold.unfolding.run import unfold
    from geounfold.unfolding.sklearn_unfolder import Unfolder

logging.getLogger(__name__).addHandler(logging.NullHandler())

_HOMES = {
    "BlockModel": "body.block_model",
    "ModelFrame": "body.model_frame",
    "axes_from_angles": "body.model_frame",
    "block_model": "io.block_sizes",
    "body_from_holes": "modelling",
    "HolesBody": "modelling",
    "regular_grid": "body.block_model",
    "transfer": "estimation.transfer",
    "Assessment": "gain",
    "assess": "gain",
    "HolesStudy": "gain",
    "study_holes": "gain",
    "compare": "comparison.flatteners",
    "ControlMesh": "mapping.control_mesh",
    "CrossCheck": "comparison.crosscheck",
    "crosscheck": "comparison.crosscheck",
    "DrillHoles": "drillholes",
    "read_drillholes": "drillholes",
    "FilledSolid": "body.fill",
    "fill": "io.solids",
    "GeounfoldError": "errors",
    "InputError": "errors",
    "NotFittedError": "errors",
    "OptionError": "errors",
    "Estimation": "estimation",
    "Neighbourhood": "estimation",
    "Variogram": "estimation",
    "decluster": "estimation",
    "estimate": "estimation",
    "explore": "estimation",
    "fit_variogram": "estimation",
    "FLATTENERS": "flattening",
    "Flattening": "flattening",
    "flatten": "flattening",
    "UnfoldingMap": "mapping.mesh_map",
    "load": "mapping.mesh_map",
    "load_domains": "mapping.domain_map",
    "DomainMap": "mapping.domain_map",
    "map_partitions": "unfolding.dask_map",
    "TetMesh": "geometry.mesh",
    "TriMesh": "geometry.mesh",
    "UnfoldOptions": "unfolding.options",
    "Unfolder": "unfolding.sklearn_unfolder",
    "Unfolding": "unfolding.result",
    "unfold": "unfolding.run",
    "Domains": "unfolding.domains",
    "unfold_domains": "unfolding.domains",
    "aligned_rms": "quality",
    "epsilon": "quality",
    "neighbours": "quality",
    "nmd": "quality",
    "simulate": "synthetic",
    "simulate_faulted": "synthetic.faulted",
}

__all__ = [
    "FLATTENERS",
    "Assessment",
    "BlockModel",
    "ControlMesh",
    "CrossCheck",
    "DomainMap",
    "Domains",
    "DrillHoles",
    "Estimation",
    "FilledSolid",
    "Flattening",
    "GeounfoldError",
    "HolesBody",
    "HolesStudy",
    "InputError",
    "ModelFrame",
    "Neighbourhood",
    "NotFittedError",
    "OptionError",
    "TetMesh",
    "TriMesh",
    "UnfoldOptions",
    "Unfolder",
    "Unfolding",
    "UnfoldingMap",
    "Variogram",
    "__version__",
    "aligned_rms",
    "assess",
    "axes_from_angles",
    "block_model",
    "body_from_holes",
    "compare",
    "crosscheck",
    "decluster",
    "epsilon",
    "estimate",
    "explore",
    "fill",
    "fit_variogram",
    "flatten",
    "load",
    "load_domains",
    "map_partitions",
    "neighbours",
    "nmd",
    "read_drillholes",
    "regular_grid",
    "report",
    "simulate",
    "simulate_faulted",
    "study_holes",
    "transfer",
    "unfold",
    "unfold_domains",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used, so that starting costs little."""
    if name == "report":  # a package that is called too
        return import_module(f"{__name__}.report")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, and no others."""
    return sorted(__all__)
