"""The outputs of `geounfold unfold`: the table, the summary, and what is carried with a body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from geounfold.cli.answers.locations import flat_columns, outside_warnings, place_counts
from geounfold.cli.answers.report_data import report_columns, report_holes
from geounfold.cli.inputs.body import BodyInputs
from geounfold.io import PointTable, write_json
from geounfold.io.result_columns import UNFOLDED, result_columns, world_columns
from geounfold.io.tables.parted import PartedTable

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.estimation import Exploration
    from geounfold.geometry.mesh import Floats
    from geounfold.mapping.mesh_map import UnfoldingMap
    from geounfold.unfolding.result import Unfolding


class UnfoldedBody:
    """An unfolded body with its samples and drill-holes carried, to be written.

    Parameters
    ----------
    result : Unfolding
        Of the blocks.
    body : BodyInputs
        What was read.
    summary : dict
        Of the result; what was read and carried is added.
    exploration : Exploration, optional
        Of a grade, for the summary and the report.
    mended : bool
        Whether the table gets the column ``mended``.
    part : bool
        Whether the table gets the column ``body_part`` also if no body is divided.

    Attributes
    ----------
    summary : dict
        What the command answers; complete once the outputs are written.
    warnings : list of str
        All warnings of the run, in the summary too; complete once the outputs are written.
    """

    def __init__(
        self,
        result: Unfolding,
        body: BodyInputs,
        summary: Mapping[str, Any],
        exploration: Exploration | None = None,
        mended: bool = False,
        part: bool = False,
    ) -> None:
        columns = {"mended": mended, "body_part": part or bool(result.junctions)}
        self._asked = [name for name, wanted in columns.items() if wanted]
        self._result, self._body, self._exploration = result, body, exploration
        carry = flat_columns(result.map, result.uncertainty)
        self._samples = None if body.samples is None else carry(body.samples.points)
        self._holes = {} if body.holes is None else body.holes.carried(carry)
        self.warnings: list[str] = [*summary.get("warnings", []), *self._carried_warnings()]
        read = body.table.facts() | ({} if body.frame is None else body.frame.facts())
        if summary.get("unit"):  # of --unit
            read["unit"] = summary["unit"]
        self.summary = {**summary, "warnings": self.warnings, "input": read}
        if body.solid is not None:
            self.summary["solid"] = body.solid.facts()
        if body.samples is not None:
            self.summary["samples"] = body.samples.facts()
        if body.holes is not None:
            self.summary["drillholes"] = body.holes.facts(self._holes)
        if exploration is not None:
            self.summary["exploration"] = exploration.summary()

    def write(self, parts: Mapping[str, Path]) -> None:
        """Write the outputs that are wanted.

        Parameters
        ----------
        parts : mapping
            The path of each, by its option.
        """
        body = self._body
        body.table.write_parts(parts["--output"], self._table_columns)
        # The table may be written in batches, which give the sums of the volumes.
        self._complete()
        if body.samples is not None and self._samples is not None and "--samples-out" in parts:
            body.samples.write(parts["--samples-out"], self._samples)
        if body.holes is not None:
            body.holes.write(parts, self._holes)
        if "--map" in parts:
            self._result.save(parts["--map"])
        if "--mesh" in parts:
            from geounfold.io.control_mesh import write_control

            saved = cast("UnfoldingMap", self._result.map)  # the method has one: checked before
            write_control(parts["--mesh"], saved, self._result.certificate)
        if "--slips" in parts:
            from geounfold.io.tables.files import write_table

            write_table(parts["--slips"], self._result.slips)
        if "--summary" in parts:
            write_json(parts["--summary"], self.summary)
        if "--report" in parts:
            self._write_report(parts["--report"])

    def _complete(self) -> None:
        """Add what is known once the table was written."""
        self.summary.update(self._body.volumes.facts())
        self.warnings += self._body.volumes.warnings()

    def _table_columns(self, frame: pd.DataFrame, points: Floats, rows: slice) -> dict[str, Any]:
        """Return the output columns of a batch of rows."""
        world = {} if self._body.frame is None else world_columns(points)
        found = self._results(points, rows)
        return {**world, **found, **self._body.volumes.columns(frame, found)}

    def _results(self, points: Floats, rows: slice) -> dict[str, Any]:
        """Return the results of a batch of rows."""
        return block_results(self._result, rows, self._asked)

    def _write_report(self, path: Path) -> None:
        from geounfold.report import carried_faults, write_report

        body, result = self._body, self._result
        table = cast(PointTable | PartedTable, body.table)  # a report's table is read whole
        write_report(
            path,
            self.summary,
            table.points,
            result.points,
            report_columns(table, block_results(result, slice(0, len(table)), self._asked)),
            holes=report_holes(body.holes, self._holes, body.samples, self._samples),
            faults=carried_faults(result),
            horizons=result.surfaces,
            exploration=self._exploration,
        )

    def _carried_warnings(self) -> list[str]:
        """Return the warnings of samples and drill-holes."""
        body = self._body
        found = [] if body.holes is None else body.holes.holes.messages()
        if body.samples is not None and self._samples is not None:
            found += outside_warnings(body.samples.source, place_counts(self._samples))
        for name, columns in self._holes.items():
            found += outside_warnings(f"the holes' {name}", place_counts(columns))
        return found


def block_results(result: Unfolding, rows: slice, asked: Sequence[str] = ()) -> dict[str, Any]:
    """Return the results of some of the blocks, by output column; ``asked``: columns on request."""
    distortion = {name: values[rows] for name, values in result.columns.items()}
    asked_for = {name: getattr(result, name)[rows] for name in asked}
    return result_columns(UNFOLDED, result.carried.part(rows)) | distortion | asked_for
