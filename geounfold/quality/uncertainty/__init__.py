"""How far off an answer may be: the spread of other unfoldings, on a scale set by known truths."""

from geounfold.quality.uncertainty.calibration import calibrated
from geounfold.quality.uncertainty.laid_on import laid_on
from geounfold.quality.uncertainty.position import PositionUncertainty, joined
from geounfold.quality.uncertainty.reason import with_spread_reason
from geounfold.quality.uncertainty.spread import Spread

__all__ = ["PositionUncertainty", "Spread", "calibrated", "joined", "laid_on", "with_spread_reason"]
