"""Drill-holes: from collar, survey and assay tables to samples and traces in space.

Each stage is a module. `tables` finds columns and reads numbers. `checks` names the rows that
cannot be used. `desurvey` computes paths by minimum curvature. `composite` averages grades over
equal lengths. `holes` runs all stages; `joined` adds a log's codes to assays.
"""

from geounfold.drillholes.composite import RESIDUALS, CompositeOptions
from geounfold.drillholes.findings import Finding
from geounfold.drillholes.holes import DrillHoles, read_drillholes
from geounfold.drillholes.joined import joined
from geounfold.drillholes.tables import ALIASES

__all__ = [
    "ALIASES",
    "RESIDUALS",
    "CompositeOptions",
    "DrillHoles",
    "Finding",
    "joined",
    "read_drillholes",
]
