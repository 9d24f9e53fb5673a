"""The checks of an estimation as HTML: figures with captions, and the table of settings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geounfold.report.exploration import drawn
from geounfold.report.html_text import bullets, table, text

if TYPE_CHECKING:
    from geounfold.estimation.checks import EstimationChecks


def estimation_html(checks: EstimationChecks) -> str:
    """Return figures and tables of an estimation as HTML, without a title.

    Parameters
    ----------
    checks : EstimationChecks
        As `estimation.checks.estimation_checks` returns them.
    """
    from geounfold.report.plots.grades import (
        chart_beside,
        chart_tonnage,
        chart_variograms,
    )

    grade = checks.grade
    parts = ["<h3>Settings and figures of the run</h3>", table(checks.settings)]
    if checks.expected:
        parts += ["<h3>What unfolding is expected to gain</h3>", bullets(checks.expected)]
    if checks.variograms:
        words = (
            f"Variograms of {grade} in both spaces along the axes of their models. The unfolded "
            "model is that of this run; the folded one is fitted in the same way, for comparison."
        )
        rows = [
            {
                "space": space,
                "nugget": model.nugget,
                "sill": model.sill,
                "structures": ", ".join(s.kind for s in model.structures) or "none",
                "range 1": model.ranges[0],
                "range 2": model.ranges[1],
                "range 3": model.ranges[2],
                "bearing": model.rotation[0],
            }
            for space, model in checks.models.items()
        ]
        parts += [
            "<h3>Variograms</h3>",
            drawn(chart_variograms(checks.variograms, checks.models), words),
            table(rows),
        ]
    if checks.swaths:
        words = (
            f"Mean {grade} of blocks and of samples in the same slices along the unfolded axes, "
            "over the number of samples."
        )
        parts += ["<h3>Swaths</h3>", drawn(chart_beside(checks.swaths, grade), words)]
    words = (
        "Share of blocks and of samples above a cut-off, and their mean grade. Blocks vary less "
        "than samples: estimates are smooth, and blocks larger than samples."
    )
    parts += ["<h3>Grade and tonnage</h3>", drawn(chart_tonnage(checks.tonnage, grade), words)]
    return "\n".join(parts) + f'<p class="soft">{text("Lengths are in the blocks’ unit.")}</p>'
