"""The five lines that end a run on a terminal: blocks, body, verdict, time, files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any


def closing_lines(summary: Mapping[str, Any], seconds: float, files: Iterable[str]) -> list[str]:
    """Return what a user wants to know first, from a run's summary.

    Parameters
    ----------
    summary : mapping
        As `geounfold unfold --summary` writes it; a figure that is missing is left out.
    seconds : float
        Since the command began, reading and writing included.
    files : iterable of str
        The outputs.
    """
    off = summary.get("uncertainty") or {}
    error = (
        []
        if "rms" not in off
        else [
            f"error    {off['rms']:.3g} expected; 90 % of the blocks within {off['within_90']:.3g}"
        ]
    )
    return [
        f"blocks   {_blocks(summary)}",
        f"body     {_body(summary)}",
        f"verdict  {'; '.join(_verdict(summary))}",
        *_limits(summary),
        *error,
        f"time     {_time(summary, seconds)}",
        f"files    {', '.join(files)}",
    ]


def _blocks(summary: Mapping[str, Any]) -> str:
    outside, total = summary.get("outside") or {}, int(summary.get("points") or 0)
    steps = (summary.get("lattice") or {}).get("steps")
    size = f" of {' x '.join(f'{s:.6g}' for s in steps)}" if steps else " points"
    left = [
        f"{outside[key]:,} {word}"
        for key, word in (
            ("extrapolated", "outside the mesh, extrapolated"),
            ("empty", "left empty"),
        )
        if outside.get(key)
    ]
    bodies = summary.get("bodies") or 1
    several = f" in {bodies} bodies" if bodies > 1 else ""
    return f"{total:,}{size} unfolded{several}, {', '.join(left) or 'all inside the mesh'}"


def _body(summary: Mapping[str, Any]) -> str:
    size = summary.get("flat_size") or {}
    parts = []
    if size.get("length"):
        parts.append(f"{size['length']:.4g} long and {size['width']:.4g} wide when flat")
    if size.get("thickness"):
        parts.append(f"{size['thickness']:.4g} thick (median)")
    blocks = (summary.get("body_volume") or {}).get("folded")
    hull = (summary.get("hull") or {}).get("volume")
    if blocks or hull:
        parts.append(f"volume of the {'blocks' if blocks else 'hull'} {blocks or hull:.4g}")
    return ", ".join(parts) or "size not known"


def _verdict(summary: Mapping[str, Any]) -> Iterator[str]:
    yield "proved one-to-one" if summary.get("injective") else "NOT proved one-to-one"
    levels = [v for v in (summary.get("horizons") or {}).values() if v is not None]
    if levels:
        yield f"top and bottom level to {max(levels):.1%} of the thickness"
    nmd = summary.get("nmd") or {}
    if "mean" in nmd:
        yield (
            f"distances to neighbours change by {nmd['mean']:.1%}, for 95% of the blocks by less "
            f"than {nmd['p95']:.0%}"
        )
    trust = summary.get("trust") or {}
    if trust:
        reasons = trust.get("reasons") or []
        why = f": {reasons[0]['what']}" if reasons else ""
        more = f" and {len(reasons) - 1} more" if len(reasons) > 1 else ""
        yield f"trust {trust['word']}{why}{more}"


def _limits(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield the line on what the limits take of the rim, if any were given."""
    if summary.get("limit_rims"):
        from geounfold.faults.limit_rims import limits_told

        yield f"limits   {limits_told(summary['limit_rims'])}"


def _time(summary: Mapping[str, Any], seconds: float) -> str:
    stages = summary.get("seconds") or {}
    longest = max(stages, key=lambda name: float(stages[name]), default=None)
    of_it = f", of which {longest} {stages[longest]:.1f} s" if longest else ""
    memory = summary.get("peak_memory_mb")
    return f"{seconds:.1f} s{of_it}" + (f"; {memory:,.0f} MB of memory" if memory else "")


def names_of(paths: Iterable[str | None]) -> list[str]:
    """Return the outputs that are given, the shortest names that lead to them."""
    return [str(Path(path)) for path in paths if path is not None]
