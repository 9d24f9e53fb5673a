"""What unfolding is worth: a verdict before the work, and a company's own comparison after it.

`arms` holds the coordinates that are compared, `expected` the error to expect in each, `assessment`
the verdict, `trial` the kriging of every arm, and `from_holes` the comparison by left-out holes.
"""

from geounfold.gain.assessment import Assessment, assess
from geounfold.gain.from_holes import HolesStudy, study_holes

__all__ = ["Assessment", "HolesStudy", "assess", "study_holes"]
