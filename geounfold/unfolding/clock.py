"""The stages of a run: their seconds, their log, and how far the whole has come."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import signature
from typing import Any

from geounfold.backends.progress import heard_by

SHARES = {
    "frame": 0.10,
    "hull": 0.13,
    "split": 0.04,
    "sheet": 0.50,
    "map": 0.06,
    "certificate": 0.08,
    "quality": 0.09,
}
"""Share of an unfolding's time that each stage takes, in their order.

Rounded means of sim_case_1, sim_case_2 and recumbent; the sheet took 0.45 to 0.62 there.
"""

_BODIES = ("hull", "split", "sheet")  # stages that every body has
_SAME = {"thesis": "sheet"}  # the thesis's method takes the sheet's place
_LEAST = 0.002  # least growth of the share that is told

Progress = Callable[..., Any]
"""Called with a stage's name as it begins; one of two arguments also gets the share done, 0 to 1,
and is called inside long stages too."""

_log = logging.getLogger("geounfold")


class Clock:
    """Seconds per stage; stages are logged, and told to whoever shows them.

    Parameters
    ----------
    progress : callable, optional
        See Progress.

    Attributes
    ----------
    seconds : dict of float
        By stage.
    """

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress
        self._shares = progress is not None and takes_two(progress)
        self._done, self._told = 0.0, -1.0
        self._body, self._bodies = 0, 1

    def body(self, number: int, count: int) -> None:
        """Note which of the bodies is fitted, from 0."""
        self._body, self._bodies = number, count

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage."""
        _log.info("stage %s", name)
        low, high = self._range(_SAME.get(name, name))
        self._tell(name, low, first=True)

        def hear(share: float) -> None:
            self._tell(name, low + share * (high - low))

        start = time.perf_counter()
        try:
            with heard_by(hear if self._shares else None):
                yield
        finally:
            taken = time.perf_counter() - start
            self.seconds[name] = self.seconds.get(name, 0.0) + taken
            _log.debug("%s took %.2f s", name, taken)
        self._done = max(self._done, high)

    def over(self) -> None:
        """Tell that the run is over."""
        if self._shares:
            self._tell("done", 1.0, first=True)

    def _range(self, name: str) -> tuple[float, float]:
        """Return the shares done at a stage's begin and end."""
        if name not in SHARES:
            return self._done, self._done
        names = list(SHARES)
        low = sum(SHARES[n] for n in names[: names.index(name)])
        high = low + SHARES[name]
        if name in _BODIES:
            begin = sum(SHARES[n] for n in names[: names.index(_BODIES[0])])
            span = sum(SHARES[n] for n in _BODIES)
            low, high = (
                begin + (self._body + (at - begin) / span) * span / self._bodies
                for at in (low, high)
            )
        return low, high

    def _tell(self, name: str, done: float, *, first: bool = False) -> None:
        if self._progress is None:
            return
        self._done = min(max(self._done, done), 1.0)
        if not self._shares:
            if first:
                self._progress(name)
        elif first or self._done >= self._told + _LEAST:
            self._told = self._done
            self._progress(name, self._done)


def takes_two(progress: Progress) -> bool:
    """Return whether a function takes a name and a share."""
    try:
        signature(progress).bind("", 0.0)
    except (TypeError, ValueError):
        return False
    return True
