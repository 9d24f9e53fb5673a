"""Random simulated bodies of all families, each from one seed."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from geounfold.errors import OptionError
from geounfold.synthetic.body import Body, Sheet
from geounfold.synthetic.random_families import BLOCKS, BREADTH, FAMILIES, RECIPES, common_draws
from geounfold.synthetic.sampling import sample

_DRAWS = 200  # draws from one seed; the family that needs most (hairpin) takes 5 in the mean
_APART = 1.75  # least gap between limbs, in longest block sides; a cube's diagonal is 1.73
_NEAR = 6.0  # block sides along the sheet within which points belong to one limb


def random_family(seed: int) -> str:
    """Return the family of FAMILIES to which a seed's random body belongs."""
    return FAMILIES[int(np.random.default_rng([seed, 0]).integers(len(FAMILIES)))]


def random_body(seed: int, family: str | None = None) -> Body:
    """Return a random body, named after its family and described by the values drawn.

    Profile, thickness, outline, block sides, orientation of fold and lattice, position in the
    world, noise and missing blocks are drawn. The family determines which of them is unusual.
    A body is drawn again if it is geometrically impossible, if its limbs are within 1.75 block
    sides of each other, if it is no sheet or if its number of blocks is outside BLOCKS.

    Parameters
    ----------
    seed : int
        Seed, 0 or more; equal seeds give equal bodies, bit for bit.
    family : str, optional
        One of FAMILIES; by default the seed's own (random_family).

    Raises
    ------
    OptionError
        The family is unknown, or the seed is below 0.

    Examples
    --------
    >>> body = random_body(0)
    >>> body.name == random_family(0), 2_000 <= len(body.folded) <= 12_000
    (True, True)
    """
    if not isinstance(seed, int) or seed < 0:
        raise OptionError(f"seed must be a whole number from 0 up, not {seed!r}")
    family = random_family(seed) if family is None else family
    if family not in RECIPES:
        raise OptionError(f"family {family!r} is not one of: {', '.join(FAMILIES)}")
    rng = np.random.default_rng([seed, 1])
    for _ in range(_DRAWS):
        body = _drawn(rng, family, seed)
        if body is not None:
            return body
    raise OptionError(f"no valid body of the family {family!r} in {_DRAWS} drawings of {seed}")


def _drawn(rng: np.random.Generator, family: str, seed: int) -> Body | None:
    """Return the body drawn; None if it is not valid."""
    draft = common_draws(rng)
    RECIPES[family](draft)
    try:
        spec = draft.spec(family, seed)
        if _limb_gap(Sheet(spec)) < _APART * max(spec.steps):
            return None
        body = sample(family, spec)
    except OptionError:
        return None
    thick = float((body.top - body.bottom).max())
    narrow = family != "strip" and min(spec.width, spec.length) < BREADTH * thick
    return None if narrow or not BLOCKS[0] <= len(body.folded) <= BLOCKS[1] else body


def _limb_gap(sheet: Sheet) -> float:
    """Return the least distance between points of the section that are far along the sheet."""
    spec = sheet.spec
    side = max(spec.steps)
    if spec.closed or spec.refold is not None:
        return np.inf
    n = int(min(400, max(20, 3 * spec.length / side)))
    truth = sheet.boundary(n, 2)
    truth = truth[truth[:, 1] == 0][:, [0, 2]]
    folded = sheet.slip.fold(truth[:, 0], truth[:, 1])
    far = cdist(truth[:, :1], truth[:, :1]) > _NEAR * side + 2 * sheet.slip.reach
    apart = cdist(folded, folded)[far]
    return float(apart.min()) if len(apart) else np.inf
