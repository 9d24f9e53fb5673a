"""Solids filled with blocks: closed surfaces, and what lies between two open ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from geounfold.backends.igl import SurfaceIndex
from geounfold.backends.igl_solids import FastWinding
from geounfold.body.fill.between import Pair, facing_pair, walled
from geounfold.body.fill.cells import Cells, Distance, Inside, cells_inside
from geounfold.body.fill.shell import Shell, closed_shell
from geounfold.errors import InputError, OptionError, check_number
from geounfold.geometry.mesh import Floats, TriMesh

ACROSS = 8
"""Blocks across the mean thickness, if no size is given.

The stratigraphic error of a folded layer falls little with more: see the guide on wireframes.
"""

USUAL = 1_000_000
"""Number of blocks above which the size that is chosen from the thickness grows."""

MOST = 20_000_000
"""Number of blocks above which a size that is given is refused; they take about 3 GB."""

FEW = 3.0  # blocks across the mean thickness below which the user is told

SPLITS = (2, 4, 8)
"""Parts into which a side of a block at the border may be split."""

_ROUND = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)


@dataclass(frozen=True, eq=False)
class FilledSolid:
    """Blocks in a solid, and the surfaces that bound it.

    Made by ``fill``. ``unfold`` takes it in place of points; its surfaces are then the horizons.

    Attributes
    ----------
    points : (n, 3) float
        Centroids, in the surface's coordinates, in lexicographic order.
    sizes : (n, 3) float
        Sides of every block.
    block_size : (3,) float
        Sides of a whole block.
    shell : Shell or None
        The closed surface, mended; None between two open ones.
    pair : Pair or None
        The surfaces above and below; None in a closed one.
    told : tuple of str
        What was mended and chosen, one sentence each.
    """

    points: Floats
    sizes: Floats
    block_size: Floats
    shell: Shell | None
    pair: Pair | None
    told: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        """Return one line: blocks, their size, their volume."""
        return (
            f"<FilledSolid of {len(self)} blocks of {_sides(self.block_size)}: "
            f"volume {self.blocks_volume:.6g} for {self.volume:.6g}>"
        )

    @property
    def bounds(self) -> Shell | Pair:
        """The closed surface, or the two open ones."""
        out = self.pair if self.shell is None else self.shell
        assert out is not None
        return out

    @property
    def volume(self) -> float:
        """Volume of the solid; between two surfaces that of the blocks."""
        return self.blocks_volume if self.shell is None else self.shell.volume

    @property
    def blocks_volume(self) -> float:
        """Volume of the blocks."""
        return float(np.prod(self.sizes, axis=1).sum())

    @property
    def table(self) -> pd.DataFrame:
        """The blocks: x, y, z of the centroids, and their sides dx, dy, dz."""
        columns = dict(zip("xyz", self.points.T, strict=True))
        return pd.DataFrame(columns | dict(zip(("dx", "dy", "dz"), self.sizes.T, strict=True)))

    def facts(self) -> dict[str, Any]:
        """Return the figures for a summary."""
        whole = bool((self.sizes == self.block_size).all())
        return {
            "blocks": len(self),
            "block_size": self.block_size.tolist(),
            "sub_blocked": not whole,
            "blocks_volume": self.blocks_volume,
            "volume": self.volume,
            "thickness": self.bounds.thickness,
            "told": list(self.told),
        }


def fill_solid(
    mesh: TriMesh, block_size: float | Sequence[float] | None = None, sub_blocks: int = 1
) -> FilledSolid:
    """Return the blocks whose centres lie in a closed surface.

    Parameters
    ----------
    mesh : TriMesh
        A closed surface in any orientation; see `closed_shell` for what is mended.
    block_size : float or three floats, optional
        Sides of a block; by default an eighth of the mean thickness, rounded down, or the sides of
        the blocks whose faces the triangles are.
    sub_blocks : int
        2, 4 or 8 splits the sides of blocks at the border into as many parts; 1 splits none.

    Raises
    ------
    InputError
        The surface cannot be a solid's, or no block's centre lies in it.
    OptionError
        A size or a split outside the valid values, or too many blocks.
    """
    _check(block_size, sub_blocks)
    shell = closed_shell(mesh)
    cells, told = _own_cells(shell, block_size)
    if cells is None:
        step, told = block_sides(block_size, shell.thickness, shell.volume)
        cells = Cells(step)

    points, sizes = _blocks(cells, shell.mesh.V, _inside(shell.mesh), sub_blocks)
    _check_some(points, cells, shell.thickness)
    return FilledSolid(points, sizes, cells.step, shell, None, (*shell.told, *told))


def fill_between(
    top: TriMesh,
    bottom: TriMesh,
    block_size: float | Sequence[float] | None = None,
    sub_blocks: int = 1,
) -> FilledSolid:
    """Return the blocks whose centres lie between two open surfaces.

    A wall joins their borders. If one has a hole or several parts, a centre lies between them if
    they fill more than half of its view, which cuts rims short by up to a thickness.

    Parameters
    ----------
    top, bottom : TriMesh
        The surfaces, in any orientation.
    block_size, sub_blocks
        As in `fill_solid`.

    Raises
    ------
    InputError
        The surfaces are the same, or no block's centre lies between them.
    OptionError
        As in `fill_solid`.
    """
    _check(block_size, sub_blocks)
    pair = facing_pair(top, bottom)
    closed = walled(pair)
    V = np.concatenate([pair.top.V, pair.bottom.V])
    F = np.concatenate([pair.top.F, pair.bottom.F + len(pair.top.V)])
    step, told = block_sides(block_size, pair.thickness, pair.volume)
    cells = Cells(step)
    solid = _within(TriMesh(V, F)) if closed is None else _inside(closed)
    points, sizes = _blocks(cells, V, solid, sub_blocks)
    _check_some(points, cells, pair.thickness)
    return FilledSolid(points, sizes, step, None, pair, told)


def _inside(mesh: TriMesh) -> tuple[Inside, Distance]:
    """Return what tells points inside a closed surface, and their distance from it."""
    wind, index = FastWinding(mesh.V, mesh.F), SurfaceIndex(mesh.V, mesh.F)
    return (
        lambda points: np.asarray(wind(points) > 0.5),
        lambda points: index.closest(points)[0],
    )


def _within(mesh: TriMesh) -> tuple[Inside, Distance]:
    """Return what tells points between open surfaces: these fill more than half of the view.

    Nothing is known about a whole large cell then.
    """
    wind = FastWinding(mesh.V, mesh.F)
    return lambda points: np.asarray(wind(points) > 0.5), lambda points: np.zeros(len(points))


def _check(block_size: float | Sequence[float] | None, sub_blocks: int) -> None:
    """Raise OptionError unless both options are valid."""
    if sub_blocks not in (1, *SPLITS):
        raise OptionError(f"sub_blocks must be 1, 2, 4 or 8, but is {sub_blocks}")
    if block_size is None:
        return
    sides = np.atleast_1d(np.asarray(block_size, dtype=object)).tolist()
    if len(sides) not in (1, 3):
        raise OptionError(f"block_size must be a length or three, but is {block_size}")
    for side in sides:
        check_number("block_size", side, 0, low_open=True)


def _check_some(points: Floats, cells: Cells, thickness: float) -> None:
    """Raise InputError if there is no block."""
    if not len(points):
        raise InputError(
            f"no centre of a block of {_sides(cells.step)} lies inside; the mean thickness is "
            f"{thickness:.4g}: give a smaller --block-size"
        )


def _blocks(
    cells: Cells, around: Floats, solid: tuple[Inside, Distance], parts: int
) -> tuple[Floats, Floats]:
    """Return centroids and sides of the blocks inside, cut into parts where the border is."""
    if parts == 1:
        points = cells.centres(cells_inside(cells, around, *solid))
        return points, np.tile(cells.step, (len(points), 1))
    fine = cells.parted(parts)
    small = cells_inside(fine, around, *solid)
    key, back, count = np.unique(
        np.floor_divide(small, parts), axis=0, return_inverse=True, return_counts=True
    )
    whole = count == parts**3
    kept = small[~whole[back.ravel()]]
    points = np.concatenate([cells.centres(key[whole]), fine.centres(kept)])
    sizes = np.repeat([cells.step, fine.step], [int(whole.sum()), len(kept)], axis=0)
    order = np.lexsort(points.T[::-1])
    return points[order], sizes[order]


def _own_cells(
    shell: Shell, block_size: float | Sequence[float] | None
) -> tuple[Cells | None, tuple[str, ...]]:
    """Return the lattice of blocks whose faces the triangles are, if these sides are wanted."""
    lattice = shell.blocks
    if lattice is None:
        return None, ()
    step = np.array([float(f"{s:.9g}") for s in lattice.steps])
    asked = step if block_size is None else np.broadcast_to(np.asarray(block_size, float), 3)
    if not np.allclose(asked, step, rtol=1e-6) or shell.volume / step.prod() > MOST:
        return None, ()
    told = f"the triangles are faces of blocks of {_sides(step)}: these blocks were taken"
    return Cells(step, lattice.origin, lattice.axes), (told,)


def block_sides(
    given: float | Sequence[float] | None, thickness: float, volume: float
) -> tuple[Floats, tuple[str, ...]]:
    """Return the sides of a block, (3,), and what the user is told of them."""
    if given is None:
        return _size_from(thickness, volume)
    step = np.broadcast_to(np.asarray(given, dtype=np.float64), 3).copy()
    blocks = volume / float(step.prod())
    if blocks > MOST:
        least = float(np.cbrt(volume / USUAL))
        raise OptionError(
            f"block_size {_sides(step)} makes about {blocks:.3g} blocks, more than {MOST:,}; "
            f"{_rounded_up(least):g} makes about {USUAL:,}"
        )
    across = thickness / float(step.min())
    if across >= FEW:
        return step, ()
    return step, (
        f"a block of {_sides(step)} is large for a mean thickness of {thickness:.4g}: smaller "
        f"blocks, such as {_rounded(thickness / ACROSS):g}, show the folds better",
    )


def _size_from(thickness: float, volume: float) -> tuple[Floats, tuple[str, ...]]:
    """Return cubes of a share of the mean thickness, or larger ones if these would be too many."""
    side = _rounded(thickness / ACROSS)
    told = (
        f"blocks of {side:g} a side were chosen, {thickness / side:.3g} to the mean thickness of "
        f"{thickness:.4g}; --block-size sets another size"
    )
    if volume / side**3 > USUAL:
        side = _rounded_up(float(np.cbrt(volume / USUAL)))
        told = (
            f"blocks of {side:g} a side were chosen, so that there are at most {USUAL:,}; the mean "
            f"thickness is {thickness:.4g}; --block-size sets another size"
        )
    return np.full(3, side), (told,)


def _rounded(length: float) -> float:
    """Return a length rounded down to a short number.

    >>> [_rounded(x) for x in (14.9, 0.9, 1.0, 77)]
    [12.5, 0.8, 1.0, 60.0]
    """
    power = 10.0 ** np.floor(np.log10(length * (1 + 1e-9)))
    return float(f"{max(r for r in _ROUND if r * power <= length * (1 + 1e-9)) * power:.6g}")


def _rounded_up(length: float) -> float:
    """Return a length rounded up to a short number.

    >>> [_rounded_up(x) for x in (14.9, 0.9, 1.0, 82)]
    [15.0, 1.0, 1.0, 100.0]
    """
    power = 10.0 ** np.floor(np.log10(length))
    steps = [r * power for r in (*_ROUND, 10.0)]
    return float(f"{min(s for s in steps if s >= length * (1 - 1e-9)):.6g}")


def _sides(step: Floats) -> str:
    return " x ".join(f"{s:.6g}" for s in step)
