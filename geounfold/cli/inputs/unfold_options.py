"""The options of the unfolding, from the command line and a file."""

from __future__ import annotations

import shlex
from argparse import Namespace
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from geounfold.errors import InputError, OptionError
from geounfold.io.paths import existing_file

if TYPE_CHECKING:
    from geounfold.unfolding.options import UnfoldOptions

T = TypeVar("T")

MODEL_OPTIONS = (
    *("method", "flattener", "hull", "split", "up", "datum", "coordinates", "body"),
    *("parts", "neighbours", "reach", "uncertainty"),
)
"""The options of `UnfoldOptions` that have a flag of the same name and a value."""


def unfold_options(args: Namespace) -> UnfoldOptions:
    """Return the options that are given; those of the command line override those of --config.

    Raises
    ------
    OptionError
        A value outside the valid ones. The message is that of
        `UnfoldOptions`, with the flag in place of the name.
    InputError
        The file of options cannot be read.
    """
    from geounfold.unfolding.options import UnfoldOptions

    given = {n: getattr(args, n) for n in MODEL_OPTIONS if hasattr(args, n)}
    values = {name: _READERS.get(name, str)(text) for name, text in given.items()}
    if hasattr(args, "allow_uncertified"):
        values["allow_uncertified"] = args.allow_uncertified
    if getattr(args, "strict", False):
        values["strict"] = True
    path = config_file(args)
    base = None if path is None else _read_config(path)

    def made(chosen: Mapping[str, Any]) -> UnfoldOptions:
        return UnfoldOptions(**chosen) if base is None else replace(base, **chosen)

    return flagged(made, values)


def flagged(make: Callable[[Mapping[str, Any]], T], values: Mapping[str, Any]) -> T:
    """Return an options class made of values; an error begins with the flag at fault.

    Parameters
    ----------
    make : callable
        Makes the options of some of the values.
    values : mapping
        By the option's name.

    Raises
    ------
    OptionError
        That of the class, behind the flag whose value is refused by itself.
    """
    try:
        return make(values)
    except OptionError:
        for name, value in values.items():
            try:
                make({name: value})
            except OptionError as error:
                flag, sentence = f"--{name.replace('_', '-')}", str(error)
                own = sentence.startswith(f"{name} ")  # the flag takes the place of the name
                said = sentence.removeprefix(name) if own else f": {sentence}"
                raise OptionError(f"{flag}{said}") from error
        raise


def _read_config(path: str) -> UnfoldOptions:
    """Return the options in a TOML file."""
    from geounfold.unfolding.options_toml import from_toml

    try:
        text = existing_file(Path(path)).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise OptionError(f"{path}: not valid TOML: not UTF-8 text") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    return from_toml(text, path)


def config_file(args: Namespace) -> str | None:
    """Return the file of --config; None for a command without it, or if it is not given."""
    path: str | None = getattr(args, "config", None)
    return path


def command_line(args: Namespace) -> str:
    """Return the command that repeats the run, in a shell's words."""
    return shlex.join(["geounfold", *args.words])


def listed(names: str) -> str | list[str]:
    """Return names separated by commas, or the word all."""
    found = [name.strip() for name in names.split(",")]
    return "all" if found == ["all"] else found


def _number(text: str) -> float | str:
    """Return a whole number or a number; any other text, for the options class to refuse."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _numbers(text: str) -> tuple[float | str, ...]:
    return tuple(_number(word) for word in text.split(","))


_READERS: dict[str, Callable[[str], Any]] = {
    "up": _numbers,
    "body": _number,
    "neighbours": _number,
    "reach": _number,
    "uncertainty": _number,
}
