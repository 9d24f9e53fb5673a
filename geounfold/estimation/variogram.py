"""Variogram models: a nugget and nested structures along three axes."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from geounfold.errors import OptionError
from geounfold.geometry.mesh import Floats
from geounfold.geometry.rotations import angles_of
from geounfold.geometry.rotations import rotation_from_angles as turned

KINDS = ("spherical", "exponential", "gaussian", "matern")
"""Kinds of structures."""

SMOOTHNESS = 1.5
"""Smoothness of a Matern structure if none is given: between exponential (0.5) and gaussian."""

LEAST_NUGGET = 1e-6
"""Smallest nugget of a purely gaussian model, as a share of the sill.

The condition of a kriging system is at most its number of samples over this share. Estimates of 24
samples by gstlearn and by LAPACK differ by 0.0002 of a deviation with 1e-6, by 0.006 with 1e-7, by
0.2 with 1e-8 (ranges of several times the samples' extent).
"""

_LEFT = np.log(20.0)  # exponent that leaves 5 % of the covariance at the range

Triple = tuple[float, float, float]


def correlation(kind: str, h: Floats, smoothness: float = SMOOTHNESS) -> Floats:
    """Return the correlation of a structure at distances in units of its range.

    Spherical: 1 - 3 h / 2 + h^3 / 2, and 0 beyond the range. Exponential: 20^-h; gaussian:
    20^-h^2. Matern: x^s K_s(x) / (2^(s-1) Gamma(s)) with smoothness s and x in proportion to h.
    All but the spherical one leave 5 % at the range (Chiles and Delfiner 2012, section 2.5).

    Examples
    --------
    >>> [float(correlation(kind, np.array([1.0]))[0].round(3)) for kind in KINDS]
    [0.0, 0.05, 0.05, 0.05]
    """
    if kind == "spherical":
        r = np.minimum(h, 1.0)
        return np.asarray(1 - 1.5 * r + 0.5 * r**3)
    if kind == "matern":
        return _bessel(matern_scale(smoothness) * h, smoothness)
    return np.asarray(np.exp(-_LEFT * (h if kind == "exponential" else h**2)))


def _bessel(x: Floats, smoothness: float) -> Floats:
    """Return the Matern correlation at distances in units of its scale."""
    if smoothness == SMOOTHNESS:
        return np.asarray((1 + x) * np.exp(-x))
    from scipy.special import gamma, kv

    x = np.asarray(x, dtype=np.float64)
    far = np.maximum(x, 1e-8)  # K is infinite at 0, where the correlation is 1
    found = far**smoothness * kv(smoothness, far) / (2 ** (smoothness - 1) * gamma(smoothness))
    return np.asarray(np.where(x > 1e-8, found, 1.0))


@cache
def matern_scale(smoothness: float) -> float:
    """Return the range of a Matern structure, at which 5 % are left, in units of its scale.

    Examples
    --------
    >>> round(matern_scale(0.5), 6), round(float(np.log(20)), 6)  # 0.5 is the exponential model
    (2.995732, 2.995732)
    """
    from scipy.optimize import brentq

    return float(brentq(lambda x: float(_bessel(np.array([x]), smoothness)[0]) - 0.05, 0.1, 100.0))


@dataclass(frozen=True)
class Structure:
    """One structure of a variogram.

    Parameters
    ----------
    kind : {"spherical", "exponential", "gaussian", "matern"}
    sill : float
        Variance of the structure, above 0.
    ranges : (float, float, float)
        Ranges along the model's axes, in the points' unit. In the unfolded space without
        rotation, the first two lie along the layer and the third across it.
    smoothness : float
        Smoothness of a Matern structure, 0.1 to 20; the other kinds have none.

    Raises
    ------
    OptionError
        The kind is not a valid one, or a sill, range or smoothness is outside its valid range.
    """

    kind: str
    sill: float
    ranges: Triple
    smoothness: float = SMOOTHNESS

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise OptionError(f"structure {self.kind!r} is not one of: {', '.join(KINDS)}")
        sill = numbers("the sill of a structure", (self.sill,), 1)[0]
        ranges = numbers("the ranges of a structure", self.ranges, 3)
        if not (sill > 0 and min(ranges) > 0):
            raise OptionError(f"sill and ranges must be above 0, but are {sill} and {ranges}")
        smooth = numbers("the smoothness of a structure", (self.smoothness,), 1)[0]
        if not 0.1 <= smooth <= 20:
            raise OptionError(f"the smoothness must be from 0.1 to 20, but is {smooth}")
        if self.kind != "matern" and smooth != SMOOTHNESS:
            raise OptionError(f"a {self.kind} structure has no smoothness: only matern has one")
        object.__setattr__(self, "smoothness", smooth)
        object.__setattr__(self, "sill", sill)
        object.__setattr__(self, "ranges", ranges)

    def facts(self) -> dict[str, Any]:
        """Return the structure in the form that `from_facts` reads."""
        more = {"smoothness": self.smoothness} if self.kind == "matern" else {}
        return {"kind": self.kind, "sill": self.sill, "ranges": list(self.ranges), **more}


@dataclass(frozen=True)
class Variogram:
    """A variogram model.

    Parameters
    ----------
    nugget : float
        Variance at distance 0, 0 or more.
    structures : tuple of Structure
        Nested structures.
    rotation : (float, float, float)
        Bearing, plunge and dip of the axes, degrees, as in block models. The second axis points
        to the bearing (clockwise from +y) and down by the plunge. The first axis is turned down
        about the second by the dip.

    Raises
    ------
    OptionError
        A value is outside its valid range, the sill is 0, or a gaussian model lacks a nugget.
    """

    nugget: float
    structures: tuple[Structure, ...]
    rotation: Triple = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "nugget", numbers("the nugget", (self.nugget,), 1)[0])
        object.__setattr__(self, "rotation", numbers("the rotation", self.rotation, 3))
        object.__setattr__(self, "structures", tuple(self.structures))
        if self.nugget < 0:
            raise OptionError(f"the nugget must not be negative, but is {self.nugget}")
        if not self.sill > 0:
            raise OptionError("a variogram needs a nugget or a structure")
        smooth = {s.kind for s in self.structures} == {"gaussian"}
        if smooth and self.nugget < LEAST_NUGGET * self.sill:
            raise OptionError(
                f"a gaussian structure needs a nugget of at least {LEAST_NUGGET:g} of the sill, "
                f"here {LEAST_NUGGET * self.sill:.3g}: kriging systems cannot be solved without it"
            )

    @property
    def sill(self) -> float:
        """The whole variance, including the nugget."""
        return self.nugget + sum(s.sill for s in self.structures)

    @property
    def ranges(self) -> Triple:
        """The largest range along each axis; 0 for a pure nugget."""
        if not self.structures:
            return 0.0, 0.0, 0.0
        a, b, c = np.max([s.ranges for s in self.structures], axis=0).tolist()
        return a, b, c

    @property
    def reach(self) -> Triple:
        """The mean range along each axis, weighted by the structures' sills; 0 for a nugget."""
        if not self.structures:
            return 0.0, 0.0, 0.0
        sills = [s.sill for s in self.structures]
        a, b, c = np.average([s.ranges for s in self.structures], axis=0, weights=sills).tolist()
        return a, b, c

    @property
    def axes(self) -> Floats:
        """The axes as rows, (3, 3)."""
        return turned(*self.rotation)

    def gamma(self, separation: Floats) -> Floats:
        """Return the semivariance (n,) at separations (n, 3); it is 0 at separation 0."""
        h = np.asarray(separation, dtype=np.float64) @ self.axes.T
        left = np.zeros(len(h))
        for s in self.structures:
            left += s.sill * correlation(s.kind, np.linalg.norm(h / s.ranges, axis=1), s.smoothness)
        return np.where((h == 0).all(axis=1), 0.0, self.sill - left)

    def to_gstlearn(self) -> Any:
        """Return the model as gstlearn's Model, with an unknown constant mean.

        Raises
        ------
        MissingDependencyError
            gstlearn is not installed.
        """
        from geounfold.backends import gstlearn

        return gstlearn.model_of(self.nugget, self.parts, self.axes)

    @classmethod
    def from_gstlearn(cls, model: Any) -> Variogram:
        """Return a gstlearn Model of one variable in three dimensions.

        Raises
        ------
        InputError
            A structure is of another kind than `KINDS`, or turned differently.
        """
        from geounfold.backends import gstlearn

        return cls._of(*gstlearn.parts_of(model))

    def to_gstools(self) -> Any:
        """Return the model as GSTools' CovModel, of several structures as a SumModel.

        Raises
        ------
        OptionError
            The ranges of the structures are not in proportion, which a SumModel cannot have.
        MissingDependencyError
            GSTools is not installed.
        """
        from geounfold.backends import gstools

        return gstools.model_of(self.nugget, self.parts, self.axes)

    @classmethod
    def from_gstools(cls, model: Any) -> Variogram:
        """Return a GSTools model in three dimensions: a CovModel or a SumModel.

        Raises
        ------
        InputError
            A structure is of another kind than `KINDS`.
        """
        from geounfold.backends import gstools

        return cls._of(*gstools.parts_of(model))

    @property
    def parts(self) -> list[tuple[str, float, Triple, float]]:
        """Kind, sill, ranges and smoothness of each structure, as the libraries' doors take them.

        The lengths of a Matern structure are those of its scale.
        """
        return [
            (s.kind, s.sill, _divided(s.ranges, _unit(s.kind, s.smoothness)), s.smoothness)
            for s in self.structures
        ]

    @classmethod
    def _of(cls, nugget: float, parts: Any, axes: Floats) -> Variogram:
        structures = []
        for kind, sill, lengths, smoothness in parts:
            more = (smoothness,) if kind == "matern" else ()
            ranges = _divided(lengths, 1 / _unit(kind, smoothness))
            structures.append(Structure(kind, sill, ranges, *more))
        return cls(nugget, tuple(structures), angles_of(axes))

    def facts(self) -> dict[str, Any]:
        """Return the model in the form that `from_facts` reads."""
        return {
            "nugget": self.nugget,
            "structures": [s.facts() for s in self.structures],
            "rotation": list(self.rotation),
        }

    def to_toml(self, notes: Sequence[str] = ()) -> str:
        """Return the model as a text that can be edited and that `from_toml` reads.

        Parameters
        ----------
        notes : sequence of str, optional
            Further comments, a line each.

        Examples
        --------
        >>> model = Variogram(0.1, (Structure("spherical", 0.9, (150, 150, 20)),))
        >>> from_toml(model.to_toml(), "text") == model
        True
        """
        lines = [
            "# Variogram in the unfolded space; lengths in the map's unit. There x and y lie in",
            "# the layer, z across it. Azimuths are clockwise from the unfolded y, not from north.",
            *(f"# {note}" for note in notes),
            f"nugget = {self.nugget!r}  # variance at distance 0",
            "# Bearing (azimuth of axis 2), its plunge, and dip of axis 1, degrees. Axis 1 lies 90",
            "# degrees clockwise of axis 2; axis 3 is square to both: across the layer.",
            f"rotation = {list(self.rotation)}",
        ]
        for s in self.structures:
            lines += [
                "",
                "[[structures]]",
                f'kind = "{s.kind}"  # {", ".join(KINDS)}',
                f"sill = {s.sill!r}",
                f"ranges = {list(s.ranges)}  # along axes 1 and 2 (in the layer) and 3 (across)",
            ]
            if s.kind == "matern":
                lines.append(f"smoothness = {s.smoothness!r}")
        return "\n".join(lines) + "\n"


def _unit(kind: str, smoothness: float) -> float:
    return matern_scale(smoothness) if kind == "matern" else 1.0


def _divided(lengths: Triple, by: float) -> Triple:
    a, b, c = (float(length) / by for length in lengths)
    return a, b, c


def from_facts(facts: Any, source: str = "the variogram") -> Variogram:
    """Return the model of a dict of nugget, structures (kind, sill, ranges) and rotation.

    Raises
    ------
    OptionError
        A key is missing or unknown, or a value is outside its valid range.
    """
    if not isinstance(facts, Mapping):
        raise OptionError(f"{source}: must be an object with nugget, structures and rotation")
    known = {"nugget", "structures", "rotation"}
    if set(facts) - known or "structures" not in facts:
        raise OptionError(
            f"{source}: needs structures; besides it may have nugget and rotation only"
        )
    structures = facts["structures"]
    if not isinstance(structures, list | tuple) or not all(
        isinstance(s, Mapping) and set(s) - {"smoothness"} == {"kind", "sill", "ranges"}
        for s in structures
    ):
        raise OptionError(
            f"{source}: each structure needs exactly kind, sill and ranges, and a matern one may "
            "have smoothness"
        )
    try:
        parts = tuple(Structure(**s) for s in structures)
        return Variogram(facts.get("nugget", 0.0), parts, facts.get("rotation", (0.0, 0.0, 0.0)))
    except OptionError as error:
        raise OptionError(f"{source}: {error}") from error


def from_json(text: str, source: str) -> Variogram:
    """Return the model in a JSON text: the model itself, or a summary with key ``variogram``.

    Raises
    ------
    OptionError
        The text is not JSON, or not a valid model.
    """
    try:
        facts = json.loads(text)
    except ValueError as error:
        raise OptionError(f"{source}: not valid JSON: {error}") from error
    if isinstance(facts, Mapping) and "variogram" in facts:
        facts = facts["variogram"]
    return from_facts(facts, source)


def from_toml(text: str, source: str) -> Variogram:
    """Return the model in a TOML text, as `Variogram.to_toml` writes it.

    Raises
    ------
    OptionError
        The text is not TOML, or not a valid model.
    """
    try:
        facts = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise OptionError(f"{source}: not valid TOML: {error}") from error
    return from_facts(facts.get("variogram", facts), source)


def numbers(what: str, values: Any, count: int) -> tuple[Any, ...]:
    """Return the values as `count` finite floats, or raise OptionError."""
    try:
        found = tuple(float(v) for v in values)
    except (TypeError, ValueError) as error:
        raise OptionError(f"{what}: {values!r} is not {count} numbers") from error
    if len(found) != count or not np.isfinite(found).all():
        raise OptionError(f"{what}: {values!r} is not {count} finite numbers")
    return found
