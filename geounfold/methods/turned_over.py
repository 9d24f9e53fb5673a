"""Fits and maps with top and bottom exchanged."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from geounfold.geometry.mesh import Floats
from geounfold.mapping.control_mesh import ControlMesh
from geounfold.methods.contract import BodyFit, Placed, Pointwise

OTHER_SIDE = {"top": "bottom", "bottom": "top"}


@dataclass(frozen=True, eq=False)
class TurnedOver:
    """A pointwise map with top and bottom exchanged: the flat space turned about its x axis."""

    rule: Pointwise

    @property
    def way_back(self) -> bool:
        """Whether the rule has an inverse."""
        return self.rule.way_back

    def to_flat(self, points: Floats) -> Placed:
        """Place folded points by the rule, then turn them over."""
        placed = self.rule.to_flat(points)
        return Placed(half_turn(placed.points), 1 - placed.stratigraphic, placed.anchored)

    def to_folded(self, points: Floats) -> Floats:
        """Turn flat points back over, then carry them by the rule."""
        return self.rule.to_folded(half_turn(points))


def half_turn(V: Floats) -> Floats:
    """Return flat points (n, 3) rotated by half a turn about the x axis, so not mirrored."""
    out: Floats = V * np.array([1.0, -1.0, -1.0])
    return out


def _over_control(control: ControlMesh) -> ControlMesh:
    return ControlMesh(
        control.folded,
        control.unfolded.with_vertices(half_turn(control.unfolded.V)),
        1 - control.stratigraphic,
    )


def turned_over(fit: BodyFit) -> BodyFit:
    """Return the fit with top and bottom exchanged: the flat space rotated about its x axis."""
    notes = dict(fit.notes)
    if "layers_follow" in notes:
        notes["layers_follow"] = OTHER_SIDE.get(str(notes["layers_follow"]), "mid")
    parts = fit.split
    return replace(
        fit,
        split=replace(parts, side=-parts.side, flipped_up=not parts.flipped_up),
        control=None if fit.control is None else _over_control(fit.control),
        shell=None if fit.shell is None else _over_control(fit.shell),
        surfaces={
            OTHER_SIDE.get(name, name): replace(
                pair, unfolded=pair.unfolded.with_vertices(half_turn(pair.unfolded.V))
            )
            for name, pair in fit.surfaces.items()
        },
        flattenings={OTHER_SIDE.get(name, name): f for name, f in fit.flattenings.items()},
        notes=notes,
        rule=None if fit.rule is None else TurnedOver(fit.rule),
    )
