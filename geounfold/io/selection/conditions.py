"""Conditions on the rows of a table, and how each is decided for a column's values.

One rule for every condition: a missing value (blank, NA, NaN, null) equals nothing and lies below
and above nothing. ``!=`` is the opposite of ``=``, so that it holds for missing values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.geometry.mesh import Bools, Floats
from geounfold.io.column_values import objects
from geounfold.io.coordinate_columns import readable_numbers
from geounfold.io.messages import shown

Columns = Callable[[str], pd.Series]
"""Returns the column of a name."""

_ORDER: dict[str, Callable[[Any, Any], np.ndarray]] = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}


@dataclass(frozen=True)
class Value:
    """A value that a column is compared with.

    Attributes
    ----------
    text : str
    number : float or None
        The number that the text is; None for text in quotes.
    quoted : bool
        Whether the text has quotes: it is compared as text, character by character.
    """

    text: str
    number: float | None
    quoted: bool


@dataclass(frozen=True)
class OtherColumn:
    """A column in backticks that another one is compared with."""

    name: str


class Condition:
    """A condition on every row."""

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        raise NotImplementedError

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        raise NotImplementedError


@dataclass(frozen=True)
class Both(Condition):
    """All parts hold."""

    parts: tuple[Condition, ...]

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        return np.asarray(np.logical_and.reduce([part.of(columns) for part in self.parts]))

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        for part in self.parts:
            yield from part.names()


@dataclass(frozen=True)
class Either(Condition):
    """One part or more holds."""

    parts: tuple[Condition, ...]

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        return np.asarray(np.logical_or.reduce([part.of(columns) for part in self.parts]))

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        for part in self.parts:
            yield from part.names()


@dataclass(frozen=True)
class Not(Condition):
    """The condition does not hold."""

    part: Condition

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        return np.asarray(~self.part.of(columns))

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        yield from self.part.names()


@dataclass(frozen=True)
class Missing(Condition):
    """The column has no value."""

    column: str

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        return _missing(columns(self.column))

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        yield self.column


@dataclass(frozen=True)
class OneOf(Condition):
    """The column equals one of some values."""

    column: str
    values: tuple[Value, ...]

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        column = columns(self.column)
        return np.asarray(np.logical_or.reduce([_equal(column, value) for value in self.values]))

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        yield self.column


@dataclass(frozen=True)
class Equal(Condition):
    """The column equals a value, or another column."""

    column: str
    other: Value | OtherColumn

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        column = columns(self.column)
        if isinstance(self.other, Value):
            return _equal(column, self.other)
        return _alike(column, columns(self.other.name))

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        yield self.column
        if isinstance(self.other, OtherColumn):
            yield self.other.name


@dataclass(frozen=True)
class Order(Condition):
    """The column's numbers lie below or above a number, or those of another column."""

    column: str
    sign: str
    other: Value | OtherColumn

    def of(self, columns: Columns) -> Bools:
        """Return which rows meet it, (n,)."""
        column = columns(self.column)
        if isinstance(self.other, Value) and _holds_dates(column):
            dates, date = _dates(column), _date(column, self.other)
            return np.asarray(_ORDER[self.sign](dates, date), dtype=bool)
        left = _numbers(column, self.sign)
        if isinstance(self.other, OtherColumn):
            right = _numbers(columns(self.other.name), self.sign)
        elif self.other.number is None:
            raise InputError(
                f"where: {self.sign} compares numbers, and '{shown(self.other.text)}' is text; "
                "compare text by =, != or in, and put the name of another column in backticks"
            )
        else:
            right = np.full(len(left), self.other.number)
        with np.errstate(invalid="ignore"):
            return np.asarray(_ORDER[self.sign](left, right), dtype=bool)

    def names(self) -> Iterator[str]:
        """Yield the columns that it names."""
        yield self.column
        if isinstance(self.other, OtherColumn):
            yield self.other.name


