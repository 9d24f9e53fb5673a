"""Numbers that options are given as text."""

from __future__ import annotations

import math

from geounfold.errors import OptionError


def number(text: str, option: str) -> float:
    """Return the finite number that an option is given."""
    try:
        value = float(text)
    except ValueError as error:
        raise OptionError(f"{option} needs a number, not '{text}'") from error
    if not math.isfinite(value):
        raise OptionError(f"{option} needs a finite number, not '{text}'")
    return value


def whole_number(text: str, option: str) -> int:
    """Return the whole number of 1 or more that an option is given."""
    if not text.isdecimal() or int(text) < 1:
        raise OptionError(f"{option} needs a whole number of 1 or more, not '{text}'")
    return int(text)


def three_numbers(text: str, option: str, such: str = "10,10,5") -> tuple[float, float, float]:
    """Return the three finite numbers that an option is given, such as `such`."""
    try:
        a, b, c = (number(word, option) for word in text.split(","))
    except (ValueError, OptionError) as error:
        raise OptionError(
            f"{option} needs three finite numbers such as {such}, not '{text}'"
        ) from error
    return a, b, c
