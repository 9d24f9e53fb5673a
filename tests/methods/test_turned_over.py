"""Maps turned over by half a turn."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from geounfold.methods.turned_over import TurnedOver


def test_turned_over_is_a_half_turn():
    rule = SimpleNamespace(
        way_back=True,
        to_flat=lambda P: SimpleNamespace(points=P, stratigraphic=P[:, 2], anchored=P[:, 0] > 0),
        to_folded=lambda Q: Q,
    )
    over = TurnedOver(rule)
    P = np.array([[1.0, 2, 0.3]])
    assert over.to_flat(P).points.tolist() == [[1, -2, -0.3]]
    assert over.to_flat(P).stratigraphic.tolist() == [0.7]
    assert over.to_folded(over.to_flat(P).points).tolist() == P.tolist()
    assert over.way_back
