"""Methods for whole bodies: one contract, a table."""

from __future__ import annotations

from geounfold.methods.contract import Body, BodyFit, Method, Placed, Pointwise, SurfacePair
from geounfold.methods.heights import VerticalOptions
from geounfold.methods.isomap import IsomapOptions, fit_isomap
from geounfold.methods.pointmap import PointwiseMap, no_mesh
from geounfold.methods.shear import fit_shear
from geounfold.methods.sheet import fit_sheet
from geounfold.methods.stratigraphic import fit_stratigraphic
from geounfold.methods.thesis import fit_thesis
from geounfold.methods.ufo import fit_ufo
from geounfold.methods.volumetric import VolumetricOptions, fit_volumetric

__all__ = [
    "METHODS",
    "Body",
    "BodyFit",
    "IsomapOptions",
    "Method",
    "Placed",
    "Pointwise",
    "PointwiseMap",
    "SurfacePair",
    "VerticalOptions",
    "VolumetricOptions",
    "no_mesh",
]

_FAR = 10.0  # blocks: meshes without a shell leave some blocks outside

#: The methods by name.
METHODS: dict[str, Method] = {
    m.name: m
    for m in (
        Method("sheet", fit_sheet, "sheet_options"),
        Method("thesis", fit_thesis, "thesis_options", reach=_FAR, hull="alpha", surfaces=False),
        Method("ufo", fit_ufo, "sheet_options", reach=_FAR),
        Method(
            "stratigraphic", fit_stratigraphic, "vertical_options", control=False, flattens=False
        ),
        Method("shear", fit_shear, "vertical_options", control=False, flattens=False),
        Method("volumetric", fit_volumetric, "volumetric_options", reach=_FAR),
        Method("isomap", fit_isomap, "isomap_options", control=False, flattens=False),
    )
}
