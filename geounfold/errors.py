"""Every error geounfold raises on purpose, and the checks that options classes make.

The command line prints the message as one line and leaves with ``exit_status``:
2 if the user's input or options are at fault, 1 for anything else.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from difflib import get_close_matches
from numbers import Integral, Real
from typing import Any


class GeounfoldError(Exception):
    """Base of all errors raised by geounfold; the message is one clear sentence."""

    exit_status = 1


class InputError(GeounfoldError, ValueError):
    """The points, tables or files given cannot be used: what, where, what to do.

    It is a ValueError too, as other libraries raise for values that do not fit.
    """

    exit_status = 2


class OptionError(InputError):
    """An option has a value outside its valid ones, which the message lists."""


class NotFittedError(InputError, AttributeError):
    """An `Unfolder` was used before it was fitted; scikit-learn's error of that name too."""


class OutputError(InputError):
    """An output cannot be written, or exists already and may not be replaced."""


class NoSheetError(InputError):
    """The body has no two opposite surfaces (a ball, a cube), so nothing to flatten."""


class StreamError(InputError):
    """The body cannot be unfolded from batches of its file; in memory it may be."""


class TrustError(InputError):
    """The layers of the answer are not to be trusted, and ``strict`` was asked for."""


class DomainError(GeounfoldError):
    """Some domains of a model failed; the others have their results."""


class MeshError(GeounfoldError):
    """A mesh is malformed: an index out of range, a wrong shape, a wrong topology."""


class HullError(GeounfoldError):
    """No closed hull could be made by the chosen method; the message names another."""


class SplitError(GeounfoldError):
    """The hull could not be split into a top and a bottom."""


class FlatteningError(GeounfoldError):
    """A surface could not be flattened, or the flattener returned an invalid answer."""


class ControlMeshError(GeounfoldError):
    """The control mesh is inverted or does not hold the blocks."""


class BackendError(GeounfoldError):
    """A library that geounfold calls failed."""


class MissingDependencyError(GeounfoldError):
    """An optional library, or a system library that a wheel needs, is absent."""


# ------------------------------------------------------------------------------ checks of options


def check_number(
    name: str,
    value: object,
    low: float | None = None,
    high: float | None = None,
    *,
    low_open: bool = False,
    high_open: bool = False,
    none: bool = False,
) -> None:
    """Raise OptionError unless an option's value is a finite number in its range.

    Parameters
    ----------
    name : str
        The option as the user writes it, such as ``hull_options.level``.
    value : any
        What was given; true and false are no numbers.
    low, high : float, optional
        The range; None for no bound.
    low_open, high_open : bool
        Whether the bound itself is outside the range.
    none : bool
        Whether None is valid too.

    Raises
    ------
    OptionError
        One sentence: the name, what is valid, the value.

    Examples
    --------
    >>> check_number("hull_options.level", 2, 0, 1, low_open=True, high_open=True)
    Traceback (most recent call last):
    geounfold.errors.OptionError: hull_options.level must be a number between 0 and 1, but is 2
    """
    if none and value is None:
        return
    if not (_is_number(value, Real) and _within(value, low, high, low_open, high_open)):
        range_ = _range_words(low, high, low_open, high_open)
        raise _refusal(name, f"a number{range_}", value, none)


def check_whole(
    name: str,
    value: object,
    low: int | None = None,
    high: int | None = None,
    *,
    word: str | None = None,
    none: bool = False,
) -> None:
    """Raise OptionError unless an option's value is a whole number in its range.

    Parameters as in `check_number`, both bounds in the range; ``word`` is a text that is valid
    too.

    Examples
    --------
    >>> check_whole("neighbours", 0, 1)
    Traceback (most recent call last):
    geounfold.errors.OptionError: neighbours must be a whole number of 1 or more, but is 0
    """
    if (none and value is None) or (word is not None and isinstance(value, str) and value == word):
        return
    if not (_is_number(value, Integral) and _within(value, low, high, False, False)):
        range_ = _range_words(low, high, False, False)
        also = "" if word is None else f", {word!r}"
        raise _refusal(name, f"a whole number{range_}{also}", value, none)


def check_one_of(name: str, value: object, valid: Iterable[str], *, none: bool = False) -> None:
    """Raise OptionError unless an option's value is one of some words.

    Examples
    --------
    >>> check_one_of("datum", "far", ("top", "mid"))
    Traceback (most recent call last):
    geounfold.errors.OptionError: datum must be one of top, mid, but is 'far'
    """
    if none and value is None:
        return
    words = tuple(valid)
    if not (isinstance(value, str) and value in words):
        error = _refusal(name, f"one of {', '.join(words)}", value, none)
        raise OptionError(f"{error}{nearest(value, words) if isinstance(value, str) else ''}")


