"""The least that must hold: one body, one call, one proof."""

import geounfold as gu


def test_a_folded_body_unfolds_and_is_proved() -> None:
    body = gu.simulate("slab", blocks=1000)
    unfolding = gu.unfold(body.folded)
    assert unfolding.certificate.injective
