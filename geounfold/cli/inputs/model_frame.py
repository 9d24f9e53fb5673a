"""The options for a block model in its own coordinates: --origin and --rotation."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from geounfold.cli.inputs.numbers import three_numbers
from geounfold.errors import OptionError

if TYPE_CHECKING:
    from geounfold.body.model_frame import ModelFrame
    from geounfold.geometry.mesh import Floats


def model_axes(rotation: str | None) -> Floats | None:
    """Return the axes of a model turned by --rotation, (3, 3); None without it."""
    from geounfold.body.model_frame import axes_from_angles

    return None if rotation is None else axes_from_angles(*three_numbers(rotation, "--rotation"))


def model_frame(args: Namespace) -> ModelFrame | None:
    """Return the frame of the points, given by --origin and --rotation; None without them."""
    if args.origin is None:
        if args.rotation is not None:
            raise OptionError(
                "--rotation turns a model's own coordinates about its origin: give --origin too, "
                "or neither if the centroids are world coordinates"
            )
        return None
    from geounfold.body.model_frame import ModelFrame

    angles = (0.0, 0.0, 0.0)
    if args.rotation is not None:
        angles = three_numbers(args.rotation, "--rotation")
    return ModelFrame.turned(three_numbers(args.origin, "--origin"), *angles)
