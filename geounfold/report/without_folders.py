"""A summary without the folders of the files it names, so that a report can be passed on."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any


def without_folders(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the summary with every file name in it without its folder.

    Known are the files of its ``input``, ``samples`` and ``drillholes``, and the words of its
    ``command``; they are replaced wherever they stand, warnings included.

    Examples
    --------
    >>> without_folders({"input": {"file": "/home/me/b.csv"}, "warnings": ["/home/me/b.csv: 3"]})
    {'input': {'file': 'b.csv'}, 'warnings': ['b.csv: 3']}
    """
    known = sorted(_paths(summary), key=lambda path: (-len(path), path))
    if not known:
        return dict(summary)
    pattern = re.compile("|".join(map(re.escape, known)))
    shortened: dict[str, Any] = _replaced(summary, pattern)
    return shortened


def _paths(summary: Mapping[str, Any]) -> set[str]:
    """Return the paths with folders that a summary names."""
    words: list[str] = []
    for key in ("input", "samples", "drillholes"):
        facts = summary.get(key)
        if isinstance(facts, Mapping):
            words += _strings(facts.get("file"))
            words += _strings(facts.get("files"))
    command = summary.get("command")
    if isinstance(command, str):
        for word in _words(command):
            words.append(word.partition("=")[2] if word.startswith("--") and "=" in word else word)
    return {word for word in words if PurePath(word).name and PurePath(word).name != word}


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command)
    except ValueError:  # an odd quote: no shell's words
        return command.split()


def _strings(value: object) -> list[str]:
    """Return the strings in a value, however nested."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return [text for item in value for text in _strings(item)]
    return []


def _replaced(value: Any, pattern: re.Pattern[str]) -> Any:
    if isinstance(value, str):
        return pattern.sub(lambda found: PurePath(found[0]).name, value)
    if isinstance(value, Mapping):
        return {key: _replaced(item, pattern) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_replaced(item, pattern) for item in value]
    return value
