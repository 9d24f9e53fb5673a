"""The layout of a text table: its separator, the row of names, and where the data begin.

Exports put other lines above the names (comments, a title, a model's definition) and below them
(units, types, defaults). The names are those of the first row that holds a set of coordinates and
is as long as the rows below it; in a table without coordinates, the first row of texts of that
length. What is left out or assumed is kept as notes, which commands print and put in the summary.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, takewhile
from pathlib import Path

import pandas as pd

from geounfold.errors import InputError
from geounfold.io.column_values import objects
from geounfold.io.messages import counted, shown
from geounfold.io.packages.definition_rows import definition_rows, is_number
from geounfold.io.packages.names import Triple, coordinate_sets, plain_name

BLANKS = r"\s+"
"""The separator of columns that blanks separate."""

_SEPARATORS = (",", ";", "\t", "|", BLANKS)
_MARKS = ("#", "!", "%", "//", "/", '"#')
_LINE_END = re.compile(rb"\r\n|\n|\r")
_MOST_COLUMNS = 1 << 16  # names in the first row beyond which the file is no table
_LOOKED = 300  # lines in which the names are looked for
_NEXT = 10  # rows that the row of names is compared with
_COMMA = r"\s*[+-]?\d+,\d+(?:[eE][+-]?\d+)?\s*"
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d+)?")
_SEP = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)


@dataclass(frozen=True)
class TextLayout:
    """How a text table is laid out.

    Attributes
    ----------
    names : tuple of str
        Names of the columns.
    separator : str
        One character, or `BLANKS`.
    start : int
        Byte, of the text in UTF-8, at which the data begin.
    lines : int
        Number of lines before the data.
    decimal_comma : bool
        Whether numbers have a decimal comma.
    notes : tuple of str
        What was left out or assumed, a sentence each.
    """

    names: tuple[str, ...]
    separator: str
    start: int
    lines: int
    decimal_comma: bool = False
    notes: tuple[str, ...] = ()

    def with_points(self, frame: pd.DataFrame, path: str | Path) -> pd.DataFrame:
        """Return a part of the table with decimal points in place of decimal commas.

        Raises
        ------
        InputError
            A column has numbers with a comma and numbers with a point.
        """
        if not self.decimal_comma:
            return frame
        columns = {}
        for k in range(frame.shape[1]):
            column = frame.iloc[:, k]
            mixed = column.str.fullmatch(_COMMA).to_numpy(dtype=bool)
            if mixed.any():
                pointed = column.str.fullmatch(r"\s*[+-]?\d+\.\d+\s*").to_numpy(dtype=bool)
                if pointed.any():
                    raise InputError(
                        f"{path}: column '{shown(self.names[k])}' has numbers with a decimal comma "
                        f"and with a point: '{shown(objects(column)[pointed.argmax()])}'; write "
                        "all of them with a point"
                    )
                column = column.where(~mixed, column.str.replace(",", ".", regex=False))
            columns[k] = column
        out = pd.DataFrame(columns, index=frame.index)
        out.columns = frame.columns
        return out


@dataclass(frozen=True)
class _Line:
    text: str
    end: int  # byte behind its end
    number: int  # from 1

    @property
    def comment(self) -> bool:
        return self.text.lstrip().startswith(_MARKS)


def text_layout(path: Path, head: bytes, columns: Triple | None = None) -> TextLayout:
    """Return the layout of a text table.

    Parameters
    ----------
    path : path
        The file, for messages.
    head : bytes
        The beginning of its text in UTF-8; it may end within a row.
    columns : three str, optional
        Names of the coordinates; by default those of `packages.names`.

    Raises
    ------
    InputError
        The content is empty, or its coordinates are not those of centres.
    """
    every = list(islice(_lines(head), _LOOKED))
    rows = [line for line in every if line.text.strip()]
    if not rows:
        raise InputError(f"{path}: the file is empty")
    given = _SEP.fullmatch(rows[0].text.strip())
    separators: tuple[str, ...] = _SEPARATORS
    if given is not None and len(rows) > 1:
        separators, rows = (given.group(1),), rows[1:]
    names = _names(rows, separators, columns, head) or _joined_names(rows, head)
    if len(names.fields) > _MOST_COLUMNS:
        raise InputError(
            f"{path}: is not a table of points: its first row names {len(names.fields)} columns"
        )
    return _layout(path, rows, names, columns)


@dataclass(frozen=True)
class _Names:
    """The row of names: its index among the rows, its last line, separator and fields."""

    row: int
    last: _Line
    separator: str
    fields: list[str]
    coordinates: bool


def _layout(path: Path, rows: list[_Line], names: _Names, columns: Triple | None) -> TextLayout:
    """Return the layout below the row of names."""
    below = [line for line in rows[names.row + 1 :] if line.number > names.last.number]
    whole = list(takewhile(lambda line: line.text.count('"') % 2 == 0, below[: 4 * _NEXT]))
    fields = [split(line.text, names.separator) for line in whole]
    where = _where(names.fields, columns) if names.coordinates else ()
    left_out = definition_rows(fields[: 2 * _NEXT], where, len(names.fields))
    if left_out.fault:
        raise InputError(f"{path}: {left_out.fault}")
    last = below[left_out.count - 1] if left_out.count else names.last
    comma = _has_decimal_commas(fields[left_out.count :])
    notes = [*_notes_above(rows[: names.row]), *left_out.notes]
    if names.separator in (BLANKS, "|"):
        what = "blanks" if names.separator == BLANKS else "bars"
        notes.append(f"its columns are separated by {what}")
    if comma:
        notes.append("its decimal commas were read as points")
    return TextLayout(
        tuple(name.strip() for name in names.fields),
        names.separator,
        last.end,
        last.number,
        comma,
        tuple(notes),
    )


def _names(
    rows: list[_Line], separators: tuple[str, ...], columns: Triple | None, head: bytes
) -> _Names | None:
    """Return the row of names; None if no row of the first lines can be it."""
    plain = [k for k, line in enumerate(rows) if not line.comment]
    found: _Names | None = None
    for k in plain:
        for separator in separators:
            fields = split(rows[k].text, separator)
            if len(fields) < 3 or not _has_coordinates(fields, columns):
                continue
            if rows[k].text.count('"') % 2:  # quotes protect the end of this line
                return _joined_names(rows[k:], head, k)
            names = _Names(k, rows[k], separator, fields, True)
            if _as_long(rows, k, separator, len(fields)):
                return names
            found = found or names
    if found is not None:
        return found
    first = plain[0] if plain else len(rows)
    above = rows[first - 1].text.lstrip().lstrip('#!%/"').strip() if first else ""
    for separator in separators:
        fields = split(above, separator)
        if len(fields) < 3 or not _has_coordinates(fields, columns):
            continue
        if _as_long(rows, first - 1, separator, len(fields)):
            return _Names(first - 1, rows[first - 1], separator, fields, True)
    return _first_texts(rows, plain, separators)


def _first_texts(rows: list[_Line], plain: list[int], separators: tuple[str, ...]) -> _Names | None:
    """Return the first row of texts that is as long as most rows; None if rows have no length."""
    some = plain[: 4 * _NEXT]
    best, most = None, 0.0
    for separator in separators:
        lengths = Counter(len(split(rows[k].text, separator)) for k in some)
        length, times = lengths.most_common(1)[0] if lengths else (1, 0)
        share = times / max(len(some), 1)
        if length > 1 and share > max(most, 0.5):
            best, most = (separator, length), share
    if best is None:
        return None
    for k in some:
        fields = split(rows[k].text, best[0])
        texts = [field for field in fields if field.strip() and not is_number(field)]
        if len(fields) == best[1] and len(texts) == len(fields):
            return _Names(k, rows[k], best[0], fields, False)
    fields = split(rows[some[0]].text, best[0])
    bare = best[0] == BLANKS and all(map(is_number, fields))  # the error then shows the columns
    return _Names(some[0], rows[some[0]], BLANKS, fields, False) if bare else None


def _joined_names(rows: list[_Line], head: bytes, above: int = 0) -> _Names:
    """Return the first row that is no comment, even if quotes in it protect line ends.

    ``above`` is the number of rows before these.
    """
    k = next((k for k, line in enumerate(rows) if not line.comment), 0)
    bare = "".join(rows[k].text.split('"')[::2])  # the text outside quotes
    separator = max(",;\t", key=bare.count)
    following = [line for line in islice(_lines(head), _LOOKED) if line.number >= rows[k].number]
    used = 0

    def texts() -> Iterator[str]:
        nonlocal used
        for line in following:
            used += 1
            yield line.text

    fields = next(csv.reader(texts(), delimiter=separator))
    whole = used < len(following) or rows[k].text.count('"') % 2 == 0
    last = following[used - 1] if whole else rows[k]
    fields = fields if whole else split(rows[k].text, separator)
    return _Names(above + k, last, separator, fields, _has_coordinates(fields, None))


def split(text: str, separator: str) -> list[str]:
    """Return the fields of a row; quotes protect separators."""
    if separator == BLANKS:
        return [a or b for a, b in re.findall(r'"([^"]*)"|(\S+)', text)]
    line = text.rstrip("\r\n")
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator), [])


def _as_long(rows: list[_Line], k: int, separator: str, count: int) -> bool:
    """Return whether at least half of the next rows have as many fields."""
    below = [line.text for line in rows[k + 1 :] if not line.comment][:_NEXT]
    same = sum(len(split(text, separator)) == count for text in below)
    return 2 * same >= len(below)


def _has_coordinates(fields: Sequence[str], columns: Triple | None) -> bool:
    if columns is None:
        return bool(coordinate_sets(fields))
    there = {field.strip().casefold() for field in fields}
    return all(name.strip().casefold() in there for name in columns)


def _where(fields: Sequence[str], columns: Triple | None) -> tuple[int, ...]:
    """Return the positions of the coordinates."""
    if columns is not None:
        there = [field.strip().casefold() for field in fields]
        return tuple(there.index(name.strip().casefold()) for name in columns)
    plain = [plain_name(field) for field in fields]
    return tuple(plain.index(name) for name in coordinate_sets(fields)[0])


def _notes_above(rows: list[_Line]) -> list[str]:
    """Return the notes on lines above the names."""
    comments = [line for line in rows if line.comment]
    titles = [line.text.strip(" \t\r\n,;") for line in rows if not line.comment]
    shown_titles = ", ".join(f"'{shown(title)}'" for title in titles if title)
    notes = []
    if comments:
        notes.append(f"{counted(len(comments), 'comment line')} above the names skipped")
    if titles:
        named = f": {shown_titles}" if shown_titles else ""
        notes.append(f"{counted(len(titles), 'line')} above the names skipped{named}")
    return notes


def _has_decimal_commas(rows: list[list[str]]) -> bool:
    """Return whether numbers have decimal commas, and none could have commas between thousands."""
    fields = [field.strip() for row in rows for field in row if "," in field]
    decimal = [field for field in fields if re.fullmatch(_COMMA, field)]
    sure = [field for field in decimal if not _THOUSANDS.fullmatch(field)]
    others = [f for f in fields if _THOUSANDS.fullmatch(f) and not re.fullmatch(_COMMA, f)]
    return bool(sure) and not others


def _lines(content: bytes) -> Iterator[_Line]:
    """Yield lines with their ends, of any of the three kinds, without a byte-order mark."""
    start = len(codecs.BOM_UTF8) if content.startswith(codecs.BOM_UTF8) else 0
    number = 1
    while start < len(content):
        found = _LINE_END.search(content, start)
        end = found.end() if found else len(content)
        yield _Line(content[start:end].decode("utf-8", errors="replace"), end, number)
        start, number = end, number + 1
