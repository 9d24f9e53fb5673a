"""Methods for whole bodies: one contract, a table."""

from __future__ import annotations

from geounfold.methods.contract import BodyFit, Method, Placed, Pointwise, PreparedBody, SurfacePair
from geounfold.methods.isomap import IsomapMethodOptions, fit_isomap
from geounfold.methods.pointwise_map import PointwiseMap, no_mesh
from geounfold.methods.shear import fit_shear
from geounfold.methods.sheet.method import sheet_method
from geounfold.methods.stratigraphic import fit_stratigraphic
from geounfold.methods.thesis.method import fit_thesis
from geounfold.methods.ufo import fit_ufo
from geounfold.methods.vertical_heights import VerticalOptions
from geounfold.methods.volumetric import VolumetricOptions, fit_volumetric

__all__ = [
    "METHODS",
    "BodyFit",
    "IsomapMethodOptions",
    "Method",
    "Placed",
    "Pointwise",
    "PointwiseMap",
    "PreparedBody",
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
        Method("sheet", sheet_method, "sheet_options"),
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
