"""Values of table columns: as Python objects, and the types that text values can take."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd


def objects(column: pd.Series) -> np.ndarray:
    """Return a column's values as Python objects, (n,); missing ones are empty strings."""
    values = np.array(column.to_numpy(dtype=object))
    missing = column.isna().to_numpy(dtype=bool)
    if missing.any():
        values[missing] = ""
    return values


def unique_names(names: Iterable[object]) -> list[str]:
    """Return names as text; a name that is there already gets a number.

    Examples
    --------
    >>> unique_names(["au", "cu", "au"])
    ['au', 'cu', 'au_2']
    """
    made: list[str] = []
    taken: set[str] = set()
    for name in map(str, names):
        number, unique = 1, name
        while unique in taken:
            number += 1
            unique = f"{name}_{number}"
        taken.add(unique)
        made.append(unique)
    return made


@dataclass(frozen=True)
class TextKind:
    """The type that a column of text can be converted to without loss.

    Attributes
    ----------
    filled : bool
        Whether any text is not blank.
    whole : bool
        Whether every text that is not blank is an integer of 18 digits or fewer.
    real : bool
        Whether every text that is not blank is a float of 15 integer digits or fewer.
    """

    filled: bool
    whole: bool
    real: bool

    @classmethod
    def of(cls, column: pd.Series) -> TextKind:
        """Return the kind of a column of text."""
        words = _words(column)
        filled = words[words != ""]
        whole, fraction = r"(?:0|[1-9]\d{0,14})", r"(?:[eE][+-]?\d+)?"
        return cls(
            len(filled) > 0,
            bool(filled.str.fullmatch(r"0|-?[1-9]\d{0,17}").all()),
            bool(filled.str.fullmatch(rf"[+-]?(?:{whole}(?:\.\d*)?|\.\d+){fraction}").all()),
        )

    def joined(self, other: TextKind) -> TextKind:
        """Return the kind of both columns' texts together."""
        return TextKind(
            self.filled or other.filled, self.whole and other.whole, self.real and other.real
        )

    def typed(self, column: pd.Series) -> pd.Series:
        """Return text as integers or floats if that loses nothing, blanks as missing values."""
        if not self.filled or not (self.whole or self.real):
            return column
        words = _words(column)
        blank = (words == "").to_numpy()
        if self.whole:
            integers = pd.Series(pd.array([0] * len(words), dtype="Int64"))
            integers[~blank] = words[~blank].astype(np.int64)
            integers[blank] = pd.NA
            return integers
        return words.where(~blank, "nan").astype(np.float64)


def _words(column: pd.Series) -> pd.Series:
    return pd.Series(column.to_numpy(dtype=object), dtype=object).astype(str)


def typed_values(column: pd.Series) -> pd.Series:
    """Return text as integers or floats if that loses nothing, blanks as missing values."""
    return TextKind.of(column).typed(column)
