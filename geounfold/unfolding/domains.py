"""Several domains of one model, every one unfolded on its own."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pandas as pd

from geounfold.errors import DomainError, GeounfoldError, InputError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.io.coordinate_columns import coordinate_columns
from geounfold.io.messages import counted
from geounfold.io.result_columns import UNFOLDED, result_columns
from geounfold.io.selection import column_position, read_where
from geounfold.io.selection.labels import codes_of
from geounfold.io.selection.mixed import left_out
from geounfold.io.tables.parted import spread_columns
from geounfold.io.tables.points import chosen_rows
from geounfold.mapping.domain_map import DomainMap
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.result import Unfolding
from geounfold.unfolding.run import unfold
from geounfold.unfolding.waste import waste_domains, waste_told

_log = logging.getLogger("geounfold")

_MOST = 1000  # domains of a run; models have tens, a column of grades thousands

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Domains(Mapping[str, Unfolding]):
    """The unfolded domains of a model, by name; those that failed are named apart.

    Attributes
    ----------
    column : str
        Column that names the domains.
    results : dict of Unfolding
        By the domain's name.
    failures : dict of GeounfoldError
        Why a domain could not be unfolded, by its name.
    blocks : dict of int
        Number of blocks of every domain.
    given : DataFrame or None
        The model.
    part : (n,) int
        Position of each row's domain among `results`; -1 if the row was not selected, -2 if its
        domain has no result.
    """

    column: str
    results: Mapping[str, Unfolding]
    failures: Mapping[str, GeounfoldError]
    blocks: Mapping[str, int]
    given: pd.DataFrame | None
    part: Ints

    def __getitem__(self, name: str) -> Unfolding:
        return self.results[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.results)

    def __len__(self) -> int:
        return len(self.results)

    def __repr__(self) -> str:
        failed = f"; failed: {', '.join(self.failures)}" if self.failures else ""
        return f"Domains(by {self.column}: {', '.join(self.results)}{failed})"

    @property
    def table(self) -> pd.DataFrame:
        """The model with all results, the rows in order.

        The location of rows without a result is ``elsewhere``, or ``not selected``.
        """
        if self.given is None:
            raise InputError("the domains were not given as a DataFrame")
        divided = any(u.junctions for u in self.values())
        found = []
        for k, u in enumerate(self.values()):
            columns = {**result_columns(UNFOLDED, u.carried), **u.columns}
            if divided:
                columns["body_part"] = u.body_part
            found.append((np.flatnonzero(self.part == k), columns))
        return self.given.assign(**spread_columns(found, self.part))

    @property
    def rows(self) -> pd.DataFrame:
        """A row per domain: blocks, outcome, trust, figures, seconds, error."""
        return pd.DataFrame(self.facts())

    def facts(self) -> list[dict[str, Any]]:
        """Return a row per domain, in the order of their names, for a summary."""
        return [
            _result_row(name, self.results[name])
            if name in self.results
            else _failure_row(name, count, self.failures[name])
            for name, count in self.blocks.items()
        ]

    @property
    def map(self) -> DomainMap:
        """The maps of all domains.

        Raises
        ------
        InputError
            The method has no control mesh.
        """
        maps = {}
        for name, u in self.items():
            if not isinstance(u.map, UnfoldingMap):
                raise InputError(f"method {u.options.method} has no map that can be saved")
            maps[name] = u.map
        return DomainMap(self.column, maps)

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write the maps of all domains into one file; ``geounfold.load_domains`` reads it."""
        self.map.save(path)

    def check(self) -> None:
        """Raise DomainError if a domain failed; the first one's error if all did."""
        if not self.failures:
            return
        first = next(iter(self.failures))
        if not self.results:
            raise type(self.failures[first])(f"{self.column} {first}: {self.failures[first]}")
        told = "; ".join(f"{name}: {error}" for name, error in self.failures.items())
        rest = f'"{left_out(self.column, list(self.failures))}"'
        raise DomainError(
            f"{len(self.failures)} of {len(self.blocks)} domains failed, the others are there: "
            f"{told}; --where {rest} leaves out what is no body"
        )


def unfold_domains(
    points: pd.DataFrame,
    by: str,
    options: UnfoldOptions | None = None,
    *,
    where: str | None = None,
    progress: Progress | None = None,
    **changes: Any,
) -> Domains:
    """Unfold every domain of a model on its own.

    Parameters
    ----------
    points : DataFrame
        The model: centroids, in columns found by name, and the column of the domains.
    by : str
        Column that names each block's domain; a block without a name is in none.
    options : UnfoldOptions, optional
        Options of every domain.
    where : str, optional
        Chooses rows, such as ``"DOMAIN!=WASTE"``.
    progress : callable, optional
        Called with every stage's name as it starts, the domain's name before it.
    **changes
        Fields of UnfoldOptions given by name.

    Returns
    -------
    Domains
        The unfoldings by name. A domain that fails is in ``failures`` and leaves the others
        standing.

    Raises
    ------
    InputError
        No such column, or no row is chosen.
    GeounfoldError
        All domains failed; the error is that of the first.

    Examples
    --------
    >>> import geounfold as gu
    >>> X = gu.simulate("sim_case_1").folded
    >>> model = pd.DataFrame(np.concatenate([X, X + 500]), columns=["x", "y", "z"])
    >>> model["LODE"] = np.repeat(["A", "B"], len(X))
    >>> gu.unfold_domains(model, "LODE")
    Domains(by LODE: A, B)
    """
    position = column_position([str(name) for name in points.columns], by, "the table")
    chosen = np.ones(len(points), dtype=bool)
    if where is not None:
        chosen = chosen_rows(read_where(where), points, "the table")
    codes, names = codes_of([points.iloc[:, position]])
    codes = np.where(chosen, codes, -1)

    def run(rows: Ints, stage: Progress | None) -> Unfolding:
        return unfold(points.iloc[rows], options, progress=stage, **changes)

    check_domains_named(codes, names, f"column '{by}'")
    column = str(points.columns[position])
    for warning in model_warnings(column, codes, names, chosen, _places(points, chosen)):
        _log.warning("%s", warning)
    results, failures, blocks = each_domain(codes, names, run, progress)
    part = parts_of_rows(codes, names, list(results), chosen)
    found = Domains(column, results, failures, blocks, points.copy(), part)
    if not results:
        found.check()
    return found


