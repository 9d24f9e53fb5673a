"""Bodies that bring their own truth, as the simulated ones do."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from geounfold.geometry.mesh import Floats


@runtime_checkable
class KnownBody(Protocol):
    """A body whose unfolding is known."""

    @property
    def name(self) -> str:
        """Its name in the table."""

    @property
    def folded(self) -> Floats:
        """Block centroids, (n, 3)."""

    @property
    def truth(self) -> Floats:
        """True unfolded position of each block, (n, 3)."""

    @property
    def stratigraphic(self) -> Floats:
        """True stratigraphic coordinate of each block, (n,): 0 at the bottom, 1 at the top."""
