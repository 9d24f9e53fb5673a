"""The summary of a run: what ran and how good the answer is, ready for JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from geounfold._version import __version__
from geounfold.backends.igl import boundary_loops, is_manifold
from geounfold.backends.system.memory import peak_memory_mb
from geounfold.body.check import count_duplicates
from geounfold.body.parts import Junction
from geounfold.body.prepare import PreparedPoints
from geounfold.faults.limit_rims import LimitRim
from geounfold.faults.result import FaultResult
from geounfold.flattening import Flattening
from geounfold.geometry.measures import enclosed_volume, triangle_areas
from geounfold.geometry.mesh import Floats
from geounfold.io.messages import counted
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.mapping.prism_coordinates import PrismInterpolant
from geounfold.methods import BodyFit, PointwiseMap, SurfacePair
from geounfold.quality.uncertainty import PositionUncertainty
from geounfold.unfolding.level_horizons import flat_size, level_errors
from geounfold.unfolding.measured import Measured
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.options_toml import to_toml


@dataclass(frozen=True, eq=False)
class RunRecord:
    """Everything that a run made.

    Attributes
    ----------
    options : UnfoldOptions
        As used.
    prepared : PreparedPoints
        The points, their lattice and frame, the bodies among them.
    fits : list of BodyFit
        The stages of every body, working units.
    map : UnfoldingMap or PointwiseMap
        The map of all bodies.
    measured : Measured
        Where the points went, what is proved of the map, how good it is.
    seconds : dict of float
        Per stage.
    faulted : FaultResult or None
        What taking the faults out gave; None if there are none.
    uncertainty : PositionUncertainty or None
        How far off the places may be; None if the user did not choose to measure it.
    limits : tuple of LimitRim
        What each limit given takes of the rim.
    """

    options: UnfoldOptions
    prepared: PreparedPoints
    fits: list[BodyFit]
    map: UnfoldingMap | PointwiseMap
    measured: Measured
    seconds: dict[str, float]
    faulted: FaultResult | None = None
    uncertainty: PositionUncertainty | None = None
    limits: tuple[LimitRim, ...] = ()

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.prepared.points)

    @property
    def duplicates(self) -> int:
        """Number of points with the coordinates of an earlier one."""
        return count_duplicates(self.prepared.points)

    @property
    def apart(self) -> Floats:
        """The points that are in none of the bodies to unfold, (k, 3)."""
        rest = np.ones(len(self.prepared.points), dtype=bool)
        for group in self.prepared.groups:
            rest[group] = False
        return self.prepared.points[rest]

    @property
    def left_empty(self) -> Floats:
        """The points without an image, (k, 3)."""
        return self.prepared.points[~self.measured.carried.placed]

    @property
    def torn(self) -> int:
        """Number of blocks that came to lie far from a block that they touch."""
        return len(self.measured.torn)

    @property
    def largest_distance(self) -> float:
        """Largest distance of a point from the control mesh."""
        return float(self.measured.carried.distance.max())

    @property
    def flat_size(self) -> dict[str, float | None]:
        """Length, width and thickness of the unfolded body (see `level_horizons.flat_size`)."""
        return flat_size(self.fits, self.measured.carried, self.prepared.frame)

    @property
    def volumes(self) -> dict[str, float | None]:
        """Volume of the blocks in both spaces (see `body_volume`)."""
        return body_volume(self)

    @property
    def full_box(self) -> list[int] | None:
        """Sides of the lattice's box in blocks if the blocks fill it; None else."""
        cells = self.prepared.cells
        if cells is None or not len(cells):
            return None
        sides = np.ptp(cells, axis=0) + 1
        full = len(cells) >= np.prod(sides.astype(np.float64))
        return [int(side) * self.prepared.joined for side in sides] if full else None

    @property
    def outside(self) -> int:
        """Number of points that the control mesh does not hold."""
        return int((~self.measured.carried.inside).sum())

    @property
    def empty(self) -> int:
        """Number of points without an image."""
        return int((~self.measured.carried.placed).sum())

    @property
    def lost(self) -> int:
        """Number of points that were not brought back although the map holds their image."""
        returned = self.measured.returned
        return 0 if returned is None else int(returned.lost.sum())

    @property
    def round_trip_max(self) -> float | None:
        """Largest distance between a point and its return; None if there is no way back."""
        returned = self.measured.returned
        return None if returned is None else returned.largest

    @property
    def junctions(self) -> tuple[Junction, ...]:
        """Places where sheet parts meet, in the data's coordinates."""
        division = self.prepared.division
        return () if division is None else division.junctions

    @property
    def injective(self) -> bool:
        """Whether the map is proved one-to-one; the certificate covers tetrahedra only."""
        return self.measured.certificate.injective and self.map.prisms is None

    @property
    def faults(self) -> list[str]:
        """Reasons why the map is not proved one-to-one; empty if it is."""
        certificate = self.measured.certificate
        faults = [] if certificate.injective else certificate.faults
        if self.map.prisms is None:
            return faults
        return [*faults, f"{self.map.coordinates} coordinates, which no theorem covers"]


