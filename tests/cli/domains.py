"""A model of four domains: two lodes that touch, a folded seam, and waste."""

import numpy as np
import pandas as pd

from tests.shapes import grid_cells


def four_domains() -> pd.DataFrame:
    """Return a model of 10 m blocks: arches of 4 blocks on each other, a trough of 3, waste."""
    lode = grid_cells(24, 12, 4)
    lode[:, 2] += 3 - np.abs(lode[:, 0] - 12) // 4
    seam = grid_cells(24, 12, 3) + np.array([0, 0, 14])
    seam[:, 2] += np.abs(seam[:, 0] - 12) // 3
    cells = {"LODE 1": lode, "LODE 2": lode + np.array([0, 0, 4]), "SEAM": seam}
    own = {tuple(cell): name for name, part in cells.items() for cell in part.tolist()}
    box = grid_cells(30, 18, 28) - 3
    frame = pd.DataFrame(box * 10.0, columns=list("xyz"))
    frame["DOMAIN"] = [own.get(tuple(cell), "WASTE") for cell in box.tolist()]
    frame["AU"] = frame["DOMAIN"].map({"LODE 1": 1.0, "LODE 2": 2.0, "SEAM": 3.0, "WASTE": 0.0})
    return frame.sample(frac=1, random_state=4, ignore_index=True)
