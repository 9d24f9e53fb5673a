"""Options as TOML text: one that explains all of them, one that repeats a run, and back."""

from __future__ import annotations

import inspect
import textwrap
import tomllib
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from geounfold._version import __version__
from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS
from geounfold.unfolding.options import VALID, UnfoldOptions

_WIDTH = 96
_METHOD, _METHOD_OPTIONS = "flattener", "flattener_options"  # the one names the other's type
_WORDS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
_MANY = {float: "numbers", int: "whole numbers", bool: "true or false", str: "texts"}


def template() -> str:
    """Return every option with its default, explained, as TOML.

    Read back it gives the defaults.  Options without a value are commented out, and so are those
    of flatteners, which depend on the one chosen.

    Examples
    --------
    >>> from_toml(template()) == UnfoldOptions()
    True
    """
    head = (
        f"Options of geounfold {__version__}, with their defaults. Lines may be left out; what "
        "the command line says goes before what stands here. None means that the line is left "
        "out. Use: geounfold unfold --config FILE"
    )
    return "\n".join([*_comment(head), "", *_section(UnfoldOptions(), (), explain=True)]) + "\n"


def to_toml(options: UnfoldOptions) -> str:
    """Return the TOML text that stands for these options, defaults included, bit for bit.

    Examples
    --------
    >>> chosen = UnfoldOptions(datum="top", reach=0.1 + 0.2)
    >>> from_toml(to_toml(chosen)) == chosen
    True
    """
    head = f"# geounfold {__version__}"
    return "\n".join([head, *_section(options, (), explain=False)]) + "\n"


def from_toml(text: str, source: str = "the configuration") -> UnfoldOptions:
    """Return the options that a TOML text stands for; what it leaves out has its default.

    Parameters
    ----------
    text : str
        As `template` and `to_toml` write it.
    source : str
        Begins the messages: the file's name.

    Raises
    ------
    OptionError
        No TOML, an option that does not exist, or a value of the wrong type or outside the valid
        ones; the message names it and what is valid.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise OptionError(f"{source}: not valid TOML: {error}") from error
    made: UnfoldOptions = _made(UnfoldOptions, table, (), source)
    return made


# ---------------------------------------------------------------------------------------- writing


def _section(options: Any, path: tuple[str, ...], *, explain: bool) -> Iterator[str]:
    """Yield the lines of one dataclass: its own values, then a table for each dataclass in it."""
    cls = type(options)
    notes = _notes(cls)
    inner = []
    for field in fields(cls):
        value = getattr(options, field.name)
        if is_dataclass(value) or field.name == _METHOD_OPTIONS:
            inner.append((field.name, value))
            continue
        if explain:
            yield from _explained(cls, field, path, notes.get(field.name, ""))
        if value is not None:
            yield f"{field.name} = {_literal(value)}"
        elif explain:
            yield f"# {field.name} = ...  ({_words(_hints(cls)[field.name])}; not set)"
    for name, value in inner:
        below = (*path, name)
        if is_dataclass(value):
            yield from _head(type(value), below, explain=explain)
            yield from _section(value, below, explain=explain)
        elif explain:
            for flattener in FLATTENERS.values():
                yield from ("", f"# With {_METHOD} = {_literal(flattener.name)}:")
                lines = [f"[{'.'.join(below)}]"]
                lines += _section(flattener.options(), below, explain=True)
                yield from (f"# {line}".rstrip() for line in lines)


def _head(cls: type, path: tuple[str, ...], *, explain: bool) -> Iterator[str]:
    yield ""
    if explain:
        yield from _comment(_summary(cls))
    yield f"[{'.'.join(path)}]"


def _explained(cls: type, field: Field[Any], path: tuple[str, ...], note: str) -> list[str]:
    """Return what the docstring says of a field, and its valid values where they have names."""
    valid = VALID.get(field.name) if not path else None
    if field.name == _METHOD:
        valid = tuple(FLATTENERS)
    words = f"{note} Valid: {', '.join(valid)}." if valid else note
    return _comment(words) if words else []


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in textwrap.wrap(" ".join(text.split()), _WIDTH - 2)]


def _literal(value: Any) -> str:
    """Return a value as TOML; numbers to the last bit."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        kept = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in kept) + '"'
    return f"[{', '.join(_literal(item) for item in value)}]"


