"""One reference surface laid flat, with blocks anchored to it along its normals (as in U-Fo)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geounfold.geometry.mesh import Floats, TetMesh, TriMesh
from geounfold.mapping.control_mesh import ControlMesh, Datum
from geounfold.methods.contract import BodyFit, PreparedBody, SurfacePair
from geounfold.methods.sheet.result import SheetResult
from geounfold.methods.sheet.stages import sheet_stages


@dataclass(frozen=True, eq=False)
class AnchoredSheet:
    """A mid surface, laid flat, and the prisms that stand on it, working units.

    Attributes
    ----------
    sheet : SheetResult
        Stages from which the surface was taken.
    mid : TriMesh
        The surface, with normals towards the top.
    uv : (n, 2) float
        The surface laid flat.
    low, high : (n,) float
        Heights of bottom and top along the normals at its vertices.
    height : (layers, n) float
        Heights of the prisms' vertices, layer by layer, the lowest first.
    folded : TetMesh
        The prisms, cut into tetrahedra: vertices layer by layer along the normals.
    """

    sheet: SheetResult
    mid: TriMesh
    uv: Floats
    low: Floats
    high: Floats
    height: Floats
    folded: TetMesh

    def control(self, datum: Datum) -> ControlMesh:
        """Return the map to prisms perpendicular to the flat triangles."""
        z = np.stack([datum.z(h, self.low, self.high) for h in self.height])
        share = (self.height - self.low) / (self.high - self.low)
        flat = np.column_stack([np.tile(self.uv, (len(z), 1)), z.ravel()])
        return ControlMesh(self.folded, self.folded.with_vertices(flat), share.ravel())

    def surfaces(self, datum: Datum) -> dict[str, SurfacePair]:
        """Return mid, top and bottom in both spaces, carried by that map."""
        heights = {"mid": np.zeros_like(self.low), "top": self.high, "bottom": self.low}
        mesh, out = self.sheet.mesh, {}
        for name, height in heights.items():
            z = datum.z(height, self.low, self.high)
            flat = self.mid.with_vertices(np.column_stack([self.uv, z]))
            how = mesh.flattenings["mid"] if name == "mid" else None
            out[name] = SurfacePair(mesh.surfaces[name][0], flat, how)
        return out


def fit_ufo(body: PreparedBody) -> BodyFit:
    """Return the map that keeps each block's place on the reference surface and its height.

    The reference is the mid surface that ``sheet`` fits, laid flat by the chosen flattener.  A
    ray along the normal through a block meets it at the block's anchor, and the ray's length is
    the block's height over the flat surface.  The rays at the surface's vertices are the edges of
    prisms over its triangles, so the map is linear on tetrahedra, has an inverse, and can be
    proved.

    Notes
    -----
    U-Fo itself takes the surface as an input and anchors each block by its own ray; the thesis
    gives no more detail (sections 2.3.2 and 3.2.6).  Layers do not slip over one another here: off
    the reference surface, lengths along a fold's layers change by height times curvature.

    Raises
    ------
    SplitError, FlatteningError
        The mid surface could not be fitted or flattened.
    """
    anchored = anchor(body)
    mesh = anchored.sheet.mesh
    with body.stage("ufo"):
        datum = Datum(body.datum, float(anchored.low.mean()), float(anchored.high.mean()))
        control, surfaces = anchored.control(datum), anchored.surfaces(datum)
    flattenings = {"mid": mesh.flattenings["mid"]}
    notes: dict[str, object] = {"reference": "mid"}
    return BodyFit(
        body.hull, body.split, control, None, surfaces, flattenings, anchored.sheet, notes
    )


def anchor(body: PreparedBody) -> AnchoredSheet:
    """Return the body's mid surface laid flat, and the prisms that stand on it."""
    sheet = sheet_stages(body, "mid", 0.0)
    layers, surfaces = sheet.mesh.layers, sheet.mesh.surfaces
    return AnchoredSheet(
        sheet,
        TriMesh(layers.P, layers.F),
        layers.flat,
        surfaces["bottom"][1].V[:, 2],
        surfaces["top"][1].V[:, 2],
        np.stack(layers.heights),
        TetMesh(layers.folded, layers.tets()),
    )
