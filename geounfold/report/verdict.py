"""What a summary says, in plain words: sound or not, what was checked, what to distrust."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from geounfold.report.html_text import mapping, number

_CARE = 0.001  # share of blocks outside the control mesh from which the verdict asks for care
_BENT = 0.1  # change of neighbour distances that the thesis counts as an error (section 3.5)
_SWOLLEN = 0.05  # change of volume that is worth telling before tonnages are taken
_STRETCHED = 0.005  # edge strain of a flattened surface above which it is not developable

_RUNGS = {
    "capped": "offsets from the mid surface were capped where the fold is tighter than half the "
    "thickness",
    "blended": "offsets from the mid surface fall back around places where normals cross",
    "refined": "only finer cells and layers could follow the fold",
    "untangled": "some vertices of the control mesh were moved to turn inverted tetrahedra upright",
    "shrunk": "the control mesh was drawn in towards the mid surface until nothing was inverted",
}


@dataclass(frozen=True)
class Verdict:
    """What a summary says, in words.

    Attributes
    ----------
    level : str
        ``good``, ``care`` or ``bad``.
    headline : str
        One sentence.
    reasons : tuple of str
        One sentence per thing that was checked.
    distrust : tuple of str
        One sentence per thing that a user should look at before relying on the result.
    """

    level: str
    headline: str
    reasons: tuple[str, ...]
    distrust: tuple[str, ...] = ()


def verdict(summary: Mapping[str, Any]) -> Verdict:
    """Return a plain verdict on an unfolding from its summary; what is absent is not judged.

    Examples
    --------
    >>> verdict({"inverted_folded": 0, "inverted_unfolded": 2}).level
    'bad'
    """
    level, headline = _headline(summary)
    return Verdict(level, headline, tuple(_reasons(summary)), tuple(_distrust(summary)))


def _headline(summary: Mapping[str, Any]) -> tuple[str, str]:
    inverted = [summary.get("inverted_folded"), summary.get("inverted_unfolded")]
    outside, proved = summary.get("outside_share"), summary.get("injective")
    if any(inverted):
        return "bad", "The map folds over itself: do not use it as it is."
    if proved is False and mapping(summary.get("certificate")).get("injective") is True:
        return (
            "care",
            "Usable: the tetrahedra are one to one; between their corners it is not proved.",
        )
    if proved is False:
        return "bad", "The map is not proved one to one: do not use it as it is."
    if None in inverted:
        return "care", "It is not known whether the map folds over itself."
    if outside is not None and outside > _CARE:
        return "care", f"Usable with care: {outside:.2%} of the blocks were extrapolated."
    if summary.get("torn"):
        blocks = _count(summary["torn"], "block")
        return "care", f"Usable with care: {blocks} parted from blocks that they touch."
    if proved is not True:
        return "care", "Usable: nothing is inverted. That it is one to one is not proved."
    return "good", "Sound: the map is proved to be one to one."


def _reasons(summary: Mapping[str, Any]) -> Iterator[str]:
    folded, unfolded = summary.get("inverted_folded"), summary.get("inverted_unfolded")
    if folded is not None and unfolded is not None:
        yield f"Inverted tetrahedra: {folded} in the folded space, {unfolded} in the unfolded one."
    certificate = mapping(summary.get("certificate"))
    if certificate.get("injective") is True:
        yield (
            f"Proved: {number(certificate['tetrahedra'])} tetrahedra, none inverted, and "
            f"{number(certificate['boundary_faces'])} border faces, none crossing, in both spaces, "
            "by exact predicates; so their map is one to one (Lipman 2014)."
        )
        used = mapping(summary.get("coordinates")).get("name", "tet")
        if used != "tet":
            yield (
                f"Not proved: inside the prisms points go by {used} coordinates of their corners, "
                "not by the tetrahedra's; the blocks were there and back, and none inside out."
            )
    elif certificate.get("reason"):
        yield f"Not proved: {certificate['reason']}."
    elif certificate:
        yield (
            f"Not proved: {number(certificate['crossing_folded'])} pairs of border faces cross in "
            f"the folded space, {number(certificate['crossing_unfolded'])} in the unfolded one; "
            f"{number(certificate['blocks_in_faulty_elements'])} blocks lie in elements at fault "
            "(listed below, and marked in the mesh that --mesh writes)."
        )
    empty = mapping(summary.get("outside")).get("empty")
    if empty:
        yield f"{number(empty)} blocks lie beyond the map's reach and were left empty."
    outside = summary.get("outside_share")
    if outside is not None:
        share = "every block" if outside == 0 else f"all blocks but {outside:.3%}"
        yield f"The control mesh holds {share}."
    if summary.get("round_trip_max") is not None:
        yield (
            "There and back through the map, blocks inside move by at most "
            f"{number(summary['round_trip_max'])} (input's unit)."
        )
    error = summary.get("nmd")
    if isinstance(error, Mapping) and "mean" in error:
        yield (
            f"Neighbour mean distances change by {error['mean']:.2%} on average, "
            f"{error.get('p95', float('nan')):.2%} at the 95th percentile. This measure hardly "
            "sees folds: leaving the body as it is would score 0, and a right unfolding changes "
            "it where layers slid over one another."
        )


def _distrust(summary: Mapping[str, Any]) -> Iterator[str]:
    yield from _places_to_distrust(summary)
    yield from _shapes_to_distrust(summary)
    yield from _holes_to_distrust(mapping(summary.get("drillholes")))
    if summary:
        yield (
            "The proof says that nothing overlaps and everything comes back, not that the geology "
            "is right. Faults, and limbs less than a block apart, are not seen: check the layers "
            "against known horizons before variograms rely on them."
        )


def _places_to_distrust(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield what concerns single blocks."""
    certificate = mapping(summary.get("certificate"))
    faulty = certificate.get("blocks_in_faulty_elements")
    if faulty:
        yield (
            f"{_count(faulty, 'block')} in elements at fault: their coordinates may belong to two "
            "places. Leave them out, or unfold the body without the part around them."
        )
    outside = mapping(summary.get("outside"))
    if outside.get("extrapolated"):
        yield (
            f"{_count(outside['extrapolated'], 'block')} marked extrapolated: carried by a shell "
            "around the control mesh, up to "
            f"{number(float(outside.get('largest_distance', 0.0)))} from it (input's unit)."
        )
    if outside.get("empty"):
        yield f"{_count(outside['empty'], 'block')} without an image: they are not in the pictures."
    if summary.get("torn"):
        yield (
            f"{_count(summary['torn'], 'block')} torn from a block that it touched: pairs across "
            "such a tear are no neighbours any more. Colour by nmd_error to find them."
        )
    given = mapping(summary.get("input"))
    if given.get("dropped_invalid"):
        yield f"{_count(given['dropped_invalid'], 'row')} of the input left out: no coordinates."


