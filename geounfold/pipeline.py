"""Unfold a body: the stages in order, and everything that came of them."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, overload

import numpy as np
import pandas as pd

from geounfold._version import __version__
from geounfold.backends.blas import one_thread
from geounfold.backends.igl import boundary_loops, is_manifold
from geounfold.bodies import check_points, count_duplicates, select_body, separate_bodies
from geounfold.certificate import Certificate, certify
from geounfold.cloud import QUIET, unevenness
from geounfold.config import to_toml
from geounfold.control import ControlMesh, scaled, side_by_side
from geounfold.coordinates import PrismInterpolant
from geounfold.display import Facts
from geounfold.disturbed import disturbed_lattice
from geounfold.errors import ControlMeshError, InputError, OptionError
from geounfold.fitting import BodyFit, SurfacePair, fit
from geounfold.flattening import Flattening
from geounfold.frame import Frame, working_frame
from geounfold.geometry import enclosed_volume, triangle_areas
from geounfold.hull import Hull
from geounfold.io.results import FOLDED, UNFOLDED, frame_points, result_columns, with_carried
from geounfold.lattice import Lattice, measure_lattice
from geounfold.mapping import Carried, Returned, UnfoldingMap, checked_points
from geounfold.mesh import Floats, Ints, Space, TriMesh, as_trimesh, in_space
from geounfold.methods import METHODS, PointwiseMap, no_mesh
from geounfold.options import UnfoldOptions
from geounfold.quality import SUSPECT, Quality, assess, assess_points, torn_blocks
from geounfold.solid import solid_cells

if TYPE_CHECKING:
    import dask.dataframe
    import pyvista

Progress = Callable[[str], None]


class _Clock:
    """Seconds per stage, with the stages' names shown as they start."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        if self._progress is not None:
            self._progress(name)
        start = time.perf_counter()
        try:
            yield
        finally:
            taken = time.perf_counter() - start
            self.seconds[name] = self.seconds.get(name, 0.0) + taken


@one_thread()
def unfold(
    points: Floats | pd.DataFrame,
    options: UnfoldOptions | None = None,
    *,
    top: TriMesh | tuple[Any, Any] | None = None,
    bottom: TriMesh | tuple[Any, Any] | None = None,
    progress: Progress | None = None,
    **changes: Any,
) -> Unfolding:
    """Take the folds out of a body given by its block centroids.

    Parameters
    ----------
    points : (n, 3) array or DataFrame
        Centroids in any length unit and any coordinates; of a DataFrame the coordinate
        columns are found by name (centroid_x/y/z, x/y/z, XC/YC/ZC, easting/...).
    options : UnfoldOptions, optional
        Defaults where not given.
    top, bottom : TriMesh or (V, F), optional
        Hanging wall and footwall in the points' coordinates, in place of an extracted hull;
        both or neither.
    progress : callable, optional
        Called with every stage's name as it starts.
    **changes
        Fields of UnfoldOptions given by name.

    Returns
    -------
    Unfolding

    Raises
    ------
    InputError
        Points that are no body (too few, flat, several bodies, no sheet), or options outside
        their valid values.
    HullError, SplitError, FlatteningError, ControlMeshError
        A stage failed; the message says where and what to try.

    Examples
    --------
    >>> import geounfold as gu
    >>> body = gu.simulate("sim_case_1")
    >>> u = gu.unfold(body.folded)
    >>> u.points.shape == body.folded.shape
    True
    """
    chosen = replace(options or UnfoldOptions(), **changes)
    _check_method(chosen)
    clock = _Clock(progress)
    with clock.stage("frame"):
        P = _points(points)
        lattice = measure_lattice(P)
        solid = solid_cells(P, lattice)
        filled, lattice = (P, lattice) if solid is None else (solid.points, solid.lattice)
        about = disturbed_lattice(P) if lattice is None and unevenness(P) > QUIET else None
        if about is None:
            check_points(filled, lattice)
            frame = working_frame(filled, lattice)
        else:
            check_points(P @ about.axes.T / about.steps)
            frame = working_frame(P, about, exact=False)
        work = np.ascontiguousarray(frame.snap(frame.to_work(filled)))
        labels = separate_bodies(work, frame)
        own = labels if solid is None else labels[solid.home]
        groups = select_body(P, own, chosen.body)
        _check_single(groups, chosen)
        parts = [_sorted(work[labels == own[group[0]]]) for group in groups]
        given = frame.to_work(P)
    reference = _reference(top, bottom, frame)
    fits = [
        fit(part, _sorted(given[group]), frame, chosen, reference, clock.stage)
        for part, group in zip(parts, groups, strict=True)
    ]
    del filled, work, parts  # as large as the points, and done with
    with clock.stage("map"):
        mapping = _mapping(fits, frame, chosen)
        carried = mapping.carry(P)
        returned = mapping.returned(P, carried)
    with clock.stage("certificate"):
        certificate = _certificate(mapping, carried, frame)
    _check_certified(certificate, chosen)
    _check_placed(groups, P, carried, chosen)
    with clock.stage("quality"):
        quality = _quality(mapping, carried, P, frame, given, chosen.neighbours)
        torn = _torn(groups, given, carried, quality, frame)
    _check_coordinates(quality, returned, P, chosen)
    _check_torn(torn, P, chosen)
    fitted = sum(len(group) for group in groups)
    return Unfolding(
        P,
        chosen,
        frame,
        lattice,
        fits,
        mapping,
        carried,
        returned,
        quality,
        certificate,
        clock.seconds,
        fitted,
        len(torn),
        points if isinstance(points, pd.DataFrame) else None,
    )


