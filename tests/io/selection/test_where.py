"""Rows chosen by an expression: every comparison, every type, every mistake."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from geounfold.errors import InputError, OptionError
from geounfold.io.selection import read_where

# As a CSV gives it (text), then the same values in the types of a Parquet file.
TEXT = pd.DataFrame(
    {
        "ROCK": ["ORE", "WASTE", "", "ORE ", "ore"],
        "ORE": ["1", "0", "1.0", "", "2"],
        "AU": ["0.5", "0.1", "", ".2", "1e-1"],
        "ORE ZONE": ["a b", "c", "d", "e", "f"],
        "HOLE": ["007", "7", "x", "", "07"],
    },
    dtype=object,
)
TYPED = pd.DataFrame(
    {
        "ROCK": pd.array(["ORE", "WASTE", None, "ORE", "ore"], dtype="string"),
        "ORE": pd.array([1, 0, 1, None, 2], dtype="Int64"),
        "AU": [0.5, 0.1, np.nan, 0.2, 0.1],
        "RICH": [True, False, True, False, False],
    }
)


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("ROCK=ORE", "10010"),
        ("rock == 'ORE'", "10010"),  # an exact name, else any letter case; text exactly
        ('ROCK <> "ORE"', "01101"),  # the opposite of =, a missing value included
        ("not ROCK=ORE", "01101"),
        ("ROCK is missing", "00100"),
        ("ROCK = ''", "00100"),
        ("ROCK is not missing and AU>0.1", "10010"),
        ("ORE=1", "10100"),
        ("ORE != 1", "01011"),
        ("AU >= 0.1", "11011"),
        ("AU < 0.2", "01001"),
        ("0.2 <= AU", "10010"),
        ("AU<=0.1 or ROCK=ORE and AU>0.3", "11001"),  # and binds before or
        ("(AU<=0.1 or ROCK=ORE) and AU>0.3", "10000"),
        ("ROCK in (ORE, WASTE)", "11010"),
        ("ROCK NOT IN ('ORE')", "01101"),
        ("ORE in (1, 2)", "10101"),
    ],
)
def test_rows_chosen_in_text_and_in_types(text: str, rows: str) -> None:
    for frame in (TEXT, TYPED):
        found = read_where(text).mask(frame)
        assert "".join(str(int(v)) for v in found) == rows, frame.dtypes


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("'ORE ZONE' = 'a b'", "10000"),
        ("`ORE ZONE` in (c, d)", "01100"),
        ("HOLE='007'", "10000"),  # in quotes: text
        ("HOLE=7", "11001"),  # a number: equal as numbers
        ("AU=`ORE`", "00000"),
        ("ORE>`AU`", "10001"),
        ("'ORE ZONE'='c' or \"ORE ZONE\"=\"d\"", "01100"),
    ],
)
def test_quotes_and_other_columns(text: str, rows: str) -> None:
    assert "".join(str(int(v)) for v in read_where(text).mask(TEXT)) == rows


def test_truth_values_are_compared_as_words_or_numbers() -> None:
    for text in ("RICH=true", "RICH = 1", "RICH != False"):
        assert read_where(text).mask(TYPED).tolist() == [True, False, True, False, False]
    with pytest.raises(InputError, match="holds true and false, not 'rich'"):
        read_where("RICH=rich").mask(TYPED)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("ROCK", "comparison such as = or in is needed, not the end"),
        ("ROCK=", "a value is needed, not the end"),
        ("=ORE", "a column is needed, not '=' at character 1"),
        ("ROCK=MASSIVE ORE", "text with blanks needs quotes"),
        ("(ROCK=ORE", "a closing bracket"),
        ("ROCK=ORE)", "the end is needed, not '\\)' at character 9"),
        ("ROCK='ORE", "the quote ' at character 6 is not closed"),
        ("ROCK=ORE & ORE=1", "write and, not &"),
        ("0<ORE<2", "join two comparisons by and"),
        ("ROCK in ORE", "an opening bracket"),
        ("ROCK is ORE", "missing is needed"),
        ("__import__('os').getcwd()", "comparison such as"),
        ("not " * 200 + "ROCK=ORE", "60 brackets"),
        ("(" * 200, "60 brackets"),
        ("ROCK=" + "x" * 20_000, "10000 are the most"),
    ],
)
def test_expressions_that_are_not_well_formed(text: str, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        read_where(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ROK=ORE", r"no column 'ROK' in where 'ROK=ORE'; did you mean ROCK\? the file has: ROCK"),
        ("AU=high", "column 'AU' holds numbers, and 'high' is text"),
        ("ROCK>3", "> compares numbers, and column 'ROCK' has 'ORE' at data row 1"),
        ("AU>high", "'high' is text"),
        ("ORE ZONE=c", "comparison"),
    ],
)
def test_columns_and_types_that_do_not_fit(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_where(text).mask(TEXT, "b.csv")


def test_columns_that_differ_by_case_only_need_the_exact_name() -> None:
    frame = pd.DataFrame({"Au": [1.0], "AU": [2.0]})
    assert read_where("AU=2").mask(frame).all()
    with pytest.raises(InputError, match="2 columns are called 'au'"):
        read_where("au=2").mask(frame)


def test_the_order_of_rows_permutes_the_choice() -> None:
    order = np.random.default_rng(3).permutation(len(TEXT))
    chosen = read_where("ORE=1 or AU<0.3").mask(TEXT)
    shuffled = read_where("ORE=1 or AU<0.3").mask(TEXT.iloc[order])
    np.testing.assert_array_equal(shuffled, chosen[order])


def test_dates_are_compared_as_dates() -> None:
    dates = pd.to_datetime(["2020-01-01", None, "2021-06-30"])
    for values in (dates, pd.array(dates, dtype="timestamp[ns][pyarrow]")):
        frame = pd.DataFrame({"MINED": values})
        for text, rows in (
            ("MINED = 2020-01-01", "100"),
            ("MINED > '2020-12-31'", "001"),
            ("MINED is missing", "010"),
            ("MINED != '2020-01-01'", "011"),
        ):
            assert "".join(str(int(v)) for v in read_where(text).mask(frame)) == rows
        with pytest.raises(InputError, match="holds dates, and 'soon' is none"):
            read_where("MINED=soon").mask(frame)
