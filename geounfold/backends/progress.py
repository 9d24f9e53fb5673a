"""How far a long stage has come: told from inside, heard by whoever shows it.

A stage that is not listened to costs nothing. Ranges nest, so a loop tells its own share only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[float], None]

_listener: ContextVar[Listener | None] = ContextVar("progress of a stage", default=None)


def told(share: float) -> None:
    """Tell how far the stage, or the part of it that `within` sets, has come: 0 to 1."""
    listener = _listener.get()
    if listener is not None:
        listener(share)


@contextmanager
def heard_by(listener: Listener | None) -> Iterator[None]:
    """Give what is told inside to a listener."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


@contextmanager
def within(low: float, high: float) -> Iterator[None]:
    """Make what is told inside a part of the stage, from ``low`` to ``high``, and tell both ends.

    Examples
    --------
    >>> heard = []
    >>> with heard_by(heard.append), within(0.5, 1.0):
    ...     told(0.5)
    >>> heard
    [0.5, 0.75, 1.0]
    """
    outer = _listener.get()
    if outer is None:
        yield
        return
    outer(low)
    with heard_by(lambda share: outer(low + share * (high - low))):
        yield
    outer(high)
