"""How far a run has come, and how long it will take: from what stages took on other bodies."""

from __future__ import annotations

import time
from collections.abc import Callable

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

_SAME = {"thesis": "sheet"}  # the thesis's method stands in the sheet's place
_ALMOST = 0.95  # of a stage that takes longer than foreseen


class Forecast:
    """Share done and seconds left of a run whose stages are told as they begin.

    Nothing is foreseen before the first known stage is over, in a run of other stages, or once a
    stage comes again (several bodies).

    Parameters
    ----------
    clock : callable, optional
        Seconds, for tests.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._start = self._began = clock()
        self._stage = ""
        self._taken: dict[str, float] = {}
        self._lost = False

    @property
    def elapsed(self) -> float:
        """Seconds since the run began."""
        return self._clock() - self._start

    def begin(self, stage: str) -> None:
        """Note that a stage begins, and that the one before is over."""
        now = self._clock()
        if self._stage in SHARES:
            self._taken[self._stage] = now - self._began
        self._stage, self._began = _SAME.get(stage, stage), now
        self._lost = self._lost or self._stage in self._taken

    @property
    def done(self) -> float | None:
        """Share of the run that is over, 0 to 1; None where nothing is foreseen."""
        known = self._known()
        if known is None:
            return None
        pace, before = known
        share = SHARES[self._stage]
        return before + share * min((self._clock() - self._began) / (pace * share), _ALMOST)

    @property
    def left(self) -> float | None:
        """Seconds that are left; None where nothing is foreseen."""
        known = self._known()
        if known is None:
            return None
        pace, before = known
        share = SHARES[self._stage]
        rest = max(pace * share - (self._clock() - self._began), 0.0)
        return rest + pace * max(1.0 - before - share, 0.0)

    def _known(self) -> tuple[float, float] | None:
        """Return the seconds that the whole takes, and the share before the stage."""
        spent = sum(self._taken.values())
        if self._lost or self._stage not in SHARES or spent <= 0:
            return None
        names = list(SHARES)
        before = sum(SHARES[name] for name in names[: names.index(self._stage)])
        return spent / sum(SHARES[name] for name in self._taken), before
