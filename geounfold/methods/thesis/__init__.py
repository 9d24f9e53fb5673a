"""The thesis's own method (chapter 3), kept as a reference to compare with."""

from geounfold.methods.thesis.build import ThesisMesh, thesis_control
from geounfold.methods.thesis.options import ThesisOptions

__all__ = ["ThesisMesh", "ThesisOptions", "thesis_control"]
