"""The options that say where block models lie: --origin and --rotation."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from geounfold.errors import OptionError

if TYPE_CHECKING:
    from geounfold.body.model_frame import ModelFrame
    from geounfold.geometry.mesh import Floats


def three_numbers(text: str, option: str, such: str = "10,10,5") -> tuple[float, float, float]:
    """Return the three numbers that an option is given, one such as ``such``."""
    try:
        a, b, c = (float(word) for word in text.split(","))
    except ValueError as error:
        raise OptionError(f"{option} needs three numbers such as {such}, not '{text}'") from error
    return a, b, c


def model_axes(rotation: str | None) -> Floats | None:
    """Return the axes that --rotation says; None without it."""
    from geounfold.body.model_frame import axes_from_angles

    return None if rotation is None else axes_from_angles(*three_numbers(rotation, "--rotation"))


def model_frame(args: Namespace) -> ModelFrame | None:
    """Return the frame that --origin says a command's points to be in; None without it."""
    if args.origin is None:
        if args.rotation is not None:
            raise OptionError(
                "--rotation turns a model's own coordinates about its origin: give --origin too, "
                "or neither where the centroids are world coordinates"
            )
        return None
    from geounfold.body.model_frame import ModelFrame

    angles = (0.0, 0.0, 0.0)
    if args.rotation is not None:
        angles = three_numbers(args.rotation, "--rotation")
    return ModelFrame.turned(three_numbers(args.origin, "--origin"), *angles)
