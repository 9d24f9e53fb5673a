"""The sides of a table's blocks: from columns, from an option, or from the centroids' lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from geounfold.body.block_model import BlockModel
from geounfold.body.lattice import measure_lattice
from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats
from geounfold.io.coordinate_columns import numbers, readable_numbers
from geounfold.io.messages import listing
from geounfold.io.packages.names import Triple, plain_name, side_sets


def size_columns(names: Sequence[str]) -> Triple | None:
    """Return the names of the three columns of block sides; None if there are no such columns.

    Raises
    ------
    InputError
        Several sets of such columns.

    Examples
    --------
    >>> size_columns(["IJK", "XC", "YC", "ZC", "XINC", "YINC", "ZINC"])
    ('XINC', 'YINC', 'ZINC')
    """
    plain = [plain_name(name) for name in names]
    found = side_sets(names)
    if not found:
        return None
    if len(found) > 1 or any(plain.count(name) > 1 for name in found[0]):
        there = [name for name, bare in zip(names, plain, strict=True) if bare in sum(found, ())]
        raise InputError(
            f"several columns may be the blocks' sides: {listing(there)}; name three by --sizes"
        )
    a, b, c = (names[plain.index(name)] for name in found[0])
    return a, b, c


@dataclass(frozen=True)
class Sides:
    """The sides of a table's blocks, from three columns or the same for all blocks.

    Attributes
    ----------
    given : three str or three float
        Column names, or lengths in the unit of the coordinates.
    """

    given: Triple | tuple[float, float, float]

    def of(self, frame: pd.DataFrame) -> Floats:
        """Return the sides (n, 3) of a table's rows; NaN if they are not positive numbers."""
        if isinstance(self.given[0], str):
            read = [readable_numbers(frame[name])[0] for name in self.given]
            sides = np.column_stack(read)
        else:
            sides = np.broadcast_to(np.array(self.given, dtype=np.float64), (len(frame), 3)).copy()
        out: Floats = np.where((sides > 0) & np.isfinite(sides), sides, np.nan)
        return out


def block_model(
    frame: pd.DataFrame,
    centroids: Floats,
    sizes: Triple | tuple[float, float, float] | None = None,
    axes: Floats | None = None,
    *,
    source: str = "the table",
) -> BlockModel:
    """Return the blocks that a table lists.

    Parameters
    ----------
    frame : DataFrame, n rows
        The table.
    centroids : (n, 3) float
        Its coordinates.
    sizes : three names or numbers, optional
        Columns of sides, or the sides of all blocks. By default columns are found by name (XINC,
        dx, x_size ...); without such columns the sides are the steps of the centroids' lattice.
    axes : (3, 3) float, optional
        The model's own axes as rows. By default those of the centroids' lattice, or the world's
        if the centroids have no lattice.
    source : str
        The file's name, with which messages begin.

    Raises
    ------
    InputError
        No sides are found, or some are not positive numbers.
    """
    lattice = None if axes is not None and sizes is not None else measure_lattice(centroids)
    if axes is None:
        axes = np.eye(3) if lattice is None else lattice.axes
    names: Triple | None = None
    if sizes is None:
        names = size_columns([str(name) for name in frame.columns])
    elif isinstance(sizes[0], str):
        names = (str(sizes[0]), str(sizes[1]), str(sizes[2]))
    if names is not None:
        missing = [name for name in names if name not in frame.columns]
        if missing:
            raise InputError(f"{source}: no column {listing(missing)} for the blocks' sides")
        sides = np.column_stack([numbers(frame[name], source=source) for name in names])
    elif sizes is not None:
        sides = np.broadcast_to(np.array(sizes, dtype=np.float64), centroids.shape).copy()
    elif lattice is not None:
        sides = np.broadcast_to(lattice.steps, centroids.shape).copy()
    else:
        raise InputError(
            f"{source}: no columns of block sides (such as XINC, YINC, ZINC or dx, dy, dz) and no "
            "lattice to measure them from; give --sizes"
        )
    return BlockModel(centroids, sides, axes)