# -------------------------------------------------------------------------------------- docstrings


def _summary(cls: type) -> str:
    """Return what a dataclass's docstring says before its first heading, as plain text."""
    lines = _doc(cls).splitlines()
    heads = [i for i, line in enumerate(lines[1:]) if line and not line.strip("-")]
    return " ".join(lines[: heads[0]] if heads else lines).replace("``", "")


def _notes(cls: type) -> dict[str, str]:
    """Return what numpydoc headings say of each field, own or inherited."""
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


def _hints(cls: type) -> dict[str, Any]:
    return get_type_hints(cls)


def _made(cls: Any, table: dict[str, Any], path: tuple[str, ...], source: str) -> Any:
    """Return a dataclass made of a TOML table."""
    known = [field.name for field in fields(cls)]
    for name in table:
        if name not in known:
            raise OptionError(
                f"{source}: there is no option {'.'.join((*path, name))}; "
                f"valid{' in ' + '.'.join(path) if path else ''}: {', '.join(known) or 'none'}"
            )
    hints = dict(_hints(cls))
    if _METHOD_OPTIONS in known:
        chosen = table.get(_METHOD, _default(cls, _METHOD))
        hints[_METHOD_OPTIONS] = _options_of(chosen, (*path, _METHOD), source)
    values = {
        name: _value(hints[name], value, (*path, name), source) for name, value in table.items()
    }
    try:
        return cls(**values)
    except OptionError as error:
        place = f" [{'.'.join(path)}]" if path else ""
        raise OptionError(f"{source}{place}: {error}") from error


def _default(cls: Any, name: str) -> Any:
    found = next(field for field in fields(cls) if field.name == name)
    return None if found.default is MISSING else found.default


def _options_of(flattener: Any, path: tuple[str, ...], source: str) -> type:
    if not isinstance(flattener, str) or flattener not in FLATTENERS:
        raise OptionError(
            f"{source}: {'.'.join(path)} must be one of {', '.join(FLATTENERS)}, but is "
            f"{_shown(flattener)}"
        )
    return FLATTENERS[flattener].options


def _value(hint: Any, value: Any, path: tuple[str, ...], source: str) -> Any:
    """Return a TOML value as the type that a field has."""
    if is_dataclass(hint):
        if isinstance(value, dict):
            return _made(hint, value, path, source)
        raise OptionError(
            f"{source}: {'.'.join(path)} must be a table of options, but is {_shown(value)}"
        )
    for arm in _arms(hint):
        if _fits(arm, value):
            return _as(arm, value)
    raise OptionError(f"{source}: {'.'.join(path)} must be {_words(hint)}, but is {_shown(value)}")


def _arms(hint: Any) -> tuple[Any, ...]:
    """Return the types that a hint allows, None left out: TOML has no word for it."""
    arms = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    return tuple(arm for arm in arms if arm is not NoneType)


def _fits(hint: Any, value: Any) -> bool:
    if get_origin(hint) is tuple:
        kinds = get_args(hint)
        if not isinstance(value, list):
            return False
        if kinds[-1] is Ellipsis:
            return all(_fits(kinds[0], item) for item in value)
        return len(value) == len(kinds) and all(map(_fits, kinds, value))
    if hint is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return type(value) is hint


def _as(hint: Any, value: Any) -> Any:
    if get_origin(hint) is tuple:
        return tuple(_as(get_args(hint)[0], item) for item in value)
    return hint(value)


def _words(hint: Any) -> str:
    """Return what a type is called in a message."""
    words = []
    for arm in _arms(hint):
        if get_origin(arm) is tuple:
            kinds = get_args(arm)
            count = "" if kinds[-1] is Ellipsis else f"{len(kinds)} "
            words.append(f"a list of {count}{_MANY[kinds[0]]}")
        else:
            words.append(_WORDS[arm])
    return " or ".join(words)


def _shown(value: Any) -> str:
    """Return a value as it stands in TOML, or what it is."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, bool | int | float | str):
        return _literal(value)
    if isinstance(value, list):
        return "a list"
    return str(value)
