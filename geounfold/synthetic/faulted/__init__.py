"""Bodies that were folded and faulted, in any order, with their exact truth."""

from geounfold.synthetic.faulted.body import FaultedBody, Surface, TrueSlip
from geounfold.synthetic.faulted.catalogue import FAULTED_CASES, random_faulted, simulate_faulted
from geounfold.synthetic.faulted.events import (
    Fault,
    FoldEvent,
    ListricFault,
    PlanarFault,
    ScissorFault,
    TipFault,
)
from geounfold.synthetic.faulted.recipe import FaultedSpec, Oval, Rectangle, Wandering
from geounfold.synthetic.faulted.variants import VARIANTS, drawn_otherwise

__all__ = [
    "FAULTED_CASES",
    "VARIANTS",
    "Fault",
    "FaultedBody",
    "FaultedSpec",
    "FoldEvent",
    "ListricFault",
    "Oval",
    "PlanarFault",
    "Rectangle",
    "ScissorFault",
    "Surface",
    "TipFault",
    "TrueSlip",
    "Wandering",
    "drawn_otherwise",
    "random_faulted",
    "simulate_faulted",
]
