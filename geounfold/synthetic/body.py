"""Simulated folded bodies: their blocks, and the exact map between folded and unfolded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats, TriMesh
from geounfold.geometry.rotations import rotation_from_angles
from geounfold.synthetic.fold_spec import FoldSpec, keeps
from geounfold.synthetic.outline import Even, Thickness
from geounfold.synthetic.profile import FlexuralSlip, require_positive


@dataclass(frozen=True, eq=False)
class Sheet:
    """The geometry of a simulated body: the exact map between its truth and the world.

    Truth coordinates (u, v, w) run across the fold axis, along it, and up the layer's normal.
    Local coordinates (x, y, z) are those of the folded sheet, before it is turned and moved into
    the world.

    Parameters
    ----------
    spec : FoldSpec
        The body's recipe.

    Raises
    ------
    OptionError
        A hinge's radius is within the half-thickness, limbs overlap, or the ends of a closed sheet
        do not meet.
    """

    spec: FoldSpec

    def __post_init__(self) -> None:
        if self.spec.closed:
            self._check_closed()
        self._check_hinges(self.slip, self.spec.shape)
        if self.second is not None:
            self._check_hinges(self.second, Even(2 * self.second.reach))
        self._check_overlap()

    @cached_property
    def axes(self) -> Floats:
        """The fold's axes x, y, z as rows, (3, 3), in world coordinates."""
        return rotation_from_angles(self.spec.azimuth, self.spec.plunge, self.spec.tilt)

    @cached_property
    def lattice_axes(self) -> Floats:
        """The lattice's axes as rows, (3, 3), in world coordinates."""
        s = self.spec
        if s.grid == "before":
            return self.axes
        return rotation_from_angles(s.lattice_bearing, s.lattice_plunge, s.lattice_dip)

    @cached_property
    def slip(self) -> FlexuralSlip:
        """The fold's section, between (u, w) and (x, z)."""
        s = self.spec
        pin = None if s.pin is None else float(np.radians(s.pin))
        return FlexuralSlip(s.profile, s.length, s.shape.reach(), pin, s.origin, s.closed)

    @cached_property
    def second(self) -> FlexuralSlip | None:
        """The second fold's section, between (v, z) and (y, z), or None."""
        if self.spec.refold is None:
            return None
        z = np.stack([self._section(side)[:, 1] for side in (-1, 1)])
        return FlexuralSlip(
            self.spec.refold, self.spec.width, float(np.abs(z - self._middle).max()) * 1.001
        )

    @cached_property
    def _middle(self) -> float:
        """Height of the second fold's mid surface."""
        z = np.stack([self._section(side)[:, 1] for side in (-1, 1)])
        return float((z.max() + z.min()) / 2)

    def _section(self, side: int) -> Floats:
        """Return points (x, z) of the section along the sheet at its reach."""
        u = np.linspace(0, self.spec.length, 2001)
        return self.slip.fold(u, np.full(len(u), side * self.slip.reach))

    def inside(self, truth: Floats) -> Bools:
        """Return which points (n, 3) in truth coordinates lie in the body."""
        u, v, w = truth.T
        low, high = self.heights(u, v)
        # A closed sheet ends at normals, so a point belongs to the arc length of its own normal.
        along = self.slip.arc_length(u, w) if self.spec.closed else u
        out: Bools = keeps(self.spec, along, v, w) & (w >= low) & (w <= high)
        return out

    def heights(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Return heights w of bottom and top, (n,) each, over points of the sheet."""
        return self.spec.shape.heights(u / self.spec.length, v / self.spec.width)

    def fold(self, truth: Floats) -> Floats:
        """Return world coordinates (n, 3) of points (n, 3) in truth coordinates."""
        return self.to_world(self.fold_local(truth))

    def unfold(self, points: Floats) -> tuple[Floats, Bools]:
        """Return truth coordinates (n, 3) of world points, and which points have them.

        A point outside the sheet's reach has False and a row of zeros.
        """
        offset = np.asarray(self.spec.offset, float)
        return self.unfold_local((points - offset) @ self.axes.T)

    def to_world(self, local: Floats) -> Floats:
        """Return world coordinates of local ones, (n, 3)."""
        out: Floats = local @ self.axes + np.asarray(self.spec.offset, float)
        return out

    def fold_local(self, truth: Floats) -> Floats:
        """Return local coordinates (n, 3) of points (n, 3) in truth coordinates."""
        xz = self.slip.fold(truth[:, 0], truth[:, 2])
        return self.refold(np.stack([xz[:, 0], truth[:, 1], xz[:, 1]], axis=1))

    def refold(self, local: Floats) -> Floats:
        """Return local points (n, 3) after the second fold, if there is one."""
        if self.second is None:
            return local
        yz = self.second.fold(local[:, 1], local[:, 2] - self._middle)
        return np.column_stack([local[:, 0], yz])

    def unfold_local(self, local: Floats) -> tuple[Floats, Bools]:
        """Return truth coordinates (n, 3) of local points, and which points have them."""
        found = np.ones(len(local), bool)
        if self.second is not None:
            vz, found = self.second.unfold(local[:, 1:])
            local = np.column_stack([local[:, 0], vz[:, 0], vz[:, 1] + self._middle])
        uw, reached = self.slip.unfold(local[:, [0, 2]])
        found = found & reached
        truth = np.stack([uw[:, 0], local[:, 1], uw[:, 1]], axis=1)
        truth[~found] = 0
        return truth, found

    def boundary(self, n: int = 200, m: int = 9) -> Floats:
        """Return truth coordinates (2 n m, 3) of bottom and top over the whole sheet."""
        # The ends of a closed sheet coincide: stay half a step away from them.
        short = self.spec.length / (2 * n) if self.spec.closed else 0.0
        u, v = np.meshgrid(
            np.linspace(short, self.spec.length - short, n),
            np.linspace(0, self.spec.width, m),
            indexing="ij",
        )
        low, high = self.heights(u.ravel(), v.ravel())
        sides = [self.over(u.ravel(), v.ravel(), w) for w in (low, high)]
        return np.concatenate(sides)

    def over(self, along: Floats, v: Floats, w: Floats) -> Floats:
        """Return truth coordinates (n, 3) at heights w over positions on the sheet.

        ``along`` is u, or the arc length s on a closed sheet.
        """
        u = self.slip.slipped(along, w) if self.spec.closed else along
        return np.stack([u, v, w], axis=1)

    def _check_closed(self) -> None:
        """Raise OptionError unless the profile's ends meet, in one direction."""
        ends = np.array([0.0, self.spec.length])
        gap = float(np.linalg.norm(np.diff(self.slip.points(ends), axis=0)))
        turns = float(np.diff(self.spec.profile.heading(ends))[0]) / (2 * np.pi)
        if gap > 1e-9 * self.spec.length or np.abs(np.abs(turns) - 1) > 1e-9:
            raise OptionError(
                f"a closed body's profile must end where it starts after one turn, but ends "
                f"{gap:.4g} away after {turns:.4g} turns; make the length that of the closed curve"
            )

    def _check_hinges(self, slip: FlexuralSlip, shape: Thickness) -> None:
        """Raise OptionError if the sheet reaches a centre of curvature."""
        s = slip.knots[:: max(1, len(slip.knots) // 4000), None]
        t = slip.reach * np.linspace(-1, 1, 17)
        curvature = slip.profile.curvature(s)
        tight = 1 - t * curvature <= 0
        a = (s - t * (slip.profile.heading(s) - slip.still)) / slip.length
        tight &= (a >= 0) & (a <= 1)
        rows, columns = np.nonzero(tight)
        for b in np.linspace(0, 1, 9):
            low, high = shape.heights(a[rows, columns], np.full(len(rows), b))
            hit = rows[(t[columns] >= low) & (t[columns] <= high)]
            if len(hit):
                k = hit[np.argmax(np.abs(curvature[hit, 0]))]
                raise OptionError(
                    f"the hinge at arc length {s[k, 0]:.4g} has radius "
                    f"{1 / np.abs(curvature[k, 0]):.4g}, within the body's half-thickness there; "
                    "open the hinge or thin the body"
                )

    def _check_overlap(self) -> None:
        """Raise OptionError if the folded sheet covers itself."""
        truth = self.boundary()
        back, found = self.unfold_local(self.fold_local(truth))
        off = np.abs(back - truth).max(axis=1) > 1e-6 * self.spec.length
        if not found.all() or off.any():
            u, v, w = truth[np.flatnonzero(~found | off)[0]]
            raise OptionError(
                f"the folded body covers itself near u = {u:.4g}, v = {v:.4g}, w = {w:.4g}; "
                "lower the headings, spread the hinges or thin the body"
            )


@dataclass(frozen=True, eq=False)
class Body:
    """A simulated body: blocks folded and before folding.

    Attributes
    ----------
    name : str
        Name of the case, or family of a random body.
    folded : (n, 3) float
        Block centroids as in a block model, world coordinates.
    truth : (n, 3) float
        The same blocks before folding: u across the fold axis, v along it, w height above the
        mid surface. The frame is right-handed and w grows towards the top, so it is never a
        mirror image.
    bottom, top : (n,) float
        Heights w of the body's surfaces below and above each block.
    steps : (3,) float
        Block sides along the lattice's axes; those of the parents in a sub-blocked body.
    sizes : (n, 3) float
        Each block's own sides along the lattice's axes.
    sheet : Sheet
        The exact map, for any other points.
    """

    name: str
    folded: Floats
    truth: Floats
    bottom: Floats
    top: Floats
    steps: Floats
    sizes: Floats
    sheet: Sheet

    def __repr__(self) -> str:
        """Return one line: the case and its blocks."""
        sides = " x ".join(f"{s:.4g}" for s in self.steps)
        return f"<Body {self.name} of {len(self.folded)} blocks of {sides}>"

    def __iter__(self) -> Iterator[Floats]:
        """Unpack as ``X, W``: the folded points and their truth."""
        return iter((self.folded, self.truth))

    @property
    def description(self) -> str:
        """Description of the body in one line."""
        return self.sheet.spec.description

    @property
    def developable(self) -> bool:
        """Whether an exact flattening exists."""
        return self.sheet.spec.developable

    @property
    def stratigraphic(self) -> Floats:
        """True stratigraphic coordinate (n,): 0 at the bottom, 1 at the top."""
        out: Floats = (self.truth[:, 2] - self.bottom) / (self.top - self.bottom)
        return out

    def frame(self, decimals: int | None = None) -> pd.DataFrame:
        """Return a table with a row per block and columns centroid_x/y/z and true_x/y/z.

        If blocks differ in size, columns dim_x/y/z hold their sides along the lattice's axes.

        Parameters
        ----------
        decimals : int, optional
            Decimals to which all columns are rounded; not rounded by default.
        """
        data = {f"centroid_{c}": self.folded[:, i] for i, c in enumerate("xyz")}
        data.update({f"true_{c}": self.truth[:, i] for i, c in enumerate("xyz")})
        if (self.sizes != self.sizes[:1]).any():
            data.update({f"dim_{c}": self.sizes[:, i] for i, c in enumerate("xyz")})
        table = pd.DataFrame(data)
        return table if decimals is None else table.round(decimals) + 0.0

    def horizon(self, side: str, spacing: float) -> tuple[TriMesh, Floats]:
        """Return the exact top or bottom surface on a grid, folded, and its truth (n, 3).

        Parameters
        ----------
        side : {'top', 'bottom'}
            The surface to return. Its normals point up the sheet.
        spacing : float
            Edge length before folding. Triangles that leave the outline are dropped.

        Raises
        ------
        OptionError
            A value outside its valid ones.
        """
        if side not in ("top", "bottom"):
            raise OptionError(f"side {side!r} is not one of: top, bottom")
        require_positive("spacing", spacing)
        spec = self.sheet.spec
        n, m = (max(2, round(x / spacing) + 1) for x in (spec.length, spec.width))
        grid = np.meshgrid(
            np.linspace(0, spec.length, n), np.linspace(0, spec.width, m), indexing="ij"
        )
        u, v = grid[0].ravel(), grid[1].ravel()
        heights = self.sheet.heights(u, v)
        w = heights[side == "top"]
        truth = self.sheet.over(u, v, w)
        kept = keeps(spec, u, v, w) & (heights[1] > heights[0])
        k = np.arange(len(truth)).reshape(n, m)
        p, q, r, s = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
        F = np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
        mesh, old = TriMesh(self.sheet.fold(truth), F).submesh(kept[F].all(axis=1))
        return mesh, truth[old]
