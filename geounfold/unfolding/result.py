"""The result of an unfolding."""

from __future__ import annotations

from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, overload

import numpy as np
import pandas as pd

from geounfold.body.parts import Junction
from geounfold.errors import OptionError
from geounfold.geometry.mesh import Bools, Floats, Ints, Space, TriMesh, in_space
from geounfold.io.result_columns import FOLDED, UNFOLDED, result_columns, with_carried
from geounfold.io.selection.mixed import box_told, mixed_frame
from geounfold.io.tables.parted import spread_columns
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.methods import PointwiseMap, SurfacePair, no_mesh
from geounfold.surfaces.hull import Hull
from geounfold.unfolding.measured import in_world
from geounfold.unfolding.notebook_card import Facts
from geounfold.unfolding.summary import RunRecord, body_volume, summarise, warnings_of

if TYPE_CHECKING:
    import dask.dataframe
    import pyvista


class Unfolding:
    """An unfolded body: its points, the map both ways, every stage's meshes, the figures.

    Made by ``unfold``; all coordinates are true to scale, in the input's unit.

    Attributes
    ----------
    folded : (n, 3) float
        The points as given; those of the rows chosen, if the user chose some.
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
    trust : Trust or None
        How far to trust the layers: good, fair or poor, with reasons; None without a control mesh.
    uncertainty : PositionUncertainty or None
        Standard deviations of the places, and of those of other points; None if the user did not
        choose to measure them.
    seconds : dict of float
        Per stage.
    chosen : (m,) bool or None
        Rows of the DataFrame given that are the body; None if all are.
    """

    def __init__(
        self,
        record: RunRecord,
        given: pd.DataFrame | None = None,
        chosen: Bools | None = None,
    ) -> None:
        """Keep a run's record, the DataFrame that the points came in, and its rows chosen."""
        self._record = record
        self.chosen = chosen
        self._given = None if given is None else given.copy()
        prepared, measured = record.prepared, record.measured
        self.options = record.options
        self.folded = prepared.points
        self.frame = prepared.frame
        self.lattice = prepared.lattice
        self.fits = record.fits
        self.map = record.map
        self.carried = measured.carried
        self.quality = measured.quality
        self.certificate = measured.certificate
        self.trust = measured.trust
        self.uncertainty = record.uncertainty
        self.seconds = record.seconds

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
    def body_volume(self) -> dict[str, float | None]:
        """Volume of the blocks, ``folded`` and ``unfolded``; None if it is not known."""
        return body_volume(self._record)

    @cached_property
    def body_part(self) -> Ints:
        """Sheet part of every point, (n,), 0 the largest of its body; -1 outside the bodies.

        Parts are numbered over all bodies to unfold. A body of one sheet is one part.
        """
        out = np.full(len(self.folded), -1)
        for part, rows in enumerate(self._record.prepared.groups):
            out[rows] = part
        return out

    @cached_property
    def fault_block(self) -> Ints:
        """Fault block of every point, (n,), 0 the largest; -1 outside the body.

        A body without faults is one fault block.
        """
        out = np.full(len(self.folded), -1)
        for block, rows in enumerate(self._record.prepared.groups):
            out[rows] = block if self._record.faulted is not None else 0
        return out

    @cached_property
    def faults(self) -> pd.DataFrame:
        """A row per fault and pair of fault blocks: throw, heave, strike slip, rake, gaps.

        Lengths are in the data's unit, angles in degrees; empty for bodies without faults.
        """
        found = self._record.faulted
        return pd.DataFrame() if found is None else found.table

    @property
    def slips(self) -> pd.DataFrame:
        """A row per slip vector: places on both walls of a fault that meet in the flat space."""
        found = self._record.faulted
        return pd.DataFrame() if found is None else found.slips()

    @property
    def fault_surfaces(self) -> dict[str, tuple[Floats, Ints]]:
        """Vertices and triangles of the faults by name, in the data's coordinates, folded space.

        They are those given, or those fitted between the fault blocks.
        """
        found = self._record.faulted
        if found is None:
            return {}
        to_world = self.frame.to_world
        return {surface.name: (to_world(surface.V), surface.F) for surface in found.cells.surfaces}

    @property
    def junctions(self) -> tuple[Junction, ...]:
        """Places where sheet parts meet, in the data's coordinates; empty for whole bodies."""
        return self._record.junctions

    @property
    def mended(self) -> np.ndarray:
        """What the hull made of every point, (n,) of str.

        Empty if the point is the body's, ``cut`` in a thin bridge, ``dropped`` away from the
        body, ``smoothed`` at a rough skin. Every point is carried all the same.
        """
        return self._record.prepared.mended.column

    @property
    def columns(self) -> dict[str, Floats]:
        """Distortion per point: volume_ratio, nmd_error, stretch_min, stretch_max, shear.

        With the option uncertainty, sd_along and sd_across too.
        """
        return self.quality.blocks.columns() | self._deviations

    @cached_property
    def _deviations(self) -> dict[str, Floats]:
        if self.uncertainty is None:
            return {}
        return self.uncertainty.columns(self.folded, self.carried.placed)

    @property
    def table(self) -> pd.DataFrame:
        """The DataFrame given, or x, y and z of an array, with all results as further columns.

        Index, columns, their order and types are as given; a column called as a result is
        replaced in its place.  The results are unfolded_x, unfolded_y, unfolded_z,
        stratigraphic, location, mesh_distance, those of ``columns`` and, if a body has several
        sheets, body_part; if faults were taken out, fault_block. Rows that were not chosen have
        empty results and the location ``not selected``.
        """
        given = self._given
        if given is None:
            given = pd.DataFrame(self.folded, columns=["x", "y", "z"])
        parts = {"body_part": self.body_part} if self.junctions else {}
        found = {**result_columns(UNFOLDED, self.carried), **self.columns, **parts}
        if self.chosen is not None:
            rows = np.flatnonzero(self.chosen)
            found = spread_columns([(rows, found)], np.where(self.chosen, 0, -1))
        return given.assign(**found)

    def to_flat(self, points: Floats, fault_block: Ints | None = None) -> Floats:
        """Return other folded points (m, 3) in the flat space.

        Parameters
        ----------
        points : (m, 3) float
            In the data's coordinates.
        fault_block : (m,) int, optional
            Fault block of each, if faults were taken out; by the side of the faults if not given.
        """
        if fault_block is None or isinstance(self.map, PointwiseMap):
            return self.map.to_flat(points)
        return self.map.to_flat(points, fault_block)

    def to_folded(self, points: Floats, fault_block: Ints | None = None) -> Floats:
        """Return points of the flat space (m, 3) in the folded one.

        Parameters
        ----------
        points : (m, 3) float
            In the data's unit.
        fault_block : (m,) int, optional
            Fault block of each, which tells between the two walls of a cut-off.
        """
        if fault_block is None or isinstance(self.map, PointwiseMap):
            return self.map.to_folded(points)
        return self.map.to_folded(points, fault_block)

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
        from geounfold.unfolding.dask_map import map_partitions

        return map_partitions(self.map, frame)

    def to_pyvista(
        self, space: Space = "folded", *, cells: bool = False
    ) -> pyvista.PolyData | pyvista.UnstructuredGrid:
        """Return the points, or the blocks as cells, in one space with all columns.

        Parameters
        ----------
        space : {"folded", "unfolded"}
            Space of the points; the data of the other space's name, (n, 3), hold their places
            there.  Unfolded, points without an image (location outside) are left out.
        cells : bool
            True for a hexahedron for each block: its sides are those of the DataFrame's columns
            (dx, XINC, ...), or of the lattice, and its corners are carried by the map.  A block
            with a corner beyond the map's reach keeps its sides about its unfolded centre.

        Raises
        ------
        InputError
            The blocks' sides are not known.
        """
        from geounfold.io.formats.vtk import cloud, hexahedra

        here, there, other = in_space(space, self.folded, self.points)
        keep = np.isfinite(here).all(axis=1)
        table = self.table if self.chosen is None else self.table[self.chosen]
        columns = {str(name): _plain_column(c)[keep] for name, c in table.items()}
        if cells:
            from geounfold.unfolding.block_corners import block_corners

            flat = (self.points, self.to_flat) if space == "unfolded" else ()
            made = hexahedra(block_corners(table, self.folded, *flat)[keep], columns)
            made.cell_data[other] = there[keep]
            return made
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
        return {name: pair.in_world(self.frame) for name, pair in self.fits[0].surfaces.items()}

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
        return in_world(self.map.control, self.frame)

    @property
    def torn(self) -> int:
        """Number of blocks that came to lie far from a block that they touch."""
        return len(self._record.measured.torn)

    @property
    def outside_share(self) -> float:
        """Share of the points that the control mesh does not hold."""
        return float(np.mean(~self.carried.inside))

    @property
    def round_trip_max(self) -> float | None:
        """Largest distance between a point and its return, over those that have both.

        None if the method has no way back.
        """
        return self._record.round_trip_max

    def save(self, path: str | Path | BinaryIO) -> None:
        """Write the map (not the points) as .npz; ``geounfold.load`` reads it.

        Raises
        ------
        OptionError
            The method has no control mesh.
        """
        self.map.save(path)

    def report(
        self,
        path: str | Path,
        *,
        samples: pd.DataFrame | None = None,
        unit: str = "",
        overwrite: bool = False,
    ) -> None:
        """Write the report: one page with pictures, verdict and figures; see `geounfold.report`.

        Parameters
        ----------
        path : path
            A file that ends in .html.
        samples : DataFrame, optional
            Other points to show in both spaces.
        unit : str, optional
            Unit of the coordinates, such as ``m``.
        overwrite : bool
            Whether an existing file is replaced.
        """
        write = import_module("geounfold").report  # the public one: reports stand above this room
        write(self, path, samples=samples, unit=unit, overwrite=overwrite)

    def summary(self) -> dict[str, Any]:
        """Return what ran and how good it is, ready for JSON."""
        found = summarise(self._record, self.surfaces)
        return {**found, "warnings": [*self._notes(), *found["warnings"]]}

    def _notes(self) -> list[str]:
        """Return what the DataFrame's columns tell of other rock among the rows."""
        if self._given is None or self.chosen is not None or self._given.shape[1] <= 3:
            return []
        return [n for n in (mixed_frame(self._given), box_told(self._record.full_box)) if n]

    @property
    def injective(self) -> bool:
        """Whether the map is proved one-to-one: the certificate covers tetrahedra only."""
        return self._record.injective

    def _facts(self) -> Facts:
        return Facts(
            points=len(self.folded),
            bodies=self._record.prepared.bodies,
            outside=self._record.outside,
            method=self.options.method,
            faults=self._record.faults,
            checked=self.certificate.tetrahedra,
            epsilon=self.quality.nmd.mean,
            epsilon_p95=self.quality.nmd.p95,
            volume=self.quality.volume_unfolded / self.quality.volume_folded,
            trust=None if self.trust is None else self.trust.word,
            round_trip=self.round_trip_max,
            seconds=sum(self.seconds.values()),
            warnings=[*self._notes(), *warnings_of(self._record)],
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
