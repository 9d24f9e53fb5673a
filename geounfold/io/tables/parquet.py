"""Parquet files, written one part after the other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from geounfold.extras import require
from geounfold.io.column_values import TextKind

if TYPE_CHECKING:
    from types import ModuleType


def pyarrow_module() -> ModuleType:
    """Return pyarrow with its Parquet part loaded.

    Raises
    ------
    MissingDependencyError
        pyarrow is not installed.
    """
    require("pyarrow.parquet", "Parquet files")
    return require("pyarrow", "Parquet files")


class ParquetParts:
    """A Parquet file that is written one part after the other."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._pyarrow = pyarrow_module()
        self._writer: Any = None

    def write(self, frame: pd.DataFrame, kinds: Mapping[str, TextKind] | None = None) -> None:
        """Write a part.

        Parameters
        ----------
        frame : DataFrame
            The part's rows; every part has the same columns.
        kinds : mapping of str to TextKind, optional
            Columns of text that are written as numbers, by name, and their kinds.
        """
        pyarrow, kinds = self._pyarrow, kinds or {}
        names = [str(name) for name in frame.columns]
        arrays = [
            pyarrow.array(kinds[name].typed(column) if name in kinds else column, from_pandas=True)
            for name, column in ((n, frame.iloc[:, i]) for i, n in enumerate(names))
        ]
        table = pyarrow.Table.from_arrays(arrays, names=names)
        if self._writer is None:
            # Coordinates hardly repeat, so a dictionary of them costs time and space.
            others = [f.name for f in table.schema if not pyarrow.types.is_floating(f.type)]
            unique = len(set(names)) == len(names)
            self._writer = pyarrow.parquet.ParquetWriter(
                self._path, table.schema, use_dictionary=others if unique else True
            )
        self._writer.write_table(table.cast(self._writer.schema))

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._writer.close()
