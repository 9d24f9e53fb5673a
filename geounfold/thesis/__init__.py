"""The thesis's own method (chapter 3), kept as a reference to compare with."""

from geounfold.thesis.build import ThesisMesh, thesis_control
from geounfold.thesis.options import ThesisOptions

__all__ = ["ThesisMesh", "ThesisOptions", "thesis_control"]
