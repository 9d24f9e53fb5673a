"""A table of comparisons as aligned text: what a terminal has room for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

_LEFT = ("surface", "body", "method", "flattener", "stop")
_COLUMNS: Mapping[str, str] = {
    "surface": "surface",
    "body": "body",
    "method": "method",
    "flattener": "flattener",
    "epsilon_folded": "eps(X,Y)",
    "epsilon_truth": "eps(W,Y)",
    "rms": "RMS",
    "stratigraphic_error": "strat",
    "injective": "proved",
    "torn": "torn",
    "unplaced": "empty",
    "area_error": "E_s",
    "edge_strain": "strain",
    "area_distortion": "area",
    "angle_distortion": "angle",
    "symmetric_dirichlet": "Dirichlet",
    "flips": "flips",
    "overlaps": "overlaps",
    "iterations": "steps",
    "stop": "stop",
    "seconds": "seconds",
}
"""Headings of the columns that are printed; the file has all of them."""


def table_text(frame: pd.DataFrame) -> str:
    """Return a table's main columns as aligned text; a failed row ends in its error."""
    rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
    shown = [name for name in _COLUMNS if any(row.get(name) not in (None, "") for row in rows)]
    head = {name: _COLUMNS[name] for name in shown}
    lines = [head, *({name: _cell(row[name]) for name in shown} for row in rows)]
    width = {name: max(len(line[name]) for line in lines) for name in shown}
    errors = ["", *(str(row.get("error") or "") for row in rows)]
    return "".join(
        f"{'  '.join(_padded(name, line[name], width[name]) for name in shown)}  {error}".rstrip()
        + "\n"
        for line, error in zip(lines, errors, strict=True)
    )


def _padded(name: str, text: str, width: int) -> str:
    return text.ljust(width) if name in _LEFT else text.rjust(width)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
