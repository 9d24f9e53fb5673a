"""A sheet for every cell: votes of the rays, cut surfaces of doubled zones, nearest sheets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from geounfold.body.parts.rays import MedialPoints, cells_along
from geounfold.body.parts.rules import Zone
from geounfold.body.parts.sheets import Sheets
from geounfold.body.parts.voxels import Voxels
from geounfold.geometry.mesh import Bools, Floats, Ints

_SMOOTH = 16
"""Number of rays whose cuts are averaged for the surface between two plies."""

_ASIDE = (0.2, 0.45)
"""Cost of a unit of distance along the largest sheet, and along others, for cells on no ray."""

_BEYOND = (0.75, 0.15)
"""Distance from a sheet's face, in thicknesses, from which a cell is of none: others, a rod's."""

_LOOSE = 0.02
"""Share of the body below which a loose bit of a sheet goes to the one that it touches most."""

_TOUCHING = ndimage.generate_binary_structure(3, 3)


def label_cells(body: Voxels, sheets: Sheets) -> Ints:
    """Return the sheet of each occupied cell, as a table; -1 for empty cells and for no sheet."""
    inside = np.flatnonzero(body.occupied)
    row = np.full(body.occupied.size, -1)
    row[inside] = np.arange(len(inside))
    own = sheets.sheet[sheets.regions.label]
    own[sheets.regions.label < 0] = -1
    slot = own.copy()  # sheets, then zones, then rods
    for k, zone in enumerate(sheets.zones):
        slot[sheets.regions.label == zone.region] = sheets.count + k
    rods = sheets.count + len(sheets.zones)
    slot[(sheets.regions.label >= 0) & sheets.rod[sheets.regions.label]] = rods
    use = np.flatnonzero(slot >= 0)
    rays = sheets.regions.rays.at(use)
    cell, ray, _ = cells_along(rays, body)
    weight = (rays.area / rays.thickness)[ray]
    hit = row[cell] >= 0
    votes = np.bincount(
        (row[cell] * (rods + 1) + slot[use][ray])[hit],
        weight[hit],
        minlength=len(inside) * (rods + 1),
    ).reshape(len(inside), rods + 1)
    best = np.where(votes.max(axis=1) > 0, votes.argmax(axis=1), -2)
    place = np.stack(np.unravel_index(inside, body.occupied.shape), axis=1) * body.steps
    label = np.where(best == rods, -1, best)
    for k, zone in enumerate(sheets.zones):
        mine = best == sheets.count + k
        label[mine] = _side(place[mine], sheets, zone)
    free = np.flatnonzero(label < 0)
    label[free] = _nearest_sheet(
        place[free], _Plates.of(sheets, own), sheets.count, best[free] == rods
    )
    out = np.full(body.occupied.size, -1)
    out[inside] = label
    return _tidied(out.reshape(body.occupied.shape), sheets.count)


def in_pieces(table: Ints, count: int) -> tuple[Ints, Ints]:
    """Return parts, (a, b, c), the largest first, and the sheet that each is of, (k,).

    A part is a sheet, or one of its pieces that do not touch: a sheet that crosses another is cut
    by it in two.
    """
    parts = np.full(table.shape, -1)
    sheet: list[int] = []
    size: list[int] = []
    for k in range(count):
        pieces, n = ndimage.label(table == k, _TOUCHING)
        for piece in range(1, n + 1):
            parts[pieces == piece] = len(sheet)
            sheet.append(k)
            size.append(int((pieces == piece).sum()))
    order = np.argsort(-np.array(size), kind="stable")
    rank = np.append(np.argsort(order), -1)
    return rank[parts], np.array(sheet)[order]


def _side(place: Floats, sheets: Sheets, zone: Zone) -> Ints:
    """Return the lower or the upper ply's sheet for places in a doubled zone, (k,).

    Each ray is cut at the plies' share of its length, wherever in a cell that is. The mean plane
    of the cuts around a cell's centre decides for the cell.
    """
    rays = sheets.regions.rays.at(sheets.regions.rows(zone.region))
    cut = _bottom(rays) + zone.share * rays.thickness[:, None] * rays.normal
    count = min(_SMOOTH, len(cut))
    near = cKDTree(cut).query(place, k=count)[1].reshape(len(place), count)
    height = ((place[:, None] - cut[near]) * rays.normal[near]).sum(axis=2).mean(axis=1)
    lower, upper = (int(sheets.sheet[ply]) for ply in zone.plies)
    return np.where(height > 0, upper, lower)


@dataclass(frozen=True, eq=False)
class _Plates:
    """Pieces of sheets around medial points: those of whole sheets, and of both plies of zones."""

    middle: Floats
    normal: Floats
    thickness: Floats
    sheet: Ints

    @classmethod
    def of(cls, sheets: Sheets, own: Ints) -> _Plates:
        """Return the pieces; ``own`` is the sheet of each medial point, or -1."""
        rays = sheets.regions.rays
        whole = np.flatnonzero(own >= 0)
        found = [(rays.middle[whole], rays.normal[whole], rays.thickness[whole], own[whole])]
        for zone in sheets.zones:
            mine = rays.at(sheets.regions.rows(zone.region))
            bottom, share = _bottom(mine), zone.share
            for ply, low, part in zip(zone.plies, (0.0, share), (share, 1 - share), strict=True):
                up = (low + part / 2) * mine.thickness
                sheet = np.full(len(up), sheets.sheet[ply])
                place = bottom + up[:, None] * mine.normal
                found.append((place, mine.normal, part * mine.thickness, sheet))
        return cls(*(np.concatenate(column) for column in zip(*found, strict=True)))


def _nearest_sheet(place: Floats, plates: _Plates, count: int, rod: Bools) -> Ints:
    """Return the sheet for cells on no sheet's rays, (k,); -1 for one that is far from all."""
    cost = np.empty((len(place), count))
    beyond = np.empty_like(cost)
    for k in range(count):
        mine = np.flatnonzero(plates.sheet == k)
        near = mine[cKDTree(plates.middle[mine]).query(place)[1]]
        way = place - plates.middle[near]
        height = np.abs((way * plates.normal[near]).sum(axis=1))
        along = np.sqrt(np.maximum((way**2).sum(axis=1) - height**2, 0.0))
        over = np.maximum(height - plates.thickness[near] / 2 - 0.3, 0.0)
        cost[:, k] = over + _ASIDE[min(k, 1)] * along
        beyond[:, k] = over / np.maximum(plates.thickness[near], 1.0)
    best = cost.argmin(axis=1)
    limit = np.where(rod, _BEYOND[1], _BEYOND[0])
    return np.where(beyond[np.arange(len(place)), best] > limit, -1, best)


def _bottom(rays: MedialPoints) -> Floats:
    """Return the end of each ray that its normal points away from, (k, 3)."""
    upward = ((rays.start - rays.end) * rays.normal).sum(axis=1) > 0
    return np.where(upward[:, None], rays.end, rays.start)


def _tidied(label: Ints, count: int) -> Ints:
    """Return labels without loose bits: these go to the sheet that they touch most."""
    filled = label >= 0
    least = _LOOSE * float(filled.sum())
    for sheet in range(count):
        pieces, n = ndimage.label(label == sheet, _TOUCHING)
        if n < 2:
            continue
        size = np.bincount(pieces.ravel())
        largest = int(size[1:].argmax()) + 1
        for k, box in enumerate(ndimage.find_objects(pieces), start=1):
            if k == largest or size[k] > least:
                continue
            wide = tuple(slice(max(s.start - 1, 0), s.stop + 1) for s in box)
            bit = pieces[wide] == k
            ring = ndimage.binary_dilation(bit) & ~bit & filled[wide]
            beside = label[wide][ring]
            beside = beside[beside >= 0]
            label[wide][bit] = np.bincount(beside).argmax() if len(beside) else -1
    return label
