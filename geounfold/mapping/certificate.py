"""Proof that a mesh of tetrahedra is one-to-one: exact predicates and one theorem.

Theorem (Lipman, "Bijective mappings of meshes with boundary and the degree in mesh processing",
2014, arXiv 1310.0955): a piecewise linear map of a mesh with boundary that keeps every simplex
upright, and whose restriction to the boundary is one-to-one, is one-to-one.  A space of a control
mesh is such a map, from the tetrahedra glued along their faces into space.  So it is an embedding
when

1. the tetrahedra are glued face to face and their boundary is a closed manifold, 2. every
tetrahedron has positive volume, 3. the boundary does not intersect itself, and 4. no part of the
boundary lies inside out within another.  (A body may have cavities; the number of tetrahedra over a
place is the boundary's winding number about it, 0 or 1.)

If both spaces are embeddings, the map from one to the other is one-to-one, and so is its inverse.
Exact predicates (Shewchuk's, in libigl) decide orientations and intersections, on the same numbers
that carry points.  Positive volumes alone are no proof: around an inner hinge the tetrahedra of a
column may all be upright and yet overlap others two columns away.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from geounfold.backends import igl as backend
from geounfold.geometry.measures import boundary_faces, enclosed_volume
from geounfold.geometry.mesh import Bools, Floats, Ints, TetMesh
from geounfold.mapping.control_mesh import ControlMesh

THEOREM = (
    "tetrahedra glued face to face, all of positive volume, whose closed boundary does not "
    "intersect itself, do not overlap (Lipman 2014, arXiv 1310.0955); true of both spaces, the "
    "piecewise linear map between them is one-to-one"
)

_NAMED = 50  # largest number of flaws listed one by one


_COUNTS = (
    *("tetrahedra", "boundary_faces", "inverted_folded", "inverted_unfolded"),
    *("crossing_folded", "crossing_unfolded", "nested_folded", "nested_unfolded"),
)
"""Entries of a certificate that are sums over its parts."""


@dataclass(frozen=True, eq=False)
class Gluing:
    """The gluing of tetrahedra and their boundary, independent of coordinates.

    Attributes
    ----------
    T : (m, 4) int
        Tetrahedra.
    F : (b, 3) int
        Boundary faces, outward.
    owner : (b,) int
        Tetrahedron of each face.
    misglued : (k,) int
        Tetrahedra at faces that more than two share, or two on the same side of.
    closed : bool
        Whether the boundary is a closed manifold.
    """

    T: Ints
    F: Ints
    owner: Ints
    misglued: Ints
    closed: bool

    @classmethod
    def of(cls, T: Ints) -> Gluing:
        """Return the gluing of tetrahedra (m, 4)."""
        F, owner, misglued = boundary_faces(T)
        closed = bool(
            len(F) and (backend.triangle_adjacency(F) >= 0).all() and backend.is_manifold(F)
        )
        return cls(T, F, owner, misglued, closed)

    @property
    def sound(self) -> bool:
        """Whether condition 1 of the theorem holds."""
        return self.closed and not len(self.misglued)

    @property
    def pinched(self) -> Ints:
        """Vertices at which the boundary is no manifold, sorted."""
        E = np.sort(self.F[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, count = np.unique(E, axis=0, return_counts=True)
        return np.union1d(edges[count != 2], backend.pinched_vertices(self.F))

    @cached_property
    def part(self) -> Ints:
        """Connected part of the boundary that each of its faces belongs to, (b,)."""
        return backend.face_components(self.F)


@dataclass(frozen=True, eq=False)
class SpaceFlaws:
    """Flaws that prevent the proof in one space of a control mesh.

    Attributes
    ----------
    inverted : (k,) int
        Tetrahedra whose volume is not positive.
    crossing : (c, 2) int
        Pairs of boundary faces that intersect.
    nested : (p,) int
        Parts of the boundary that lie inside out within others; searched only if the
        boundary does not intersect itself.
    """

    inverted: Ints
    crossing: Ints
    nested: Ints

    @property
    def none(self) -> bool:
        """Whether conditions 2 to 4 of the theorem hold."""
        return not (len(self.inverted) or len(self.crossing) or len(self.nested))

    def elements(self, gluing: Gluing) -> Ints:
        """Return the tetrahedra at fault, sorted."""
        faces = np.isin(gluing.part, self.nested)
        faces[self.crossing.ravel()] = True
        return np.unique(np.concatenate([self.inverted, gluing.owner[faces]]))


def examine(V: Floats, gluing: Gluing) -> SpaceFlaws:
    """Return the flaws of one space, vertices V (n, 3)."""
    inverted = np.flatnonzero(~backend.upright(V, gluing.T))
    crossing = backend.self_intersections(V, gluing.F)
    nested = np.empty(0, np.int64) if len(crossing) else _nested(V, gluing)
    return SpaceFlaws(inverted, crossing, nested)


def _nested(V: Floats, gluing: Gluing) -> Ints:
    """Return the parts of an embedded boundary whose winding about a place is not 0 or 1.

    An outer part encloses a positive volume and must lie outside of all others; a cavity's is
    negative and must lie within one more outer part than cavities.
    """
    count = int(gluing.part.max(initial=-1)) + 1
    if count < 2:
        return np.empty(0, np.int64)
    wrong = []
    for part in range(count):
        mine = gluing.part == part
        outer = enclosed_volume(V, gluing.F[mine]) > 0
        around = backend.winding_number(V, gluing.F[~mine], V[gluing.F[mine][:1, 0]])[0]
        if round(around) != (0 if outer else 1):
            wrong.append(part)
    return np.array(wrong, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Certificate(Mapping[str, Any]):
    """Result of the proof for a control mesh; also a mapping of its entries.

    Attributes
    ----------
    injective : bool
        True only if all conditions of the theorem hold in both spaces: the map is one-to-one.
    tetrahedra, boundary_faces : int
        Numbers checked, including those of the shell around the body.
    glued : bool
        Condition 1: tetrahedra glued face to face, boundary a closed manifold.
    inverted_folded, inverted_unfolded : int
        Condition 2: tetrahedra whose volume is not positive.
    crossing_folded, crossing_unfolded : int
        Condition 3: pairs of boundary faces that intersect.
    nested_folded, nested_unfolded : int
        Condition 4: parts of the boundary inside out within others.
    elements : (k,) int
        Tetrahedra at fault; indices from ``len(control.folded.T)`` on are those of the shell.
    blocks : (k,) int
        Number of blocks in each of them.
    folded, unfolded : (k, 3) float
        Their centres, in the coordinates given.
    reason : str
        Reason why nothing could be checked; empty if the mesh was checked.
    """

    injective: bool
    tetrahedra: int
    boundary_faces: int
    glued: bool
    inverted_folded: int
    inverted_unfolded: int
    crossing_folded: int
    crossing_unfolded: int
    nested_folded: int
    nested_unfolded: int
    elements: Ints
    blocks: Ints
    folded: Floats
    unfolded: Floats
    reason: str = ""

    @classmethod
    def unproved(cls, reason: str) -> Certificate:
        """Return the certificate of a map that cannot be checked, with the reason."""
        none, nowhere = np.empty(0, np.int64), np.empty((0, 3))
        return cls(
            injective=False,
            tetrahedra=0,
            boundary_faces=0,
            glued=False,
            inverted_folded=0,
            inverted_unfolded=0,
            crossing_folded=0,
            crossing_unfolded=0,
            nested_folded=0,
            nested_unfolded=0,
            elements=none,
            blocks=none,
            folded=nowhere,
            unfolded=nowhere,
            reason=reason,
        )

    @property
    def faults(self) -> list[str]:
        """The failed conditions, one phrase each."""
        if self.reason:
            return [self.reason]
        phrases = {
            "tetrahedra inverted in the folded space": self.inverted_folded,
            "tetrahedra inverted in the unfolded space": self.inverted_unfolded,
            "pairs of boundary faces that cross in the folded space": self.crossing_folded,
            "pairs of boundary faces that cross in the unfolded space": self.crossing_unfolded,
            "parts of the boundary inside out in the folded space": self.nested_folded,
            "parts of the boundary inside out in the unfolded space": self.nested_unfolded,
        }
        out = [f"{count} {phrase}" for phrase, count in phrases.items() if count]
        return out if self.glued else ["tetrahedra that are not glued face to face", *out]

    def as_dict(self) -> dict[str, Any]:
        """Return the certificate for JSON: counts, the theorem, the first flaws one by one."""
        counts = {
            name: value
            for name in self.__dataclass_fields__
            if isinstance(value := getattr(self, name), (bool, int))
        }
        return {
            **counts,
            **({"reason": self.reason} if self.reason else {}),
            "theorem": THEOREM,
            "faulty_elements": len(self.elements),
            "blocks_in_faulty_elements": int(self.blocks.sum()),
            "flaws": [
                {
                    "element": int(self.elements[k]),
                    "blocks": int(self.blocks[k]),
                    "folded": self.folded[k].tolist(),
                    "unfolded": self.unfolded[k].tolist(),
                }
                for k in np.argsort(-self.blocks, kind="stable")[:_NAMED]
            ],
        }

    def __getitem__(self, name: str) -> Any:
        return self.as_dict()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.as_dict())

    def __len__(self) -> int:
        return len(self.as_dict())


def certify_parts(
    control: ControlMesh,
    shell: ControlMesh | None,
    held: Ints,
    vertex_part: Ints,
    *,
    apart: bool = True,
) -> Certificate:
    """Return the certificate of a map whose control meshes touch in the folded space.

    Each part is proved by itself, on the numbers that carry its points. The flat images of the
    parts must lie apart along x, which makes the map of all points one-to-one: no two parts have
    an image in common, and a point belongs to one part. Fault blocks, which share one flat space,
    are proved one by one; how far their images overlap is measured.

    Parameters
    ----------
    control, shell, held
        As `certify` takes them, of all parts as one.
    vertex_part : (n,) int
        Part of each vertex.
    apart : bool
        Whether the parts must lie apart; False for fault blocks.
    """
    whole, count = control if shell is None else shell, len(control.folded.T)
    found, elements, reaches = [], [], []
    for part in range(int(vertex_part.max()) + 1):
        own = vertex_part == part
        core = np.flatnonzero(own[control.folded.T[:, 0]])
        rest = np.empty(0, np.int64)
        if shell is not None:
            rest = np.flatnonzero(own[shell.folded.T[:, 0]])
        rows = np.concatenate([core, count + rest])
        number = np.full(count + (0 if shell is None else len(shell.folded.T)) + 1, -1)
        number[rows] = np.arange(len(rows))  # the last stays -1: no element
        inner = _part_of(control, own[: len(control.folded.V)], core, own)
        outer = None if shell is None or not len(rest) else _part_of(shell, own, rest, own)
        found.append(certify(inner, outer, number[held]))
        elements.append(rows[found[-1].elements])
        x = whole.unfolded.V[own, 0]
        reaches.append((float(x.min()), float(x.max())))
    reaches.sort()
    overlaps = sum(a[1] >= b[0] for a, b in pairwise(reaches)) if apart else 0
    sums = {name: sum(getattr(c, name) for c in found) for name in _COUNTS}
    sums["crossing_unfolded"] += overlaps
    return Certificate(
        injective=all(c.injective for c in found) and not overlaps,
        glued=all(c.glued for c in found),
        elements=np.concatenate(elements),
        blocks=np.concatenate([c.blocks for c in found]),
        folded=np.concatenate([c.folded for c in found]),
        unfolded=np.concatenate([c.unfolded for c in found]),
        **sums,
    )


def _part_of(mesh: ControlMesh, vertices: Bools, tets: Ints, own: Bools) -> ControlMesh:
    """Return some tetrahedra of a mesh on some of its vertices; ``own`` numbers these."""
    T = (np.cumsum(own) - 1)[mesh.folded.T[tets]]
    return ControlMesh(
        TetMesh(mesh.folded.V[vertices], T),
        TetMesh(mesh.unfolded.V[vertices], T),
        mesh.stratigraphic[vertices],
    )


def certify(control: ControlMesh, shell: ControlMesh | None, held: Ints) -> Certificate:
    """Return the certificate of a control mesh and, if given, the shell around it.

    Parameters
    ----------
    control : ControlMesh
        The body's tetrahedra.
    shell : ControlMesh or None
        Tetrahedra around it; its first vertices are the body's.
    held : (n,) int
        The tetrahedron that carries each block, -1 for none; rows as in ``elements``.
    """
    whole = control if shell is None else shell
    T = control.folded.T if shell is None else np.concatenate([control.folded.T, shell.folded.T])
    gluing = Gluing.of(T)
    folded, unfolded = (examine(mesh.V, gluing) for mesh in (whole.folded, whole.unfolded))
    elements = np.unique(
        np.concatenate([gluing.misglued, folded.elements(gluing), unfolded.elements(gluing)])
    )
    count = np.bincount(held[held >= 0], minlength=len(T))
    return Certificate(
        injective=gluing.sound and folded.none and unfolded.none,
        tetrahedra=len(T),
        boundary_faces=len(gluing.F),
        glued=gluing.sound,
        inverted_folded=len(folded.inverted),
        inverted_unfolded=len(unfolded.inverted),
        crossing_folded=len(folded.crossing),
        crossing_unfolded=len(unfolded.crossing),
        nested_folded=len(folded.nested),
        nested_unfolded=len(unfolded.nested),
        elements=elements,
        blocks=count[elements],
        folded=whole.folded.V[T[elements]].mean(axis=1),
        unfolded=whole.unfolded.V[T[elements]].mean(axis=1),
    )
