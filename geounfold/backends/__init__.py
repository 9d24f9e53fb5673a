"""All calls of libigl, MeshLab, gstlearn, TetGen and fTetWild: plain arrays in and out."""
