"""The verdict on an unfolding in plain words: sound or not, what was checked, what to distrust."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from geounfold.report.html_text import mapping, number

_CARE = 0.001  # share of blocks outside the control mesh from which the verdict is care
_BENT = 0.1  # change of neighbour distances that the thesis counts as an error (section 3.5)
_SWOLLEN = 0.05  # change of volume above which tonnages need a weight
_STRETCHED = 0.005  # edge strain of a flattened surface above which it is not developable

_RUNGS = {
    "capped": "the map reaches less far out where the fold is tighter than half the thickness",
    "blended": "the map reaches less far out where lines across the layer would cross",
    "refined": "the fold is so tight that the map needed finer cells",
    "untangled": "some cells of the map were moved, because they were turned inside out",
    "shrunk": "the map reaches less far out, because cells there were turned inside out",
}


@dataclass(frozen=True)
class Verdict:
    """The verdict on an unfolding, in words.

    Attributes
    ----------
    level : str
        ``good``, ``care`` or ``bad``.
    headline : str
        One sentence.
    reasons : tuple of str
        One sentence for each check.
    distrust : tuple of str
        One sentence for each thing to look at before relying on the result.
    """

    level: str
    headline: str
    reasons: tuple[str, ...]
    distrust: tuple[str, ...] = ()


def verdict(summary: Mapping[str, Any]) -> Verdict:
    """Return a plain verdict on an unfolding from its summary; missing figures are not judged.

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
            "Usable: the cells of the map are one-to-one; between their corners nothing is proved.",
        )
    if proved is False:
        return "bad", "The map is not proved one-to-one: do not use it as it is."
    if None in inverted:
        return "care", "It is not known whether the map folds over itself."
    trust = mapping(summary.get("trust")).get("word")
    if trust == "poor":
        return "bad", "Proved one-to-one, but the layers look wrong: see what to distrust."
    if trust == "fair":
        return "care", "Usable with care: some of the layers may be wrong."
    if outside is not None and outside > _CARE:
        return "care", f"Usable with care: {outside:.2%} of the blocks were extrapolated."
    if summary.get("torn"):
        blocks = _count(summary["torn"], "block")
        return "care", f"Usable with care: {blocks} moved away from blocks that they touched."
    if proved is not True:
        return "care", "Usable: no cell of the map is inside out, but it is not proved one-to-one."
    return "good", "Sound: the map is proved one-to-one."


def _reasons(summary: Mapping[str, Any]) -> Iterator[str]:
    folded, unfolded = summary.get("inverted_folded"), summary.get("inverted_unfolded")
    if folded is not None and unfolded is not None:
        yield f"Cells of the map turned inside out: {folded} folded, {unfolded} unfolded."
    certificate = mapping(summary.get("certificate"))
    if certificate.get("injective") is True:
        yield (
            f"Proved: no two places become one. All {number(certificate['tetrahedra'])} cells of "
            f"the map keep their sense and its {number(certificate['boundary_faces'])} border "
            "faces do not cross, in both spaces, checked without rounding (Lipman 2014)."
        )
        used = mapping(summary.get("coordinates")).get("name", "tet")
        if used != "tet":
            yield (
                f"Not proved: inside the cells, points are carried by {used} coordinates of the "
                "corners. Checked at the blocks only: every block returns, "
                "and none is turned inside out."
            )
    elif certificate.get("reason"):
        yield f"Not proved: {certificate['reason']}."
    elif certificate:
        yield (
            f"Not proved: {number(certificate['crossing_folded'])} pairs of border faces cross in "
            f"the folded space, {number(certificate['crossing_unfolded'])} in the unfolded one; "
            f"{number(certificate['blocks_in_faulty_elements'])} blocks lie in cells at fault "
            "(listed below, and marked in the mesh that --mesh writes)."
        )
    empty = mapping(summary.get("outside")).get("empty")
    if empty:
        yield f"{number(empty)} blocks lie beyond the map's reach and were left empty."
    outside = summary.get("outside_share")
    if outside is not None:
        share = "every block" if outside == 0 else f"all blocks but {outside:.3%}"
        yield f"The map covers {share}; what lies around it is extrapolated."
    if summary.get("round_trip_max") is not None:
        yield (
            "Blocks that are unfolded and folded again miss their place by at most "
            f"{number(summary['round_trip_max'])} (input's unit)."
        )
    error = summary.get("nmd")
    if isinstance(error, Mapping) and "mean" in error:
        yield (
            f"Neighbour mean distances change by {error['mean']:.2%} on average, "
            f"{error.get('p95', float('nan')):.2%} at the 95th percentile. This measure "
            "hardly depends on folds: the folded body itself scores 0, and a correct unfolding "
            "changes it where layers slipped over one another."
        )


def _distrust(summary: Mapping[str, Any]) -> Iterator[str]:
    yield from _layers_to_distrust(mapping(summary.get("trust")))
    yield from _places_to_distrust(summary)
    yield from _shapes_to_distrust(summary)
    yield from _holes_to_distrust(mapping(summary.get("drillholes")))
    if summary:
        yield (
            "A proved map does not overlap and has an inverse; the geology may still be wrong. "
            "Coordinates do not show every fault, nor limbs less than a block apart: check the "
            "layers against known horizons before you compute variograms."
        )


