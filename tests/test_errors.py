"""The checks of options: what they let through, and the one sentence they refuse with."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from geounfold.errors import (
    OptionError,
    check_flag,
    check_number,
    check_numbers,
    check_one_of,
    check_options,
    check_whole,
    check_words,
)

between = partial(check_number, low=0, high=1, low_open=True, high_open=True)
positive = partial(check_number, low=0, low_open=True)
count = partial(check_whole, low=1)
few = partial(check_whole, low=1, high=9)
word = partial(check_one_of, valid=("top", "mid"))
three = partial(check_numbers, count=3)
some = partial(check_words, valid=("harmonic", "arap"))

GOOD: list[tuple[Callable[..., None], Any]] = [
    (between, 0.5),
    (between, np.float32(0.5)),
    (positive, 3),
    (positive, np.int64(3)),
    (partial(check_number, low=0, high=1), 0),
    (partial(check_number, high=1, high_open=True), -5.0),
    (partial(positive, none=True), None),
    (count, 1),
    (count, np.int32(7)),
    (partial(count, none=True), None),
    (partial(count, word="all"), "all"),
    (word, "mid"),
    (partial(word, none=True), None),
    (check_flag, True),
    (three, [0, 0, 1.0]),
    (three, np.eye(3)[2]),
    (some, ("arap",)),
    (partial(check_options, kind=int, none=True), None),
]


@pytest.mark.parametrize(("check", "value"), GOOD)
def test_good_values_pass(check: Callable[..., None], value: Any) -> None:
    check("x", value)


BAD: list[tuple[Callable[..., None], Any, str]] = [
    (between, 2, "a number between 0 and 1, but is 2"),
    (between, 0, "a number between 0 and 1, but is 0"),
    (between, 1.0, "a number between 0 and 1, but is 1.0"),
    (between, "far", "a number between 0 and 1, but is 'far'"),
    (between, True, "a number between 0 and 1, but is True"),
    (between, np.True_, "a number between 0 and 1, but is np.True_"),
    (between, float("nan"), "a number between 0 and 1, but is nan"),
    (between, None, "a number between 0 and 1, but is None"),
    (between, np.float64(2), "a number between 0 and 1, but is 2.0"),
    (positive, float("inf"), "a number above 0, but is inf"),
    (positive, 10**400, f"a number above 0, but is 1{'0' * 59}..."),
    (positive, 1j, "a number above 0, but is 1j"),
    (partial(positive, none=True), 0, "a number above 0 or None, but is 0"),
    (partial(check_number, low=0, high=1), -1, "a number from 0 to 1, but is -1"),
    (
        partial(check_number, low=0, high=1, high_open=True),
        1,
        "a number from 0 to below 1, but is 1",
    ),
    (
        partial(check_number, low=0, high=1, low_open=True),
        0,
        "a number above 0 and up to 1, but is 0",
    ),
    (partial(check_number, low=0), -1, "a number of 0 or more, but is -1"),
    (partial(check_number, high=0), 1, "a number of 0 or less, but is 1"),
    (partial(check_number, high=0, high_open=True), 0, "a number below 0, but is 0"),
    (check_number, [1], r"a number, but is [1]"),
    (count, 0, "a whole number of 1 or more, but is 0"),
    (count, 2.0, "a whole number of 1 or more, but is 2.0"),
    (count, False, "a whole number of 1 or more, but is False"),
    (few, 10, "a whole number from 1 to 9, but is 10"),
    (partial(count, none=True), "3", "a whole number of 1 or more or None, but is '3'"),
    (
        partial(check_whole, low=0, word="all", none=True),
        "both",
        "a whole number of 0 or more, 'all' or None, but is 'both'",
    ),
    (word, "far", "one of top, mid, but is 'far'"),
    (word, ["top"], "one of top, mid, but is ['top']"),
    (word, "x" * 100, f"one of top, mid, but is '{'x' * 59}..."),
    (partial(word, none=True), 1, "one of top, mid or None, but is 1"),
    (check_flag, 1, "true or false, but is 1"),
    (check_flag, "true", "true or false, but is 'true'"),
    (three, (0, 1), "a list of 3 numbers, but is [0, 1]"),
    (three, [0, 1, "up"], "a list of 3 numbers, but is [0, 1, 'up']"),
    (three, [0, 1, float("nan")], "a list of 3 numbers, but is [0, 1, nan]"),
    (three, np.zeros((3, 1)), "a list of 3 numbers, but is [[0.0], [0.0], [0.0]]"),
    (three, 1, "a list of 3 numbers, but is 1"),
    (some, (), "a list of one or more of harmonic, arap, but is []"),
    (some, "arap", "a list of one or more of harmonic, arap, but is 'arap'"),
    (some, ["lscm"], "a list of one or more of harmonic, arap, but is ['lscm']"),
    (partial(check_options, kind=int), {}, "int, but is {}"),
    (partial(check_options, kind=int, none=True), "a", "int or None, but is 'a'"),
]


@pytest.mark.parametrize(("check", "value", "sentence"), BAD)
def test_bad_values_are_refused_in_one_sentence(
    check: Callable[..., None], value: Any, sentence: str
) -> None:
    with pytest.raises(OptionError) as refused:
        check("hull_options.x", value)
    assert str(refused.value) == f"hull_options.x must be {sentence}"
