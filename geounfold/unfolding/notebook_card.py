"""An unfolding in one line, and as a small table in notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape


@dataclass(frozen=True)
class Facts:
    """Facts of an unfolding for its line and its table.

    Attributes
    ----------
    points, bodies, outside : int
        How many points and bodies were unfolded, and how many points the control mesh does not
        hold.
    method : str
        The method that made the map.
    faults : sequence of str
        Why the map is not proved one-to-one; empty if it is.
    checked : int
        Tetrahedra that the certificate checked.
    epsilon, epsilon_p95 : float
        Relative change of the distances to the neighbours: mean and 95th percentile.
    volume : float
        Volume of the body, unfolded over folded.
    trust : str or None
        How far to trust the layers: good, fair or poor; None if that was not judged.
    round_trip : float or None
        Largest distance between a point and its image carried back; None if there is no way
        back.
    seconds : float
        The run's.
    warnings : sequence of str
        One sentence each.
    """

    points: int
    bodies: int
    outside: int
    method: str
    faults: Sequence[str]
    checked: int
    epsilon: float
    epsilon_p95: float
    volume: float
    trust: str | None
    round_trip: float | None
    seconds: float
    warnings: Sequence[str]

    @property
    def verdict(self) -> str:
        """Whether the answer can be used as it is, in one phrase."""
        if self.faults:
            return "not proved one-to-one"
        count = len(self.warnings)
        if not count:
            return "proved one-to-one"
        return f"proved one-to-one, {count} warning{'s' if count > 1 else ''}"

    def line(self) -> str:
        """Return one line."""
        return (
            f"<Unfolding of {self.points} points by {self.method}: {self.verdict}; "
            f"epsilon {self.epsilon:.4f}, {self.outside} outside>"
        )

    def html(self) -> str:
        """Return a table that takes its colours from the page, for light and dark alike."""
        certificate = (
            "; ".join(self.faults)
            if self.faults
            else f"{self.checked:,} tetrahedra checked in both spaces, no fault"
        )
        rows = {
            "verdict": self.verdict,
            "certificate": certificate,
            "points": f"{self.points:,} in {self.bodies:,} bod{'ies' if self.bodies > 1 else 'y'}, "
            f"{self.outside:,} outside the control mesh",
            "epsilon": f"{self.epsilon:.4f} mean, {self.epsilon_p95:.4f} 95th percentile",
            "volume": f"{self.volume:.4f} of the folded body's",
            **({} if self.trust is None else {"trust in the layers": self.trust}),
            "there and back": "no way back"
            if self.round_trip is None
            else f"{self.round_trip:.2g} at most off",
            "method": f"{self.method}, {self.seconds:.1f} s",
        }
        cells = "".join(
            f'<tr><th scope="row" style="text-align:left">{escape(name)}</th>'
            f'<td style="text-align:left">{escape(text)}</td></tr>'
            for name, text in rows.items()
        )
        notes = "".join(f"<li>{escape(text)}</li>" for text in self.warnings)
        table = f"<table><caption>Unfolding</caption><tbody>{cells}</tbody></table>"
        return f"<div>{table}{f'<ul>{notes}</ul>' if notes else ''}</div>"
