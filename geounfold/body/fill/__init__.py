"""Blocks inside wireframes: closed surfaces mended and filled, the body between two open ones."""

from geounfold.body.fill.filled import FilledSolid, fill_between, fill_solid
from geounfold.body.fill.shell import Shell, closed_shell

__all__ = ["FilledSolid", "Shell", "closed_shell", "fill_between", "fill_solid"]
