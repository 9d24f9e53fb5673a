"""The package's own rules, read from its source: circles, lengths, signatures, imports."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.places import ROOT

PACKAGE = ROOT / "geounfold"
MOST_LINES, MOST_BODY, MOST_PARAMETERS = 500, 60, 8

# The package offers simulate as a public name; the commands simulate and completion list its cases.
SIMULATE = {
    "geounfold",
    "geounfold.cli.commands.simulate",
    "geounfold.cli.commands.completion",
}


def _name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {_name(path): path.read_text() for path in sorted(PACKAGE.rglob("*.py"))}
TREES = {name: ast.parse(text) for name, text in SOURCES.items()}


def _imports(name: str) -> set[str]:
    """Return the package's modules that a module imports, inside functions too."""
    found = set()
    for node in ast.walk(TREES[name]):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.add(inner if inner in SOURCES else node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return (found & set(SOURCES)) - {name}


IMPORTS = {name: _imports(name) for name in SOURCES}


def _functions() -> list[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    return [
        (name, node)
        for name, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]


def test_no_import_leads_back_to_its_own_module() -> None:
    # A module that nothing imports is in no circle: take such modules away until none is left.
    left = {name: set(imports) for name, imports in IMPORTS.items()}
    while free := set(left) - set().union(*left.values()):
        for name in free:
            del left[name]
    circular = {name for name, imports in left.items() if imports}
    assert not circular, f"import each other, or are imported by such: {sorted(circular)}"


def test_modules_are_short() -> None:
    lines = {name: len(text.splitlines()) for name, text in SOURCES.items()}
    assert {name: n for name, n in lines.items() if n > MOST_LINES} == {}


def test_bodies_of_functions_are_short() -> None:
    long: dict[str, int] = {}
    for name, node in _functions():
        body = node.body[1:] if ast.get_docstring(node) is not None else node.body
        if body and (n := body[-1].end_lineno - body[0].lineno + 1) > MOST_BODY:
            long[f"{name}.{node.name}"] = n
    assert long == {}


def test_long_signatures_have_their_reason_beside_them() -> None:
    bare = {}
    for name, node in _functions():
        given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        count = sum(a.arg not in ("self", "cls") for a in given)
        if count > MOST_PARAMETERS:
            first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
            beside = SOURCES[name].splitlines()[first - 2 : node.body[0].lineno - 1]
            if not any("#" in line for line in beside):
                bare[f"{name}.{node.name}"] = count
    assert bare == {}


def test_only_simulate_imports_synthetic_bodies() -> None:
    users = {
        name
        for name, imports in IMPORTS.items()
        if any(other.startswith("geounfold.synthetic") for other in imports)
        and not name.startswith("geounfold.synthetic")
    }
    assert users <= SIMULATE
