"""Recipes of faulted bodies of many kinds, drawn from a seed: networks, lattices, folds, limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from geounfold.synthetic.faulted.events import (
    Event,
    Fault,
    FoldEvent,
    ListricFault,
    PlanarFault,
    ScissorFault,
    TipFault,
)
from geounfold.synthetic.faulted.pieces import drag, splay, waves
from geounfold.synthetic.faulted.recipe import FaultedSpec, Outline, Oval, Rectangle, Wandering

_UTM = (452_300.0, 6_851_700.0, 310.0)
_STEPS = ((10.0, 10.0, 10.0), (8.0, 8.0, 8.0), (12.0, 10.0, 5.0), (10.0, 10.0, 5.0))
_INF = float("inf")


def wide_spec(seed: int) -> FaultedSpec:
    """Return the recipe that a seed draws.

    Kinds take turns: one fault, dominoes, a graben or horst, crossing faults, a splay, a listric, a
    scissor fault, one with a tip. Everything else is drawn: sizes, dips, rakes, folds before or
    after, drag, outlines, block sides, the lattice's bearing, sub-blocks, and limits of the model.
    """
    rng = np.random.default_rng([seed, 78])
    kind = list(_KINDS)[seed % len(_KINDS)]
    length, width = float(rng.uniform(380, 620)), float(rng.uniform(260, 420))
    thickness = float(rng.uniform(40, 75))
    faults = _KINDS[kind](rng, length, width, thickness)
    outlines: tuple[Outline, ...] = (Rectangle(), Oval(), Wandering(25, seed))
    spec = FaultedSpec(
        events=_in_order(rng, faults, length, width, thickness, kind),
        length=length,
        width=width,
        thickness=thickness,
        outline=outlines[rng.integers(3)],
        swell=float(rng.choice([0, 0, 0, 0.25])),
        steps=_STEPS[rng.choice(4, p=[0.5, 0.15, 0.15, 0.2])],
        about=f"drawn from a seed: {kind}",
    )
    if rng.random() < 0.5:
        spec = replace(spec, bearing=float(rng.uniform(-45, 45)), offset=_UTM)
    if rng.random() < 0.15:
        spec = replace(spec, sub_blocks=2)
    if rng.random() < 0.12:
        spec = replace(spec, crop=((-_INF, 0.15 * width, -_INF), (_INF, 0.85 * width, _INF)))
    return spec


def _in_order(
    rng: np.random.Generator,
    faults: tuple[Fault, ...],
    length: float,
    width: float,
    thickness: float,
    kind: str,
) -> tuple[Event, ...]:
    """Return folds and faults in the order of time."""
    size = sum(_size(fault) for fault in faults)
    events: list[Event] = list(faults)
    before = kind in ("listric", "scissor") or rng.random() < 0.6
    common: dict[str, Any] = {"length": length + 900, "start": -450.0}
    amplitude = float(rng.uniform(5, 45))
    wavelength, phase = float(rng.uniform(360, 700)), float(rng.uniform(0, 360))
    azimuth = float(rng.uniform(-40, 40))
    reach = thickness / 2 * 1.3 + 20
    high = reach if before else reach + size
    amplitude = min(amplitude, _steepest(wavelength, high))
    fold = waves(amplitude, wavelength, phase, azimuth=azimuth, reach=high, **common)
    events.insert(0 if before else len(events), fold)
    first = faults[0]
    if kind == "one" and isinstance(first, PlanarFault) and rng.random() < 0.3:
        # A flexure on the fault's trace; it strikes y, so the fault is made to.
        down = np.sign(first.dip_slip) * (1 if first.strike < 90 else -1)
        bend = drag(
            first.point[0], down * float(rng.uniform(10, 35)), reach=reach, length=length + 300
        )
        straight = replace(first, strike=0.0 if first.strike < 90 else 180.0)
        events = [bend, straight]
    if before and rng.random() < 0.2:
        events.append(_across(rng, width, thickness + size))
    return tuple(events)


def _across(rng: np.random.Generator, width: float, reach: float) -> FoldEvent:
    """Return a gentle fold across the others, after the faults."""
    amplitude, wavelength = float(rng.uniform(5, 20)), float(rng.uniform(500, 800))
    return waves(
        min(amplitude, _steepest(wavelength, reach + 80)),
        wavelength,
        float(rng.uniform(0, 360)),
        azimuth=90.0 + float(rng.uniform(-20, 20)),
        reach=reach + 80,
        length=width + 1400,
        start=-700.0,
    )


def _steepest(wavelength: float, reach: float) -> float:
    """Return the largest slope, degrees, at which no normal within reach meets another."""
    return float(np.degrees(wavelength / (2 * np.pi * 1.2 * reach)))


def _size(fault: Fault) -> float:
    """Return a bound on the slip of a fault."""
    if isinstance(fault, PlanarFault):
        return float(np.hypot(fault.dip_slip, fault.strike_slip))
    if isinstance(fault, ListricFault):
        return float(np.radians(abs(fault.angle)) * fault.radius)
    if isinstance(fault, ScissorFault):
        return abs(fault.dip_slip) + float(np.radians(abs(fault.angle)) * 250)
    assert isinstance(fault, TipFault)
    return abs(fault.dip_slip)


def _plane(
    rng: np.random.Generator,
    name: str,
    point: tuple[float, float, float],
    thickness: float,
    facing: float | None = None,
) -> PlanarFault:
    """Return a plane across the length; ``facing``: 0 if it dips to +x, 180 if to -x."""
    turn = float(rng.choice([0.0, 180.0])) if facing is None else facing
    size = thickness * float(rng.uniform(0.3, 1.8))
    oblique = rng.random() < 0.35
    rake = float(np.radians(rng.uniform(-80, 80) if oblique else rng.normal(0, 10)))
    sign = 1.0 if rng.random() < 0.7 else -1.0
    wavy = rng.random() < 0.25
    return PlanarFault(
        name=name,
        point=point,
        strike=turn + float(rng.uniform(-18, 18)),
        dip=float(rng.uniform(38, 88)),
        dip_slip=sign * size * float(np.cos(rake)),
        strike_slip=size * float(np.sin(rake)),
        amplitude=float(rng.uniform(4, 14)) if wavy else 0.0,
        wavelength=float(rng.uniform(120, 260)),
        phase=float(rng.uniform(0, 6)),
    )


_Kind = Callable[[np.random.Generator, float, float, float], tuple[Fault, ...]]


def _one(rng: np.random.Generator, length: float, width: float, thick: float) -> tuple[Fault, ...]:
    x = length * float(rng.uniform(0.35, 0.65))
    return (_plane(rng, "f1", (x, width / 2, 0.0), thick),)


def _dominoes(
    rng: np.random.Generator, length: float, width: float, thick: float
) -> tuple[Fault, ...]:
    count, facing = int(rng.integers(2, 5)), float(rng.choice([0.0, 180.0]))
    dip, turn = float(rng.uniform(50, 75)), float(rng.uniform(-8, 8))
    out = []
    for k in range(count):
        x = length * (k + 1) / (count + 1) + float(rng.uniform(-15, 15))
        out.append(
            PlanarFault(name=f"f{k + 1}", point=(x, width / 2, 0.0),
                        strike=facing + turn + float(rng.uniform(-5, 5)),
                        dip=dip + float(rng.uniform(-4, 4)),
                        dip_slip=thick * float(rng.uniform(0.3, 1.1)))
        )  # fmt: skip
    return tuple(out)


def _pair(rng: np.random.Generator, length: float, width: float, thick: float) -> tuple[Fault, ...]:
    towards = (0.0, 180.0) if rng.random() < 0.5 else (180.0, 0.0)
    return tuple(
        replace(
            _plane(rng, f"f{k + 1}", (length * share, width / 2, 0.0), thick, facing),
            dip=float(rng.uniform(50, 75)),
        )
        for k, (share, facing) in enumerate(zip((0.3, 0.7), towards, strict=True))
    )


def _crossing(
    rng: np.random.Generator, length: float, width: float, thick: float
) -> tuple[Fault, ...]:
    middle = (length * float(rng.uniform(0.4, 0.6)), width * float(rng.uniform(0.4, 0.6)), 0.0)
    older = _plane(rng, "f1", middle, 0.7 * thick)
    younger = _plane(rng, "f2", middle, 0.8 * thick)
    turn = float(rng.choice([-1.0, 1.0])) * float(rng.uniform(60, 100))
    return older, replace(younger, strike=older.strike + turn)


def _splay(
    rng: np.random.Generator, length: float, width: float, thick: float
) -> tuple[Fault, ...]:
    main = (float(rng.uniform(-8, 8)), float(rng.uniform(55, 72)))
    branch = (main[0] + float(rng.uniform(45, 75)), float(rng.uniform(60, 75)))
    slips = (thick * float(rng.uniform(0.6, 1.3)), thick * float(rng.uniform(0.4, 1.0)))
    return splay((main, branch), slips, (0.42 * length, width / 2, 0.0))


def _listric(
    rng: np.random.Generator, length: float, width: float, thick: float
) -> tuple[Fault, ...]:
    arc = ListricFault(
        name="f1",
        point=(length * float(rng.uniform(0.3, 0.5)), width / 2, 0.0),
        strike=float(rng.uniform(-15, 15)),
        dip=float(rng.uniform(45, 65)),
        radius=float(rng.uniform(240, 420)),
        angle=float(rng.uniform(4, 14)),
    )
    return (arc,)


def _scissor(
    rng: np.random.Generator, length: float, width: float, thick: float
) -> tuple[Fault, ...]:
    fault = ScissorFault(
        name="f1",
        point=(length * float(rng.uniform(0.4, 0.6)), width * float(rng.uniform(0.2, 0.8)), 0.0),
        strike=float(rng.choice([0.0, 180.0])) + float(rng.uniform(-12, 12)),
        dip=float(rng.uniform(55, 85)),
        angle=float(rng.choice([-1.0, 1.0])) * float(rng.uniform(4, 11)),
        dip_slip=thick * float(rng.uniform(0, 0.8)),
    )
    return (fault,)


def _tip(rng: np.random.Generator, length: float, width: float, thick: float) -> tuple[Fault, ...]:
    fault = TipFault(
        name="f1",
        point=(length * float(rng.uniform(0.4, 0.6)), width / 2, 0.0),
        strike=float(rng.uniform(-10, 10)),
        dip=float(rng.uniform(55, 80)),
        dip_slip=thick * float(rng.uniform(0.6, 1.2)),
        fade=width * float(rng.uniform(0.6, 0.9)),
        tip=width * float(rng.uniform(0.1, 0.3)),
    )
    return (fault,)


_KINDS: dict[str, _Kind] = {
    "one": _one,
    "dominoes": _dominoes,
    "graben or horst": _pair,
    "crossing": _crossing,
    "splay": _splay,
    "listric": _listric,
    "scissor": _scissor,
    "tip": _tip,
}
