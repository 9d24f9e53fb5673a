"""Maps between the folded and the flat space: control mesh, certificate, map file."""
