"""Comparisons: flatteners of one surface, methods of one body, meshers of one border."""