def _shapes_to_distrust(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield what concerns the body as a whole."""
    error = mapping(summary.get("nmd"))
    if error.get("p95", 0.0) > _BENT:
        yield (
            f"Distances between neighbours change by more than {_BENT:.0%} for over one block in "
            f"twenty (at most {error['max']:.0%}). Slip between layers does that as well as "
            "distortion: compare nmd_error with shear in the pictures; where only the first is "
            "high, ranges of variograms are off."
        )
    volume = mapping(summary.get("volume_change"))
    if volume.get("p95", 0.0) > _SWOLLEN:
        yield (
            f"Volumes change by more than {_SWOLLEN:.0%} for over one block in twenty: weight by "
            "volume_ratio, or take tonnages in the folded space."
        )
    yield from _strained(mapping(summary.get("flattening")))
    method = mapping(summary.get("method"))
    rung = method.get("rung")
    if isinstance(rung, str) and rung != "constant":
        what = _RUNGS.get(rung, f"the control mesh had to be mended (rung '{rung}')")
        yield f"{what[0].upper()}{what[1:]}: layers near there follow the fold less exactly."
    if isinstance(summary.get("bodies"), int) and summary["bodies"] > 1:
        yield (
            f"{summary['bodies']} bodies were unfolded one by one: distances from one to another "
            "mean nothing; figures about surfaces are the largest body's."
        )


def _strained(flattening: Mapping[str, Any]) -> Iterator[str]:
    for name, how in flattening.items():
        strain = _last(mapping(how).get("edge_strain"))
        if name == "mid" and strain is not None and strain > _STRETCHED:
            yield (
                "The mid surface is curved both ways, so that no flat image keeps all its lengths: "
                f"they change by {strain:.1%} (root mean square over its edges)."
            )
        faults = [
            f"{mapping(how)[key]} {key}" for key in ("flips", "overlaps") if mapping(how).get(key)
        ]
        if faults:
            yield f"The flat {name} surface has {' and '.join(faults)}: see Flattened surfaces."
        stop = mapping(how).get("stop")
        if stop in ("max_iter", "stalled"):
            yield f"Flattening the {name} surface stopped before it had settled ({stop})."


def _holes_to_distrust(holes: Mapping[str, Any]) -> Iterator[str]:
    name = "samples" if holes.get("samples") else "traces"
    found = mapping(holes.get(name))
    if found.get("extrapolated") or found.get("outside"):
        yield (
            f"Of {number(found['points'])} points of the drill-holes' {name}, "
            f"{number(found.get('extrapolated', 0))} lie outside the control mesh (marked "
            f"extrapolated) and {number(found.get('outside', 0))} beyond the map's reach (no flat "
            "image): the farther out, the less they mean."
        )
    errors = [f for f in _records(holes.get("findings")) if f.get("severity") not in (None, "note")]
    if errors:
        rows = sum(int(f.get("count", 0)) for f in errors)
        yield f"{_count(rows, 'row')} of the drill-hole tables could not be used as they are."


def _records(value: object) -> Iterable[Mapping[str, Any]]:
    return [mapping(item) for item in value] if isinstance(value, list | tuple) else []


def _last(value: object) -> float | None:
    """Return the last of several numbers, or the only one; None where there is none."""
    if isinstance(value, list | tuple):
        value = value[-1] if value else None
    return float(value) if isinstance(value, int | float) else None


def _count(count: int, noun: str) -> str:
    return f"{number(count)} {noun}{'' if count == 1 else 's'}"
