"""Comparisons: flatteners of a surface, methods of unfolding a body, meshers of a border."""
