"""What taking the faults out gave: poses, slips, and how well the fault blocks fit together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from geounfold.body.fault_cells import FaultCells
from geounfold.faults.block_map import Pose
from geounfold.faults.slips import VALUES, Slips
from geounfold.geometry.mesh import Floats

MOST_OVERLAP = 0.03
"""Share of the blocks that may overlap; 0 to 0.015 on 18 designed bodies."""

_KNOWN = ("outline", "shape", "given", "weld")
"""How strike slip may be settled; `prior` leaves it open."""


@dataclass(frozen=True, eq=False)
class FaultFit:
    """One fault between two fault blocks.

    Attributes
    ----------
    fault : str
        Name of the fault.
    foot, hanging : int
        Fault blocks below and above it.
    slips : Slips or None
        Places on both walls that meet; None if none do.
    turn : float
        Turn of the hanging wall against the footwall in the plane of the layers, degrees.
    resolved_by : str
        How strike slip was settled: ``outline``, ``shape`` of the cut-offs, ``given``, ``weld`` or
        ``prior``.
    along_sd : float
        Standard deviation of the slip along the fault, by the fit, in blocks.
    """

    fault: str
    foot: int
    hanging: int
    slips: Slips | None
    turn: float
    resolved_by: str
    along_sd: float

    @property
    def slip_known(self) -> bool:
        """Whether something marks the strike slip, and the blocks fit within one block."""
        fits = self.slips is not None and self.slips.misfit <= 1.0
        return fits and self.resolved_by in _KNOWN

    def row(self, scale: float) -> dict[str, Any]:
        """Return the fault as a row for table and summary; lengths in the data's unit.

        Parameters
        ----------
        scale : float
            Length of a block.
        """
        out: dict[str, Any] = {
            "fault": self.fault,
            "footwall_block": self.foot,
            "hanging_wall_block": self.hanging,
            "pairs": 0 if self.slips is None else len(self.slips.gap),
        }
        for name in VALUES:
            value = None if self.slips is None else getattr(self.slips, name)
            low, mid, high = _quantiles(value)
            out |= {name: mid, f"{name}_p10": low, f"{name}_p90": high}
        s = self.slips
        return out | {
            "turn": self.turn,
            "misfit": None if s is None else s.misfit * scale,
            "gap_area": 0.0 if s is None else s.area(1.0) * scale**2,
            "overlap_area": 0.0 if s is None else s.area(-1.0) * scale**2,
            "along_sd": self.along_sd * scale,
            "resolved_by": self.resolved_by,
            "slip_known": self.slip_known,
        }


def _quantiles(values: Floats | None) -> tuple[float | None, ...]:
    if values is None:
        return (None, None, None)
    return tuple(float(q) for q in np.quantile(values, (0.1, 0.5, 0.9)))


@dataclass(frozen=True, eq=False)
class FaultResult:
    """A body whose fault blocks were unfolded and joined.

    Attributes
    ----------
    cells : FaultCells
        What gives a folded point its fault block.
    poses : tuple of Pose
        Of every fault block, working units.
    groups : tuple of int
        First block of each block's group: blocks of other groups were not joined to it.
    faults : tuple of FaultFit
        Every fault between two blocks.
    overlap : float
        Share of the blocks whose images lie in the image of another fault block.
    scale : float
        Length of a block in the data's unit.
    notes : tuple of str
        What was mended, joined or left open, one sentence each.
    """

    cells: FaultCells
    poses: tuple[Pose, ...]
    groups: tuple[int, ...]
    faults: tuple[FaultFit, ...]
    overlap: float
    scale: float
    notes: tuple[str, ...] = ()

    def rows(self) -> list[dict[str, Any]]:
        """Return a row per fault and pair of blocks."""
        return [fault.row(self.scale) for fault in self.faults]

    def warnings(self) -> list[str]:
        """Return what a user should know of the faults, one sentence each."""
        out = list(self.notes)
        open_ = [f"{f.fault} ({f.foot}|{f.hanging})" for f in self.faults if not f.slip_known]
        if open_:
            out.append(
                f"nothing marks the strike slip along {', '.join(open_)}; it is taken to be small: "
                "give --slip-direction if it is known"
            )
        if self.overlap > MOST_OVERLAP:
            out.append(
                f"{self.overlap:.1%} of the blocks overlap those of another fault block in the "
                "flat space: fault surfaces and blocks disagree"
            )
        return out

    @property
    def table(self) -> pd.DataFrame:
        """The rows as a DataFrame."""
        return pd.DataFrame(self.rows())

    def slips(self) -> pd.DataFrame:
        """Return all slip vectors: places on both walls, throw, heave, strike slip, rake, gap."""
        parts = []
        for fault in self.faults:
            s = fault.slips
            if s is None:
                continue
            columns: dict[str, Any] = {
                "fault": fault.fault,
                "footwall_block": fault.foot,
                "hanging_wall_block": fault.hanging,
                "stratigraphic": np.array([0.1, 0.3, 0.5, 0.7, 0.9])[s.level],
            }
            for name, places in (("foot", s.foot), ("hanging", s.hanging)):
                columns |= {f"{name}_{axis}": places[:, k] for k, axis in enumerate("xyz")}
            columns |= {name: getattr(s, name) for name in VALUES}
            columns["gap"] = s.gap * self.scale
            parts.append(pd.DataFrame(columns))
        return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
