"""Images of a run's points, and what is proved and measured of the map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from geounfold.body.fault_cells import FaultCells
from geounfold.body.prepare import PreparedPoints
from geounfold.body.working_frame import Frame
from geounfold.faults.result import FaultResult
from geounfold.faults.trust import with_fault_reasons
from geounfold.geometry.mesh import Floats, Ints
from geounfold.mapping.carried import Carried, Returned, few
from geounfold.mapping.certificate import Certificate, certify, certify_parts
from geounfold.mapping.control_mesh import ControlMesh, scaled
from geounfold.mapping.mesh_map import UnfoldingMap
from geounfold.methods import BodyFit, PointwiseMap
from geounfold.methods.contract import Stage
from geounfold.methods.sheet.sharpening.lattice_sites import scatter
from geounfold.quality.blocks import Quality, assess, assess_points
from geounfold.quality.torn_blocks import SUSPECT, torn_blocks
from geounfold.quality.trust import Signs, Trust, judge, measure_signs
from geounfold.quality.uncertainty import PositionUncertainty, with_spread_reason
from geounfold.unfolding.checks import (
    check_certified,
    check_coordinates,
    check_placed,
    check_torn,
    check_trust,
)
from geounfold.unfolding.options import UnfoldOptions

_RETURNED = 250_000
"""Number of points above which a part of about so many is carried to the flat space and back."""


@dataclass(frozen=True, eq=False)
class Measured:
    """The points carried by the map, and what was checked and measured of them.

    Attributes
    ----------
    carried : Carried
        The points in the flat space.
    returned : Returned or None
        The same brought back; None if the method has no way back.
    certificate : Certificate
        What is proved of the map.
    quality : Quality
        Figures for the whole and per block.
    torn : (k,) int
        Rows of blocks that came to lie far from a block that they touch.
    trust : Trust or None
        How far to trust the layers; None if the method has no control mesh.
    """

    carried: Carried
    returned: Returned | None
    certificate: Certificate
    quality: Quality
    torn: Ints
    trust: Trust | None


def measure(
    mapping: UnfoldingMap | PointwiseMap,
    prepared: PreparedPoints,
    fits: Sequence[BodyFit],
    options: UnfoldOptions,
    stage: Stage,
    faulted: FaultResult | None = None,
    uncertainty: PositionUncertainty | None = None,
) -> Measured:
    """Carry the points by a map, and check and measure the answer.

    Raises
    ------
    ControlMeshError
        The answer is not proved one-to-one, leaves blocks of a body without an image, or tears
        blocks apart, and ``options.allow_uncertified`` is not set; or the trust is poor and
        ``options.strict`` is set.
    """
    P, frame = prepared.points, prepared.frame
    with stage("map"):
        carried = mapping.carry(P)
        returned = _returned(mapping, P, carried)
    with stage("certificate"):
        certificate = _certificate(mapping, carried, frame)
    check_certified(certificate, options)
    check_placed(prepared, carried, options)
    with stage("quality"):
        quality = _quality(mapping, carried, P, frame, prepared.work, options.neighbours)
        torn = _torn(prepared.groups, prepared.work, carried, quality, frame)
        if 0 < len(torn) <= few(len(P)):
            carried, torn = carried.without(torn), torn[:0]
            returned = _returned(mapping, P, carried)
            quality = _quality(mapping, carried, P, frame, prepared.work, options.neighbours)
    check_coordinates(quality, returned, P, options)
    check_torn(P[torn], len(P), options)
    with stage("trust"):
        trust = _trust(mapping, prepared, fits, carried)
        if faulted is not None:
            trust = with_fault_reasons(trust, faulted)
        trust = with_spread_reason(trust, uncertainty, frame.scale)
    check_trust(trust, options)
    return Measured(carried, returned, certificate, quality, torn, trust)


def _returned(
    mapping: UnfoldingMap | PointwiseMap, points: Floats, carried: Carried
) -> Returned | None:
    """Return the round trip of the points.

    Tetrahedra bring every point back, to rounding. So of many points a part is brought back that is
    spread over all of them, whatever the order of the rows.
    """
    if isinstance(mapping, PointwiseMap) or mapping.prisms is not None or len(points) <= _RETURNED:
        return mapping.returned(points, carried)
    some = np.flatnonzero(scatter(points) < _RETURNED / len(points))
    found = mapping.returned(points[some], carried.part(some))
    lost = np.zeros(len(points), dtype=bool)
    lost[some] = found.lost
    return replace(found, lost=lost)


def in_world(control: ControlMesh, frame: Frame) -> ControlMesh:
    """Return a control mesh in the data's coordinates and unit."""
    return scaled(control, frame.to_world(control.folded.V), frame.scale)


