"""Bodies mended on their lattice before a hull is put around them."""

from geounfold.body.mending.mend import WORDS, Mended, mend
from geounfold.body.mending.record import MendingRecord

__all__ = ["WORDS", "Mended", "MendingRecord", "mend"]
