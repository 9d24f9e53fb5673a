"""A verdict before the work: what unfolding gains for one body, its samples and its variogram."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from geounfold.errors import InputError
from geounfold.estimation import (
    FlatSamples,
    Structure,
    Variogram,
    fit_variogram,
    flat_samples,
    hole_numbers,
)
from geounfold.gain.arms import (
    Limbs,
    Places,
    best_planes,
    limbs_of,
    mean_normal,
    places_of,
    rotation_of,
    thickness_of,
    turn_between,
)
from geounfold.gain.expected import Truth, expected_error
from geounfold.geometry.mesh import Floats, Ints
from geounfold.geometry.rotations import rotation_from_angles
from geounfold.io.grade_values import GradeRules, grade_rules

RIVALS = ("isotropic", "plane", "limbs", "stratigraphic")

_TARGETS = 160  # points of the body at which errors are foretold
_MOST_DRAWS = 40  # rounds of points drawn in the body's box
_ALONG = (1.0, 0.5)  # ranges tried along a plane, over that along the layer
_ACROSS = (1.0, 2.0, 4.0)  # and across it, over that across the layer
_ROUND = 5  # ranges tried without a plane
_APART = 1e3  # extents between limbs, so that no sample of one estimates another
_BOUNDS = {  # realised less foretold gain, between which nine of ten runs of the study fall
    "isotropic": (-0.19, 0.13),
    "plane": (-0.13, 0.21),
    "limbs": (-0.16, 0.10),
    "stratigraphic": (-0.12, 0.10),
}
_SERVE = {
    "isotropic": "one range without a direction serves",
    "plane": "a plane serves",
    "limbs": "a plane for each limb serves",
}
_SERVES = 0.03  # gain below which another arm serves as well: less than the study's runs scatter
_PAYS = 0.10  # gain from which the verdict is that unfolding pays


@dataclass(frozen=True, eq=False)
class Assessment:
    """What to expect of unfolding.

    Attributes
    ----------
    gains : DataFrame
        A row for each rival (isotropic, plane, limbs, stratigraphic): the error of kriging in its
        coordinates, that in the unfolded ones, both over the standard deviation without nugget;
        gain (1 - unfolded / rival), and low and high, between which nine of ten runs of the study
        fall.
    turn_in_range, turn_in_spacing : float
        By how much the layer turns over the variogram's range and over the spacing, degrees.
    off_plane : float
        Degrees off the layer's mean plane within which nine of ten samples lie.
    limbs : int
        Number of domains of like dip.
    spacing, thickness : float
        Median distance of samples to the nearest other hole along the layer, and mean thickness.
    variogram : Variogram
        In the unfolded space.
    samples : FlatSamples
    verdict : str
        One sentence.
    """

    gains: pd.DataFrame
    turn_in_range: float
    turn_in_spacing: float
    off_plane: float
    limbs: int
    spacing: float
    thickness: float
    variogram: Variogram
    samples: FlatSamples
    verdict: str

    @property
    def nugget(self) -> float:
        """Nugget over the sill."""
        return self.variogram.nugget / self.variogram.sill

    def lines(self) -> list[str]:
        """Return the answer as text."""
        along, _, across = self.variogram.ranges
        out = [
            f"the layer turns by {self.turn_in_range:.0f} degrees over the range of {along:.4g} "
            f"and by {self.turn_in_spacing:.0f} over the spacing of {self.spacing:.4g}",
            f"nine of ten samples lie within {self.off_plane:.0f} degrees of one plane",
            f"nugget {self.nugget:.0%}; spacing {self.spacing / along:.2g} ranges; range across "
            f"{across / self.thickness:.2g} of the thickness of {self.thickness:.4g}",
        ]
        out += [
            f"error expected against {name}: {row.gain:.0%} less ({row.low:.0%} to {row.high:.0%})"
            for name, row in zip(self.gains.index, self.gains.itertuples(), strict=True)
        ]
        return [*out, self.verdict]

    def facts(self) -> dict[str, Any]:
        """Return the figures for a summary."""
        return {
            "gains": {str(name): dict(row) for name, row in self.gains.iterrows()},
            "turn_in_range": self.turn_in_range,
            "turn_in_spacing": self.turn_in_spacing,
            "off_plane": self.off_plane,
            "limbs": self.limbs,
            "nugget": self.nugget,
            "spacing": self.spacing,
            "thickness": self.thickness,
            "variogram": self.variogram.facts(),
            "samples": self.samples.facts(),
            "verdict": self.verdict,
        }


def assess(
    unfolding: Any,
    samples: pd.DataFrame,
    *,
    grade: str,
    hole: str | None = None,
    variogram: Variogram | None = None,
    values: GradeRules | None = None,
) -> Assessment:
    """Foretell by how much unfolding lowers the error of kriging, from the samples at hand.

    The true covariance is taken to be the variogram of the samples in the unfolded space. The error
    of kriging in every kind of coordinates then follows from the samples' places (`expected`). The
    rivals have the best of several ranges, and of several planes.

    Parameters
    ----------
    unfolding : Unfolding or UnfoldingMap
        The body's map.
    samples : DataFrame
        Folded samples with coordinates, the grade and the hole.
    grade, hole : str
        Columns; the hole's is found by name.
    variogram : Variogram, optional
        In the unfolded space; a nugget and one structure are fitted by default.
    values : GradeRules or mapping, optional
        How the grade's values are read.

    Raises
    ------
    InputError
        A column is missing, holes are unknown or fewer than three, or no sample lies in the map.
    """
    carrier = getattr(unfolding, "map", unfolding)
    flat = flat_samples(
        carrier, samples, grade=grade, hole=hole, rules=grade_rules(values), soft_boundary=0.0,
        source=str(samples.attrs.get("source", "the samples")),
    )  # fmt: skip
    return assess_samples(carrier, flat, variogram)


def assess_samples(
    carrier: Any, flat: FlatSamples, variogram: Variogram | None = None
) -> Assessment:
    """Return the assessment of samples that are carried to the unfolded space, as `assess`."""
    if flat.holes is None:
        raise InputError(
            "assess needs to know the holes: give the name of the samples' hole column"
        )
    holes = hole_numbers(flat.holes)
    check_three_holes(int(holes.max()) + 1, "in the body")
    model = variogram
    if model is None:
        model = fit_variogram(
            flat.points, flat.grades, holes=holes, anisotropy="transverse", structures=1
        ).model
    own, there = places_of(carrier, flat.folded)
    holes, grades = holes[there], flat.grades[there]
    targets = places_of(carrier, points_in_body(carrier, flat.folded))[0]
    return assessed(own, holes, grades, targets, model, flat)


def assessed(  # what assess has found; the study calls it too
    own: Places,
    holes: Ints,
    grades: Floats,
    targets: Places,
    model: Variogram,
    flat: FlatSamples,
) -> Assessment:
    """Return the assessment of samples and targets whose places are known."""
    if not model.structures:
        raise InputError(
            "the variogram in the unfolded space is pure nugget: no coordinates help; check the "
            "grades, or give --variogram"
        )
    spacing = spacing_of(own.flat, holes)
    errors = foretold(own, holes, grades, targets, model, spacing)
    gains = pd.DataFrame(
        {
            "error": {name: errors[name] for name in RIVALS},
            "unfolded": errors["unfolded"],
        }
    )
    gains["gain"] = 1 - gains["unfolded"] / gains["error"]
    below, above = np.array([_BOUNDS[name] for name in RIVALS]).T
    gains["low"], gains["high"] = gains["gain"] + below, gains["gain"] + above
    plane = mean_normal(own.normal)
    off = np.degrees(np.arccos(np.clip(np.abs(own.normal @ plane), 0, 1)))
    return Assessment(
        gains=gains,
        turn_in_range=turn_between(own, model.ranges[0]),
        turn_in_spacing=turn_between(own, spacing),
        off_plane=float(np.quantile(off, 0.9)),
        limbs=len(limbs_of(own.normal).axes),
        spacing=spacing,
        thickness=thickness_of(own),
        variogram=model,
        samples=flat,
        verdict=_verdict(gains["gain"]),
    )


def _verdict(gain: pd.Series) -> str:
    """Return the sentence: the simplest rival that serves as well, or what unfolding gains."""
    folded = gain[list(_SERVE)]
    level = gain["stratigraphic"] < _SERVES
    more = "; x, y and height in the layer, which unfolding gives too, do as well" if level else ""
    for name, words in _SERVE.items():
        if gain[name] < _SERVES:
            return f"{words} as well here: unfolding is expected to gain {gain[name]:.0%} on it"
    best, least = str(folded.idxmin()), float(folded.min())
    word = "to pay here" if least >= _PAYS else "to gain little here"
    return f"unfolding is expected {word}: {least:.0%} less error than the best rival, {best}{more}"


def points_in_body(carrier: Any, around: Floats) -> Floats:
    """Return points (n, 3) drawn evenly in the body of a map, with a fixed seed.

    Raises
    ------
    InputError
        The map's body is too thin in the box of its samples.
    """
    rng = np.random.default_rng(0)
    mesh = getattr(carrier, "whole", None)
    corners = around if mesh is None else carrier.frame.to_world(mesh.folded.V)
    low, high = corners.min(axis=0), corners.max(axis=0)
    found: list[Floats] = []
    count = 0
    for _ in range(_MOST_DRAWS):
        P = low + (high - low) * rng.random((2000, 3))
        carried = carrier.carry(P)
        inside = carrier.in_body(P, carried) if hasattr(carrier, "in_body") else carried.inside
        found.append(P[inside])
        count += int(inside.sum())
        if count >= _TARGETS:
            break
    if count < _TARGETS // 4:
        raise InputError("too little of the body lies in the box around it to assess it")
    return np.concatenate(found)[:_TARGETS]


def check_three_holes(count: int, which: str) -> None:
    """Raise InputError if so many holes are too few to assess a body by."""
    if count < 3:
        raise InputError(f"assess needs samples of three holes or more {which}, not of {count}")


def spacing_of(flat: Floats, holes: Ints) -> float:
    """Return the median distance along the layer from a hole's middle to the nearest other one."""
    from scipy.spatial import cKDTree

    count = np.bincount(holes)
    middles = np.column_stack([np.bincount(holes, flat[:, k]) / count for k in range(2)])
    near = np.asarray(cKDTree(middles).query(middles, k=2)[0])[:, 1]
    return float(np.median(near))


