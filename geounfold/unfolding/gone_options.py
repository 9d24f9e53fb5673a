"""Options of version 0.1.0 that are gone since 0.2.0, for whoever has a file that holds them."""

from __future__ import annotations

import tomllib
from typing import Any

RENAMED = {
    "hull_options.sigma": "hull_options.blur",
    "sheet_options.fit.smooth": "sheet_options.smoothing",
    "sheet_options.medial.parallel": "sheet_options.core",
    "sheet_options.control.cell": "sheet_options.mesh_cell",
    "sheet_options.coarse.blocks": "sheet_options.merge_above",
    "thesis_options.flattener": "flattener",
    "thesis_options.flattener_options": "flattener_options",
}
"""Names that options have had, and those that they have now."""

_FORMER = """
[flattener_options]
stiffness = 1.0
density = 1.0
warm_strain = 0.05
warm_tol = 1e-3
warm_max_iter = 60
guard = true
initial = "relaxed"
energy_tol = 1e-4
releases = "as many as it takes"
weights = "cotangent"
distances = "auto"

[hull_options]
remesh_iterations = 2
sigma_thin = 1.0
shell = 0.9
smoothing = 10

[sheet_options]
left_out = 0.008
sheared = 1.0
refused_rough = 1.25
refused_agree = 0.95
refused_share = 0.4
tapering = 0.1
taper_half = 4.5
taper_gain = 1.4

[sheet_options.medial]
sweeps = 6
closing = 2.5
island = 0.05
erosion = 1.5
domain = 1.2
fair = 0.5
prefer = 0.2

[sheet_options.fit]
knots = 3.5
cell = 1.5
rough = 1.5
quiet = 0.03
loud = 0.08
smooth_half = 3.0
order_half = 2
weak = 0.0001
unseen = 0.0003
rounds = 4
agree = 0.93
first = 1.5
later = 1.0
erosion = 1.5
reach = 4.0
ahead = inf

[sheet_options.closer]
knots = 3.5
cell = 1.5
smooth = 1.0
rough = 1.0
quiet = 0.03
loud = 0.08
smooth_half = 3.0
order_half = 2
weak = 0.0001
unseen = 0.0001
rounds = 8
agree = 0.93
first = 1.5
later = 0.7
erosion = 0.75
reach = 4.0
ahead = 2.0

[sheet_options.occupancy]
margins = [0.3, 0.3, 0.15, 0.1, 0.06, 0.04, 0.03, 0.02, 0.02, 0.02]
smooth = 2.7
least = 1.73
pace = 1.15
tolerated = 0.03
adapt = 0.06
smooth_half = 3.5
rim = 1.0
depths = [1.25, 1.0, 0.75]
band = 1.2
thin = 1.25
cover = 0.9
thinnest = 1.0
taper = 0.25
slack = 0.5
misfit = 0.01
enough = 100
held = true
sheared = 0.0

[sheet_options.horizons]
smooth = 1.5
agree = 0.9
erosion = 0.5
misfit = 2.5
stiffness = 0.0001
separate = 1.5
margins = [0.1, 0.1, 0.06, 0.04, 0.03, 0.02]
blurred = 2.0
thinnest = 0.25

[sheet_options.layers]
clear = 0.5
rounds = 4
smooth = [1.0, 1.6, 2.4, 3.2]
smooth_half = 2.0
most = 12000

[sheet_options.conform]
varied = 0.03
strained = 0.002
share = 0.5

[sheet_options.control]
widest = 3.0
turn = 0.1
many = 8000
turn_merged = 0.25
dilation = 1
pad = 0.6
pad_capped = 1.0
focal = 0.9
slope = 0.7
reach = 3
slopes = [0.3, 0.6, 1.2]
focal_refined = 0.95
shrinks = 40
shell = 3.0

[sheet_options.coarse]
surface = 12000.0
layers = 1.0

[thesis_options]
cell = 1.5
merge = 0.5
pad = 0.5
least_gap = 0.5
max_hidden = 0.05
max_pieces = 0.1
max_steep = 0.1

[isomap_options]
near = 50
rounds = 4
largest = 2.5
"""


def gone(name: str, value: Any) -> str | None:
    """Return what to do about an option of 0.1.0 that is gone, in one sentence; None for others.

    Parameters
    ----------
    name : str
        The option, with the tables that it stands in: ``sheet_options.fit.knots``.
    value : any
        What the file gives it; the first gone option in it, if that is a table.

    Examples
    --------
    >>> gone("hull_options.shell", 0.8)
    'hull_options.shell is gone since 0.2.0: leave it out (its default was 0.9)'
    """
    if name in RENAMED:
        return f"{name} is called {RENAMED[name]} since 0.2.0: write it there"
    found: Any = tomllib.loads(_FORMER)
    for word in name.split("."):
        found = found.get(word) if isinstance(found, dict) else None
    if isinstance(found, dict):
        inside = value if isinstance(value, dict) else {}
        sentences = (gone(f"{name}.{word}", below) for word, below in inside.items())
        first = next((sentence for sentence in sentences if sentence), None)
        return first or f"{name} is gone since 0.2.0: leave it out"
    if found is None:
        return None
    return f"{name} is gone since 0.2.0: leave it out (its default was {found})"
