"""geounfold: take the folds out of an ore body, and put them back.

>>> import geounfold as gu
>>> body = gu.simulate("sim_case_1")
>>> flat = gu.unfold(body.folded)
>>> flat.outside_share
0.0
"""

from geounfold._version import __version__
from geounfold.control import ControlMesh
from geounfold.errors import GeounfoldError, InputError
from geounfold.flattening import FLATTENERS, Flattening, flatten
from geounfold.mapping import UnfoldingMap, load
from geounfold.mesh import TetMesh, TriMesh
from geounfold.options import UnfoldOptions
from geounfold.pipeline import Unfolding, unfold
from geounfold.quality import aligned_rms, epsilon, neighbours, nmd
from geounfold.synthetic import simulate

__all__ = [
    "FLATTENERS",
    "ControlMesh",
    "Flattening",
    "GeounfoldError",
    "InputError",
    "TetMesh",
    "TriMesh",
    "UnfoldOptions",
    "Unfolding",
    "UnfoldingMap",
    "__version__",
    "aligned_rms",
    "epsilon",
    "flatten",
    "load",
    "neighbours",
    "nmd",
    "simulate",
    "unfold",
]