def _check_method(options: UnfoldOptions) -> None:
    """Raise OptionError where the method proves nothing, unless that is allowed."""
    if METHODS[options.method].control:
        return
    if options.coordinates != "tet":
        raise OptionError(
            no_mesh(options.method, f"--coordinates {options.coordinates} has no prisms to go by")
        )
    if options.allow_uncertified:
        return
    raise OptionError(
        no_mesh(options.method, "nothing is proved of its map")
        + ", or --allow-uncertified to write the answer all the same"
    )


def _check_single(groups: Sequence[Ints], options: UnfoldOptions) -> None:
    """Raise OptionError where a method without a control mesh is to unfold several bodies."""
    if len(groups) > 1 and not METHODS[options.method].control:
        raise OptionError(
            no_mesh(options.method, "it unfolds one body at a time") + ", or choose one by --body"
        )


def _sorted(points: Floats) -> Floats:
    """Return points in lexicographic order, so that their sums do not know the rows' order."""
    return points[np.lexsort(points.T[::-1])]


def _torn(
    groups: Sequence[Ints], work: Floats, carried: Carried, quality: Quality, frame: Frame
) -> Ints:
    """Return the rows whose touching blocks in their own body came to lie far away."""
    flat = carried.points / frame.scale
    found = []
    for group in groups:
        rows = group[carried.placed[group]]
        suspects = np.flatnonzero(quality.blocks.nmd_error[rows] > SUSPECT)
        found.append(rows[torn_blocks(work[rows], flat[rows], frame.sides, suspects)])
    return np.concatenate(found)


def _check_torn(torn: Ints, folded: Floats, options: UnfoldOptions) -> None:
    """Raise ControlMeshError where neighbours were torn apart, unless that is allowed."""
    if not len(torn) or options.allow_uncertified:
        return
    where = ", ".join(f"{c:.6g}" for c in np.median(folded[torn], axis=0))
    raise ControlMeshError(
        f"{len(torn)} of {len(folded)} blocks were torn from their neighbours, around ({where}): "
        "limbs too close together, or a sheet too narrow for its thickness; try another --hull, "
        "or --allow-uncertified to write the answer all the same"
    )


def _gradients(mapping: UnfoldingMap, folded: Floats, carried: Carried) -> Floats | None:
    """Return the gradients at points with an image; None where they are the tetrahedra's."""
    if mapping.prisms is None:
        return None
    return mapping.gradients(folded[carried.placed], carried.element[carried.placed])


