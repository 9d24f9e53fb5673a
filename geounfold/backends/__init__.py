"""The only doors to libigl, pymeshlab and other meshing libraries: plain arrays in and out."""
