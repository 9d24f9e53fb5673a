"""The outputs of `geounfold unfold` if the rows are read in batches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from geounfold.cli.answers.unfolded import UnfoldedBody
from geounfold.cli.inputs.body import BodyInputs
from geounfold.io.selection.mixed import MixedColumns

if TYPE_CHECKING:
    import pandas as pd

    from geounfold.geometry.mesh import Floats
    from geounfold.unfolding.result import Unfolding
    from geounfold.unfolding.streamed_result import StreamedUnfolding


class StreamedAnswer(UnfoldedBody):
    """An unfolded body whose rows are carried as the table is written.

    Parameters
    ----------
    result : StreamedUnfolding
        Of the blocks.
    body : BodyInputs
        What was read.
    more : dict
        What the summary tells beside the result's.
    """

    def __init__(
        self, result: StreamedUnfolding, body: BodyInputs, more: Mapping[str, Any]
    ) -> None:
        super().__init__(cast("Unfolding", result), body, more)
        self._streamed = result
        self._mixed = MixedColumns(body.table.names)

    def _table_columns(self, frame: pd.DataFrame, points: Floats, rows: slice) -> dict[str, Any]:
        self._mixed.add(frame)
        return super()._table_columns(frame, points, rows)

    def _results(self, points: Floats, rows: slice) -> dict[str, Any]:
        return self._streamed.carried(points)

    def _complete(self) -> None:
        found = self._streamed.summary()
        told = found.pop("warnings")
        own = dict(self.summary)
        self.summary.clear()
        self.summary.update({**found, **own})
        mixed = self._mixed.sentence()
        hints = [f"{self._body.table.source}: {mixed}" if mixed else "", self._body.box_hint(found)]
        self.warnings[:0] = [*filter(None, hints), *told]
        super()._complete()
