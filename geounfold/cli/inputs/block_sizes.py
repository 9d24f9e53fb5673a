"""The sides of blocks, from --sizes or from columns, and the blocks' volumes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError, OptionError
from geounfold.io.coordinate_columns import parse_columns
from geounfold.io.packages.names import Triple

if TYPE_CHECKING:
    from geounfold.geometry.mesh import Floats
    from geounfold.io.block_sizes import Sides


def columns_or_lengths(text: str) -> Triple | tuple[float, float, float]:
    """Return the three lengths, or the three columns, that an option is given."""
    try:
        a, b, c = (float(word) for word in text.split(","))
    except ValueError:
        return parse_columns(text)
    return a, b, c


class BlockVolumes:
    """Volumes of blocks, folded and unfolded: output columns and sums.

    Parameters
    ----------
    sizes : str or None
        The user's three columns or lengths; None finds columns by name.
    names : sequence of str
        The table's columns.
    source : str
        The table, for messages.

    Raises
    ------
    InputError
        A column that the table does not have.
    OptionError
        Lengths that are not positive.
    """

    def __init__(self, sizes: str | None, names: Sequence[str], source: str) -> None:
        from geounfold.io.block_sizes import Sides, size_columns

        self._sides: Sides | None = None
        self._folded = self._unfolded = 0.0
        self._without = 0
        if sizes is None:
            with suppress(InputError):  # several sets of columns: the user names none
                found = size_columns(names)
                self._sides = None if found is None else Sides(found)
            return
        given = columns_or_lengths(sizes)
        for value in given:
            if isinstance(value, str) and value not in names:
                raise InputError(f"{source}: no column '{value}' for --sizes")
            if not isinstance(value, str) and not 0 < value < np.inf:
                raise OptionError(f"--sizes needs three positive lengths, not '{sizes}'")
        self._sides = Sides(given)

    def columns(self, frame: pd.DataFrame, results: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return block_volume and unfolded_volume of a batch of rows; empty without sides.

        Their sums are added to those of earlier batches.
        """
        if self._sides is None:
            return {}
        volume = self._sides.of(frame).prod(axis=1)
        unfolded = volume * results["volume_ratio"]
        self._without += int(np.count_nonzero(np.isnan(volume)))
        self._folded += float(np.nansum(volume))
        self._unfolded += float(np.nansum(unfolded))
        return {"block_volume": volume, "unfolded_volume": unfolded}

    def facts(self) -> dict[str, Any]:
        """Return the sums over all batches, for the summary."""
        if self._sides is None:
            return {}
        return {
            "block_volumes": {
                "folded": self._folded,
                "unfolded": self._unfolded,
                "without_sides": self._without,
            }
        }

    def warnings(self) -> list[str]:
        """Return the warning of rows without sides."""
        if not self._without:
            return []
        return [f"{self._without} blocks have no positive sides, and so no volume"]
