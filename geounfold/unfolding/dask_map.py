"""A fitted map on a Dask cluster: DataFrames in partitions, and files in parts.

The map travels as plain arrays, once to every worker.  Each part is a task of its own, which reads
its rows, carries them and writes one file, or returns one partition; a task that is lost with its
worker is done again and writes the same file again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from geounfold.backends.system import files
from geounfold.backends.threads import cores
from geounfold.errors import InputError, MissingDependencyError, OptionError
from geounfold.geometry.measures import LARGEST_COORDINATE
from geounfold.io.column_values import TextKind
from geounfold.io.coordinate_columns import coordinate_columns, numbers
from geounfold.io.packages.names import Triple
from geounfold.io.result_columns import (
    FOLDED,
    UNFOLDED,
    given_blocks,
    result_columns,
    with_carried,
    world_columns,
)
from geounfold.io.tables.files import table_writer, with_columns
from geounfold.io.tables.parts import Part
from geounfold.io.tables.points import Place
from geounfold.mapping.mesh_map import UnfoldingMap

if TYPE_CHECKING:
    from dask.dataframe import DataFrame
    from distributed import Client

    from geounfold.methods import PointwiseMap

_WAIT = 10  # seconds for a scheduler to answer


def _missing(error: ImportError) -> MissingDependencyError:
    return MissingDependencyError(f"Dask is not installed: pip install 'geounfold[dask]' ({error})")


def map_partitions(
    mapping: UnfoldingMap | PointwiseMap, frame: DataFrame, *, inverse: bool = False
) -> DataFrame:
    """Return a Dask DataFrame with the images of its points, computed on its own workers.

    Parameters
    ----------
    mapping : UnfoldingMap or PointwiseMap
        A fitted map, as ``Unfolding.map`` or ``load`` gives it.
    frame : dask.dataframe.DataFrame
        Points; the coordinate columns are found by name.
    inverse : bool
        From the flat space back; columns unfolded_x/y/z are taken first then.

    Returns
    -------
    dask.dataframe.DataFrame
        The same partitions, index and columns, and those of ``Unfolding.transform``; lazy.

    Raises
    ------
    MissingDependencyError
        Dask is not installed.
    InputError
        No coordinate columns; when computed, coordinates that are missing or no numbers.
    """
    try:
        from dask import delayed
    except ImportError as error:
        raise _missing(error) from error
    meta = _carried(frame._meta, mapping, inverse)
    # Not a task's argument but a task: the map is sent once to a worker, and made again if lost.
    out: DataFrame = frame.map_partitions(
        _carried, delayed(mapping, traverse=False), inverse, meta=meta, align_dataframes=False
    )
    return out


def _carried(
    frame: pd.DataFrame, mapping: UnfoldingMap | PointwiseMap, inverse: bool
) -> pd.DataFrame:
    carry = partial(mapping.carry, inverse=inverse)
    return with_carried(frame, carry, FOLDED if inverse else UNFOLDED)


@contextmanager
def cluster(scheduler: str | None = None) -> Iterator[Client]:
    """Yield a client of the scheduler at an address, or of workers on this machine's cores.

    Raises
    ------
    MissingDependencyError
        Dask is not installed.
    OptionError
        No scheduler answers at the address.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise _missing(error) from error
    if scheduler is None:
        with (
            LocalCluster(
                n_workers=cores(), threads_per_worker=1, dashboard_address=":0", silence_logs=50
            ) as local,
            Client(local) as client,
        ):
            yield client
        return
    try:
        client = Client(scheduler, timeout=_WAIT)
    except (OSError, ValueError, TypeError) as error:
        raise OptionError(
            f"--scheduler {scheduler}: no Dask scheduler answers there within {_WAIT} s; start one "
            "by `dask scheduler`, or leave the option out to use this machine's cores"
        ) from error
    with client:
        yield client


@dataclass(frozen=True)
class Carrying:
    """How files are carried.

    Attributes
    ----------
    columns : three str or None
        Names of the coordinate columns; None to find them by name.
    inverse : bool
        From the flat space back.
    drop_invalid : bool
        Leave out rows whose coordinates are missing or infinite instead of refusing them.
    ending : str
        Of the files written: .csv or .parquet.
    place : callable or None
        Takes the files' coordinates to the world's.
    """

    columns: Triple | None
    inverse: bool
    drop_invalid: bool
    ending: str
    place: Place | None = None

    def where(self, part: Part) -> tuple[int, int, int]:
        """Return which of a part's columns are the coordinates."""
        columns = self.columns
        if columns is None and self.inverse and set(UNFOLDED) <= set(part.names):
            columns = UNFOLDED
        own = self.place is not None
        where = coordinate_columns(part.names, columns, source=part.path, own=own)
        names = FOLDED if self.inverse else UNFOLDED
        clash = [part.names[k] for k in where if part.names[k] in names]
        if clash:
            raise InputError(
                f"{part.path}: the result's column '{clash[0]}' would replace the coordinates "
                "read; rename the input's columns"
            )
        return where