def _check_coordinates(
    quality: Quality, returned: Returned | None, folded: Floats, options: UnfoldOptions
) -> None:
    """Raise ControlMeshError where a prism's coordinates fold or do not come back.

    Unless that is allowed.  That they do neither at any block is no proof.
    """
    if options.coordinates == "tet" or options.allow_uncertified or returned is None:
        return
    lost = returned.lost
    over = quality.blocks.volume_ratio <= 0
    wrong = over | lost
    if not wrong.any():
        return
    where = ", ".join(f"{c:.6g}" for c in np.median(folded[wrong], axis=0))
    raise ControlMeshError(
        f"{options.coordinates} coordinates turn {int(over.sum())} of {len(folded)} blocks inside "
        f"out and bring {int(lost.sum())} not back, around ({where}): use --coordinates tet, or "
        "--allow-uncertified to write the answer all the same"
    )


def _check_certified(certificate: Certificate, options: UnfoldOptions) -> None:
    """Raise ControlMeshError where the map is not proved, unless that is allowed."""
    if certificate.injective or options.allow_uncertified:
        return
    place = certificate.folded[np.argmax(certificate.blocks)] if len(certificate.folded) else []
    where = ", ".join(f"{c:.6g}" for c in place)
    raise ControlMeshError(
        f"the map is not one-to-one: {', '.join(certificate.faults)}, "
        f"with {int(certificate.blocks.sum())} blocks, most of them around ({where}); the fold is "
        "too tight there for this block size: try another --hull or --flattener, or "
        "--allow-uncertified to write the answer all the same"
    )


def _check_placed(
    groups: Sequence[Ints], folded: Floats, carried: Carried, options: UnfoldOptions
) -> None:
    """Raise ControlMeshError where blocks of a body have no image, unless that is allowed."""
    rows = np.concatenate([group[~carried.placed[group]] for group in groups])
    if not len(rows) or options.allow_uncertified:
        return
    where = ", ".join(f"{c:.6g}" for c in np.median(folded[rows], axis=0))
    raise ControlMeshError(
        f"{len(rows)} of {len(folded)} blocks lie outside the control mesh and farther than its "
        f"reach, around ({where}): try another --hull, a larger --reach, or --allow-uncertified "
        "to leave them empty"
    )


def _points(points: Floats | pd.DataFrame) -> Floats:
    """Return finite (n, 3) coordinates, of a DataFrame those of its coordinate columns."""
    if isinstance(points, pd.DataFrame):
        points = frame_points(points)
    return checked_points(points)


def _reference(
    top: TriMesh | tuple[Any, Any] | None, bottom: TriMesh | tuple[Any, Any] | None, frame: Frame
) -> tuple[TriMesh, TriMesh] | None:
    if top is None and bottom is None:
        return None
    if top is None or bottom is None:
        raise InputError("top and bottom reference surfaces belong together: give both or neither")
    upper, lower = (as_trimesh(mesh) for mesh in (top, bottom))
    return (
        upper.with_vertices(frame.to_work(upper.V)),
        lower.with_vertices(frame.to_work(lower.V)),
    )


def _mapping(
    fits: list[BodyFit], frame: Frame, options: UnfoldOptions
) -> UnfoldingMap | PointwiseMap:
    """Return the map of all bodies, without shells where those are in each other's way."""
    rules = [(f.rule, f.points) for f in fits if f.rule is not None and f.points is not None]
    if rules:
        return PointwiseMap(options.method, frame, *rules[0], options.reach)
    reach = METHODS[options.method].reach
    meshes = [(f.control, f.shell) for f in fits if f.control is not None]
    control, shell = side_by_side(meshes)
    if len(fits) > 1 and shell is not None:
        none = np.empty(0, np.int64)
        if not certify(control, shell, none).injective:
            control, shell = side_by_side([(control, None) for control, _ in meshes])
    reach = options.reach if reach is None else reach
    return UnfoldingMap(frame, control, shell, reach, coordinates=options.coordinates)


