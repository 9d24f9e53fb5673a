"""JSON text and files, with NaN and infinity as null."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np


def write_json(path: str | Path, content: dict[str, Any]) -> None:
    """Write figures as a JSON file; NaN and infinity, which JSON lacks, become null."""
    Path(path).write_text(json_text(content), encoding="utf-8", newline="\n")


def json_text(content: dict[str, Any]) -> str:
    """Return figures as the text of one JSON object; NaN and infinity become null."""
    return json.dumps(_plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    """Return a value in JSON's own types; a type that JSON does not have becomes text."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if value is None or isinstance(value, str | int | bool):
        return value
    return str(value)
