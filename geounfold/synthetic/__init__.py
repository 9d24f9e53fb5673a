"""Simulated bodies and surfaces whose unfolding is known exactly."""

from geounfold.synthetic.body import Body, Sheet
from geounfold.synthetic.catalogue import CASES, simulate
from geounfold.synthetic.drilling import PATTERNS, DrilledTables, drill
from geounfold.synthetic.fold_spec import FoldSpec
from geounfold.synthetic.grades import FIELD_KINDS, GradeField
from geounfold.synthetic.outline import (
    Bulge,
    Ellipse,
    Embayment,
    Even,
    Gap,
    Hole,
    Lens,
    Neck,
    ObliqueCut,
    Ragged,
    Swell,
    Wedge,
)
from geounfold.synthetic.profile import Bend, Bump, FlexuralSlip, Profile, Sinusoid
from geounfold.synthetic.random_bodies import random_body, random_family
from geounfold.synthetic.random_families import FAMILIES
from geounfold.synthetic.surfaces import AnalyticSurface, cone, cylinder, slab, spherical_cap

__all__ = [
    "CASES",
    "FAMILIES",
    "FIELD_KINDS",
    "PATTERNS",
    "AnalyticSurface",
    "Bend",
    "Body",
    "Bulge",
    "Bump",
    "DrilledTables",
    "Ellipse",
    "Embayment",
    "Even",
    "FlexuralSlip",
    "FoldSpec",
    "Gap",
    "GradeField",
    "Hole",
    "Lens",
    "Neck",
    "ObliqueCut",
    "Profile",
    "Ragged",
    "Sheet",
    "Sinusoid",
    "Swell",
    "Wedge",
    "cone",
    "cylinder",
    "drill",
    "random_body",
    "random_family",
    "simulate",
    "slab",
    "spherical_cap",
]
