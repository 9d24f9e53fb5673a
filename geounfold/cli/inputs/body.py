"""All that `geounfold unfold` reads."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from geounfold.cli.inputs.block_sizes import BlockVolumes
from geounfold.cli.inputs.drillholes import HoleData, read_holes
from geounfold.cli.inputs.faults import read_faults
from geounfold.cli.inputs.grades import graded_samples
from geounfold.cli.inputs.model_frame import model_frame
from geounfold.cli.inputs.points import open_table, read_samples
from geounfold.cli.inputs.solid import open_solid, source, table_of
from geounfold.cli.terminal.console import Console
from geounfold.io import PointTable, read_surface
from geounfold.io.packages.names import plain_name
from geounfold.io.selection.mixed import box_told, mixed_columns
from geounfold.io.tables.parted import PartedTable

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.body.fill import FilledSolid
    from geounfold.body.model_frame import ModelFrame
    from geounfold.geometry.mesh import Floats, TriMesh
    from geounfold.io.tables.large import PointStream


@dataclass(frozen=True, eq=False)
class BodyInputs:
    """A body to unfold, and what is carried with it.

    Attributes
    ----------
    table : PointTable, PointStream or PartedTable
        The blocks; read whole if there is a report. With a choice of rows, a PartedTable.
    frame : ModelFrame or None
        That of the blocks; None if they are in the world.
    volumes : BlockVolumes
        From the sides of the blocks.
    samples : PointTable or None
        Loose samples.
    holes : HoleData or None
        Drill-holes.
    graded : DataFrame or None
        Coordinates and grade of the samples that the report explores.
    top, bottom : TriMesh or None
        Given surfaces.
    solid : FilledSolid or None
        The wireframe that the blocks fill.
    faults : dict
        What `geounfold.unfold` takes on faults.
    hint : str
        The columns of rock that vary, if the user chose no rows; else empty.
    """

    table: PointTable | PointStream | PartedTable
    frame: ModelFrame | None
    volumes: BlockVolumes
    samples: PointTable | None
    holes: HoleData | None
    graded: pd.DataFrame | None
    top: TriMesh | None
    bottom: TriMesh | None
    solid: FilledSolid | None = None
    faults: dict[str, Any] = field(default_factory=dict)
    hint: str = ""

    @property
    def points(self) -> Floats | FilledSolid:
        """What is unfolded: the solid, or the coordinates of the blocks."""
        return self.table.points if self.solid is None else self.solid

    def box_hint(self, summary: Mapping[str, Any]) -> str:
        """Return the sentence on blocks that fill their lattice's box, if the table tells more."""
        chosen = isinstance(self.table, PartedTable) or self.solid is not None
        if chosen or len(self.table.names) <= len(self.table.columns):
            return ""
        told = box_told(summary.get("lattice", {}).get("full_box"))
        return f"{self.table.source}: {told}" if told else ""


def read_body(args: Namespace, console: Console) -> BodyInputs:
    """Return what the options of `geounfold unfold` name.

    Raises
    ------
    InputError
        A file that cannot be used.
    OptionError
        An option that does not fit its file.
    """
    frame = model_frame(args, console, args.points)
    solid = open_solid(args, console)
    if solid is None:
        table = open_table(args, console, frame=frame, whole=args.report is not None)
    else:
        table = table_of(solid, source(args))
    table.check_writable(args.output)
    volumes = BlockVolumes(args.sizes, table.names, table.source)
    samples = read_samples(args, console)
    holes = read_holes(args, console)
    return BodyInputs(
        PartedTable.chosen(table),
        frame,
        volumes,
        samples,
        holes,
        graded_samples(args, samples, holes, console),
        None if args.top is None else read_surface(args.top),
        None if args.bottom is None else read_surface(args.bottom),
        solid,
        read_faults(args, table),
        _hint(args, table),
    )


def _hint(args: Namespace, table: PointTable | PointStream) -> str:
    """Return the sentence on columns of rock that vary; empty if the user chose rows."""
    names = table.names
    if {"from", "to"} <= {plain_name(name) for name in names}:
        return (
            f"{args.points}: has columns from and to, as samples of drill-holes have: POINTS are "
            "the blocks of the body, and --samples takes the samples"
        )
    if args.where is not None or args.by is not None or len(set(names)) < len(names):
        return ""
    hint = mixed_columns(names, table.categories)
    return f"{args.points}: {hint}" if hint else ""
