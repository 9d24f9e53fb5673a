"""Field bodies that faults displace: without drag, with drag, in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from geounfold.geometry.mesh import Floats, Ints
from geounfold.synthetic.field_bodies.blocks import UTM, FieldBlocks, FieldBody, Space, relief


@dataclass(frozen=True)
class _Fault:
    """A dip-slip fault.

    Parameters
    ----------
    throw : float
        Vertical displacement over the sheet's thickness; positive if the side beyond goes down.
    dip : float
        Degrees; above 90 the fault dips below the side of smaller x (reverse, if throw > 0).
    at : float
        Its place in x at height 0.
    strike : float
        Angle of its trace to the y axis, degrees.
    drag : float
        Share of the throw that each wall takes by bending instead of breaking.
    """

    throw: float
    dip: float = 60.0
    at: float = 0.0
    strike: float = 0.0
    drag: float = 0.0


def _faulted(
    rng: np.random.Generator,
    faults: Sequence[_Fault],
    thick: float,
    slope: float,
    bearing: float,
) -> FieldBlocks:
    """Return a gently folded sheet that faults displace; the part is the fault block."""
    down = thick * sum(max(f.throw, 0.0) for f in faults)
    up = thick * sum(max(-f.throw, 0.0) for f in faults)
    offset = UTM if bearing else (0.0, 0.0, 0.0)
    space = Space(
        (-210, -75, -35 - down),
        (210, 75, 35 + thick + up),
        (6.0, 6.0, 4.0) if bearing else (5.0, 5.0, 5.0),
        bearing=bearing,
        offset=offset,
    )
    x, z = space.x.copy(), space.z.copy()
    block = np.zeros(x.shape, int)
    for fault in faults:
        at = fault.at + rng.uniform(-20, 20)
        block += _displaced(space, fault, at, thick, (x, z))
    t = z - relief(rng, x, space.y, slope)
    inside = (t > 0) & (t < thick)
    layers = [(inside & (block == k), t / thick) for k in range(len(faults) + 1)]
    return space.body(*layers)


def _displaced(
    space: Space, fault: _Fault, at: float, thick: float, back: tuple[Floats, Floats]
) -> Ints:
    """Move x and z in place back to where they were before the fault; return what is beyond it."""
    x, z = back
    dip, strike = np.radians(fault.dip), np.radians(fault.strike)
    away = (space.x - at) * np.cos(strike) + space.y * np.sin(strike)
    distance = away * np.sin(dip) + space.z * np.cos(dip)
    beyond = distance > 0
    fade = fault.drag * np.exp(-np.abs(distance) / thick)
    share = np.where(beyond, 1 - fade, fade)
    z += share * fault.throw * thick
    x -= share * fault.throw * thick / np.tan(dip) * np.cos(strike)
    out: Ints = beyond.astype(int)
    return out


def _body(
    name: str,
    about: str,
    *faults: _Fault,
    thick: float = 30.0,
    slope: float = 0.2,
    bearing: float = 0.0,
) -> FieldBody:
    broken = max(abs(f.throw) * (1 - 2 * f.drag) for f in faults)
    return FieldBody(
        name=name,
        family="fault",
        builder=partial(_faulted, faults=faults, thick=thick, slope=slope, bearing=bearing),
        # Up to 0.6 T one sheet through both halves is near the truth.
        expects="told" if broken > 0.6 else "right",
        about=about,
    )


BODIES = (
    _body("fault_03", "throw 0.3 T, dip 60", _Fault(0.3)),
    _body("fault_05_steep", "throw 0.5 T, dip 80", _Fault(0.5, dip=80.0)),
    _body("fault_06", "throw 0.6 T, dip 60", _Fault(0.6)),
    _body("fault_08", "throw 0.8 T, dip 60", _Fault(0.8), thick=40.0),
    _body("fault_08_oblique", "throw 0.8 T, strike oblique to the lattice, national grid",
          _Fault(0.8, dip=65.0, strike=30.0), thick=40.0, bearing=20.0),
    _body("fault_reverse", "reverse, throw 0.5 T", _Fault(0.5, dip=120.0)),
    _body("fault_reverse_08", "reverse, throw 0.8 T", _Fault(0.8, dip=115.0), thick=40.0),
    _body("fault_drag_08", "throw 0.8 T, drag 0.35 of it on each wall", _Fault(0.8, drag=0.35)),
    _body("fault_drag_12", "throw 1.2 T, drag 0.35 of it on each wall", _Fault(1.2, drag=0.35)),
    _body("fault_flexure", "throw 1.2 T taken by bending alone", _Fault(1.2, drag=0.5), slope=0.1),
    _body("fault_graben", "two faults to each other, 0.4 T",
          _Fault(0.4, at=-80.0), _Fault(-0.4, dip=120.0, at=80.0)),
    _body("fault_steps", "two faults the same way, 0.7 T",
          _Fault(0.7, at=-70.0), _Fault(0.7, dip=70.0, at=80.0), thick=40.0),
)  # fmt: skip
