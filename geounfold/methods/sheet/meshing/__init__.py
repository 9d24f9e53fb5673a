"""Meshing: the control mesh of prisms around the mid surface."""
