"""Build the wheel and the sdist, check them, and try the wheel in an environment of its own.

``python tools/check_package.py`` uses the versions that the tests ran with; ``--newest`` takes the
newest of everything. It needs an index of packages, and some minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

MOST_MB = 750
"""Largest size of an environment with a plain install, MB (10^6 bytes); measured: 675 on Linux."""

TOOLS = ("build>=1.2", "twine>=6")
EXAMPLES = ("sim_case_1", "sim_case_2")


def check(*, newest: bool, keep: Path | None) -> dict[str, object]:
    """Return the figures of the package; leave with an error if a check fails."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tools = _environment(folder / "tools", *TOOLS)
        dist = keep or folder / "dist"
        _run(tools, "-m", "build", "--outdir", str(dist), str(ROOT))
        wheel, sdist = next(dist.glob("*.whl")), next(dist.glob("*.tar.gz"))
        _run(tools, "-m", "twine", "check", "--strict", str(wheel), str(sdist))
        _check_contents(wheel, sdist)
        limits = [] if newest else ["--constraint", str(ROOT / "constraints.txt")]
        clean = _environment(folder / "clean", *limits, str(wheel))
        size = sum(f.stat().st_size for f in (folder / "clean").rglob("*") if not f.is_symlink())
        injective = [_unfolded(clean, folder, case) for case in EXAMPLES]
        _run(clean, "-m", "geounfold", "doctor", "--quiet")
        figures = {
            "wheel_kb": round(wheel.stat().st_size / 1e3),
            "sdist_kb": round(sdist.stat().st_size / 1e3),
            "install_mb": round(size / 1e6),
            "certified": dict(zip(EXAMPLES, injective, strict=True)),
            "packages": _packages(clean),
        }
    if size > MOST_MB * 1e6:
        sys.exit(f"a plain install takes {size / 1e6:.0f} MB, more than {MOST_MB}")
    if not all(injective):
        sys.exit(f"not proved one-to-one: {figures['certified']}")
    return figures


def _environment(folder: Path, *packages: str) -> str:
    """Return the Python of a new environment with packages."""
    venv.create(folder)  # some systems ship Python without ensurepip
    windows = os.name == "nt"
    own = str(folder / ("Scripts" if windows else "bin") / ("python.exe" if windows else "python"))
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", own)
    _run(*pip, "install", "--quiet", "pip", *packages)
    return own


def _check_contents(wheel: Path, sdist: Path) -> None:
    """Leave with an error unless the package holds its modules and data, and no more."""
    files = {p.relative_to(ROOT).as_posix() for p in _sources()}
    with zipfile.ZipFile(wheel) as archive:
        inside = {n for n in archive.namelist() if ".dist-info/" not in n}
        info = {n.rpartition("/")[2] for n in archive.namelist() if ".dist-info/" in n}
    if inside != files:
        sys.exit(f"the wheel differs from the package: {sorted(inside ^ files)[:5]}")
    if missing := {"METADATA", "LICENSE", "entry_points.txt"} - info:
        sys.exit(f"the wheel lacks {missing}")
    with tarfile.open(sdist) as archive:
        held = {n.partition("/")[2] for n in archive.getnames()}
    wanted = files | {"tests/conftest.py", "constraints.txt", "pyproject.toml", "CITATION.cff"}
    if missing := wanted - held:
        sys.exit(f"the sdist lacks {sorted(missing)[:5]}")


def _sources() -> list[Path]:
    every = (ROOT / "geounfold").rglob("*")
    return [p for p in every if p.is_file() and "__pycache__" not in p.parts]


def _unfolded(own: str, folder: Path, case: str) -> bool:
    """Return whether a body is unfolded and proved by the installed package."""
    body, out, summary = (str(folder / f"{case}{end}") for end in (".csv", "_flat.csv", ".json"))
    _run(own, "-m", "geounfold", "simulate", case, "-o", body, cwd=folder)
    _run(own, "-m", "geounfold", "unfold", body, "-o", out, "--summary", summary, cwd=folder)
    found = json.loads(Path(summary).read_text(encoding="utf-8"))
    return found["injective"] is True


def _packages(own: str) -> dict[str, str]:
    words = [own, "-m", "pip", "list", "--format", "json", "--disable-pip-version-check"]
    listed = json.loads(subprocess.run(words, check=True, capture_output=True).stdout)
    return {entry["name"]: entry["version"] for entry in listed}


def _run(*words: str, cwd: Path = ROOT) -> None:
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(words, cwd=cwd, env=environment, check=False, stdout=sys.stderr)
    if done.returncode:
        sys.exit(f"{' '.join(words)} ended with {done.returncode}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--newest", action="store_true", help="without constraints.txt")
    parser.add_argument("--keep", type=Path, help="folder for the wheel and the sdist")
    given = parser.parse_args()
    print(json.dumps(check(newest=given.newest, keep=given.keep), indent=2))
