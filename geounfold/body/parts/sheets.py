"""Sheets: regions joined, or kept apart, by the rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from geounfold.body.block_cells import connected
from geounfold.body.parts.meetings import Meeting, find_meetings
from geounfold.body.parts.regions import Regions
from geounfold.body.parts.rules import Continuation, Doubled, Hinge, Rod, Stack, Step, Zone
from geounfold.geometry.mesh import Bools, Floats, Ints

_AREA, _SHARE, _VOLUME = 3.0, 0.02, 0.02
"""Least size of a sheet: thicknesses squared, share of all medial area, share of the volume."""

_ACUTE = 0.9
"""Cosine between two sheets below which they meet as a branch, no step or neck: 26 degrees."""

_CLOSE = 0.25
"""Height in thicknesses up to which a larger region continues both sides of what is no step.

Regions are small on flat and long blocks, and bend beside each other.
"""


@dataclass(frozen=True)
class Rules:
    """The rules, in the order in which they are tried."""

    rod: Rod = field(default_factory=Rod)
    doubled: Doubled = field(default_factory=Doubled)
    continuation: Continuation = field(default_factory=Continuation)
    step: Step = field(default_factory=Step)
    stack: Stack = field(default_factory=Stack)
    hinge: Hinge = field(default_factory=Hinge)


@dataclass(frozen=True, eq=False)
class Contact:
    """A meeting of regions of two different sheets, with the kind of junction that it makes."""

    regions: tuple[int, int]
    kind: str
    meeting: Meeting


@dataclass(frozen=True, eq=False)
class Sheets:
    """Sheets of a body, as groups of its regions.

    Attributes
    ----------
    regions : Regions
        The regions.
    sheet : (r,) int
        Sheet of each region; -1 for one that is in none, or doubled.
    thickness : (k,) float
        Mean thickness of each sheet.
    rod : (r,) bool
        Regions that are rods.
    zones : list of Zone
        Doubled regions between two sheets.
    contacts : list of Contact
        Meetings of two sheets.
    """

    regions: Regions
    sheet: Ints
    thickness: Floats
    rod: Bools
    zones: list[Zone]
    contacts: list[Contact]

    @property
    def count(self) -> int:
        """Number of sheets."""
        return len(self.thickness)


def find_sheets(regions: Regions, rules: Rules | None = None) -> Sheets:
    """Return the sheets that regions make."""
    rules = rules or Rules()
    rod = np.array([rules.rod.holds(regions, r) for r in range(regions.count)], dtype=bool)
    firm = np.bincount(regions.label[regions.firm & (regions.label >= 0)], minlength=regions.count)
    plates = [r for r in range(regions.count) if not rod[r] and firm[r]]
    meetings = find_meetings(regions, plates)
    zones = _zones(regions, plates, meetings, rules)
    doubled = {zone.region for zone in zones}
    meetings = [m for m in meetings if not doubled.intersection(m.regions)]
    group, contacts = _joined(regions, meetings, rules)
    free = [r for r in plates if r not in doubled]
    sheet, thickness = _kept(regions, group, free, plates)
    for zone in zones:  # between two regions of one sheet, or with none on one side: no junction
        own = sheet[list(zone.plies)]
        if own[0] == own[1] or (own < 0).any():
            sheet[zone.region] = own.max()
    zones = [zone for zone in zones if sheet[zone.region] < 0]
    contacts = [c for c in contacts if (s := sheet[list(c.regions)]).min() >= 0 and s[0] != s[1]]
    return Sheets(regions, sheet, thickness, rod, zones, contacts)


def _zones(
    regions: Regions, plates: Sequence[int], meetings: Sequence[Meeting], rules: Rules
) -> list[Zone]:
    """Return the doubled regions, without those that are plies of each other."""
    joins = [m.regions for m in meetings if rules.continuation.holds(m)]
    found = {}
    for r in plates:
        pairs = np.array([pair for pair in joins if r not in pair], dtype=np.int64).reshape(-1, 2)
        group = connected(pairs[:, 0], pairs[:, 1], regions.count)
        area: Floats = np.bincount(group, regions.area)[group].astype(np.float64)
        zone = rules.doubled.found(regions, r, meetings, area)
        if zone is not None and group[zone.plies[0]] != group[zone.plies[1]]:
            found[r] = zone
    for r in sorted(found, key=lambda r: regions.area[r]):
        if any(ply in found and r in found[ply].plies for ply in found[r].plies):
            del found[r]
    return list(found.values())


def _joined(
    regions: Regions, meetings: Sequence[Meeting], rules: Rules
) -> tuple[Ints, list[Contact]]:
    """Return a group for each region, (r,), and the meetings that keep regions apart."""
    order = sorted(meetings, key=lambda m: -min(regions.area[list(m.regions)]))
    joins, steps, stacks, rest = [], [], [], []
    for meeting in order:
        if rules.continuation.holds(meeting):
            joins.append(meeting)
        elif rules.step.holds(meeting, regions):
            steps.append(meeting)
        elif rules.stack.holds(meeting, regions):
            stacks.append(meeting)
        else:
            rest.append(meeting)
    steps = [m for m in steps if not _bridged(regions, m, joins)]
    group = _grouped(regions, joins, steps, stacks, rules.stack)
    for meeting in rest:
        a, b = meeting.regions
        if group[a] != group[b] and rules.hinge.holds(meeting, regions, group):
            joins.append(meeting)
    group = _grouped(regions, joins, steps, stacks, rules.stack)
    kinds = [(steps, "step"), (stacks, "neck"), (rest, "branch")]
    return group, [
        Contact(m.regions, kind if m.cosine > _ACUTE else "branch", m)
        for found, kind in kinds
        for m in found
    ]


def _bridged(regions: Regions, step: Meeting, joins: Sequence[Meeting]) -> bool:
    """Return whether a region larger than both sides of a step continues each of them."""
    least = max(regions.area[list(step.regions)])
    close = [m for m in joins if m.height < _CLOSE * min(m.thickness)]
    beside = [{r for m in close if side in m.regions for r in m.regions} for side in step.regions]
    shared = beside[0] & beside[1] - set(step.regions)
    return any(regions.area[r] > least for r in shared)


def _grouped(
    regions: Regions,
    joins: Sequence[Meeting],
    steps: Sequence[Meeting],
    stacks: Sequence[Meeting],
    stack: Stack,
) -> Ints:
    """Return regions joined, the largest first, but none that a step keeps apart.

    Nor are regions that lie over each other joined through one as small as a plug.
    """
    group = np.arange(regions.count)
    for a, b in (m.regions for m in joins):
        if group[a] == group[b]:
            continue
        small = min((a, b), key=lambda r: regions.area[r])
        plug = regions.area[small] < stack.plug * regions.thickness[small] ** 2
        apart = [*steps, *stacks] if plug else steps
        both = {group[a], group[b]}
        if any({group[p], group[q]} == both for p, q in (m.regions for m in apart)):
            continue
        group[group == group[b]] = group[a]
    return group


def _kept(
    regions: Regions, group: Ints, free: Sequence[int], plates: Sequence[int]
) -> tuple[Ints, Floats]:
    """Return the sheet of each region and the sheets' mean thicknesses, the largest sheet first."""
    area, thickness = regions.area, regions.thickness
    volume = float((area[list(plates)] * thickness[list(plates)]).sum())
    sizes: dict[int, tuple[float, float]] = {}
    for g in sorted({int(group[r]) for r in free}):
        own = [r for r in free if group[r] == g]
        whole = float(area[own].sum())
        sizes[g] = whole, float((area[own] * thickness[own]).sum()) / whole
    kept = [
        g
        for g, (a, t) in sizes.items()
        if a > max(_SHARE * regions.total, _AREA * t**2) and a * t > _VOLUME * volume
    ]
    kept.sort(key=lambda g: -sizes[g][0])
    sheet = np.full(regions.count, -1)
    for number, g in enumerate(kept):
        sheet[[r for r in free if group[r] == g]] = number
    return sheet, np.array([sizes[g][1] for g in kept])
