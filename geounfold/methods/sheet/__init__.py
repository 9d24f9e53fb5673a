"""The sheet method: a spline mid surface, flattened, with prisms along its normals."""