def summarise(run: RunRecord, surfaces: Mapping[str, SurfacePair]) -> dict[str, Any]:
    """Return the summary of a run; ``surfaces`` are those of its largest body, true to scale."""
    certificate = run.measured.certificate
    fit = run.fits[0]
    return {
        "version": __version__,
        "options": run.options.as_dict(),
        "config": to_toml(run.options),
        "points": run.count,
        "bodies": run.prepared.bodies if run.faulted is None else len(set(run.faulted.groups)),
        "parts": _parts(run),
        "junctions": [_junction(j) for j in run.junctions],
        **_faults(run),
        **_limits(run),
        "lattice": _lattice(run),
        "mended": run.prepared.mended.summary(),
        "seconds": run.seconds,
        "peak_memory_mb": peak_memory_mb(),
        "body_volume": run.volumes,
        "hull": _hull(run),
        **{name: _surface(pair) for name, pair in surfaces.items()},
        "flattening": {name: _flattening(found) for name, found in fit.flattenings.items()},
        "method": fit.notes,
        "control_mesh": _control(run),
        "inverted_folded": certificate.inverted_folded,
        "inverted_unfolded": certificate.inverted_unfolded,
        "injective": run.injective,
        "horizons": level_errors(run.fits, run.map, run.prepared.frame),
        "flat_size": run.flat_size,
        "coordinates": _coordinates(run),
        "certificate": certificate.as_dict(),
        "outside_share": run.outside / run.count,
        "outside": _outside(run),
        "round_trip_max": run.round_trip_max,
        "torn": run.torn,
        "trust": None if run.measured.trust is None else run.measured.trust.as_dict(),
        **({} if run.uncertainty is None else {"uncertainty": run.uncertainty.summary()}),
        **run.measured.quality.summary(),
        "warnings": warnings_of(run),
    }


def warnings_of(run: RunRecord) -> list[str]:
    """Return what a user should know before trusting the answer, one sentence each."""
    out = []
    if run.prepared.moved:
        out.append(
            f"the coordinates were rounded: blocks were moved by up to {run.prepared.moved:.2g} "
            "onto their lattice; export them with more digits if they are known"
        )
    if duplicates := run.duplicates:
        out.append(f"{duplicates} points repeat the coordinates of another; all were kept")
    apart = run.apart
    if len(apart):
        out.append(
            f"{counted(len(apart), 'point is', 'points are')} not part of the unfolded body, "
            f"{_first_place(apart)}; the map carries what it reaches"
        )
    if run.prepared.mended.changed:
        out.append(run.prepared.mended.sentence())
    out += [_told(junction) for junction in run.junctions]
    out += [] if run.faulted is None else run.faulted.warnings()
    out += [limit.warning() for limit in run.limits if limit.missed]
    count, outside, empty = run.count, run.outside, run.empty
    if outside > empty:
        out.append(
            f"{outside - empty} of {count} points lie outside the control mesh and "
            "were carried by its continuation; they are marked extrapolated"
        )
    if empty:
        out.append(
            f"{empty} of {count} points lie farther from the control mesh than the "
            f"map reaches ({run.map.reach * run.prepared.frame.scale:.6g}) or were torn from "
            f"their neighbours, {_first_place(run.left_empty)}; "
            "they were left empty and are marked outside"
        )
    if run.torn:
        out.append(f"{run.torn} blocks were torn from their neighbours")
    trust = run.measured.trust
    if trust is not None and trust.word == "poor":
        out.append(trust.sentence())
    out += [warning for fit in run.fits for warning in fit.warnings]
    if not run.injective:
        out.append(f"the map is not proved one-to-one: {', '.join(run.faults)}")
    if run.lost:
        out.append(f"{run.lost} points were not brought back by the map")
    return out


def body_volume(run: RunRecord) -> dict[str, float | None]:
    """Return the volume of the blocks in both spaces; None if it is not known.

    That of the folded space is the number of cells that the blocks take, times the volume of one;
    points without a lattice have none. That of the unfolded space is only known if a block is a
    cell each, because sub-blocks do not count alike.
    """
    prepared = run.prepared
    if prepared.cells is None:
        return {"folded": None, "unfolded": None}
    folded = len(prepared.cells) * prepared.frame.scale**3
    ratio = run.measured.quality.blocks.volume_ratio[np.concatenate(prepared.groups)]
    known = ratio[np.isfinite(ratio)]
    alike = len(prepared.cells) * prepared.joined**3 == prepared.chosen and len(known) > 0
    return {"folded": folded, "unfolded": folded * float(known.mean()) if alike else None}


def _first_place(points: Floats) -> str:
    """Return words that name the coordinates of the first of some points."""
    place = ", ".join(f"{c:.10g}" for c in points[0])
    return f"{'at' if len(points) == 1 else 'the first at'} ({place})"


def _told(junction: Junction) -> str:
    """Return the warning of a junction."""
    if junction.kind == "pipe":
        return f"{junction.sentence}; its blocks were carried with the sheet, check them"
    return f"{junction.sentence}; each was unfolded by itself, and stratigraphic is per part"


