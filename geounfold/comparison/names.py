"""The names that a user chooses from a table: one, several or ``all``."""

from __future__ import annotations

from collections.abc import Iterable

from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS
from geounfold.methods import METHODS


def flattener_names(chosen: str | Iterable[str]) -> list[str]:
    """Return the flatteners chosen; ``all`` means those that are free software throughout.

    Raises
    ------
    OptionError
        No name, or one that is not in FLATTENERS.
    """
    free = [name for name, flattener in FLATTENERS.items() if flattener.free]
    return _names("flatteners", chosen, list(FLATTENERS), free)


def method_names(chosen: str | Iterable[str]) -> list[str]:
    """Return the methods chosen; ``all`` means every one.

    Raises
    ------
    OptionError
        No name, or one that is not in METHODS.
    """
    return _names("methods", chosen, list(METHODS), list(METHODS))


def _names(kind: str, chosen: str | Iterable[str], valid: list[str], every: list[str]) -> list[str]:
    """Return the names chosen, each of them in ``valid``; ``all`` means those in ``every``."""
    if chosen == "all":
        return every
    names = [chosen] if isinstance(chosen, str) else list(chosen)
    unknown = [name for name in names if name not in valid]
    if unknown or not names:
        words = ", ".join(unknown) or "none"
        raise OptionError(f"unknown {kind}: {words}; choose from {', '.join(valid)}, all")
    return names
