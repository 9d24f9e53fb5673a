"""Folds and fault pairs of which the recipes of faulted bodies are made."""

from __future__ import annotations

import numpy as np

from geounfold.geometry.mesh import Floats
from geounfold.synthetic.faulted.events import FoldEvent, PlanarFault, fault_axes
from geounfold.synthetic.profile import Bump, Profile, Sinusoid


def waves(
    amplitude: float,
    wavelength: float = 420.0,
    phase: float = 0.0,
    *,
    length: float = 700.0,
    start: float = -150.0,
    reach: float = 60.0,
    azimuth: float = 0.0,
) -> FoldEvent:
    """Return sinusoidal folds."""
    wave = Sinusoid(amplitude=amplitude, wavelength=wavelength, phase=phase)
    return FoldEvent(
        profile=Profile(elements=(wave,)),
        length=length,
        reach=reach,
        start=start,
        azimuth=azimuth,
    )


def drag(at: float, degrees: float, reach: float = 60.0, length: float = 700.0) -> FoldEvent:
    """Return a flexure that takes up part of a throw before the fault breaks the layer.

    Positive degrees bend the layer down with growing x, as a fault dipping to x does.
    """
    bend = Bump(amplitude=-degrees, at=at + 150, width=35)
    return FoldEvent(profile=Profile(elements=(bend,)), length=length, reach=reach, start=-150)


def splay(
    planes: tuple[tuple[float, float], tuple[float, float]],
    slips: tuple[float, float],
    point: tuple[float, float, float],
) -> tuple[PlanarFault, PlanarFault]:
    """Return two faults of (strike, dip), the second in the hanging wall of the first.

    Both slip along the line in which they meet, the only rigid way in which three blocks can part.
    """
    line = np.cross(fault_axes(*planes[0])[2], fault_axes(*planes[1])[2])
    line *= -np.sign(line[2]) / np.linalg.norm(line)
    main, branch = (_along(line, plane, slip) for plane, slip in zip(planes, slips, strict=True))
    return (
        PlanarFault(name="f1", point=point, strike=planes[0][0], dip=planes[0][1],
                    strike_slip=main[0], dip_slip=main[1]),
        PlanarFault(name="f2", point=point, strike=planes[1][0], dip=planes[1][1],
                    strike_slip=branch[0], dip_slip=branch[1], within=(("f1", True),)),
    )  # fmt: skip


def _along(line: Floats, plane: tuple[float, float], slip: float) -> tuple[float, float]:
    """Return strike slip and dip slip, on a plane, of a slip along a line in it."""
    along, down, _ = fault_axes(*plane)
    return slip * float(line @ along), slip * float(line @ down)