def _certificate(
    mapping: UnfoldingMap | PointwiseMap, carried: Carried, frame: Frame
) -> Certificate:
    """Return what is proved of a map, places in the data's coordinates and unit."""
    if isinstance(mapping, PointwiseMap):
        return Certificate.unproved(mapping.fault)
    return _in_data(certify(mapping.control, mapping.shell, carried.element), frame)


def _quality(
    mapping: UnfoldingMap | PointwiseMap,
    carried: Carried,
    P: Floats,
    frame: Frame,
    given: Floats,
    k: int,
) -> Quality:
    """Return how good the answer is: by the control mesh, or by each block's neighbours."""
    if isinstance(mapping, PointwiseMap):
        return assess_points(P, carried.points, frame.scale**3, k)
    world, whole = (_in_world(mesh, frame) for mesh in (mapping.control, mapping.whole))
    gradients = _gradients(mapping, P, carried)
    cells = frame.cells(given)
    lattice = None if cells is None or frame.steps is None else (cells, frame.steps)
    return assess(world, whole, carried.element, P, carried.points, k, gradients, lattice)


def _in_data(certificate: Certificate, frame: Frame) -> Certificate:
    """Return a certificate whose places are in the data's coordinates and unit."""
    folded = frame.to_world(certificate.folded)
    return replace(certificate, folded=folded, unfolded=certificate.unfolded * frame.scale)


def _in_world(control: ControlMesh, frame: Frame) -> ControlMesh:
    return scaled(control, frame.to_world(control.folded.V), frame.scale)