def _layers_to_distrust(trust: Mapping[str, Any]) -> Iterator[str]:
    """Yield the reasons not to trust the layers."""
    for reason in trust.get("reasons", ()):
        what, where, do = reason["what"], reason["where"], reason["do"]
        place = "" if where is None else f", most around ({', '.join(number(c) for c in where)})"
        yield f"{what[0].upper()}{what[1:]}{place}: {do}."


def _places_to_distrust(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield sentences about single blocks."""
    certificate = mapping(summary.get("certificate"))
    faulty = certificate.get("blocks_in_faulty_elements")
    if faulty:
        yield (
            f"{_count(faulty, 'block')} in cells at fault: their coordinates may belong to "
            "two places. Leave them out, or unfold the body without the part around them."
        )
    outside = mapping(summary.get("outside"))
    if outside.get("extrapolated"):
        yield (
            f"{_count(outside['extrapolated'], 'block')} marked extrapolated: they lie outside the "
            "map's own cells, up to "
            f"{number(float(outside.get('largest_distance', 0.0)))} from it (input's unit)."
        )
    if outside.get("empty"):
        yield f"{_count(outside['empty'], 'block')} without an image: they are not in the pictures."
    if summary.get("torn"):
        yield (
            f"{_count(summary['torn'], 'block')} torn from a block that it touched: pairs across "
            "such a tear are no longer neighbours. Colour by nmd_error to find them."
        )
    given = mapping(summary.get("input"))
    if given.get("dropped_invalid"):
        yield f"{_count(given['dropped_invalid'], 'row')} of the input left out: no coordinates."


def _shapes_to_distrust(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield sentences about the whole body."""
    error = mapping(summary.get("nmd"))
    if error.get("p95", 0.0) > _BENT:
        yield (
            f"Distances between neighbours change by more than {_BENT:.0%} for over one block in "
            f"twenty (at most {error['max']:.0%}). Both slip between layers and distortion cause "
            "this: compare the colours nmd_error and shear. Where only nmd_error is high, "
            "ranges of variograms are wrong."
        )
    volume = mapping(summary.get("volume_change"))
    if volume.get("p95", 0.0) > _SWOLLEN:
        yield (
            f"Volumes change by more than {_SWOLLEN:.0%} for over one block in twenty: weight by "
            "volume_ratio, or compute tonnages in the folded space."
        )
    yield from _strained(mapping(summary.get("flattening")))
    method = mapping(summary.get("method"))
    rung = method.get("rung")
    if isinstance(rung, str) and rung != "constant":
        what = _RUNGS.get(rung, f"the map had to be repaired ('{rung}')")
        yield f"{what[0].upper()}{what[1:]}: layers near there follow the fold less exactly."
    if isinstance(summary.get("bodies"), int) and summary["bodies"] > 1:
        yield (
            f"{summary['bodies']} bodies were unfolded one by one: distances between bodies have "
            "no meaning, and figures about surfaces are those of the largest body."
        )


def _strained(flattening: Mapping[str, Any]) -> Iterator[str]:
    for name, how in flattening.items():
        strain = _last(mapping(how).get("edge_strain"))
        if name == "mid" and strain is not None and strain > _STRETCHED:
            yield (
                "The mid surface is curved in two directions, so no flat image keeps all its "
                f"lengths: they change by {strain:.1%} (root mean square over its edges)."
            )
        faults = [
            f"{mapping(how)[key]} {key}" for key in ("flips", "overlaps") if mapping(how).get(key)
        ]
        if faults:
            yield f"The flat {name} surface has {' and '.join(faults)}: see Flattened surfaces."
        stop = mapping(how).get("stop")
        if stop in ("max_iter", "stalled"):
            yield f"Flattening the {name} surface stopped before it converged ({stop})."


def _holes_to_distrust(holes: Mapping[str, Any]) -> Iterator[str]:
    name = "samples" if holes.get("samples") else "traces"
    found = mapping(holes.get(name))
    if found.get("extrapolated") or found.get("outside"):
        yield (
            f"Of {number(found['points'])} points of the drill-holes' {name}, "
            f"{number(found.get('extrapolated', 0))} lie outside the map's cells (marked "
            f"extrapolated) and {number(found.get('outside', 0))} beyond the map's reach (no flat "
            "image). The farther out, the less reliable they are."
        )
    errors = [f for f in _records(holes.get("findings")) if f.get("severity") not in (None, "note")]
    if errors:
        rows = sum(int(f.get("count", 0)) for f in errors)
        yield f"{_count(rows, 'row')} of the drill-hole tables could not be used unchanged."


def _records(value: object) -> Iterable[Mapping[str, Any]]:
    return [mapping(item) for item in value] if isinstance(value, list | tuple) else []


def _last(value: object) -> float | None:
    """Return the last of several numbers, or the only one; None if there is none."""
    if isinstance(value, list | tuple):
        value = value[-1] if value else None
    return float(value) if isinstance(value, int | float) else None


def _count(count: int, noun: str) -> str:
    return f"{number(count)} {noun}{'' if count == 1 else 's'}"
