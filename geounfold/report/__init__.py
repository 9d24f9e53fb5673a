"""One self-contained HTML page about an unfolding: verdict, 3-D views, distributions, options.

Takes plain arrays and the dict of the summary, so that it can be written again from files.  The
page loads nothing from elsewhere and follows the reader's light or dark setting.
"""

import sys
from types import ModuleType
from typing import Any

from geounfold.report.faults import CarriedFaults, carried_faults
from geounfold.report.of_unfolding import report
from geounfold.report.page import report_html, write_report
from geounfold.report.payload import CarriedHoles, CarriedPoints
from geounfold.report.verdict import Verdict, verdict

__all__ = [
    "CarriedFaults",
    "CarriedHoles",
    "CarriedPoints",
    "Verdict",
    "carried_faults",
    "report",
    "report_html",
    "verdict",
    "write_report",
]


class _Public(ModuleType):
    """The package, which is also the public function ``geounfold.report``."""

    def __call__(self, *given: Any, **named: Any) -> None:
        report(*given, **named)


sys.modules[__name__].__class__ = _Public