class Unfolding:
    """An unfolded body: its points, the map both ways, every stage's meshes, the figures.

    Made by ``unfold``; all coordinates are true to scale, in the input's unit.

    Attributes
    ----------
    folded : (n, 3) float
        The points as given.
    points : (n, 3) float
        The points unfolded, in the same order; z is the stratigraphic coordinate.
    stratigraphic : (n,) float
        0 at the bottom surface, 1 at the top.
    location : (n,) str
        ``inside`` the control mesh, ``extrapolated`` around it, or ``outside``: left empty.
    options : UnfoldOptions
        As used.
    frame : Frame
        The working frame.
    lattice : Lattice or None
        The block lattice, None for scattered points.
    fits : list of BodyFit
        Every stage, in working units, one per body.
    map : UnfoldingMap or PointwiseMap
        Carries any points both ways; the latter, of methods without a control mesh, can neither
        be saved nor proved.
    quality : Quality
        Figures for the whole and per block.
    certificate : Certificate
        What is proved of the map, and what stands against it; also a mapping.
    seconds : dict of float
        Per stage.
    """

    def __init__(
        self,
        folded: Floats,
        options: UnfoldOptions,
        frame: Frame,
        lattice: Lattice | None,
        fits: list[BodyFit],
        mapping: UnfoldingMap | PointwiseMap,
        carried: Carried,
        returned: Returned | None,
        quality: Quality,
        certificate: Certificate,
        seconds: dict[str, float],
        fitted_points: int,
        torn: int,
        given: pd.DataFrame | None = None,
    ) -> None:
        self.folded = folded
        self.options = options
        self.frame = frame
        self.lattice = lattice
        self.fits = fits
        self.map = mapping
        self.carried = carried
        self.quality = quality
        self.certificate = certificate
        self.seconds = seconds
        self._returned = returned
        self._fitted_points = fitted_points
        self._torn = torn
        self._given = None if given is None else given.copy()

    @property
    def points(self) -> Floats:
        """The unfolded points, (n, 3)."""
        return self.carried.points

    @property
    def stratigraphic(self) -> Floats:
        """0 at the bottom surface, 1 at the top, (n,)."""
        return self.carried.stratigraphic

    @property
    def location(self) -> np.ndarray:
        """``inside``, ``extrapolated`` or ``outside`` (empty) for every point, (n,) of str."""
        return self.carried.location

    @property
    def columns(self) -> dict[str, Floats]:
        """Distortion per point: volume_ratio, nmd_error, stretch_min, stretch_max, shear."""
        return self.quality.blocks.columns()

    @property
    def table(self) -> pd.DataFrame:
        """The DataFrame given, or x, y and z of an array, with all results as further columns.

        Index, columns, their order and types are as given; a column called as a result is
        replaced in its place.  The results are unfolded_x, unfolded_y, unfolded_z,
        stratigraphic, location, mesh_distance and those of ``columns``.
        """
        given = self._given
        if given is None:
            given = pd.DataFrame(self.folded, columns=["x", "y", "z"])
        return given.assign(**result_columns(UNFOLDED, self.carried), **self.columns)

    def to_flat(self, points: Floats) -> Floats:
        """Return other folded points (m, 3) in the flat space."""
        return self.map.to_flat(points)

    def to_folded(self, points: Floats) -> Floats:
        """Return points of the flat space (m, 3) in the folded one."""
        return self.map.to_folded(points)

    @overload
    def transform(self, points: pd.DataFrame) -> pd.DataFrame: ...
    @overload
    def transform(self, points: Floats) -> Floats: ...
    def transform(self, points: Floats | pd.DataFrame) -> Floats | pd.DataFrame:
        """Return other folded points in the flat space.

        Parameters
        ----------
        points : (m, 3) array or DataFrame
            Of a DataFrame the coordinate columns are found by name.

        Returns
        -------
        (m, 3) array or DataFrame
            As given; a DataFrame with its index and columns, and unfolded_x, unfolded_y,
            unfolded_z, stratigraphic, location and mesh_distance.  Points beyond the map's reach
            are NaN.

        Raises
        ------
        InputError
            Coordinates that are missing, infinite or no numbers.
        """
        if isinstance(points, pd.DataFrame):
            return with_carried(points, self.map.carry, UNFOLDED)
        return self.to_flat(points)

    @overload
    def inverse_transform(self, points: pd.DataFrame) -> pd.DataFrame: ...
    @overload
    def inverse_transform(self, points: Floats) -> Floats: ...
    def inverse_transform(self, points: Floats | pd.DataFrame) -> Floats | pd.DataFrame:
        """Return points of the flat space in the folded one.

        As ``transform``; a DataFrame's columns unfolded_x, unfolded_y, unfolded_z are taken
        before others, and it gets folded_x, folded_y, folded_z, location and mesh_distance.
        """
        if isinstance(points, pd.DataFrame):
            return with_carried(points, partial(self.map.carry, inverse=True), FOLDED)
        return self.to_folded(points)

    def map_partitions(self, frame: dask.dataframe.DataFrame) -> dask.dataframe.DataFrame:
        """Return a Dask DataFrame's points in the flat space, lazily, with ``transform``'s columns.

        The map is sent to the workers, not the points to it; see `geounfold.map_partitions`,
        which takes a map that was loaded and goes back as well.
        """
        from geounfold.clusters import map_partitions

        return map_partitions(self.map, frame)

    def to_pyvista(self, space: Space = "folded") -> pyvista.PolyData:
        """Return the points in one space with all columns, the other space as an array.

        Parameters
        ----------
        space : {"folded", "unfolded"}
            Where the points lie; the point data of the other's name, (n, 3), holds where they
            lie there.  Unfolded, points without an image (location outside) are left out.
        """
        from geounfold.io.formats.vtk import cloud

        here, there, other = in_space(space, self.folded, self.points)
        keep = np.isfinite(here).all(axis=1)
        columns = {str(name): _plain_column(c)[keep] for name, c in self.table.items()}
        made = cloud(here[keep], columns)
        made.point_data[other] = there[keep]
        return made

    @property
    def hull(self) -> Hull | None:
        """The (largest) body's hull, in working units; None with reference surfaces."""
        return self.fits[0].hull

    @property
    def hull_mesh(self) -> TriMesh:
        """The (largest) body's split surface in the data's coordinates."""
        mesh = self.fits[0].split.mesh
        return mesh.with_vertices(self.frame.to_world(mesh.V))

    @cached_property
    def surfaces(self) -> dict[str, SurfacePair]:
        """Top, bottom and mid surface of the (largest) body, folded and unfolded."""
        return {
            name: SurfacePair(
                pair.folded.with_vertices(self.frame.to_world(pair.folded.V)),
                pair.unfolded.with_vertices(pair.unfolded.V * self.frame.scale),
                pair.flattening,
            )
            for name, pair in self.fits[0].surfaces.items()
        }

    @property
    def top(self) -> SurfacePair:
        """The hanging wall in both spaces."""
        return self.surfaces["top"]

    @property
    def bottom(self) -> SurfacePair:
        """The footwall in both spaces."""
        return self.surfaces["bottom"]

    @cached_property
    def control(self) -> ControlMesh:
        """The control mesh in the data's coordinates and unit.

        Raises
        ------
        OptionError
            The method has none.
        """
        if isinstance(self.map, PointwiseMap):
            raise OptionError(no_mesh(self.options.method, "there is none to return"))
        return _in_world(self.map.control, self.frame)

    @property
    def torn(self) -> int:
        """Number of blocks that came to lie far from a block that they touch."""
        return self._torn

    @property
    def outside_share(self) -> float:
        """Share of the points that the control mesh does not hold."""
        return float(np.mean(~self.carried.inside))

    @property
    def round_trip_max(self) -> float | None:
        """Largest distance between a point and its return, over those that have both.

        None where the method has no way back.
        """
        return None if self._returned is None else self._returned.largest

    @property
    def _lost(self) -> int:
        """How many points were not brought back though the map holds their image."""
        return 0 if self._returned is None else int(self._returned.lost.sum())

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write the map (not the points) as .npz; ``geounfold.load`` reads it.

        Raises
        ------
        OptionError
            The method has no control mesh.
        """
        self.map.save(path)

    def summary(self) -> dict[str, Any]:
        """Return what ran and how good it is, ready for JSON."""
        certificate = self.certificate
        return {
            "version": __version__,
            "options": self.options.as_dict(),
            "config": to_toml(self.options),
            "points": len(self.folded),
            "bodies": len(self.fits),
            "lattice": self._lattice_summary(),
            "seconds": self.seconds,
            "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            "hull": self._hull_summary(),
            **{name: self._surface_summary(pair) for name, pair in self.surfaces.items()},
            "flattening": {k: _flattening_summary(f) for k, f in self.fits[0].flattenings.items()},
            "method": self.fits[0].notes,
            "control_mesh": self._control_summary(),
            "inverted_folded": certificate.inverted_folded,
            "inverted_unfolded": certificate.inverted_unfolded,
            "injective": self.injective,
            "coordinates": self._coordinates_summary(),
            "certificate": certificate.as_dict(),
            "outside_share": self.outside_share,
            "outside": self._outside_summary(),
            "round_trip_max": self.round_trip_max,
            "torn": self._torn,
            **self.quality.summary(),
            "warnings": self._warnings(),
        }

    @property
    def injective(self) -> bool:
        """Whether the map is proved one-to-one: the certificate speaks of tetrahedra alone."""
        return self.certificate.injective and self.map.prisms is None

    @property
    def _faults(self) -> list[str]:
        """What stands against a proof that the map is one-to-one; empty where there is one."""
        faults = [] if self.certificate.injective else self.certificate.faults
        if self.map.prisms is None:
            return faults
        return [*faults, f"{self.map.coordinates} coordinates, which no theorem covers"]

    def _coordinates_summary(self) -> dict[str, Any]:
        prisms = self.map.prisms
        out: dict[str, Any] = {"name": self.map.coordinates, "proved": self.injective}
        if prisms is None:
            return out
        return {
            **out,
            **prisms.counts(),
            "blocks_in_prisms": self._in_prisms(prisms),
            "blocks_inside_out": int((self.quality.blocks.volume_ratio <= 0).sum()),
            "blocks_not_brought_back": self._lost,
            "tolerance": prisms.tolerance * self.frame.scale,
        }

    def _in_prisms(self, prisms: PrismInterpolant) -> int:
        element = self.carried.element[self.carried.placed]
        return int((prisms.prism[element] >= 0).sum())

    def _lattice_summary(self) -> dict[str, Any]:
        spacing = self.frame.scale
        if self.lattice is None:
            return {"found": False, "spacing": spacing}
        return {"found": True, "spacing": spacing, "steps": self.lattice.steps.tolist()}

    def _outside_summary(self) -> dict[str, Any]:
        carried = self.carried
        return {
            "extrapolated": int((carried.placed & ~carried.inside).sum()),
            "empty": int((~carried.placed).sum()),
            "largest_distance": float(carried.distance.max()),
            "reach": self.map.reach * self.frame.scale,
        }

    def _hull_summary(self) -> dict[str, Any]:
        hull = self.hull
        if hull is None:
            return {"method": "reference surfaces"}
        cube = self.frame.scale**3
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

    @staticmethod
    def _surface_summary(pair: SurfacePair) -> dict[str, Any]:
        before = triangle_areas(pair.folded.V, pair.folded.F).sum()
        after = triangle_areas(pair.unfolded.V, pair.unfolded.F).sum()
        return {"faces": len(pair.folded.F), "area": float(before), "area_unfolded": float(after)}

    def _control_summary(self) -> dict[str, Any] | None:
        if isinstance(self.map, PointwiseMap):
            return None
        control = self.map.control
        return {
            "vertices": len(control.folded.V),
            "tetrahedra": len(control.folded.T),
            "volume_folded": self.quality.volume_folded,
            "volume_unfolded": self.quality.volume_unfolded,
        }

    def _warnings(self) -> list[str]:
        out = []
        duplicates = count_duplicates(self.folded)
        if duplicates:
            out.append(f"{duplicates} points repeat the coordinates of another; all were kept")
        apart = len(self.folded) - self._fitted_points
        if apart:
            out.append(
                f"{apart} points are not part of the unfolded body; they were carried where its "
                "map reaches them"
            )
        outside, empty = (int((~a).sum()) for a in (self.carried.inside, self.carried.placed))
        if outside > empty:
            out.append(
                f"{outside - empty} of {len(self.folded)} points lie outside the control mesh and "
                "were carried by its continuation; they are marked extrapolated"
            )
        if empty:
            out.append(
                f"{empty} of {len(self.folded)} points lie farther from the control mesh than the "
                f"map reaches ({self.map.reach * self.frame.scale:.6g}); they were left empty"
            )
        if self._torn:
            out.append(f"{self._torn} blocks were torn from their neighbours")
        out += [warning for fit in self.fits for warning in fit.warnings]
        if not self.injective:
            out.append(f"the map is not proved one-to-one: {', '.join(self._faults)}")
        if self._lost:
            out.append(f"{self._lost} points were not brought back by the map")
        return out

    def _facts(self) -> Facts:
        return Facts(
            points=len(self.folded),
            bodies=len(self.fits),
            outside=int((~self.carried.inside).sum()),
            method=self.options.method,
            faults=self._faults,
            checked=self.certificate.tetrahedra,
            epsilon=self.quality.nmd.mean,
            epsilon_p95=self.quality.nmd.p95,
            volume=self.quality.volume_unfolded / self.quality.volume_folded,
            round_trip=self.round_trip_max,
            seconds=sum(self.seconds.values()),
            warnings=self._warnings(),
        )

    def __repr__(self) -> str:
        """Return one line: points, method, verdict, error and points outside."""
        return self._facts().line()

    def _repr_html_(self) -> str:
        """Return verdict, certificate and figures as a small table, for notebooks."""
        return self._facts().html()


def _plain_column(column: pd.Series) -> np.ndarray:
    """Return a column as VTK can hold it: numbers, truth values as 0 and 1, else texts."""
    if pd.api.types.is_bool_dtype(column.dtype) and not column.hasnans:
        return column.to_numpy(dtype=np.uint8)
    if pd.api.types.is_numeric_dtype(column.dtype):
        exact = isinstance(column.dtype, np.dtype)
        return column.to_numpy() if exact else column.to_numpy(np.float64, na_value=np.nan)
    return column.astype(object).where(column.notna(), "").astype(str).to_numpy(dtype=object)


def _flattening_summary(flattening: Flattening) -> dict[str, Any]:
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
