"""Starting costs little: what is loaded before anything is computed."""

import subprocess
import sys

import pytest

HEAVY = {
    *("numpy", "scipy", "pandas", "pyarrow", "igl", "pymeshlab", "pytetwild", "pyvista"),
    *("matplotlib", "dask", "distributed", "sklearn", "rich", "gstools", "tetgen"),
}


@pytest.mark.parametrize(
    "start",
    [
        "import geounfold; dir(geounfold)",
        "from geounfold.cli import main; main(['--help'])",
        "from geounfold.cli import main; main(['map', '--help'])",
        "from geounfold.cli import main; main(['--version'])",
    ],
)
def test_nothing_heavy_is_loaded_to_start(start):
    code = f"{start}\nimport sys; print('loaded:', sorted({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.splitlines()[-1] == "loaded: []"


def test_unfolding_loads_neither_pictures_nor_clusters():
    """They would cost half of what the arrays do; numpy, scipy and pandas are needed."""
    code = (
        "import geounfold as gu, sys; gu.unfold, gu.load, gu.simulate\n"
        "print('loaded:', sorted({'matplotlib', 'pyvista', 'dask', 'distributed', 'sklearn', "
        "'pyarrow.parquet', 'rich'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout.splitlines()[-1] == "loaded: []"