def _trust(
    mapping: UnfoldingMap | PointwiseMap,
    prepared: PreparedPoints,
    fits: Sequence[BodyFit],
    carried: Carried,
) -> Trust | None:
    """Return how far to trust the layers of all bodies; None without a control mesh."""
    if isinstance(mapping, PointwiseMap):
        return None
    frame = prepared.frame
    signs = [
        replace(
            fit.signs or _signs_of(fit, mapping, frame),
            strays=0.0 if fit.hull is None or frame.steps is None else fit.hull.strays,
        )
        for fit in fits
    ]
    kind = "body" if prepared.division is None else "part"
    if mapping.parts is not None and isinstance(mapping.parts.cells, FaultCells):
        kind = "fault block"
    names = [f"{kind} {number}" for number in range(len(fits))] if len(fits) > 1 else [""]
    return judge(signs, names, frame, prepared.points, carried.stratigraphic)


def _signs_of(fit: BodyFit, mapping: UnfoldingMap, frame: Frame) -> Signs:
    """Return the signs of a method that lays its own surfaces flat, not the mid surface."""
    side = 1.0 if frame.sides is None else float(max(frame.sides))
    return measure_signs(fit.split.mesh, mapping, side, over_mid=False)


def _torn(
    groups: Sequence[Ints], work: Floats, carried: Carried, quality: Quality, frame: Frame
) -> Ints:
    """Return the rows of blocks that touch another of their body and now lie far from it."""
    flat = carried.points / frame.scale
    found = []
    for group in groups:
        rows = group[carried.placed[group]]
        suspects = np.flatnonzero(quality.blocks.nmd_error[rows] > SUSPECT)
        found.append(rows[torn_blocks(work[rows], flat[rows], frame.sides, suspects)])
    return np.concatenate(found)


def _gradients(mapping: UnfoldingMap, folded: Floats, carried: Carried) -> Floats | None:
    """Return the gradients at points with an image; None if they are the tetrahedra's."""
    if mapping.prisms is None:
        return None
    return mapping.gradients(folded[carried.placed], carried.element[carried.placed])


def _certificate(
    mapping: UnfoldingMap | PointwiseMap, carried: Carried, frame: Frame
) -> Certificate:
    """Return what is proved of a map, places in the data's coordinates and unit."""
    if isinstance(mapping, PointwiseMap):
        return Certificate.unproved(mapping.fault)
    control, shell, held = mapping.control, mapping.shell, carried.element
    if mapping.parts is None:
        return in_data(certify(control, shell, held), frame)
    apart = not isinstance(mapping.parts.cells, FaultCells)
    return in_data(certify_parts(control, shell, held, mapping.parts.vertex, apart=apart), frame)


def _quality(
    mapping: UnfoldingMap | PointwiseMap,
    carried: Carried,
    P: Floats,
    frame: Frame,
    given: Floats,
    k: int,
) -> Quality:
    """Return how good the answer is: by the control mesh, or by each block's neighbours."""
    if isinstance(mapping, PointwiseMap):
        return assess_points(P, carried.points, frame.scale**3, k)
    world, whole = (in_world(mesh, frame) for mesh in (mapping.control, mapping.whole))
    gradients = _gradients(mapping, P, carried)
    cells = frame.cells(given)
    if mapping.parts is not None:  # blocks of different parts are no neighbours
        part = mapping.parts.cells.of(given)
        P = P + part[:, None] * np.array([4 * float(np.ptp(P[:, 0])), 0.0, 0.0])
        if cells is not None:
            cells = cells + part[:, None] * np.array([4 * (int(np.ptp(cells[:, 0])) + 1), 0, 0])
    lattice = None if cells is None or frame.steps is None else (cells, frame.steps)
    return assess(world, whole, carried.element, P, carried.points, k, gradients, lattice)


def in_data(certificate: Certificate, frame: Frame) -> Certificate:
    """Return a certificate with places in the data's coordinates and unit."""
    folded = frame.to_world(certificate.folded)
    return replace(certificate, folded=folded, unfolded=certificate.unfolded * frame.scale)
