"""The maps of several domains of one model, each of which carries its own points."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from geounfold.errors import InputError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.mapping import mesh_map
from geounfold.mapping.carried import Carried, checked_points
from geounfold.mapping.domain_file import holds_domains, read_domains, write_domains
from geounfold.mapping.mesh_map import UnfoldingMap


class DomainMap(Mapping[str, UnfoldingMap]):
    """The maps of the domains of one model, by name.

    Every domain was unfolded on its own and has a flat space of its own, so that points of the
    flat space need their domain's name.

    Parameters
    ----------
    column : str
        Column of the model that names the domains.
    maps : dict of UnfoldingMap
        The maps, by the domain's name.
    """

    def __init__(self, column: str, maps: Mapping[str, UnfoldingMap]) -> None:
        self.column = column
        self.maps = dict(maps)

    def __getitem__(self, name: str) -> UnfoldingMap:
        return self.maps[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.maps)

    def __len__(self) -> int:
        return len(self.maps)

    def __repr__(self) -> str:
        return f"DomainMap(by {self.column}: {', '.join(self.maps)})"

    def codes(self, domains: Sequence[Any] | np.ndarray | str, count: int) -> Ints:
        """Return the position of each point's domain among the maps, (n,); -1 if there is none.

        Parameters
        ----------
        domains : (n,) sequence or str
            Names of domains, or one for all points.
        count : int
            Number of points.

        Raises
        ------
        InputError
            There are not as many names as points.
        """
        if isinstance(domains, str):
            domains = [domains] * count
        if len(domains) != count:
            raise InputError(f"{count} points need as many names of domains, not {len(domains)}")
        place = {name: k for k, name in enumerate(self.maps)}
        return np.array([place.get(str(name).strip(), -1) for name in domains], dtype=np.int64)

    def nearest(self, points: Floats) -> Ints:
        """Return the position of the domain in or nearest to which points (n, 3) lie, (n,).

        It is -1 for points that no map reaches. Of domains at one distance the first is taken.
        """
        return nearest_domain(list(self.maps.values()), points)

    def carry(
        self, points: Floats, domains: Sequence[Any] | np.ndarray | str, *, inverse: bool = False
    ) -> Carried:
        """Carry points, each by its domain's map; those of other domains have no image.

        Parameters
        ----------
        points : (n, 3) float
            Folded points; with `inverse` unfolded ones.
        domains : (n,) sequence or str
            Each point's domain, or one for all.
        inverse : bool
            True for the way back to the folded space.
        """
        P = np.asarray(points, dtype=np.float64)
        codes = self.codes(domains, len(P))
        return carry_domains(list(self.maps.values()), P, codes, inverse=inverse)

    def to_flat(self, points: Floats, domains: Sequence[Any] | np.ndarray | str) -> Floats:
        """Return folded points (n, 3) in the flat spaces of their domains; NaN without image."""
        return self.carry(points, domains).points

    def to_folded(self, points: Floats, domains: Sequence[Any] | np.ndarray | str) -> Floats:
        """Return flat points (n, 3) of domains in the folded space; NaN without image."""
        return self.carry(points, domains, inverse=True).points

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write all maps into one file; ``geounfold.load_domains`` reads it."""
        contents = {}
        for name, saved in self.maps.items():
            stream = io.BytesIO()
            saved.save(stream)
            contents[name] = stream.getvalue()
        write_domains(path, self.column, contents)


def load_domains(path: str | Path) -> DomainMap:
    """Read the maps of several domains, written by ``DomainMap.save`` or ``Domains.save``.

    Raises
    ------
    InputError
        No such file, not the maps of domains, of another version, or damaged.
    """
    if not holds_domains(path):
        raise InputError(f"{path}: holds no maps of domains; geounfold.load reads a single map")
    column, contents = read_domains(path)
    return DomainMap(
        column,
        {name: mesh_map.of_bytes(content, Path(path)) for name, content in contents.items()},
    )


def carry_domains(
    maps: Sequence[Any], points: Floats, codes: Ints, *, inverse: bool = False
) -> Carried:
    """Return points (n, 3) carried by one of several maps each; -1 in `codes` (n,) has no image."""
    n = len(points)
    out = Carried(
        points=np.full((n, 3), np.nan),
        stratigraphic=np.full(n, np.nan),
        inside=np.zeros(n, dtype=bool),
        placed=np.zeros(n, dtype=bool),
        element=np.full(n, -1, dtype=np.int64),
        distance=np.full(n, np.nan),
    )
    for k, saved in enumerate(maps):
        rows = np.flatnonzero(codes == k)
        if len(rows):
            found = saved.carry(points[rows], inverse=inverse)
            for name in ("points", "stratigraphic", "inside", "placed", "element", "distance"):
                getattr(out, name)[rows] = getattr(found, name)
    return out


def nearest_domain(maps: Sequence[Any], points: Floats) -> Ints:
    """Return the map in or nearest to whose body folded points (n, 3) lie, (n,); -1 for none."""
    P = checked_points(points)
    best, least = np.full(len(P), -1, dtype=np.int64), np.full(len(P), np.inf)
    for k, saved in enumerate(maps):
        carried = saved.carry(P)
        away = carried.distance
        if isinstance(saved, UnfoldingMap):
            away = saved.body_distance(P, carried) * saved.frame.scale
        nearer = carried.placed & (away < least)
        best[nearer], least[nearer] = k, away[nearer]
    return best
