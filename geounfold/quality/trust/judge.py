"""The judge: good, fair or poor, with reasons, from the signs of a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from geounfold.body.working_frame import Frame
from geounfold.geometry.mesh import Bools, Floats
from geounfold.quality.trust.signs import Signs

WORDS = ("good", "fair", "poor")


@dataclass(frozen=True)
class Reason:
    """One reason not to trust an unfolding.

    Attributes
    ----------
    what : str
        What is wrong, one sentence with its figure.
    where : (x, y, z) or None
        Middle of the largest place where it shows, in the data's coordinates.
    blocks : int
        Number of blocks over and under the places where it shows.
    do : str
        What to look at or to try.
    word : str
        fair or poor.
    """

    what: str
    where: tuple[float, float, float] | None
    blocks: int
    do: str
    word: str


@dataclass(frozen=True)
class Trust:
    """How far to trust an unfolding.

    Attributes
    ----------
    word : str
        ``good``: no sign that the layers are wrong; ``fair``: small ones; ``poor``: signs that
        were found on wrong answers.
    reasons : tuple of Reason
        The worst first.
    """

    word: str
    reasons: tuple[Reason, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return it for the summary."""
        return {"word": self.word, "reasons": [asdict(reason) for reason in self.reasons]}

    def sentence(self) -> str:
        """Return the word and the worst reason in one sentence."""
        if not self.reasons:
            return f"trust is {self.word}"
        worst = self.reasons[0]
        where = (
            ""
            if worst.where is None
            else " around ({})".format(", ".join(f"{c:.6g}" for c in worst.where))
        )
        return f"trust is {self.word}: {worst.what}{where}; {worst.do}"


@dataclass(frozen=True)
class Criterion:
    """A sign, and from which value on it speaks against an answer.

    Attributes
    ----------
    name : str
        The sign's.
    fair, poor : float
        Values from which the word is at most fair, and poor.
    what, do : str
        Texts of the reason; ``{:.1%}`` or the like takes the value.
    below : bool
        Whether small values are bad.
    """

    name: str
    fair: float
    poor: float
    what: str
    do: str
    below: bool = False

    def word(self, value: float) -> str:
        """Return what a value of the sign means; NaN, not judged, is good."""
        sign = -1 if self.below else 1
        if sign * value > sign * self.poor:
            return "poor"
        return "fair" if sign * value > sign * self.fair else "good"

    def reason(
        self, value: float, where: tuple[float, float, float] | None, blocks: int, of: str = ""
    ) -> Reason | None:
        """Return the reason that a value of the sign gives; None if it speaks for good.

        Parameters
        ----------
        value : float
            The sign.
        where : (x, y, z) or None
            The place, in the data's coordinates.
        blocks : int
            Number of blocks there.
        of : str
            Name of the body or part, if there are several.
        """
        word = self.word(value)
        if word == "good":
            return None
        what = self.what.format(value)
        return Reason(f"{of}: {what}" if of else what, where, blocks, self.do, word)

    def excess(self, value: float) -> float:
        """Return the value over the poor one: how bad it is, comparable among criteria."""
        if not np.isfinite(value):
            return 0.0
        return self.poor / max(value, 1e-9) if self.below else value / self.poor


NEVER = float("inf")

CRITERIA = (
    Criterion(
        "off",
        0.01,
        0.03,
        "{:.1%} of the body's top and bottom does not come to lie at the flat top or bottom",
        "look there for a fault, a branch, a second sheet or a bulge, and unfold such parts one by "
        "one",
    ),
    Criterion(
        "length",
        0.08,
        0.12,
        "lengths change by more than 30 % on {:.1%} of the body's top and bottom",
        "look there for a limb or a hinge that was laid out wrongly",
    ),
    Criterion(
        "level",
        0.02,
        0.05,
        "the mid surface lies outside the body on {:.1%} of its extent",
        "look there for a fault that sets the layer off, and unfold its sides one by one",
    ),
    Criterion(
        "step",
        0.4,
        0.45,
        "the top or the bottom steps along a line of {:.2f} times the body's width",
        "look there for a fault or a repeat, and unfold its sides one by one",
    ),
    Criterion(
        "breadth",
        2.4,
        2.4,
        "the body is only {:.1f} times as wide as thick: which direction is its thickness cannot "
        "be told from coordinates",
        "compare the layers with known ones, or give the surfaces by --top and --bottom",
        below=True,
    ),
    Criterion(
        "rough",
        0.05,
        0.05,
        "top and bottom are rough: their levels are {:.0%} of the thickness off in the mean",
        "smooth the body's surfaces, or take its layers to be no nearer than that",
    ),
    Criterion(
        "strays",
        0.01,
        0.02,
        "the body is ragged: {:.1%} of its blocks lie more than a block outside a smooth surface",
        "model the domain with a smoother boundary, or take its layers to be no nearer than that",
    ),
    Criterion(
        "ends",
        0.05,
        NEVER,
        "{:.1%} of the body's surface between top and rim lies off both",
        "look there for ends that are cut off obliquely, and leave out the blocks past them",
    ),
)
"""What is judged.  The limits are measured on bodies with a known truth; see results/trust.md."""


