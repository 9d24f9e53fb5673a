"""The body as blocks: lattice, sub-blocks, scattered points, separate parts, block models."""
