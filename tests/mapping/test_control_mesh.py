"""Control meshes: the datum that the unfolded body is levelled by."""

import numpy as np
import pytest

from geounfold.errors import OptionError
from geounfold.mapping.control_mesh import Datum


def test_datums_level_their_surface():
    rng = np.random.default_rng(2)
    bottom, top = rng.uniform(-4, -2, 20), rng.uniform(1, 5, 20)
    assert np.array_equal(Datum("mid", -3, 3).z(top, bottom, top), top)
    assert np.allclose(Datum("top", -3, 3).z(top, bottom, top), 3)
    assert np.allclose(Datum("bottom", -3, 3).z(bottom, bottom, top), -3)
    both = Datum("proportional", -3, 3)
    assert np.allclose(both.z(top, bottom, top), 3)
    assert np.allclose(both.z(bottom, bottom, top), -3)
    # A shear keeps every thickness.
    sheared = Datum("top", -3, 3)
    assert np.allclose(sheared.z(top, bottom, top) - sheared.z(bottom, bottom, top), top - bottom)


def test_an_unknown_datum_is_refused():
    with pytest.raises(OptionError, match="mid, top, bottom, proportional"):
        Datum("sea", -1, 1)
