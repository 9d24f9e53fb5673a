"""The report's section on faults: slip table, flat map with cut-offs, throw along strike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats, Ints
from geounfold.report.charts import dot_chart
from geounfold.report.columns import by_number
from geounfold.report.html_text import mapping, section, table, text

if TYPE_CHECKING:
    from geounfold.unfolding.result import Unfolding

SLIP_COLUMNS = (
    *("fault", "footwall_block", "hanging_wall_block", "stratigraphic"),
    *(f"{wall}_{space}{axis}" for wall in ("foot", "hanging") for space in ("", "unfolded_")
      for axis in "xyz"),
    *("throw", "strike_slip", "gap"),
)  # fmt: skip
"""Columns that the table of slips must have."""

_MIDDLE = 0.5  # stratigraphic height of the flat map
_LAYER = 0.17  # blocks at most as far from it are drawn: a layer of three blocks has one
_CHARTS = 24  # faults and pairs of blocks whose throw is drawn at most
_BREAK = 4.0  # times the median distance of neighbours on a cut-off: a longer one ends the line
_CELLS = 160  # cells of the flat map along its longer side at most
_WIDE = 900.0  # width of the flat map, pixels


@dataclass(frozen=True, eq=False)
class CarriedFaults:
    """Faults of a body whose fault blocks were unfolded and joined.

    Attributes
    ----------
    surfaces : mapping of str to ((n, 3) float, (m, 3) int)
        Vertices and triangles in folded space, by the fault's name.
    slips : DataFrame
        Pairs of places on both walls that meet in flat space, with SLIP_COLUMNS: lengths in the
        data's unit, heights from 0 (bottom) to 1 (top), throw positive if the hanging wall went
        down, gap negative for an overlap.

    Raises
    ------
    InputError
        A column of the slips is missing.
    """

    surfaces: Mapping[str, tuple[Floats, Ints]]
    slips: pd.DataFrame

    def __post_init__(self) -> None:
        missing = [name for name in SLIP_COLUMNS if name not in self.slips.columns]
        if missing:
            raise InputError(f"the slips lack the columns {', '.join(missing)}")

    def places(self, wall: str, space: str) -> Floats:
        """Return places on a wall, (k, 3).

        Parameters
        ----------
        wall : {'foot', 'hanging'}
        space : {'folded', 'unfolded'}
        """
        infix = "unfolded_" if space == "unfolded" else ""
        return self.slips[[f"{wall}_{infix}{axis}" for axis in "xyz"]].to_numpy(np.float64)


def carried_faults(unfolding: Unfolding) -> CarriedFaults | None:
    """Return an unfolded body's faults as the report shows them; None if it has none.

    Places on both walls are carried into flat space by their own fault block.
    """
    surfaces, slips = unfolding.fault_surfaces, unfolding.slips
    if not surfaces:
        return None
    if not len(slips):
        slips = pd.DataFrame({name: np.empty(0) for name in SLIP_COLUMNS})
        return CarriedFaults(surfaces, slips)
    flat: dict[str, Floats] = {}
    for wall, block in (("foot", "footwall_block"), ("hanging", "hanging_wall_block")):
        places = slips[[f"{wall}_{axis}" for axis in "xyz"]].to_numpy(np.float64)
        image = unfolding.to_flat(places, slips[block].to_numpy())
        flat |= {f"{wall}_unfolded_{axis}": image[:, k] for k, axis in enumerate("xyz")}
    slips = slips.assign(**flat)
    kept = np.isfinite(slips[list(flat)].to_numpy()).all(axis=1)
    return CarriedFaults(surfaces, slips.loc[kept])


@dataclass(frozen=True, eq=False)
class _Cutoff:
    """Rows of the slips on one fault between two blocks at one height, in order along strike."""

    fault: str
    blocks: tuple[str, str]
    rows: Ints
    along: Floats  # distance along strike
    joined: Bools  # whether a row and the next belong to one line, (k - 1,)


def _cutoffs(faults: CarriedFaults) -> Iterator[_Cutoff]:
    """Yield the cut-offs, each fault's distances from its end of least y (or x)."""
    slips, foot = faults.slips, faults.places("foot", "folded")
    for fault, rows in slips.groupby("fault", sort=False).indices.items():
        along = _along_strike(foot[rows])
        keys = ["footwall_block", "hanging_wall_block", "stratigraphic"]
        own = slips.iloc[rows]
        for key, some in own.groupby(keys, sort=False).indices.items():
            order = np.argsort(along[some], kind="stable")
            at = np.asarray(rows)[some][order]
            steps = np.linalg.norm(np.diff(foot[at], axis=0), axis=1)
            near = steps <= _BREAK * (np.median(steps) if len(steps) else 0.0)
            foot_block, hanging_block, _ = cast("tuple[Any, Any, float]", key)
            blocks = (str(foot_block), str(hanging_block))
            yield _Cutoff(str(fault), blocks, at, along[some][order], near)


