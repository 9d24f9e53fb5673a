"""Meshes, measures, rotations and search structures; no geology."""
