"""Parts common to all versions of OMF: the values of elements, their units and versions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.io.column_values import unique_names
from geounfold.io.formats.grids import Blocks, with_sides
from geounfold.io.formats.point_tables import flattened
from geounfold.io.formats.registry import Meta, Points
from geounfold.io.formats.units import unit_name


def values_by_name(found: Iterable[tuple[str, np.ndarray]], rows: int) -> dict[str, np.ndarray]:
    """Return arrays as columns; arrays without a name and repeated names are numbered.

    Raises
    ------
    ValueError
        An array does not have one value, or vector, for each row.
    """
    arrays = list(found)
    names = unique_names(name or f"data_{k}" for k, (name, _) in enumerate(arrays))
    columns: dict[str, np.ndarray] = {}
    for name, (_, array) in zip(names, arrays, strict=True):
        if len(array) != rows:
            raise ValueError(f"'{name}' has {len(array)} values for {rows} places")
        columns |= flattened(name, array, rows)
    return columns


def of_parents(
    found: Iterable[tuple[str, np.ndarray]], parent: Ints, count: int
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield values of ``count`` parent blocks for each sub-block.

    ``parent`` (n,) is the row of each sub-block's parent.

    Raises
    ------
    ValueError
        An array does not have one value for each parent block.
    """
    for name, array in found:
        if len(array) != count:
            raise ValueError(f"'{name}' has {len(array)} values for {count} blocks")
        yield name, array[parent]


def block_points(blocks: Blocks, found: Iterable[tuple[str, np.ndarray]], meta: Meta) -> Points:
    """Return a block model's centroids with its values, sides and indices."""
    values = values_by_name(found, len(blocks.ijk))
    return Points(blocks.centres, with_sides(values, blocks.sides, blocks.ijk), meta)


def words_of(codes: np.ndarray, legend: Mapping[int, str]) -> np.ndarray:
    """Return the words of codes (n,); an unknown code gets an empty word.

    Examples
    --------
    >>> words_of(np.array([7, 3, -1]), {3: "ore", 7: "waste"}).tolist()
    ['waste', 'ore', '']
    """
    known, back = np.unique(codes, return_inverse=True)
    words = np.array([str(legend.get(int(code), "")) for code in known], dtype=object)
    return np.asarray(words[back.ravel()], dtype=object) if len(words) else words


def vector(value: Any) -> Floats:
    """Return three numbers of an index as an array, (3,)."""
    return np.asarray(value, dtype=np.float64).reshape(3)


def unread_version(path: Path, version: object) -> InputError:
    """Return the error for a file of a version that cannot be read."""
    return InputError(f"{path}: is an OMF file of a version that is not read: {version!r}")


def coordinate_meta(unit: str | None, reference: str | None) -> Meta:
    """Return unit and coordinate reference, without those that are empty."""
    meta = {"unit": unit_name(unit or ""), "crs": (reference or "").strip()}
    return {key: value for key, value in meta.items() if value}
