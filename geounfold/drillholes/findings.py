"""What the checks find: each finding names its table, hole and row, and what was done."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from geounfold.io.messages import counted, shown

Severity = Literal["note", "warning", "error"]
NOTE: Severity = "note"
WARNING: Severity = "warning"
ERROR: Severity = "error"

_MOST_LISTED = 1000


@dataclass(frozen=True)
class Finding:
    """One thing that a check has found.

    Attributes
    ----------
    source : str
        The table: the file's name.
    check : str
        What is amiss, in the same words for every finding of its kind.
    severity : {"note", "warning", "error"}
        A note says what was assumed; a warning that a row was left out, cut or taken otherwise
        than it stands; an error that a hole with assays cannot be placed.
    action : str
        What was done.
    hole : str
        The hole; empty where the finding is about the table.
    row : int
        The data row (1 is the first after the header); 0 where it is about the hole.
    detail : str
        The values concerned.
    """

    source: str
    check: str
    severity: Severity
    action: str
    hole: str = ""
    row: int = 0
    detail: str = ""

    @property
    def where(self) -> str:
        """Hole, row and values, as far as there are any."""
        row = f"data row {self.row}" if self.row else ""
        hole = f"hole {shown(self.hole)}" if self.hole else ""
        place = " ".join(part for part in (hole, row) if part)
        return f"{place} ({self.detail})" if self.detail and place else place or self.detail

    def __str__(self) -> str:
        where = f": {self.where}" if self.where else ""
        return f"{self.source}: {self.check}{where}; {self.action}"


@dataclass
class Log:
    """Findings as the checks add them."""

    found: list[Finding] = field(default_factory=list)

    def add(
        self,
        source: str,
        check: str,
        severity: Severity,
        action: str,
        *,
        hole: str = "",
        row: int = 0,
        detail: str = "",
    ) -> None:
        """Add one finding."""
        self.found.append(Finding(source, check, severity, action, hole, row, detail))


def messages(findings: Iterable[Finding]) -> list[str]:
    """Return one line for all findings of a kind, in the order of the first of each.

    Examples
    --------
    >>> bad = [Finding("s.csv", "no depth", "warning", "left out", "A", row) for row in (3, 5)]
    >>> messages(bad)
    ['s.csv: no depth in 2 places: hole A data row 3, hole A data row 5; left out']
    """
    lines = []
    for group in _grouped(findings).values():
        first = group[0]
        if len(group) == 1:
            lines.append(str(first))
            continue
        places = _some([f.where for f in group])
        lines.append(
            f"{first.source}: {first.check} in {len(group)} places: {places}; {first.action}"
        )
    return lines


def facts(findings: Sequence[Finding]) -> dict[str, Any]:
    """Return findings for a summary: counts by kind, and each with its hole and row."""
    counts = [
        {
            "table": group[0].source,
            "check": group[0].check,
            "severity": group[0].severity,
            "action": group[0].action,
            "count": len(group),
        }
        for group in _grouped(findings).values()
    ]
    rows = [
        {
            "table": f.source,
            "check": f.check,
            "hole": f.hole or None,
            "row": f.row or None,
            "detail": f.detail,
        }
        for f in findings[:_MOST_LISTED]
    ]
    return {"findings": counts, "finding_rows": rows, "findings_total": len(findings)}


def refusal(findings: Sequence[Finding], cure: str) -> str:
    """Return the error that names the first of the findings and how many more there are."""
    first = findings[0]
    where = f": {first.where}" if first.where else ""
    more = f" (and {counted(len(findings) - 1, 'more finding')})" if len(findings) > 1 else ""
    return f"{first.source}: {first.check}{where}{more}; {cure}"


def _grouped(findings: Iterable[Finding]) -> dict[tuple[str, str, str, str], list[Finding]]:
    groups: dict[tuple[str, str, str, str], list[Finding]] = {}
    for f in findings:
        groups.setdefault((f.source, f.check, f.severity, f.action), []).append(f)
    return groups


def _some(places: Sequence[str], most: int = 5) -> str:
    """Return the first places and how many more there are.

    Examples
    --------
    >>> _some(["a", "b"]), _some(list("abcdefg"))
    ('a, b', 'a, b, c, d, e and 2 more')
    """
    text = ", ".join(places[:most])
    return text if len(places) <= most else f"{text} and {len(places) - most} more"
