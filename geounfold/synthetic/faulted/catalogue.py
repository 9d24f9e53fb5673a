"""Named faulted bodies, and bodies drawn from a seed."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from geounfold.errors import OptionError
from geounfold.synthetic.faulted.body import FaultedBody
from geounfold.synthetic.faulted.events import (
    Event,
    Fault,
    ListricFault,
    PlanarFault,
    ScissorFault,
    TipFault,
)
from geounfold.synthetic.faulted.pieces import drag, splay, waves
from geounfold.synthetic.faulted.random_wide import wide_spec
from geounfold.synthetic.faulted.recipe import FaultedSpec, Outline, Oval, Rectangle, Wandering
from geounfold.synthetic.faulted.sampling import sample

_MIDDLE = (200.0, 150.0, 0.0)
_INF = float("inf")


def _dominoes(slips: tuple[float, ...]) -> tuple[PlanarFault, ...]:
    return tuple(
        PlanarFault(name=f"f{i + 1}", point=(110.0 + 110 * i, 150, 0), strike=4.0 - 3 * i, dip=62,
                    dip_slip=slip)
        for i, slip in enumerate(slips)
    )  # fmt: skip


def _network() -> tuple[PlanarFault, ...]:
    """Return four older faults and two younger ones that cross them: fifteen fault blocks."""
    older = tuple(
        PlanarFault(name=f"a{i + 1}", point=(160.0 + 170 * i, 300, 0), strike=3.0 - 2 * i, dip=65,
                    dip_slip=30.0 + 5 * i)
        for i in range(4)
    )  # fmt: skip
    younger = tuple(
        PlanarFault(name=f"b{i + 1}", point=(420, 190.0 + 200 * i, 0), strike=84.0 + 6 * i, dip=70,
                    dip_slip=40.0 - 8 * i)
        for i in range(2)
    )  # fmt: skip
    return older + younger


def _fault(
    strike: float,
    dip: float,
    dip_slip: float = 0.0,
    strike_slip: float = 0.0,
    point: tuple[float, float, float] = _MIDDLE,
    name: str = "f1",
) -> PlanarFault:
    return PlanarFault(
        name=name, point=point, strike=strike, dip=dip, dip_slip=dip_slip, strike_slip=strike_slip
    )


_CASES: dict[str, FaultedSpec] = {
    "normal_small": FaultedSpec(
        events=(_fault(10, 60, 15), waves(30, reach=90)),
        about="throw 0.3 T, faulted then folded",
    ),
    "normal_1T": FaultedSpec(
        events=(waves(35), _fault(8, 60, 50)),
        about="1 T, folded then faulted",
    ),
    "normal_3T": FaultedSpec(
        events=(
            _fault(-12, 65, 150, point=(190, 150, 0)),
            waves(30, 500, reach=220, length=900, start=-250),
        ),
        about="3 T, faulted then folded",
    ),
    "reverse_1T": FaultedSpec(
        events=(waves(25, phase=40), _fault(5, 45, -60, point=(210, 150, 0))),
        about="reverse, 1.2 T",
    ),
    "thrust_5T": FaultedSpec(
        events=(waves(25, phase=90), _fault(-6, 30, -250, point=(180, 150, 0))),
        about="thrust of 5 T, long overlap",
    ),
    "strike_slip": FaultedSpec(
        events=(waves(35), _fault(15, 85, 4, 90)),
        outline=Wandering(25, 3),
        about="1.8 T along strike, wandering outline",
    ),
    "strike_straight": FaultedSpec(
        events=(_fault(0, 90, 0, 80), waves(30)),
        length=420,
        width=320,
        outline=Oval(),
        about="straight vertical fault, oval outline",
    ),
    "wavy_oblique": FaultedSpec(
        events=(
            waves(30),
            PlanarFault(name="f1", point=_MIDDLE, strike=5, dip=70, dip_slip=40, strike_slip=30,
                        amplitude=14, wavelength=170, phase=0.5),
        ),
        about="corrugated fault, oblique slip",
    ),
    "listric": FaultedSpec(
        events=(
            waves(25, phase=30),
            ListricFault(name="f1", point=(190, 150, 0), strike=4, dip=60, radius=260, angle=14),
        ),
        about="hanging wall turned 14 degrees on an arc",
    ),
    "scissor": FaultedSpec(
        events=(
            waves(30),
            ScissorFault(name="f1", point=_MIDDLE, strike=0, dip=70, angle=9, dip_slip=10),
        ),
        about="throw changes sign along strike",
    ),
    "graben": FaultedSpec(
        events=(
            _fault(5, 60, 45, point=(140, 150, 0)),
            _fault(175, 60, 70, point=(300, 150, 0), name="f2"),
            waves(25, 500, reach=160, length=800, start=-200),
        ),
        length=440,
        about="two faults that dip towards each other",
    ),
    "crossing": FaultedSpec(
        events=(
            waves(30),
            _fault(0, 65, 40, point=(210, 150, 0)),
            _fault(80, 70, 55, point=(210, 160, 0), name="f2"),
        ),
        length=420,
        width=340,
        about="the younger fault offsets the older",
    ),
    "branch": FaultedSpec(
        events=(
            waves(25, 500, length=800, start=-200),
            *splay(((0, 65), (60, 70)), (60, 45), (190, 150, 0)),
        ),
        length=440,
        width=340,
        outline=Wandering(20, 5),
        about="a splay in the hanging wall",
    ),
    "domino": FaultedSpec(
        events=(waves(20, 600, length=800, start=-200), *_dominoes((35, 60, 25, 45))),
        length=520,
        width=260,
        about="four faults in a row",
    ),
    "tip": FaultedSpec(
        events=(
            waves(30),
            TipFault(name="f1", point=_MIDDLE, strike=0, dip=65, dip_slip=45, fade=200, tip=70),
        ),
        about="dies out inside the body",
    ),
    "overturned": FaultedSpec(
        events=(waves(88, 460, 200), _fault(20, 55, 55, point=(170, 150, 20))),
        about="overturned limbs",
    ),
    "cropped": FaultedSpec(
        events=(waves(30), _fault(0, 65, 30, 60)),
        width=420,
        crop=((-_INF, 60, -_INF), (_INF, 340, _INF)),
        about="no outline marks the strike slip",
    ),
    "swell": FaultedSpec(
        events=(waves(30), _fault(5, 65, 40, 60)),
        swell=0.35,
        outline=Wandering(25, 7),
        about="thickness varies, oblique slip",
    ),
    # Bodies beyond the measured prototype's eighteen.
    "drag_normal": FaultedSpec(
        events=(drag(190, 35), _fault(0, 60, 40, point=(190, 150, 0))),
        about="normal, a flexure beside the fault",
    ),
    "drag_reverse": FaultedSpec(
        events=(drag(200, -35), _fault(0, 50, -40)),
        about="reverse, a flexure beside the fault",
    ),
    "oblique_reverse": FaultedSpec(
        events=(waves(30), _fault(10, 55, -45, 45)),
        outline=Wandering(25, 11),
        about="reverse and along strike alike",
    ),
    "horst": FaultedSpec(
        events=(
            waves(25, 500, length=800, start=-200),
            _fault(175, 62, 50, point=(140, 150, 0)),
            _fault(5, 62, 35, point=(300, 150, 0), name="f2"),
        ),
        length=440,
        about="two faults that dip away from each other",
    ),
    "fold_fault_fold": FaultedSpec(
        events=(waves(20), _fault(8, 62, 45), waves(20, 500, reach=160, azimuth=70, length=900,
                                                      start=-300)),
        about="folded, faulted, folded across",
    ),
    "network": FaultedSpec(
        events=(waves(20, 700, length=1300, start=-200), *_network()),
        length=840,
        width=600,
        about="six crossing faults, fifteen fault blocks",
    ),
    "flat_blocks": FaultedSpec(
        events=(waves(30), _fault(12, 62, 50)),
        steps=(12.0, 10.0, 5.0),
        bearing=25.0,
        offset=(452_300.0, 6_851_700.0, 310.0),
        about="blocks 12 x 10 x 5, turned lattice, national grid",
    ),
    "sub_blocked": FaultedSpec(
        events=(waves(30), _fault(8, 62, 50)),
        sub_blocks=2,
        about="blocks of 10 and 5 m",
    ),
    "scattered": FaultedSpec(
        events=(waves(30), _fault(8, 62, 50)),
        grid="scattered",
        about="points without a lattice",
    ),
}  # fmt: skip

FAULTED_CASES: Mapping[str, FaultedSpec] = MappingProxyType(_CASES)
"""Recipes of the named faulted bodies, by name; read-only."""


RANDOM_FAMILIES = ("plain", "wide")
"""Families of `random_faulted`."""


def simulate_faulted(
    case: str | FaultedSpec, *, blocks: int | None = None, **overrides: object
) -> FaultedBody:
    """Return a body that was folded and faulted, with its exact truth.

    Parameters
    ----------
    case : str or FaultedSpec
        A name in FAULTED_CASES, or a recipe.
    blocks : int, optional
        Number of blocks; all are enlarged or reduced so that the body has about as many.
    **overrides
        Other values of FaultedSpec fields, such as ``steps=(10, 10, 5)``, ``bearing=30``,
        ``sub_blocks=2`` or ``grid="scattered"``.

    Returns
    -------
    FaultedBody
        Blocks, flat coordinates, fault blocks, fault surfaces and true slips.

    Raises
    ------
    OptionError
        A name is unknown (the message lists the valid ones), a value is outside its range, or no
        block lies in the body.

    Examples
    --------
    >>> body = simulate_faulted("graben")
    >>> sorted(set(body.fault_block.tolist())), list(body.surfaces)
    ([0, 1, 2], ['f1', 'f2'])
    >>> simulate_faulted("normal_1T").slips["f1"].throw.mean().round(1)  # 50 m down a dip of 60
    np.float64(43.3)
    """
    if isinstance(case, str) and case not in FAULTED_CASES:
        known = ", ".join(FAULTED_CASES)
        raise OptionError(f"no faulted body is named {case!r}; valid: {known}")
    name = case if isinstance(case, str) else "custom"
    spec = FAULTED_CASES[case] if isinstance(case, str) else case
    spec = spec.with_options(**overrides)
    return sample(name, spec if blocks is None else spec.with_blocks(blocks))


def random_faulted(seed: int, family: str = "plain", **overrides: object) -> FaultedBody:
    """Return a faulted body drawn from a seed.

    Sizes, outlines, dips, rakes, folds and the order of folding and faulting vary.

    Parameters
    ----------
    seed : int
        Equal seeds give equal bodies, bit for bit.
    family : {'plain', 'wide'}
        ``plain``: one to three planar, corrugated or listric faults that cross the length, cubic
        blocks. ``wide``: dominoes, grabens, horsts, crossing faults, splays, scissor faults, tips
        and drag too, with other block sides, turned lattices, sub-blocks and cropped models.
    **overrides
        Other values of FaultedSpec fields.

    Raises
    ------
    OptionError
        The seed is no whole number from 0 up, the family is unknown, or a value is outside its
        range.
    """
    if not isinstance(seed, int) or seed < 0:
        raise OptionError(f"seed must be a whole number from 0 up, not {seed!r}")
    if family not in RANDOM_FAMILIES:
        raise OptionError(f"family {family!r} is not one of: {', '.join(RANDOM_FAMILIES)}")
    spec = _random_spec(seed) if family == "plain" else wide_spec(seed)
    return sample(f"{family}{seed}", spec.with_options(**overrides))


def _random_spec(seed: int) -> FaultedSpec:
    """Return the recipe that a seed draws."""
    rng = np.random.default_rng([seed, 77])
    length, width = rng.uniform(360, 560), rng.uniform(260, 400)
    thickness = rng.uniform(40, 70)
    outlines: tuple[Outline, ...] = (Rectangle(), Oval(), Wandering(25, seed))
    outline = outlines[rng.integers(3)]
    count = int(rng.choice([1, 1, 1, 2, 2, 3]))
    faulted_first = bool(rng.integers(2))
    faults: list[Fault] = []
    total = 0.0
    for k in range(count):
        x = length * (k + 1) / (count + 1) + rng.uniform(-20, 20)
        fault, size = _random_fault(rng, k, (x, width / 2, 0.0), thickness, not faulted_first)
        faults.append(fault)
        total += size
    room = total if faulted_first else 0.0
    fold = waves(
        rng.uniform(10, 40),
        max(rng.uniform(350, 700), 3 * room),
        rng.uniform(0, 360),
        length=length + 700,
        start=-350,
        reach=thickness + room + 20,
        azimuth=rng.uniform(-25, 25),
    )
    events: tuple[Event, ...] = (*faults, fold) if faulted_first else (fold, *faults)
    return FaultedSpec(
        events=events,
        length=length,
        width=width,
        thickness=thickness,
        outline=outline,
        swell=float(rng.choice([0, 0, 0.25])),
        about="drawn from a seed",
    )


def _random_fault(
    rng: np.random.Generator,
    k: int,
    point: tuple[float, float, float],
    thickness: float,
    may_be_listric: bool,
) -> tuple[Fault, float]:
    """Return a fault and the size of its slip."""
    name = f"f{k + 1}"
    strike = rng.uniform(-20, 20) + (180 if rng.random() < 0.5 else 0)
    dip, size = rng.uniform(40, 85), thickness * rng.uniform(0.3, 2.0)
    kind = rng.random()
    if kind < 0.2 and may_be_listric:
        radius, angle = rng.uniform(250, 400), rng.uniform(4, 12)
        arc = ListricFault(
            name=name, point=point, strike=strike, dip=min(dip, 65), radius=radius, angle=angle
        )
        return arc, size
    rake = np.radians(rng.normal(0, 12) if kind < 0.7 else rng.uniform(-90, 90))
    sign = 1 if rng.random() < 0.7 else -1
    corrugated = rng.random() < 0.3
    shape = (5, 14), (120, 250), (0, 6)
    waves = [rng.uniform(*span) for span in shape] if corrugated else [0.0, 100.0, 0.0]
    plane = PlanarFault(
        name=name,
        point=point,
        strike=strike,
        dip=dip,
        dip_slip=sign * size * np.cos(rake),
        strike_slip=size * np.sin(rake),
        amplitude=waves[0],
        wavelength=waves[1],
        phase=waves[2],
    )
    return plane, size
