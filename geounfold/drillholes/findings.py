"""Findings of the checks: each names its table, hole, row and the action taken."""

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
    """One finding of a check.

    Attributes
    ----------
    source : str
        Name of the table's file.
    check : str
        The problem, in the same words for every finding of its kind.
    severity : {"note", "warning", "error"}
        Note: an assumption. Warning: a row was left out, cut or changed. Error: a hole with
        assays cannot be placed.
    action : str
        The action taken.
    hole : str
        Name of the hole; empty if the finding is about the table.
    row : int
        Data row (1 is the first after the header); 0 if the finding is about the hole.
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
        """Hole, row and values, as far as they are known."""
        row = f"data row {self.row}" if self.row else ""
        hole = f"hole {shown(self.hole)}" if self.hole else ""
        place = " ".join(part for part in (hole, row) if part)
        return f"{place} ({self.detail})" if self.detail and place else place or self.detail

    def __str__(self) -> str:
        where = f": {self.where}" if self.where else ""
        action = f"; {self.action}" if self.action else ""
        return f"{self.source}: {self.check}{where}{action}"


@dataclass
class Log:
    """Collects the findings of the checks."""

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
    """Return one line for each kind of finding, in the order of their first findings.

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
    """Return the findings for a summary: counts by kind, and each one's hole and row."""
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
    """Return an error message with the first finding and the number of the others."""
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
    """Return the first places and the number of the others.

    Examples
    --------
    >>> _some(["a", "b"]), _some(list("abcdefg"))
    ('a, b', 'a, b, c, d, e and 2 more')
    """
    text = ", ".join(places[:most])
    return text if len(places) <= most else f"{text} and {len(places) - most} more"