# ------------------------------------------------------------------------------ errors of the arms


def foretold(
    own: Places, holes: Ints, grades: Floats, targets: Places, model: Variogram, spacing: float
) -> dict[str, float]:
    """Return the error to expect in each arm's coordinates, over the deviation without nugget."""
    truth = Truth(model, own.flat, targets.flat, holes)
    out = {"unfolded": expected_error(truth, own.flat, targets.flat, model)}
    out["isotropic"] = min(
        expected_error(truth, own.folded, targets.folded, tried) for tried in _round(model)
    )
    normals = [mean_normal(own.normal), *best_planes(own.folded, grades, spacing)]
    out["plane"] = min(
        expected_error(truth, own.folded, targets.folded, replace(tried, rotation=rotation_of(n)))
        for n in normals
        for tried in _flattened(model)
    )
    limbs = limbs_of(own.normal)
    rows, columns = limb_coordinates(limbs, own), limb_coordinates(limbs, targets)
    out["limbs"] = min(expected_error(truth, rows, columns, tried) for tried in _flattened(model))
    thickness = thickness_of(own)
    rows, columns = own.stratigraphic(thickness), targets.stratigraphic(thickness)
    out["stratigraphic"] = min(
        expected_error(truth, rows, columns, tried) for tried in _flattened(model)
    )
    deviation = np.sqrt(truth.structured)
    return {name: error / float(deviation) for name, error in out.items()}


