"""Options as TOML: there and back, explained, and refused in one clear line."""

from __future__ import annotations

import inspect
import re
import tomllib
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS, ArapOptions, SpringDynamicOptions
from geounfold.methods.sheet.mid_surface.fit import FitOptions
from geounfold.methods.sheet.options import SheetOptions
from geounfold.methods.thesis import ThesisOptions
from geounfold.surfaces.hull import HullOptions
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.options_toml import from_toml, template, to_toml

CHANGED = UnfoldOptions(
    method="thesis",
    flattener="arap",
    hull="alpha",
    up=(0.1 + 0.2, -1e-17, 5e-324),  # no short decimals
    datum="proportional",
    body="all",
    reach=1 / 3,
    allow_uncertified=True,
    hull_options=HullOptions(alpha=2.0 / 7, smoothing=3),
    sheet_options=SheetOptions(fit=FitOptions(knots=3.0, rounds=2), refused_rough=1.1),
    thesis_options=ThesisOptions(
        flattener="spring_dynamic",
        flattener_options=SpringDynamicOptions(stop_rule="thesis", damping=0.25),
        trim=0,
    ),
)


def _dataclasses(options: Any) -> Iterator[Any]:
    """Yield options and all options within."""
    yield options
    for field in fields(options):
        if is_dataclass(value := getattr(options, field.name)):
            yield from _dataclasses(value)


@pytest.mark.parametrize(
    "options", [UnfoldOptions(), CHANGED, UnfoldOptions(body=2)], ids=["default", "changed", "body"]
)
def test_there_and_back(options: UnfoldOptions) -> None:
    assert from_toml(to_toml(options)) == options


def test_every_option_is_explained_and_read_back() -> None:
    text = template()
    assert from_toml(text) == UnfoldOptions()
    every = [*_dataclasses(UnfoldOptions()), *(f.options() for f in FLATTENERS.values())]
    assert len(every) > 15  # eleven of the stages, six of flatteners
    for options in every:
        documented = " ".join(
            inspect.cleandoc(base.__doc__ or "") for base in type(options).__mro__[:-1]
        )
        for field in fields(options):
            if is_dataclass(getattr(options, field.name)) or field.name == "flattener_options":
                assert f".{field.name}]" in text or f"[{field.name}]" in text
                continue
            where = f"{type(options).__name__}.{field.name}"
            assert re.search(rf"^(# )*{field.name} = ", text, re.MULTILINE), where
            assert re.search(rf"\b{field.name}\b", documented), f"{where} has no description"
    assert max(map(len, text.splitlines())) <= 100


@pytest.mark.parametrize("name", FLATTENERS)
def test_commented_out_options_of_flatteners_work_when_uncommented(name: str) -> None:
    _, _, rest = template().partition(f'# With flattener = "{name}":\n')
    block, _, _ = rest.partition("\n\n")
    text = f'[thesis_options]\nflattener = "{name}"\n' + re.sub("^# ", "", block, flags=re.M)
    found = from_toml(text).thesis_options
    assert found == ThesisOptions(flattener=name, flattener_options=FLATTENERS[name].options())


def test_what_is_left_out_has_its_default() -> None:
    assert from_toml("") == UnfoldOptions()
    assert from_toml("[sheet_options.fit]\nknots = 4") == UnfoldOptions(
        sheet_options=SheetOptions(fit=FitOptions(knots=4.0))
    )


def test_numpy_values_and_odd_texts_are_written() -> None:
    options = UnfoldOptions(up=np.array([0, 0, 2]), neighbours=np.int64(5))  # type: ignore[arg-type]
    read = tomllib.loads(to_toml(options))
    assert (read["up"], read["neighbours"]) == ([0, 0, 2], 5)
    with pytest.raises(OptionError, match=r'unknown method \'a\\\\"b\\x07\''):
        from_toml('method = "a\\\\\\"b\\u0007"')


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("reach = ]", "c: not valid TOML: Invalid value (at line 1, column 9)"),
        ("reech = 3", "c: there is no option reech; valid: method, flattener, hull, split, up,"),
        ("[sheet_options.fit]\nknot = 3", "no option sheet_options.fit.knot; valid in sheet_optio"),
        ("[sheet]\nx = 1", "c: there is no option sheet; valid: method"),
        ("reach = '3'", 'c: reach must be a number, but is "3"'),
        ("reach = true", "c: reach must be a number, but is true"),
        ("neighbours = 2.5", "c: neighbours must be a whole number, but is 2.5"),
        ("allow_uncertified = 1", "c: allow_uncertified must be true or false, but is 1"),
        ("up = [0, 1]", "c: up must be a list of 3 numbers, but is a list"),
        ("up = 'z'", 'c: up must be a list of 3 numbers, but is "z"'),
        ("body = 1.5", "c: body must be a whole number or a text, but is 1.5"),
        ("body = true", "c: body must be a whole number or a text, but is true"),
        ("hull = {a = 1}", "c: hull must be a text, but is a table"),
        ("hull_options = 3", "c: hull_options must be a table of options, but is 3"),
        ("[hull_options]\nalpha = 'a'", 'c: hull_options.alpha must be a number, but is "a"'),
        (
            "[sheet_options.horizons]\nmargins = [1, 'a']",
            "c: sheet_options.horizons.margins must be a list of numbers, but is a list",
        ),
        ("datum = 'middle'", "c: unknown datum 'middle'; valid: mid, top, bottom, proportional"),
        (
            "[thesis_options]\nflattener = 'x'\nflattener_options.tol = 1",
            "c: thesis_options.flattener must be one of spring, spring_dynamic, arap",
        ),
        (
            "[thesis_options]\nflattener = 'arap'\nflattener_options.warm_tol = 1",
            "valid in thesis_options.flattener_options: tol, max_iter",
        ),
        (
            "[thesis_options.flattener_options]\ntol = -1",
            "c [thesis_options.flattener_options]: spring: tol must be positive, but is -1.0",
        ),
        ("reach = 1979-05-27", "c: reach must be a number, but is 1979-05-27"),
    ],
)
def test_what_cannot_be_used_is_one_line(text: str, words: str) -> None:
    with pytest.raises(OptionError) as caught:
        from_toml(text, "c")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_summary_repeats_the_run() -> None:
    folded = gu.simulate("sim_case_1", blocks=2000).folded
    first = gu.unfold(folded, flattener="arap", datum="top", thesis_options=_arap())
    text = first.summary()["config"]
    again = gu.unfold(folded, from_toml(text))
    assert again.options == first.options
    np.testing.assert_array_equal(again.points, first.points)
    np.testing.assert_array_equal(again.columns["shear"], first.columns["shear"])
    assert again.summary()["config"] == text


def _arap() -> ThesisOptions:
    return ThesisOptions(flattener="arap", flattener_options=ArapOptions(max_iter=7))


def test_init_writes_what_config_reads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "options.toml"
    assert main(["init", "-o", str(path)]) == 0
    assert path.read_text() == template()
    assert main(["init", "-o", str(path)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert main(["init"]) == 0
    assert capsys.readouterr().out == template()
    assert main(["init", "-o", str(tmp_path / "options.ini")]) == 2
