"""The commands of the README without make, for Windows and wherever Python is.

``python tools/run.py demo`` simulates a body, unfolds it and writes a report. ``test`` runs the
fast tests. ``imitate windows`` and ``imitate macos`` run them on Linux with what that system lacks
taken away. Words after the command go on to pytest. Each command first makes the environment in
.venv, if that is missing or older than pyproject.toml or constraints.txt.
"""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
STAMP = VENV / ".run"
DEMO = ROOT / "demo"
FAST = ["-m", "pytest", "-m", "not slow", "-n", "auto", "--dist", "loadfile"]


def python() -> str:
    """Return the Python of the environment, made or renewed if needed."""
    folder = VENV / ("Scripts" if os.name == "nt" else "bin")
    own = str(folder / ("python.exe" if os.name == "nt" else "python"))
    sources = (ROOT / "pyproject.toml", ROOT / "constraints.txt")
    if not STAMP.exists() or STAMP.stat().st_mtime < max(s.stat().st_mtime for s in sources):
        if not Path(own).exists():
            venv.create(VENV)  # some systems ship Python without ensurepip
        words = ["install", "--quiet", "--constraint", "constraints.txt", "pip"]
        _run(sys.executable, "-m", "pip", "--python", own, *words, "--editable", ".[dev]")
        STAMP.touch()
    return own


def demo() -> None:
    """Simulate a folded body, unfold it, write a report and say where."""
    own = python()
    DEMO.mkdir(exist_ok=True)
    body, out = DEMO / "sim_case_1.csv", DEMO / "unfolded.csv"
    report = DEMO / "report.html"
    _run(own, "-m", "geounfold", "simulate", "sim_case_1", "-o", str(body), "--overwrite")
    more = ["--summary", str(DEMO / "summary.json"), "--map", str(DEMO / "map.npz")]
    _run(
        *(own, "-m", "geounfold", "unfold", str(body), "-o", str(out), *more),
        *("--report", str(report), "--overwrite"),
    )
    print(f"Report: {report}")


def test(*words: str) -> None:
    """Run the fast tests and the docstrings' examples, on all cores."""
    _run(python(), *FAST, *words)


def imitate(system: str, *words: str) -> None:
    """Run the fast tests with what another system lacks taken away."""
    if system not in ("windows", "macos"):
        sys.exit(f"imitate windows or macos, not {system}")
    path = [str(ROOT / "tests" / "imitation"), *filter(None, [os.environ.get("PYTHONPATH")])]
    own = python()
    _run(own, *FAST, *words, GEOUNFOLD_IMITATE=system, PYTHONPATH=os.pathsep.join(path))


COMMANDS = {"demo": demo, "test": test, "imitate": imitate}


def _run(*words: str, **more: str) -> None:
    """Run a command in the clone; leave with its status if that is not 0."""
    environment = {"OMP_NUM_THREADS": "1", **os.environ, **more}
    done = subprocess.run(words, cwd=ROOT, env=environment, check=False)
    if done.returncode:
        sys.exit(done.returncode)


def main() -> None:
    """Run the command that the first word names."""
    name, *words = sys.argv[1:] or [""]
    if name not in COMMANDS or (name == "imitate" and not words):
        sys.exit(f"usage: python tools/run.py {' | '.join(COMMANDS)}\n{__doc__}")
    COMMANDS[name](*words)


if __name__ == "__main__":
    main()
