"""Faults taken out: a body cut into fault blocks, and these joined again in one flat space."""
