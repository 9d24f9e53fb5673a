"""Options as TOML text: one that explains all of them, one that repeats a run, and back."""

from __future__ import annotations

import inspect
import textwrap
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from numbers import Integral, Real
from typing import Any, get_type_hints

import numpy as np

from geounfold._version import __version__
from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS
from geounfold.unfolding.options import VALID, UnfoldOptions, check_names

_WIDTH = 96
_FLATTENER = "flattener_options"  # the one table whose class depends on another option


def template() -> str:
    """Return every option with its default, explained, as TOML of at most 100 lines.

    Read back it gives the defaults.  Options without a default value are commented out, and so are
    those of the flatteners.

    Examples
    --------
    >>> from_toml(template()) == UnfoldOptions()
    True
    """
    head = (
        f"Options of geounfold {__version__} with their defaults. Any line may be left out; the "
        "command line's options replace the file's. Use: geounfold unfold --config FILE"
    )
    return "\n".join([*_comment(head), "", *_section(UnfoldOptions(), (), explain=True)]) + "\n"


def to_toml(options: UnfoldOptions) -> str:
    """Return options as TOML text, defaults included and numbers to the last bit.

    Examples
    --------
    >>> chosen = UnfoldOptions(datum="top", reach=0.1 + 0.2)
    >>> from_toml(to_toml(chosen)) == chosen
    True
    """
    head = f"# geounfold {__version__}"
    return "\n".join([head, *_section(options, (), explain=False)]) + "\n"


def from_toml(text: str, source: str = "the configuration") -> UnfoldOptions:
    """Return the options in a TOML text; those that it leaves out have their defaults.

    Parameters
    ----------
    text : str
        As `template` and `to_toml` write it.
    source : str
        Begins the messages: the file's name.

    Raises
    ------
    OptionError
        The text is no TOML, an option does not exist or is gone, or a value is out of its range.
    """
    try:
        table = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, and numbers of thousands of digits
        raise OptionError(f"{source}: not valid TOML: {error}") from error
    try:
        made: UnfoldOptions = _made(UnfoldOptions, table, ())
    except OptionError as error:
        raise OptionError(f"{source}: {error}") from error
    return made


# ---------------------------------------------------------------------------------------- writing


def _section(options: Any, path: tuple[str, ...], *, explain: bool) -> Iterator[str]:
    """Yield the lines of one dataclass: its own values, then a table for each dataclass in it."""
    cls = type(options)
    notes = _notes(cls)
    inner = []
    for field in fields(cls):
        value = getattr(options, field.name)
        if is_dataclass(value) or field.name == _FLATTENER:
            inner.append((field.name, value))
            continue
        if explain:
            yield from _comment(
                _explained(notes.get(field.name, ""), () if path else VALID.get(field.name, ()))
            )
        if value is not None:
            yield f"{field.name} = {_literal(value)}"
        elif explain:
            yield f"# {field.name} = ... (not set)"
    for name, value in inner:
        if is_dataclass(value):
            yield from ("", *(_comment(_summary(type(value))) if explain else ()))
            yield f"[{'.'.join((*path, name))}]"
            yield from _section(value, (*path, name), explain=explain)
        elif explain:
            yield from _of_flatteners()


def _of_flatteners() -> Iterator[str]:
    """Yield the lines on the options of flatteners, all of them comments."""
    yield ""
    yield from _comment("Options of the chosen flattener: those in its line, with their defaults.")
    yield f"# [{_FLATTENER}]"
    for name, flattener in FLATTENERS.items():
        options = flattener.options()
        values = ((f.name, getattr(options, f.name)) for f in fields(options))
        words = [n if value is None else f"{n} = {_literal(value)}" for n, value in values]
        yield f"# {name}: {', '.join(words) or 'none'}"


def _explained(note: str, valid: Sequence[str]) -> str:
    """Return an option's description with its valid names, unless it names them itself."""
    if all(name in note for name in valid):
        return note
    return f"{note} Valid: {', '.join(valid)}."


def _comment(text: str) -> list[str]:
    return [
        f"# {line}"
        for line in textwrap.wrap(" ".join(text.split()), _WIDTH - 2, break_on_hyphens=False)
    ]


def _literal(value: Any) -> str:
    """Return a value as TOML; numbers to the last bit."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Integral):
        return repr(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    if isinstance(value, str):
        kept = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in kept) + '"'
    return f"[{', '.join(_literal(item) for item in value)}]"


# -------------------------------------------------------------------------------------- docstrings


def _summary(cls: type) -> str:
    """Return a dataclass's docstring up to its first heading, as plain text."""
    lines = _doc(cls).splitlines()
    heads = [i for i, line in enumerate(lines[1:]) if line and not line.strip("-")]
    return " ".join(lines[: heads[0]] if heads else lines).replace("``", "")


def _notes(cls: type) -> dict[str, str]:
    """Return the description of each field, own or inherited, in numpydoc docstrings."""
    notes: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        names: list[str] = []
        heading = False
        lines = _doc(base).splitlines() if is_dataclass(base) else []
        for line, below in zip(lines, [*lines[1:], ""], strict=False):
            if line and below and not below.strip("-"):
                heading = line in ("Parameters", "Attributes")
            elif heading and line.startswith(" "):
                for name in names:
                    notes[name] = f"{notes.get(name, '')} {line.strip()}".strip()
            elif heading and line.strip("-"):
                names = [name.strip() for name in line.split(" : ")[0].split(",")]
                notes.update(dict.fromkeys(names, ""))
    return {name: note.replace("``", "") for name, note in notes.items()}


def _doc(cls: type) -> str:
    return inspect.cleandoc(cls.__doc__ or "")


# ---------------------------------------------------------------------------------------- reading


def _made(cls: Any, table: dict[str, Any], path: tuple[str, ...]) -> Any:
    """Return a dataclass made of a TOML table; the dataclass checks the values."""
    check_names(table, cls, path)
    kinds = dict(get_type_hints(cls))
    flattener = table.get("flattener", UnfoldOptions.flattener)
    if cls is UnfoldOptions and isinstance(flattener, str) and flattener in FLATTENERS:
        kinds[_FLATTENER] = FLATTENERS[flattener].options
    return cls(**{name: _value(kinds[name], value, (*path, name)) for name, value in table.items()})


def _value(kind: Any, value: Any, path: tuple[str, ...]) -> Any:
    """Return a TOML value as a field holds it: tables as dataclasses, lists as tuples."""
    if is_dataclass(kind):
        if isinstance(value, dict):
            return _made(kind, value, path)
        name = ".".join(path)
        raise OptionError(f"{name} must be a table of options, but is {value!r}")
    return tuple(value) if isinstance(value, list) else value
