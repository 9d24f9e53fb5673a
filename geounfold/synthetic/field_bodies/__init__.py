"""Bodies as mines have them, with what is true of each block: branches, faults, crude shells."""

from __future__ import annotations

from geounfold.synthetic.field_bodies import branches, crude, faults, folds, uneven
from geounfold.synthetic.field_bodies.blocks import FieldBlocks, FieldBody

FIELD_BODIES: dict[str, FieldBody] = {
    body.name: body for module in (branches, faults, uneven, folds, crude) for body in module.BODIES
}
"""The field suite: bodies by name."""

__all__ = ["FIELD_BODIES", "FieldBlocks", "FieldBody"]
