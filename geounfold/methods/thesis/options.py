"""Options of the thesis's method."""

from __future__ import annotations

from dataclasses import dataclass

from geounfold.errors import check_one_of, check_whole

AXES = ("principal", "up")


@dataclass(frozen=True, kw_only=True)
class ThesisOptions:
    """Options of ``thesis``.

    Parameters
    ----------
    axis : str
        Direction of the pairing: ``principal``, the axis of least extent (section 3.2.1), or
        ``up``.
    trim : int
        Rings of faces left out along each side's border, where remeshing rounds the hull.

    Raises
    ------
    OptionError
        A value out of its range.
    """

    axis: str = "principal"
    trim: int = 1

    def __post_init__(self) -> None:
        check_one_of("thesis_options.axis", self.axis, AXES)
        check_whole("thesis_options.trim", self.trim, 0)
