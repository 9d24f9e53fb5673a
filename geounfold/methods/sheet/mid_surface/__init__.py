"""The mid surface: medial points of the hull, and a spline fitted to them."""