def nearest(name: object, valid: Iterable[str]) -> str:
    """Return the question for the valid name that looks most like a wrong one; empty if none does.

    Examples
    --------
    >>> nearest("flatener", ("flattener", "hull"))
    " (did you mean 'flattener'?)"
    """
    words = {word.casefold().lstrip("-"): word for word in valid}
    found = get_close_matches(str(name).casefold().lstrip("-"), words, n=1)
    return f" (did you mean '{words[found[0]]}'?)" if found else ""


def check_flag(name: str, value: object) -> None:
    """Raise OptionError unless an option's value is true or false.

    Examples
    --------
    >>> check_flag("allow_uncertified", 1)
    Traceback (most recent call last):
    geounfold.errors.OptionError: allow_uncertified must be true or false, but is 1
    """
    if not isinstance(value, bool):
        raise _refusal(name, "true or false", value, False)


def check_numbers(name: str, value: object, count: int) -> None:
    """Raise OptionError unless an option's value is a list or tuple of so many finite numbers.

    Examples
    --------
    >>> check_numbers("up", (0, 1), 3)
    Traceback (most recent call last):
    geounfold.errors.OptionError: up must be a list of 3 numbers, but is [0, 1]
    """
    items = _items(value)
    if items is None or len(items) != count or not all(_is_number(item, Real) for item in items):
        raise _refusal(name, f"a list of {count} numbers", value, False)


def check_words(name: str, value: object, valid: Iterable[str]) -> None:
    """Raise OptionError unless an option's value is a list or tuple of some of these words.

    Examples
    --------
    >>> check_words("crosscheck.meshers", ["gmsh"], ("tetwild", "tetgen"))
    Traceback (most recent call last):
    geounfold.errors.OptionError: crosscheck.meshers must be a list of one or more of tetwild, \
tetgen, but is ['gmsh']
    """
    words = tuple(valid)
    items = _items(value)
    if not items or not all(isinstance(item, str) and item in words for item in items):
        raise _refusal(name, f"a list of one or more of {', '.join(words)}", value, False)


def check_options(name: str, value: object, kind: type, *, none: bool = False) -> None:
    """Raise OptionError unless an option's value is an instance of an options class.

    Examples
    --------
    >>> check_options("hull_options", {}, int)
    Traceback (most recent call last):
    geounfold.errors.OptionError: hull_options must be int, but is {}
    """
    if none and value is None:
        return
    if not isinstance(value, kind):
        raise _refusal(name, kind.__name__, value, none)


def _is_number(value: object, kind: type) -> bool:
    if isinstance(value, bool) or not isinstance(value, kind):
        return False
    try:
        return math.isfinite(value)  # type: ignore[arg-type]
    except OverflowError:  # a whole number that no float holds
        return False


def _within(
    value: Any, low: float | None, high: float | None, low_open: bool, high_open: bool
) -> bool:
    above = low is None or (value > low if low_open else value >= low)
    return above and (high is None or (value < high if high_open else value <= high))


def _range_words(low: float | None, high: float | None, low_open: bool, high_open: bool) -> str:
    """Return the words for a range, a blank before them; empty for no range."""
    if low is None and high is None:
        return ""
    if high is None:
        return f" above {low}" if low_open else f" of {low} or more"
    if low is None:
        return f" below {high}" if high_open else f" of {high} or less"
    if low_open and high_open:
        return f" between {low} and {high}"
    if low_open:
        return f" above {low} and up to {high}"
    return f" from {low} to below {high}" if high_open else f" from {low} to {high}"


def _items(value: object) -> list[Any] | None:
    """Return the items of a list, a tuple or an array of one dimension; None for others."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return list(value) if isinstance(value, list | tuple) else None


def _refusal(name: str, valid: str, value: object, none: bool) -> OptionError:
    return OptionError(
        f"{name} must be {valid}{' or None' if none else ''}, but is {_shown(value)}"
    )


_LONGEST = 60  # characters of a value in a message


def _shown(value: Any) -> str:
    """Return a value as a message shows it: short, alike from Python and from a file."""
    items = _items(value)
    if items is not None:
        value = items
    elif isinstance(value, Real) and type(value).__module__ == "numpy":
        value = value.item()  # type: ignore[attr-defined]
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