OUT = Criterion(
    "out",
    0.01,
    0.03,
    "{:.1%} of the blocks lie more than a quarter of the thickness above top or below bottom",
    "leave them out, or unfold them as a body of their own",
)
_BEYOND = (-0.25, 1.25)
"""Stratigraphic coordinates between which a block may lie; sound bodies have up to 0.7 % beyond."""


def grade(signs: Signs) -> str:
    """Return the word for the signs of one body."""
    return max((c.word(getattr(signs, c.name)) for c in CRITERIA), key=WORDS.index)


def score(signs: Signs) -> tuple[int, float]:
    """Return the word's number and the sum of all excesses: lower is better."""
    excess = sum(c.excess(getattr(signs, c.name)) for c in CRITERIA)
    return WORDS.index(grade(signs)), excess


def judge(
    bodies: Sequence[Signs],
    names: Sequence[str],
    frame: Frame,
    points: Floats,
    stratigraphic: Floats,
) -> Trust:
    """Return the trust of a run: that of its worst body, with the reasons of all.

    Parameters
    ----------
    bodies : sequence of Signs
        One per body, or per sheet part of them, working units.
    names : sequence of str
        What the reasons call each; empty if there is one.
    frame : Frame
        Converts places to the data's coordinates.
    points : (n, 3) float
        The blocks, in the data's coordinates.
    stratigraphic : (n,) float
        Their levels; NaN for those without an image.
    """
    beyond = out_of_layer(stratigraphic)
    return judge_counted(bodies, names, frame, points[beyond], float(beyond.mean()))


def out_of_layer(stratigraphic: Floats) -> Bools:
    """Return which blocks lie more than a quarter of the thickness out of the layer, (n,)."""
    out: Bools = (stratigraphic < _BEYOND[0]) | (stratigraphic > _BEYOND[1])
    return out


def judge_counted(
    bodies: Sequence[Signs], names: Sequence[str], frame: Frame, beyond: Floats, share: float
) -> Trust:
    """Return the trust of a run from the blocks out of the layer.

    Parameters
    ----------
    bodies, names, frame
        As `judge` takes them.
    beyond : (k, 3) float
        Blocks that `out_of_layer` names, in the data's coordinates.
    share : float
        Their share of all blocks.
    """
    found: list[tuple[float, Reason | None]] = []
    for signs, name in zip(bodies, names, strict=True):
        for criterion in CRITERIA:
            value = getattr(signs, criterion.name)
            place = signs.places.get(criterion.name)
            where = None if place is None else _place(frame.to_world(place.folded[None])[0])
            blocks = 0 if place is None else round(place.volume)
            found.append((criterion.excess(value), criterion.reason(value, where, blocks, name)))
    count = len(beyond)
    where = _place(np.median(beyond, axis=0)) if count else None
    found.append((OUT.excess(share), OUT.reason(share, where, count)))
    told = [(excess, reason) for excess, reason in found if reason is not None]
    told.sort(key=lambda pair: (-WORDS.index(pair[1].word), -pair[0]))
    return Trust(told[0][1].word if told else "good", tuple(reason for _, reason in told))


def _place(point: Floats) -> tuple[float, float, float]:
    """Return a point (3,) as plain numbers."""
    x, y, z = point.tolist()
    return x, y, z