def carry_parts(
    client: Client, mapping: UnfoldingMap, parts: Sequence[Part], folder: Path, how: Carrying
) -> Counter[str]:
    """Carry the parts of a table and write each as a file of a folder, in their order.

    Parameters
    ----------
    client : distributed.Client
        Of a cluster whose workers see the files.
    mapping : UnfoldingMap
        The map.
    parts : sequence of Part
        See `geounfold.io.parts.parts_of`.
    folder : path
        Where ``part-00000.parquet`` (or .csv) and so on are written.
    how : Carrying
        Columns, direction and kind of files.

    Returns
    -------
    Counter
        How many points were ``carried``, ``extrapolated``, left empty (``outside``), ``dropped``.

    Raises
    ------
    InputError
        As for reading the files whole.
    """
    from dask import delayed

    how.where(parts[0])
    kinds: dict[str, TextKind] = {}
    if how.ending == ".parquet" and parts[0].text:
        for seen in client.gather(client.map(_kinds, parts)):
            kinds = {n: kinds[n].joined(k) if n in kinds else k for n, k in seen.items()}
    there = delayed(mapping, traverse=False)
    task = delayed(_carry_part, pure=False)
    tasks = [
        task(part, there, str(folder / f"part-{k:05d}{how.ending}"), how, kinds)
        for k, part in enumerate(parts)
    ]
    total: Counter[str] = Counter()
    for counts in client.gather(client.compute(tasks)):
        total.update(counts)
    return total


def _kinds(part: Part) -> dict[str, TextKind]:
    frame = part.frame()
    return {name: TextKind.of(frame.iloc[:, k]) for k, name in enumerate(part.names)}


def _carry_part(
    part: Part, mapping: UnfoldingMap, out: str, how: Carrying, kinds: dict[str, TextKind]
) -> dict[str, int]:
    """Read, carry and write one part; whole or not at all, and the same each time."""
    frame = part.frame()
    points = np.column_stack([numbers(frame.iloc[:, k], source=part.path) for k in how.where(part)])
    if how.place is not None:
        points = how.place(points)
    valid = np.asarray(np.isfinite(points).all(axis=1))
    if not valid.all() and not how.drop_invalid:
        row = part.row + int(np.flatnonzero(~valid)[0]) + 1
        raise InputError(
            f"{part.path}: data row {row} has a missing or infinite coordinate, and "
            f"{int((~valid).sum())} rows in its part of the file; correct them, or go on without "
            "them by --drop-invalid"
        )
    frame, points = frame.loc[valid].reset_index(drop=True), points[valid]
    if (np.abs(points) > LARGEST_COORDINATE).any():
        raise InputError(f"{part.path}: a coordinate is beyond {LARGEST_COORDINATE:g}")
    names = FOLDED if how.inverse else UNFOLDED
    blocks = given_blocks(frame, inverse=how.inverse)
    blocks = blocks if mapping.faulted else None
    results = result_columns(names, mapping.carry_by_block(points, blocks, inverse=how.inverse))
    if how.place is not None:
        results = world_columns(points) | results
    target = Path(out)
    fresh = target.with_name(f".{target.name}")
    with table_writer(fresh) as write:
        own = {name: kind for name, kind in kinds.items() if name not in results}
        write(with_columns(frame, results), own)
    files.replace(fresh, target)
    location = results["location"]
    return {
        "carried": len(points),
        "extrapolated": int(np.count_nonzero(location == "extrapolated")),
        "outside": int(np.count_nonzero(location == "outside")),
        "dropped": int((~valid).sum()),
    }


def carry_folder(
    scheduler: str | None,
    mapping: UnfoldingMap,
    parts: Sequence[Part],
    folder: Path,
    how: Carrying,
) -> dict[str, Any]:
    """Carry parts into a folder on the cluster at an address, or on this machine's cores."""
    with cluster(scheduler) as client:
        return dict(carry_parts(client, mapping, parts, folder, how))
