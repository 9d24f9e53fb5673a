"""From drill-holes to a body: intercepts, hanging- and footwall surfaces, blocks.

`intercepts` finds the parts of holes in the body. `reference` is the surface over which the body is
drawn: a plane, or a folded one. `walls` fits hanging wall and footwall through the contacts,
`extent` bounds them along the layer, and `from_holes` runs all stages.
"""

from geounfold.modelling.from_holes import HolesBody, body_from_holes
from geounfold.modelling.options import BodyOptions

__all__ = ["BodyOptions", "HolesBody", "body_from_holes"]
