"""Block models: boxes with sides, in frames that may be turned, and values moved between them."""

from geounfold.blockmodel.model import BlockModel, regular_grid
from geounfold.blockmodel.orientation import ModelFrame, axes_from_angles
from geounfold.blockmodel.sizes import block_model
from geounfold.blockmodel.transfer import Transfer, transfer

__all__ = [
    "BlockModel",
    "ModelFrame",
    "Transfer",
    "axes_from_angles",
    "block_model",
    "regular_grid",
    "transfer",
]