def holds_numbers(column: pd.Series) -> bool:
    """Return whether a column holds numbers only, missing values aside, and at least one."""
    values, wrong = readable_numbers(column)
    return not wrong.any() and bool(np.isfinite(values).any())


def _missing(column: pd.Series) -> Bools:
    if column.dtype == object:
        return _by_value(column, _missing)
    values, wrong = readable_numbers(column)
    return np.asarray(np.isnan(values) & ~wrong)


def _by_value(column: pd.Series, decide: Callable[[pd.Series], Bools]) -> Bools:
    """Return a decision on each row, made once for every different value."""
    codes, values = pd.factorize(objects(column))
    return decide(pd.Series(pd.array(values, dtype="string"), name=column.name))[codes]


def _numbers(column: pd.Series, sign: str) -> Floats:
    """Return a column's numbers; NaN if missing."""
    values, wrong = readable_numbers(column)
    bad = np.flatnonzero(wrong)
    if len(bad):
        raise InputError(
            f"where: {sign} compares numbers, and column '{shown(column.name)}' has "
            f"'{shown(objects(column)[bad[0]])}' at data row {bad[0] + 1}; compare text by =, != "
            "or in"
        )
    return values


def _equal(column: pd.Series, value: Value) -> Bools:
    """Return which values equal one: numbers as numbers, text exactly, upper and lower case."""
    if not value.text:
        return _missing(column)
    if column.dtype == object:
        return _by_value(column, lambda values: _equal(values, value))
    if pd.api.types.is_bool_dtype(column.dtype):
        return _equal_truth(column, value)
    if _holds_dates(column):
        return np.asarray(_dates(column) == _date(column, value))
    values, _ = readable_numbers(column)
    typed = pd.api.types.is_numeric_dtype(column.dtype)
    if value.number is not None:
        same = np.asarray(values == value.number)
        return same if typed else same | (_words(column) == value.text)
    if typed or (not value.quoted and holds_numbers(column)):
        raise InputError(
            f"where: column '{shown(column.name)}' holds numbers, and '{shown(value.text)}' is "
            "text; compare it with a number"
        )
    return np.asarray((_words(column) == value.text) & ~_missing(column))


def _holds_dates(column: pd.Series) -> bool:
    return bool(pd.api.types.is_datetime64_any_dtype(column.dtype))


def _dates(column: pd.Series) -> np.ndarray:
    """Return a column of dates, (n,); missing ones compare as false."""
    return np.asarray(pd.to_datetime(column.astype(object)), dtype="datetime64[ns]")


def _date(column: pd.Series, value: Value) -> np.datetime64:
    """Return the date that a value is, such as 2024-12-31."""
    try:
        return np.datetime64(value.text, "ns")
    except ValueError as error:
        raise InputError(
            f"where: column '{shown(column.name)}' holds dates, and '{shown(value.text)}' is none; "
            "write one such as 2024-12-31"
        ) from error


def _equal_truth(column: pd.Series, value: Value) -> Bools:
    truth = {"true": True, "1": True, "false": False, "0": False}.get(value.text.casefold())
    if truth is None:
        raise InputError(
            f"where: column '{shown(column.name)}' holds true and false, not '{shown(value.text)}'"
        )
    return np.asarray([v is not None and v == truth for v in objects(column)], dtype=bool)


def _alike(column: pd.Series, other: pd.Series) -> Bools:
    """Return which rows have one value in both columns."""
    a, wrong_a = readable_numbers(column)
    b, wrong_b = readable_numbers(other)
    text = np.asarray(_words(column) == _words(other))
    missing = _missing(column) | _missing(other)
    return np.asarray(np.where(wrong_a | wrong_b, text, a == b) & ~missing, dtype=bool)


def _words(column: pd.Series) -> np.ndarray:
    """Return a column's values as text without blanks around it, (n,)."""
    return np.array([str(v).strip() for v in objects(column)], dtype=object)
