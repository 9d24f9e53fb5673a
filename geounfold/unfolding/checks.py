"""Checks of an unfolding's answer: proved, placed, not torn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geounfold.body.prepare import PreparedPoints
from geounfold.errors import ControlMeshError, OptionError, TrustError
from geounfold.geometry.mesh import Floats, Ints
from geounfold.mapping.carried import Carried, Returned, few
from geounfold.mapping.certificate import Certificate
from geounfold.methods import METHODS, no_mesh
from geounfold.quality.blocks import Quality
from geounfold.quality.trust import Trust
from geounfold.unfolding.options import UnfoldOptions


def check_method(options: UnfoldOptions) -> None:
    """Raise OptionError if the method proves nothing, unless that is allowed.

    The same if uncertainty is to be measured of another method than ``sheet``.
    """
    if options.uncertainty and options.method != "sheet":
        raise OptionError(
            f"uncertainty is measured of the method sheet only, not of {options.method}: leave out "
            "one or the other"
        )
    if METHODS[options.method].control:
        return
    if options.coordinates != "tet":
        raise OptionError(
            no_mesh(options.method, f"--coordinates {options.coordinates} has no prisms to go by")
        )
    if options.allow_uncertified:
        return
    raise OptionError(
        no_mesh(options.method, "nothing is proved of its map")
        + ", or --allow-uncertified to write the answer all the same"
    )


def check_faulted(options: UnfoldOptions, *, given: bool) -> None:
    """Raise OptionError if a method or surfaces are chosen that cannot take faults out.

    Parameters
    ----------
    options : UnfoldOptions
        Of the run.
    given : bool
        Whether top and bottom are given.
    """
    if given:
        raise OptionError("top and bottom are of a body without faults: leave out one or the other")
    if not METHODS[options.method].control:
        raise OptionError(no_mesh(options.method, "faults are taken out of control meshes only"))


def check_limited(options: UnfoldOptions, *, given: bool) -> None:
    """Raise OptionError if limits do not go with the method or with given surfaces.

    Parameters as `check_faulted` takes them.
    """
    if given:
        raise OptionError("top and bottom have no rim that limits could tell of: leave out one")
    if options.method != "sheet":
        raise OptionError(f"limits are known to the method sheet only, not to {options.method}")


def check_single(groups: Sequence[Ints], options: UnfoldOptions) -> None:
    """Raise OptionError if a method without a control mesh is to unfold several bodies."""
    if len(groups) > 1 and not METHODS[options.method].control:
        raise OptionError(
            no_mesh(options.method, "it unfolds one body at a time") + ", or choose one by --body"
        )


def check_torn(torn: Floats, count: int, options: UnfoldOptions) -> None:
    """Raise ControlMeshError if neighbours were torn apart, unless that is allowed.

    Parameters
    ----------
    torn : (k, 3) float
        The blocks that were torn from one they touch, in the data's coordinates.
    count : int
        Number of all blocks.
    options : UnfoldOptions
        Of the run.
    """
    if not len(torn) or options.allow_uncertified:
        return
    where = ", ".join(f"{c:.6g}" for c in np.median(torn, axis=0))
    raise ControlMeshError(
        f"{len(torn)} of {count} blocks were torn from their neighbours, around ({where}): "
        "limbs too close together, or a sheet too narrow for its thickness; try another --hull, "
        "or --allow-uncertified to write the answer all the same"
    )


def check_coordinates(
    quality: Quality, returned: Returned | None, folded: Floats, options: UnfoldOptions
) -> None:
    """Raise ControlMeshError if a prism's coordinates turn a block over or do not bring it back.

    Nothing is raised if that is allowed.  That it happens at no block is no proof.
    """
    if options.coordinates == "tet" or options.allow_uncertified or returned is None:
        return
    lost = returned.lost
    over = quality.blocks.volume_ratio <= 0
    wrong = over | lost
    if not wrong.any():
        return
    where = ", ".join(f"{c:.6g}" for c in np.median(folded[wrong], axis=0))
    raise ControlMeshError(
        f"{options.coordinates} coordinates turn {int(over.sum())} of {len(folded)} blocks inside "
        f"out and bring {int(lost.sum())} not back, around ({where}): use --coordinates tet, or "
        "--allow-uncertified to write the answer all the same"
    )


def check_certified(certificate: Certificate, options: UnfoldOptions) -> None:
    """Raise ControlMeshError if the map is not proved, unless that is allowed."""
    if certificate.injective or options.allow_uncertified:
        return
    place = certificate.folded[np.argmax(certificate.blocks)] if len(certificate.folded) else []
    where = ", ".join(f"{c:.6g}" for c in place)
    raise ControlMeshError(
        f"the map is not one-to-one: {', '.join(certificate.faults)}, "
        f"with {int(certificate.blocks.sum())} blocks, most of them around ({where}); the fold is "
        "too tight there for this block size: try another --hull or --flattener, or "
        "--allow-uncertified to write the answer all the same"
    )


def check_trust(trust: Trust | None, options: UnfoldOptions) -> None:
    """Raise TrustError if the trust is poor and only trusted answers are wanted."""
    if options.strict and trust is not None and trust.word == "poor":
        raise TrustError(f"{trust.sentence()}; leave out --strict to write the answer all the same")


def check_placed(prepared: PreparedPoints, carried: Carried, options: UnfoldOptions) -> None:
    """Raise ControlMeshError if more than a few blocks of a body have no image.

    Nothing is raised if that is allowed.  A few, and blocks that mending left out of the hull, are
    left empty and counted in a warning.
    """
    folded, kept = prepared.points, prepared.mended.fate == 0
    rows = np.concatenate([g[~carried.placed[g] & kept[g]] for g in prepared.groups])
    check_reached(folded[rows], len(folded), options)


def check_reached(missed: Floats, count: int, options: UnfoldOptions) -> None:
    """Raise ControlMeshError if more than a few blocks (k, 3) of ``count`` have no image."""
    if len(missed) <= few(count) or options.allow_uncertified:
        return
    where = ", ".join(f"{c:.6g}" for c in np.median(missed, axis=0))
    raise ControlMeshError(
        f"{len(missed)} of {count} blocks lie outside the control mesh and farther than its "
        f"reach, around ({where}): try another --hull, a larger --reach, or --allow-uncertified "
        "to leave them empty"
    )