def limb_coordinates(limbs: Limbs, places: Places) -> Floats:
    """Return coordinates (n, 3) in the plane of each place's limb; limbs lie far apart."""
    own = limbs.of(places.normal)
    out = np.empty_like(places.folded)
    for k, axis in enumerate(limbs.axes):
        some = own == k
        out[some] = places.folded[some] @ rotation_from_angles(*rotation_of(axis)).T
        out[some, 0] += _APART * k * 1e4
    return out


def _round(model: Variogram) -> Iterator[Variogram]:
    """Yield models of one range each."""
    along, _, across = model.ranges
    for r in np.geomspace(across, along, _ROUND):
        yield _scaled(model, (float(r), float(r), float(r)))


def _flattened(model: Variogram) -> Iterator[Variogram]:
    """Yield models of ranges along and across a plane."""
    along, _, across = model.ranges
    for a in _ALONG:
        for b in _ACROSS:
            r = a * along
            yield _scaled(model, (r, r, min(b * across, r)))


def _scaled(model: Variogram, ranges: tuple[float, float, float]) -> Variogram:
    """Return a model whose largest ranges are these, its structures in proportion, unturned."""
    largest = np.array(model.ranges)
    structures = tuple(
        Structure(s.kind, s.sill, tuple((np.array(s.ranges) / largest * ranges).tolist()))
        for s in model.structures
    )
    return replace(model, structures=structures, rotation=(0.0, 0.0, 0.0))
