"""Endings of the files that commands write."""

from __future__ import annotations

from geounfold.io.formats import point_endings, surface_endings
from geounfold.io.paths import TABLE_ENDINGS

POINTS_OUT = (*TABLE_ENDINGS, *point_endings(writing=True))
SURFACES_OUT = surface_endings(writing=True)
TRACES = (*TABLE_ENDINGS, ".vtp")
JSON = (".json",)
MAP = (".npz",)
VTU = (".vtu",)
HTML = (".html", ".htm")
PICTURE = (".png",)
TOML = (".toml",)
