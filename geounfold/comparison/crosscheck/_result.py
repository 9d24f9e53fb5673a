"""The result of a cross-check: figures of meshes and of positions, and warnings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from geounfold.comparison.crosscheck._options import CrossCheckOptions
from geounfold.geometry.mesh import Floats, TetMesh

PRISM = "prism"
"""The name of the control mesh among the meshes."""


@dataclass(frozen=True)
class MeshFigures:
    """Figures of one mesh of the control mesh's border; lengths in blocks.

    Attributes
    ----------
    mesh : str
        The mesher, or ``prism`` for the control mesh itself.
    vertices, tetrahedra, boundary_faces : int
        Their numbers.
    inverted : int
        Tetrahedra whose folded volume is not positive.
    volume : float
        Sum of the tetrahedra's signed volumes, in the input's unit cubed.
    boundary_volume : float
        Signed volume inside the mesh's own border, in the input's unit cubed.
    volume_difference : float
        ``volume`` over the volume inside the control mesh's border, minus 1.
    hausdorff_to, hausdorff_from : float
        Largest distance from this mesh's border to the control mesh's border, and back.
    dihedral_min, dihedral_p05, dihedral_median, dihedral_p95, dihedral_max : float
        Dihedral angles, degrees.
    radius_ratio_min, radius_ratio_p05, radius_ratio_median : float
        Three times the inscribed over the circumscribed radius; 1 is regular, 0 flat.
    seconds : float
        Wall time of the mesher, including the start of its process; 0 for the control mesh.
    error : str
        Why the figures are missing (NaN or 0); empty if the mesh was made.
    """

    mesh: str
    vertices: int = 0
    tetrahedra: int = 0
    boundary_faces: int = 0
    inverted: int = 0
    volume: float = np.nan
    boundary_volume: float = np.nan
    volume_difference: float = np.nan
    hausdorff_to: float = np.nan
    hausdorff_from: float = np.nan
    dihedral_min: float = np.nan
    dihedral_p05: float = np.nan
    dihedral_median: float = np.nan
    dihedral_p95: float = np.nan
    dihedral_max: float = np.nan
    radius_ratio_min: float = np.nan
    radius_ratio_p05: float = np.nan
    radius_ratio_median: float = np.nan
    seconds: float = 0.0
    error: str = ""


@dataclass(frozen=True)
class PlaceFigures:
    """Distances of one mesh's unfolded positions from the map's; lengths in blocks.

    Only the mesh's border follows the map.

    Attributes
    ----------
    mesh : str
        The mesher, or ``prism`` for the control mesh itself.
    interior : str
        How the inside follows the border: a name in INTERIORS.
    blocks : int
        Blocks compared.
    outside : int
        Blocks inside the control mesh but outside this mesh.
    rms, p95, max : float
        Distance of a block's position from the map's.
    along_layers, across_layers : float
        Root mean square of the distance's horizontal and vertical part.
    worst : tuple of 3 float
        Folded position of the block with the largest distance, in the input's coordinates.
    rms_same_interior : float
        Root mean square distance from the positions that the control mesh gives with the same
        interior: the part due to the mesh alone.  0 for the control mesh.
    inverted : int
        Tetrahedra whose unfolded volume is not positive.
    steps : int
        Local-global steps; 0 for ``harmonic``.
    seconds : float
        Wall time.
    error : str
        Why the figures are missing; empty if they are known.
    """

    mesh: str
    interior: str
    blocks: int = 0
    outside: int = 0
    rms: float = np.nan
    p95: float = np.nan
    max: float = np.nan
    along_layers: float = np.nan
    across_layers: float = np.nan
    worst: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    rms_same_interior: float = np.nan
    inverted: int = 0
    steps: int = 0
    seconds: float = 0.0
    error: str = ""


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """The control mesh beside other meshes of its border; the result of ``crosscheck``.

    Attributes
    ----------
    options : CrossCheckOptions
        The options used.
    block : float
        Size of a block, in the input's unit.
    volume : float
        Signed volume inside the control mesh's border, in the input's unit cubed.
    hull_volume, blocks_volume : float
        Volume inside the hulls of all bodies, and of their blocks, in the input's unit cubed; NaN
        if reference surfaces were given.  The control mesh encloses the hull, so its volume is
        larger by design.
    meshes : tuple of MeshFigures
        One per mesh; the control mesh first.
    places : tuple of PlaceFigures
        One per mesh and interior.
    differences : dict of (n,) float
        By ``mesh_interior``: distance of each point from the map's position, in blocks; NaN for a
        point that was not compared (outside).
    points : dict of (n, 3) float
        By ``mesh_interior``: the points unfolded by that mesh, in the input's unit; NaN for a
        point that was not compared.
    grids : dict of TetMesh
        By mesh: the folded mesh, in the input's coordinates.
    """

    options: CrossCheckOptions
    block: float
    volume: float
    hull_volume: float
    blocks_volume: float
    meshes: tuple[MeshFigures, ...]
    places: tuple[PlaceFigures, ...]
    differences: Mapping[str, Floats]
    points: Mapping[str, Floats]
    grids: Mapping[str, TetMesh]

    @property
    def warnings(self) -> list[str]:
        """One line for each difference above its bound and for each failure."""
        found = []
        for mesh in self.meshes:
            own = [places for places in self.places if places.mesh == mesh.mesh]
            found += [*self._mesh_warnings(mesh), *self._place_warnings(mesh.mesh, own)]
        return found

    def _mesh_warnings(self, mesh: MeshFigures) -> list[str]:
        """Return the warnings about one mesh."""
        if mesh.error:
            return [f"cross-check: no {mesh.mesh} mesh: {mesh.error}"]
        found, chosen = [], self.options
        if abs(mesh.volume_difference) > chosen.volume_bound:
            found.append(
                f"cross-check: the {mesh.mesh} mesh's volume differs by "
                f"{mesh.volume_difference:+.2%} from that inside the control mesh's border "
                f"(bound {chosen.volume_bound:.2%})"
            )
        apart = max(mesh.hausdorff_to, mesh.hausdorff_from)
        if apart > chosen.border_bound:
            found.append(
                f"cross-check: the {mesh.mesh} mesh's border lies up to {apart:.2f} blocks from "
                f"the control mesh's (bound {chosen.border_bound:.2f})"
            )
        return found

    def _place_warnings(self, name: str, places: list[PlaceFigures]) -> list[str]:
        """Return the warnings about a mesh's positions.

        The control mesh's own positions are not judged: they only help to explain the others.
        """
        failed = [p for p in places if p.error]
        found = [f"cross-check: {name} mesh, inside {p.interior}: {p.error}" for p in failed]
        if name == PRISM:
            return found
        done = [p for p in places if not p.error]
        lost = max((p.outside for p in done), default=0)
        if lost:
            found.append(f"cross-check: the {name} mesh does not hold {lost} blocks")
        far = [p for p in done if p.rms > self.options.position_bound]
        if far:
            worst = max(far, key=lambda p: p.max)
            where = ", ".join(f"{c:.6g}" for c in worst.worst)
            found.append(
                f"cross-check: the {name} mesh places blocks {_each(far, 'rms')} block sizes RMS "
                f"from the map (bound {self.options.position_bound:.2f}), up to {worst.max:.2f} at "
                f"({where}). Of this, {_each(far, 'rms_same_interior')} is due to the mesh; the "
                "rest comes from the interior rule, which does not follow flexural slip"
            )
        return found

    @property
    def table(self) -> pd.DataFrame:
        """One row per mesh and interior, with the figures of both; a failed mesh has one row."""
        rows = []
        for mesh in self.meshes:
            figures = asdict(mesh)
            own = [asdict(places) for places in self.places if places.mesh == mesh.mesh]
            for places in own or [asdict(PlaceFigures(mesh.mesh, ""))]:
                row = {**figures, **{_COLUMN.get(key, key): v for key, v in places.items()}}
                row["worst_x"], row["worst_y"], row["worst_z"] = row.pop("worst")
                row["error"] = figures["error"] or places["error"]
                rows.append(row)
        return pd.DataFrame(rows)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures for JSON, without the columns of blocks and the meshes."""
        return {
            "options": asdict(self.options),
            "block": self.block,
            "volume": self.volume,
            "hull_volume": _known(self.hull_volume),
            "blocks_volume": _known(self.blocks_volume),
            "meshes": [_plain(mesh) for mesh in self.meshes],
            "places": [_plain(places) for places in self.places],
            "warnings": self.warnings,
        }

    def added_to(self, summary: Mapping[str, Any]) -> dict[str, Any]:
        """Return an unfolding's summary with the cross-check and its warnings added."""
        warnings = [*summary.get("warnings", []), *self.warnings]
        return {**summary, "crosscheck": self.as_dict(), "warnings": warnings}


_COLUMN = {"seconds": "seconds_places", "inverted": "inverted_unfolded"}
"""Columns of PlaceFigures renamed in the table, in which MeshFigures has the same names."""


def _each(places: list[PlaceFigures], figure: str) -> str:
    """Return one figure of each interior, in words."""
    return " and ".join(f"{getattr(p, figure):.2f} ({p.interior})" for p in places)


def _plain(figures: MeshFigures | PlaceFigures) -> dict[str, Any]:
    """Return figures for JSON, by name."""
    return {name: _known(value) for name, value in asdict(figures).items()}


def _known(value: Any) -> Any:
    """Return a value for JSON: None if it is not finite."""
    if isinstance(value, tuple):
        return [_known(each) for each in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