def _along_strike(points: Floats) -> Floats:
    """Return distances along the longest horizontal direction, 0 at its southern end."""
    plan = points[:, :2] - points[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(plan, full_matrices=False)
    strike = axes[0] if abs(axes[0][1]) > 1e-6 else axes[0] * np.sign(axes[0][0])
    along = plan @ (strike * (np.sign(strike[1]) if abs(strike[1]) > 1e-6 else 1.0))
    out: Floats = along - along.min()
    return out


def cutoff_lines(faults: CarriedFaults, space: str) -> Floats:
    """Return the cut-offs on both walls as segments (k, 2, 3).

    Parameters
    ----------
    faults : CarriedFaults
        The faults.
    space : {'folded', 'unfolded'}
    """
    out = [np.empty((0, 2, 3))]
    for cutoff in _cutoffs(faults):
        for wall in ("foot", "hanging"):
            line = faults.places(wall, space)[cutoff.rows]
            out.append(np.stack([line[:-1], line[1:]], axis=1)[cutoff.joined])
    return np.concatenate(out)


def joined_surfaces(faults: CarriedFaults, folded: Floats, reach: float) -> tuple[Floats, Ints]:
    """Return all fault surfaces near the body as one: vertices (n, 3) and triangles (m, 3).

    Parameters
    ----------
    faults : CarriedFaults
        The faults.
    folded : (n, 3) float
        Blocks in folded space.
    reach : float
        Largest distance of a triangle's middle from the nearest block.
    """
    from scipy.spatial import cKDTree

    V, F, count = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for vertices, triangles in faults.surfaces.values():
        V.append(np.asarray(vertices, np.float64))
        F.append(np.asarray(triangles, np.int64) + count)
        count += len(vertices)
    vertices, triangles = np.concatenate(V), np.concatenate(F)
    distance = cKDTree(folded).query(vertices[triangles].mean(axis=1))[0]
    used, corners = np.unique(triangles[distance <= reach], return_inverse=True)
    return vertices[used], corners.reshape(-1, 3)


# ---------------------------------------------------------------- the section


def faults_section(
    summary: Mapping[str, Any],
    faults: CarriedFaults | None,
    unfolded: Floats,
    columns: Mapping[str, Any],
    colours: Sequence[str],
) -> str:
    """Return the section on faults; nothing if there are none.

    Parameters
    ----------
    summary : mapping
        The summary of the unfolding; ``faults`` holds a row per fault and pair of blocks.
    faults : CarriedFaults, optional
        Surfaces and slips.
    unfolded : (n, 3) float
        Blocks in flat space.
    columns : mapping
        Columns of the blocks; ``fault_block`` and ``stratigraphic`` are used.
    colours : sequence of str
        Colours of the fault blocks, repeated if there are more blocks.
    """
    found = summary.get("faults")
    rows = [mapping(row) for row in found] if isinstance(found, list | tuple) else []
    if not rows and faults is None:
        return ""
    parts = [_slip_table(rows)]
    if faults is not None:
        unit = str(mapping(summary.get("input")).get("unit", "") or "units")
        parts.append(_flat_map(faults, unfolded, columns, colours, unit))
        parts.append(_throws(faults, unit))
    return section("Faults", "\n".join(part for part in parts if part))


_TABLE = (
    ("fault", "fault"),
    ("footwall_block", "footwall block"),
    ("hanging_wall_block", "hanging wall block"),
    ("throw", "throw"),
    ("heave", "heave"),
    ("strike_slip", "strike slip"),
    ("rake", "rake"),
    ("misfit", "misfit"),
    ("gap_area", "gaps, area"),
    ("overlap_area", "overlaps, area"),
    ("resolved_by", "strike slip settled by"),
    ("slip_known", "slip known"),
)
_TABLE_WORDS = (
    "Medians, with the 10th and 90th percentiles along the fault; lengths in the input's unit, "
    "rake in degrees. Throw is positive where the hanging wall went down. Misfit is the root mean "
    "square distance that is left between cut-offs. Slip is known if the outline, the shape of "
    "the cut-offs or a given direction settles the strike slip."
)


def _slip_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the slips as a table."""
    shown = [{label: _cell(row, key) for key, label in _TABLE if key in row} for row in rows]
    found = table(shown)
    return f'<p class="soft">{text(_TABLE_WORDS)}</p>\n{found}' if found else ""


def _cell(row: Mapping[str, Any], key: str) -> Any:
    """Return a value of the slip table, with its spread if it has one."""
    value, low, high = row[key], row.get(f"{key}_p10"), row.get(f"{key}_p90")
    if value is None or low is None or high is None:
        return value
    return f"{value:.3g} ({low:.3g} to {high:.3g})"


def _throws(faults: CarriedFaults, unit: str) -> str:
    """Return the throw along strike: a chart for each fault and pair of blocks."""
    groups: dict[tuple[str, tuple[str, str]], list[_Cutoff]] = {}
    for cutoff in _cutoffs(faults):
        groups.setdefault((cutoff.fault, cutoff.blocks), []).append(cutoff)
    throw = faults.slips["throw"].to_numpy(np.float64)
    level = faults.slips["stratigraphic"].to_numpy(np.float64)
    charts = []
    for (fault, (foot, hanging)), cutoffs in list(groups.items())[:_CHARTS]:
        along = np.concatenate([cutoff.along for cutoff in cutoffs])
        rows = np.concatenate([cutoff.rows for cutoff in cutoffs])
        middle = min(cutoffs, key=lambda c: abs(float(level[c.rows[0]]) - _MIDDLE))
        least, median, most = np.quantile(throw[rows], [0.1, 0.5, 0.9]).tolist()
        title = f"{fault}, blocks {foot} and {hanging}"
        told = (
            f"Median throw {median:.4g} {unit}, 10th to 90th percentile {least:.4g} to {most:.4g}. "
            "Dots: all heights; line: the middle of the layer."
        )
        charts.append(
            f"<div><h4>{text(title)}</h4>"
            + dot_chart(
                (along, throw[rows]),
                (middle.along, throw[middle.rows]),
                (f"distance along strike, {unit}", f"throw, {unit}"),
                (f"Throw of {title}", told),
            )
            + "</div>"
        )
    left = len(groups) - len(charts)
    note = f'<p class="soft">{left} more pairs of blocks are not drawn.</p>' if left else ""
    heading = "<h3>Throw along strike</h3>"
    return f'{heading}<div class="charts">{"".join(charts)}</div>{note}' if charts else ""


# ---------------------------------------------------------------- the flat map


def _flat_map(
    faults: CarriedFaults,
    unfolded: Floats,
    columns: Mapping[str, Any],
    colours: Sequence[str],
    unit: str,
) -> str:
    """Return the map of the flat body in mid-layer: fault blocks, cut-offs, gaps, overlaps."""
    if "fault_block" not in columns or not len(unfolded):
        return ""
    block = np.asarray(columns["fault_block"]).astype(str)
    low = unfolded[:, :2].min(axis=0)
    span = np.maximum(np.ptp(unfolded[:, :2], axis=0), 1e-9)
    scale = _WIDE / float(span[0])
    if scale * float(span[1]) > 0.8 * _WIDE:
        scale = 0.8 * _WIDE / float(span[1])
    frame = _Frame(low, scale, float(span[0]) * scale, float(span[1]) * scale)
    layer = np.abs(np.asarray(columns.get("stratigraphic", _MIDDLE)) - _MIDDLE) <= _LAYER
    layer = np.broadcast_to(layer, block.shape)
    areas, names = _block_areas(unfolded[layer], block[layer], colours, frame)
    strips = _strips(faults, frame)
    lines = _map_lines(faults, frame)
    width, height = frame.width + 20, frame.height + 44
    told = (
        "Map of the flat body in the middle of the layer, true to scale. Colours: fault blocks. "
        "Solid lines are cut-offs of footwalls, dashed lines of hanging walls; red is a gap "
        "between them, black an overlap."
    )
    return (
        "<h3>Flat map</h3>"
        f'<figure class="map"><svg viewBox="-10 -10 {width:.0f} {height:.0f}" role="img" '
        f'aria-label="{text(told)}">{areas}{strips}{lines}{names}{_scale_bar(frame, unit)}</svg>'
        f"<figcaption>{text(told)}</figcaption></figure>"
    )


@dataclass(frozen=True, eq=False)
class _Frame:
    """Flat coordinates to the map's pixels, y up."""

    low: Floats
    scale: float
    width: float
    height: float

    def place(self, points: Floats) -> Floats:
        out = (points[:, :2] - self.low) * self.scale
        return np.stack([out[:, 0], self.height - out[:, 1]], axis=1)


def _block_areas(
    unfolded: Floats, block: Any, colours: Sequence[str], frame: _Frame
) -> tuple[str, str]:
    """Return the fault blocks as coloured runs of cells, and their names."""
    pixels = frame.place(unfolded)
    # 1.5 blocks if one layer of blocks is drawn, one block if two: no cell between stays empty.
    side = 1.5 * np.sqrt(frame.width * frame.height / len(unfolded))
    side = max(side, max(frame.width, frame.height) / _CELLS)
    known = sorted(set(block.tolist()), key=by_number)
    rank = {name: k for k, name in enumerate(known)}
    code = np.array([rank[name] for name in block.tolist()])
    cell = np.floor(pixels / side).astype(np.int64)
    cells, place = np.unique(cell, axis=0, return_inverse=True)
    count = np.bincount(place.ravel() * len(known) + code, minlength=len(cells) * len(known))
    most = count.reshape(len(cells), len(known)).argmax(axis=1)  # the fault block of each cell
    cells, most = _closed(cells, most)
    areas, names = [], []
    for k, name in enumerate(known):
        colour, own = colours[k % len(colours)], cells[most == k]
        if len(own):
            areas.append(f'<path fill="{colour}" fill-opacity=".55" d="{_runs(own, side)}"/>')
        x, y = np.median(pixels[code == k], axis=0)
        names.append(f'<text class="mid" x="{x:.0f}" y="{y:.0f}">{text(name)}</text>')
    return "".join(areas), "".join(names)


def _closed(cells: Ints, block: Ints) -> tuple[Ints, Ints]:
    """Return cells (k, 2) and their fault blocks, holes of one cell's width filled.

    Where few blocks lie in the middle of the layer, a cell may have none. It is filled from the
    left or from below if the cells on both sides of it are not empty.
    """
    low = cells.min(axis=0) - 1
    grid = np.full(cells.max(axis=0) - low + 2, -1)
    grid[tuple((cells - low).T)] = block
    for axis in (0, 1):
        before, after = np.roll(grid, 1, axis), np.roll(grid, -1, axis)
        grid = np.where((grid < 0) & (before >= 0) & (after >= 0), before, grid)
    x, y = np.nonzero(grid >= 0)
    return np.stack([x, y], axis=1) + low, grid[x, y]


def _runs(cells: Ints, side: float) -> str:
    """Return cells (k, 2) as rectangles, neighbours in a row joined."""
    order = np.lexsort((cells[:, 0], cells[:, 1]))
    x, y = cells[order].T
    new = np.r_[True, (np.diff(y) != 0) | (np.diff(x) != 1)]
    first = np.flatnonzero(new)
    last = np.r_[first[1:], len(x)] - 1
    return "".join(
        f"M{x[a] * side:.1f} {y[a] * side:.1f}h{(x[b] - x[a] + 1) * side:.1f}v{side:.1f}"
        f"h{-(x[b] - x[a] + 1) * side:.1f}z"
        for a, b in zip(first, last, strict=True)
    )


def _middle_cutoffs(faults: CarriedFaults) -> list[_Cutoff]:
    """Return for each fault and pair of blocks the cut-off nearest to the middle of the layer."""
    level = faults.slips["stratigraphic"].to_numpy(np.float64)
    best: dict[tuple[str, tuple[str, str]], _Cutoff] = {}
    for cutoff in _cutoffs(faults):
        key = (cutoff.fault, cutoff.blocks)
        if key not in best or _off(level, cutoff) < _off(level, best[key]):
            best[key] = cutoff
    return list(best.values())


def _off(level: Floats, cutoff: _Cutoff) -> float:
    return abs(float(level[cutoff.rows[0]]) - _MIDDLE)


def _strips(faults: CarriedFaults, frame: _Frame) -> str:
    """Return gaps and overlaps between the cut-offs in mid-layer as filled strips."""
    gap = faults.slips["gap"].to_numpy(np.float64)
    foot, hanging = (frame.place(faults.places(w, "unfolded")) for w in ("foot", "hanging"))
    paths: dict[str, list[str]] = {"gap": [], "overlap": []}
    for cutoff in _middle_cutoffs(faults):
        for k in np.flatnonzero(cutoff.joined):
            a, b = cutoff.rows[k], cutoff.rows[k + 1]
            corners = (foot[a], foot[b], hanging[b], hanging[a])
            kind = "gap" if gap[a] + gap[b] > 0 else "overlap"
            paths[kind].append(f"M{'L'.join(f'{x:.1f} {y:.1f}' for x, y in corners)}z")
    return "".join(f'<path class="{kind}" d="{"".join(p)}"/>' for kind, p in paths.items() if p)


def _map_lines(faults: CarriedFaults, frame: _Frame) -> str:
    """Return the cut-offs of both walls in mid-layer as lines, with the faults' names."""
    out = []
    for cutoff in _middle_cutoffs(faults):
        for wall in ("foot", "hanging"):
            line = frame.place(faults.places(wall, "unfolded")[cutoff.rows])
            starts = np.r_[True, ~cutoff.joined]
            path = "".join(
                f"{'M' if start else 'L'}{x:.1f} {y:.1f}"
                for (x, y), start in zip(line, starts, strict=True)
            )
            out.append(f'<path class="cutoff {wall}" d="{path}"/>')
        x, y = frame.place(faults.places("foot", "unfolded")[cutoff.rows])[len(cutoff.rows) // 2]
        out.append(
            f'<text class="name" x="{x + 6:.0f}" y="{y - 6:.0f}">{text(cutoff.fault)}</text>'
        )
    return "".join(out)


def _scale_bar(frame: _Frame, unit: str) -> str:
    """Return a scale bar below the map, at most a fifth of its width."""
    most = frame.width / 5 / frame.scale
    power = 10.0 ** np.floor(np.log10(most))
    length = float(next(s * power for s in (5, 2, 1) if s * power <= most))
    y = frame.height + 14
    return (
        f'<path class="axis" d="M0 {y - 4:.1f}V{y:.1f}H{length * frame.scale:.1f}V{y - 4:.1f}"/>'
        f'<text x="{length * frame.scale + 6:.1f}" y="{y + 3:.1f}">{length:g} {text(unit)}</text>'
    )