def _parts(run: RunRecord) -> list[dict[str, Any]]:
    """Return a row per sheet part; none if every body is one sheet."""
    division = run.prepared.division
    if division is None:
        return []
    placed = run.measured.carried.placed
    return [
        {
            "part": part,
            "body": int(division.body[part]),
            "blocks": len(rows),
            "thickness": float(division.thickness[part]),
            "empty": int((~placed[rows]).sum()),
            "outcome": "proved" if run.injective else "not proved",
        }
        for part, rows in enumerate(run.prepared.groups)
    ]


def _faults(run: RunRecord) -> dict[str, Any]:
    """Return the faults and fault blocks; nothing for bodies without faults."""
    found = run.faulted
    if found is None:
        return {}
    placed = run.measured.carried.placed
    blocks = [
        {
            "fault_block": block,
            "blocks": len(rows),
            "joined_to": found.groups[block],
            "turn": float(np.degrees(found.poses[block].angle)),
            "shear": found.poses[block].shear.tolist(),
            "empty": int((~placed[rows]).sum()),
        }
        for block, rows in enumerate(run.prepared.groups)
    ]
    return {"faults": found.rows(), "fault_blocks": blocks, "overlap_share": found.overlap}


def _limits(run: RunRecord) -> dict[str, Any]:
    """Return the limits at which the body ends, and a row of each; nothing without limits."""
    if not run.limits:
        return {}
    return {
        "limits": [limit.name for limit in run.limits if limit.used],
        "limit_rims": [limit.row() for limit in run.limits],
    }


def _junction(junction: Junction) -> dict[str, Any]:
    return {
        "kind": junction.kind,
        "parts": list(junction.parts),
        "place": list(junction.place),
        "thickness": list(junction.thickness),
        "sentence": junction.sentence,
    }


def _lattice(run: RunRecord) -> dict[str, Any]:
    spacing = run.prepared.frame.scale
    if run.prepared.lattice is None:
        return {"found": False, "spacing": spacing}
    steps = (run.prepared.lattice.steps / run.prepared.joined).tolist()
    return {"found": True, "spacing": spacing, "steps": steps, "full_box": run.full_box}


def _hull(run: RunRecord) -> dict[str, Any]:
    hull = run.fits[0].hull
    if hull is None:
        return {"method": "reference surfaces"}
    cube = run.prepared.frame.scale**3
    return {
        "method": hull.method,
        "reason": hull.reason,
        "faces": len(hull.mesh.F),
        "volume": enclosed_volume(hull.mesh.V, hull.mesh.F) * cube,
        "blocks_volume": hull.blocks_volume * cube,
        "closed": not boundary_loops(hull.mesh.F),
        "manifold": is_manifold(hull.mesh.F),
        "dropped_faces": hull.dropped,
    }


def _surface(pair: SurfacePair) -> dict[str, Any]:
    before = triangle_areas(pair.folded.V, pair.folded.F).sum()
    after = triangle_areas(pair.unfolded.V, pair.unfolded.F).sum()
    return {"faces": len(pair.folded.F), "area": float(before), "area_unfolded": float(after)}


def _control(run: RunRecord) -> dict[str, Any] | None:
    if isinstance(run.map, PointwiseMap):
        return None
    control = run.map.control
    return {
        "vertices": len(control.folded.V),
        "tetrahedra": len(control.folded.T),
        "volume_folded": run.measured.quality.volume_folded,
        "volume_unfolded": run.measured.quality.volume_unfolded,
    }


def _coordinates(run: RunRecord) -> dict[str, Any]:
    prisms = run.map.prisms
    out: dict[str, Any] = {"name": run.map.coordinates, "proved": run.injective}
    if prisms is None:
        return out
    return {
        **out,
        **prisms.counts(),
        "blocks_in_prisms": _in_prisms(run, prisms),
        "blocks_inside_out": int((run.measured.quality.blocks.volume_ratio <= 0).sum()),
        "blocks_not_brought_back": run.lost,
        "tolerance": prisms.tolerance * run.prepared.frame.scale,
    }


def _in_prisms(run: RunRecord, prisms: PrismInterpolant) -> int:
    element = run.measured.carried.element[run.measured.carried.placed]
    return int((prisms.prism[element] >= 0).sum())


def _outside(run: RunRecord) -> dict[str, Any]:
    return {
        "extrapolated": run.outside - run.empty,
        "empty": run.empty,
        "largest_distance": run.largest_distance,
        "reach": run.map.reach * run.prepared.frame.scale,
    }


def _flattening(flattening: Flattening) -> dict[str, Any]:
    def ends(history: Floats) -> list[float]:
        return [float(history[0]), float(history[-1])] if len(history) else []

    return {
        "method": flattening.method,
        "iterations": flattening.iterations,
        "stop": str(flattening.stop),
        "energy": ends(flattening.energy),
        "area_change": ends(flattening.area_error)[-1:],
        "edge_strain": ends(flattening.edge_error)[-1:],
        "flips": flattening.flips,
        "overlaps": flattening.overlaps,
        "note": flattening.note,
    }
