"""The page of a comparison by left-out holes: verdicts, gains and errors of every arm."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from geounfold.gain.arms import WORDS
from geounfold.report.html_text import bullets, number, pairs, section, table, text
from geounfold.report.sections import asset

if TYPE_CHECKING:
    from geounfold.gain import HolesStudy

_ROW, _LEFT, _WIDTH = 26, 120, 640
_APART = 40  # pixels between two numbers below the chart

_HOW = (
    "Every sample is estimated without its own hole, in five kinds of coordinates that differ by "
    "nothing else: the same samples, the same automatic fit of a variogram, the 24 nearest samples "
    "in units of the ranges and no more than 6 of a hole.",
    "Gain is 1 less the error (RMSE) in unfolded coordinates over that of the arm; 95 % of the "
    "gains over holes drawn with replacement lie in the interval.",
    "Left-out samples have nugget, blocks have not: if the nugget is high, the gain at blocks is "
    "larger than the one here. The expected gain is that at blocks.",
)


def write_gain_page(path: Path, study: HolesStudy, about: dict[str, Any]) -> None:
    """Write the page: one HTML file that loads nothing.

    Parameters
    ----------
    path : path
        The file to write; an existing one is replaced.
    study : HolesStudy
    about : dict
        What was compared, by name, shown as a table.
    """
    path.write_text(gain_page(study, about), encoding="utf-8", newline="\n")


def gain_page(study: HolesStudy, about: dict[str, Any]) -> str:
    """Return the page as HTML."""
    parts = [section("Errors at left-out holes", bullets(study.verdicts()))]
    records: list[dict[str, Any]] = [
        {str(k): v for k, v in row.items()} for row in study.errors.to_dict(orient="records")
    ]
    for grade, expected in study.assessments.items():
        rows = [row for row in records if row["grade"] == grade]
        told = {str(arm): float(gain) for arm, gain in expected.gains["gain"].items()}
        content = _chart(rows, told) + table(_rows(rows, told))
        parts.append(section(grade, content + bullets(expected.lines())))
    parts += [
        section("How it was compared", bullets(_HOW) + pairs(WORDS)),
        section("Input", pairs(about)),
        section("Left out", bullets(study.lines)),
    ]
    body = "\n".join(part for part in parts if part)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>Does unfolding pay here?</title>\n<style>{asset('style.css')}</style>\n</head>\n"
        f"<body>\n<main>\n<h1>Does unfolding pay here?</h1>\n{body}\n</main>\n</body>\n</html>\n"
    )


def _rows(rows: list[dict[str, Any]], expected: dict[str, float]) -> list[dict[str, Any]]:
    """Return the table's rows: errors, gain, interval, and what was expected."""
    out = []
    for row in rows:
        arm = str(row["arm"])
        own = arm == "unfolded"
        out.append(
            {
                "arm": arm,
                "RMSE": row["rmse"],
                "bias": row["bias"],
                "slope": row["slope"],
                "correlation": row["correlation"],
                "gain of unfolding, %": "" if own else _percent(row["gain"]),
                "interval, %": "" if own else f"{_percent(row['low'])} to {_percent(row['high'])}",
                "expected, %": "" if own else _percent(expected[arm], 0),
                "nugget": row["nugget"],
                "range along": row["range_along"],
                "across": row["range_across"],
            }
        )
    return out


def _percent(share: float, digits: int = 1) -> str:
    """Return a share in per cent; a zero has no sign."""
    return f"{round(100 * share, digits) + 0.0:.{digits}f}"


def _chart(rows: list[dict[str, Any]], expected: dict[str, float]) -> str:
    """Return the gains over the other arms with their intervals, as an SVG."""
    shown = [row for row in rows if row["arm"] != "unfolded"]
    values = [row[name] for row in shown for name in ("low", "high")]
    values += [*expected.values(), 0.0]
    low, high = min(values) - 0.02, max(values) + 0.02

    def px(value: float) -> float:
        return float(_LEFT + (value - low) / (high - low) * (_WIDTH - _LEFT - 20))

    height = _ROW * (len(shown) + 1)
    lines = [f'<path fill="none" stroke="currentColor" d="M{px(0):.1f} 0V{height - _ROW}"/>']
    for k, row in enumerate(shown):
        y, told = _ROW * (k + 0.5), px(expected[row["arm"]])
        lines.append(
            f'<text fill="currentColor" x="{_LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">'
            f"{text(row['arm'])}</text>"
            f'<path fill="none" stroke="currentColor" '
            f'd="M{px(row["low"]):.1f} {y:.1f}H{px(row["high"]):.1f}"/>'
            f'<circle r="5" fill="currentColor" cx="{px(row["gain"]):.1f}" cy="{y:.1f}"/>'
            f'<path fill="none" stroke="currentColor" d="M{told:.1f} {y - 8:.1f}v16"/>'
        )
    ends = [end for end in (low + 0.02, high - 0.02) if abs(px(end) - px(0)) > _APART]
    for tick in [0.0, *ends]:
        lines.append(
            f'<text fill="currentColor" x="{px(tick):.1f}" y="{height - 8}" text-anchor="middle">'
            f"{number(round(100 * tick))} %</text>"
        )
    words = "; ".join(
        f"{row['arm']} {row['gain']:.1%} ({row['low']:.1%} to {row['high']:.1%})" for row in shown
    )
    return (
        f'<svg viewBox="0 0 {_WIDTH} {height}" role="img" style="max-width:{_WIDTH}px">'
        f"<title>Gain of unfolding over each arm</title><desc>{text(words)}; a dot with its "
        f"interval is measured, a short upright line expected</desc>{''.join(lines)}</svg>"
    )
