"""What every call of libigl needs: its exception renamed, its answer checked."""

from __future__ import annotations

from typing import Any

import numpy as np

from geounfold.errors import BackendError
from geounfold.geometry.mesh import Floats


def call_libigl(name: str, function: Any, *arguments: Any) -> Any:
    """Return what a function of libigl returns.

    Parameters
    ----------
    name : str
        The function's name in messages.
    function : callable
        A function of libigl.
    arguments
        Its arguments, by position.

    Raises
    ------
    BackendError
        The function raised a RuntimeError.
    """
    try:
        return function(*arguments)
    except RuntimeError as error:
        raise BackendError(f"libigl's {name} failed: {error}") from error


def finite_array(values: Any, shape: tuple[int, ...], name: str) -> Floats:
    """Return an array of libigl's as floats.

    libigl returns NaN instead of raising if a system is singular (libigl issue 2439).

    Parameters
    ----------
    values : array
        What the function returned.
    shape : tuple of int
        The shape it must have.
    name : str
        The function's name in messages.

    Raises
    ------
    BackendError
        The array has another shape, or holds a value that is not finite.
    """
    out = np.asarray(values, dtype=np.float64)
    if out.shape != shape:
        raise BackendError(
            f"libigl's {name} returned an array of shape {out.shape} instead of {shape}"
        )
    if not np.isfinite(out).all():
        raise BackendError(f"libigl's {name} returned values that are not finite")
    return out
