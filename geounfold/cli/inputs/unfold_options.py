"""Words to options: those of unfolding, from the command line and a file of them."""

from __future__ import annotations

import shlex
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geounfold.errors import InputError, OptionError
from geounfold.io.paths import existing_file

if TYPE_CHECKING:
    from geounfold.unfolding.options import UnfoldOptions

MODEL_OPTIONS = (
    *("method", "flattener", "hull", "split", "up", "datum", "coordinates", "body"),
    *("neighbours", "reach"),
)


def unfold_options(args: Namespace) -> UnfoldOptions:
    """Return the options given by words and file, words first; the pipeline knows the others."""
    from geounfold.unfolding.options import UnfoldOptions

    readers: dict[str, Callable[[str], Any]] = {
        "up": lambda text: tuple(_number(part) for part in text.split(",")),
        "body": _number,
        "neighbours": _number,
        "reach": _number,
    }
    given = {n: getattr(args, n) for n in MODEL_OPTIONS if hasattr(args, n)}
    values: dict[str, Any] = {n: readers.get(n, str)(text) for n, text in given.items()}
    if hasattr(args, "allow_uncertified"):
        values["allow_uncertified"] = args.allow_uncertified
    path = config_file(args)
    return UnfoldOptions(**values) if path is None else replace(_read_config(path), **values)


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
    """Return the file of --config, where the command has it and it was given."""
    path: str | None = getattr(args, "config", None)
    return path


def command_line(args: Namespace) -> str:
    """Return the command that repeats the run, in a shell's words."""
    return shlex.join(["geounfold", *args.words])


def listed(names: str) -> str | list[str]:
    """Return names separated by commas, or the word all."""
    found = [name.strip() for name in names.split(",")]
    return "all" if found == ["all"] else found


def whole_number(text: str, option: str) -> int:
    """Return the whole number of 1 or more that an option is given."""
    if not text.isdecimal() or int(text) < 1:
        raise OptionError(f"{option} needs a whole number of 1 or more, not '{text}'")
    return int(text)


def _number(text: str) -> float | str:
    """Return a whole number or a number, or the text for UnfoldOptions to refuse or take."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