def each_domain(
    codes: Ints,
    names: list[str],
    run: Callable[[Ints, Progress | None], Any],
    progress: Progress | None,
) -> tuple[dict[str, Any], dict[str, GeounfoldError], dict[str, int]]:
    """Run every domain that has rows; return results, failures and numbers of rows by name.

    Parameters
    ----------
    codes : (n,) int
        Domain of each row; -1 for none.
    names : list of str
        Names of the domains.
    run : callable
        Returns the result of some rows (k,), given these and what to call at each stage.
    progress : callable, optional
        Called with every stage's name.
    """
    results: dict[str, Any] = {}
    failures: dict[str, GeounfoldError] = {}
    blocks: dict[str, int] = {}
    for code, name in enumerate(names):
        rows = np.flatnonzero(codes == code)
        if not len(rows):
            continue
        blocks[name] = len(rows)

        try:
            results[name] = run(rows, None if progress is None else _of_domain(progress, name))
        except GeounfoldError as error:
            failures[name] = error
    return results, failures, blocks


def _of_domain(progress: Progress, name: str) -> Progress:
    """Return what tells a domain's stages: of one argument, so that it gets no share of the run."""
    return lambda what: progress(f"{name}: {what}")


def check_domains_named(codes: Ints, names: list[str], column: str) -> None:
    """Raise InputError if no row has a domain, or if there are too many to be domains."""
    count = len(np.unique(codes[codes >= 0]))
    if not count:
        raise InputError(f"{column} has no value in any row that is chosen")
    if count > _MOST:
        first = ", ".join(names[:3])
        raise InputError(
            f"{column} has {count} different values ({first}, ...): the domains of a model are "
            f"{_MOST} at most; name the column of the domains"
        )


def model_warnings(
    column: str, codes: Ints, names: list[str], chosen: Bools, points: Floats
) -> list[str]:
    """Return what to know of a model's domains before they are unfolded, one sentence each.

    Parameters
    ----------
    column : str
        Of the domains.
    codes, chosen : (n,) int and bool
        Domain of each row, -1 for none, and the rows chosen.
    names : list of str
        Names of the domains.
    points : (k, 3) float
        Centroids of the rows chosen.
    """
    counts = np.bincount(codes[codes >= 0], minlength=len(names))
    waste = waste_domains(codes[chosen], names, points)
    told = waste_told(column, waste, dict(zip(names, counts.tolist(), strict=True)))
    blank = int(np.count_nonzero(chosen & (codes < 0)))
    none = (
        f"{counted(blank, 'row has', 'rows have')} no value in {column}, and so no domain: their "
        "results are empty"
    )
    return [*([told] if told else []), *([none] if blank else [])]


def parts_of_rows(codes: Ints, names: list[str], done: list[str], chosen: Any) -> Ints:
    """Return the position of each row's domain among those done, (n,); -1 and -2 as PartedTable."""
    place = np.array([done.index(name) if name in done else -2 for name in [*names]] + [-2])
    return np.where(chosen, place[codes], -1)


def _places(frame: pd.DataFrame, chosen: Bools) -> Floats:
    """Return the coordinates of rows; NaN for texts, about which their own domain fails."""
    at = coordinate_columns([str(name) for name in frame.columns])
    columns = (pd.to_numeric(frame.iloc[:, k], errors="coerce") for k in at)
    return np.column_stack([column.to_numpy(np.float64, na_value=np.nan) for column in columns])[
        chosen
    ]


def _result_row(name: str, u: Unfolding) -> dict[str, Any]:
    return {
        "domain": name,
        "blocks": len(u.folded),
        "outcome": "proved" if u.injective else "not proved",
        "trust": None if u.trust is None else u.trust.word,
        "nmd_mean": u.quality.nmd.mean,
        "body_volume": u.body_volume["folded"],
        "volume_folded": u.quality.volume_folded,
        "volume_unfolded": u.quality.volume_unfolded,
        "outside_share": u.outside_share,
        "torn": u.torn,
        "seconds": sum(u.seconds.values()),
        "error": "",
    }


def _failure_row(name: str, blocks: int, error: GeounfoldError) -> dict[str, Any]:
    empty = dict.fromkeys(
        (
            "trust",
            "nmd_mean",
            "body_volume",
            "volume_folded",
            "volume_unfolded",
            "outside_share",
            "torn",
            "seconds",
        )
    )
    return {"domain": name, "blocks": blocks, "outcome": "failed", **empty, "error": str(error)}
