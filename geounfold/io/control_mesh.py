"""Control meshes as VTK files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from geounfold.mapping.control_mesh import scaled

if TYPE_CHECKING:
    from geounfold.mapping.certificate import Certificate
    from geounfold.mapping.mesh_map import UnfoldingMap


def write_control(path: str | Path, mapping: UnfoldingMap, certificate: Certificate) -> None:
    """Write a map's control mesh and the shell around it as a .vtu file.

    Points are folded, in the data's coordinates; ``unfolded`` holds where each comes to lie and
    ``stratigraphic`` its coordinate.  Cells tell whether they are of the ``body`` (1) or of the
    shell (0), and which are at ``fault`` (1) where the map is not proved one-to-one, with the
    ``blocks`` that those hold.

    Parameters
    ----------
    path : path
        Ends in .vtu.
    mapping : UnfoldingMap
        The map.
    certificate : Certificate
        Of this map.
    """
    whole, frame = mapping.whole, mapping.frame
    T = whole.folded.T
    grid = scaled(whole, frame.to_world(whole.folded.V), frame.scale).to_pyvista()
    fault, blocks = np.zeros(len(T), np.uint8), np.zeros(len(T), np.int64)
    fault[certificate.elements] = 1
    blocks[certificate.elements] = certificate.blocks
    grid.cell_data["body"] = (np.arange(len(T)) < len(mapping.control.folded.T)).astype(np.uint8)
    grid.cell_data["fault"] = fault
    grid.cell_data["blocks_at_fault"] = blocks
    grid.save(path)
