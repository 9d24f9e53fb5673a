"""A faulted body: blocks, flat coordinates, fault blocks, fault surfaces and true slips."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from geounfold.geometry.mesh import Floats, Ints
from geounfold.synthetic.faulted.recipe import FaultedSpec

Surface = tuple[Floats, Ints]
"""Vertices (m, 3) and triangles (k, 3)."""


@dataclass(frozen=True, eq=False)
class TrueSlip:
    """Pairs of places that one piece of rock had on both walls of a fault, in final space.

    Attributes
    ----------
    flat : (n, 3) float
        Flat coordinates of the rock.
    footwall, hanging_wall : (n, 3) float
        Where its two halves are.
    blocks : (n, 2) int
        Fault blocks of footwall and hanging wall; -1 if the body has no block there.
    """

    flat: Floats
    footwall: Floats
    hanging_wall: Floats
    blocks: Ints

    @property
    def vectors(self) -> Floats:
        """Slip of the hanging wall, (n, 3)."""
        out: Floats = self.hanging_wall - self.footwall
        return out

    @property
    def throw(self) -> Floats:
        """Vertical part of the slip, (n,); positive if the hanging wall went down."""
        out: Floats = -self.vectors[:, 2]
        return out


@dataclass(frozen=True, eq=False)
class FaultedBody:
    """Blocks of a faulted body, and what is true of them.

    Attributes
    ----------
    name : str
        Name of the recipe.
    folded, truth : (n, 3) float
        Block centroids in world coordinates, and their flat coordinates.
    fault_block : (n,) int
        True fault block: 0 for the largest. A fault that ends inside the body divides it along
        its continuation too.
    sizes : (n, 3) float
        Block sides along the lattice's axes.
    surfaces : dict of fault name to (vertices, triangles)
        Fault surfaces in world coordinates. They reach some nine blocks past the body, and end
        where the fault does.
    slips : dict of fault name to TrueSlip
        True slip at the vertices of each surface that lie in the body. No pair is left if a
        younger fault tore all of them apart.
    spec : FaultedSpec
        The recipe.
    """

    name: str
    folded: Floats
    truth: Floats
    fault_block: Ints
    sizes: Floats
    surfaces: dict[str, Surface]
    slips: dict[str, TrueSlip]
    spec: FaultedSpec

    @property
    def level(self) -> Floats:
        """True stratigraphic coordinate, (n,): 0 at the bottom, 1 at the top."""
        u, v, w = self.truth.T
        out: Floats = w / (2 * self.spec.half_thickness(u, v)) + 0.5
        return out

    @property
    def step(self) -> float:
        """Side of a cube of a block's volume: the unit of errors in blocks."""
        return self.spec.step

    def frame(self, decimals: int | None = None) -> pd.DataFrame:
        """Return a table with a row per block.

        Columns are centroid_x/y/z, true_x/y/z, true_fault_block and, if blocks differ in size,
        dim_x/y/z: their sides along the lattice's axes.

        Parameters
        ----------
        decimals : int, optional
            Decimals to which all columns are rounded; not rounded by default.
        """
        data: dict[str, Any] = {f"centroid_{c}": self.folded[:, i] for i, c in enumerate("xyz")}
        data |= {f"true_{c}": self.truth[:, i] for i, c in enumerate("xyz")}
        if (self.sizes != self.sizes[:1]).any():
            data |= {f"dim_{c}": self.sizes[:, i] for i, c in enumerate("xyz")}
        table = pd.DataFrame(data)
        table = table if decimals is None else table.round(decimals) + 0.0
        return table.assign(true_fault_block=self.fault_block)

    def with_surfaces(self, surfaces: Mapping[str, Surface]) -> FaultedBody:
        """Return the body with other surfaces; its truth stays."""
        return replace(self, surfaces=dict(surfaces))
