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

    Points are folded, in the data's coordinates. Point data are ``unfolded``, the position in the
    flat space, and ``stratigraphic``. Cell data are ``body``, 1 in the control mesh and 0 in the
    shell; ``fault``, 1 for cells in which the map is not proved one-to-one; and
    ``blocks_at_fault``, the number of blocks in those cells.

    Parameters
    ----------
    path : path
        A file ending in .vtu.
    mapping : UnfoldingMap
        The map.
    certificate : Certificate
        The map's certificate.
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
