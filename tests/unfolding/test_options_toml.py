"""Options as TOML: there and back, explained, and refused in one clear line."""

from __future__ import annotations

import inspect
import re
import tomllib
from collections.abc import Iterator
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import geounfold as gu
from geounfold.cli import main
from geounfold.errors import OptionError
from geounfold.flattening import FLATTENERS, ArapOptions, SpringDynamicOptions
from geounfold.methods.sheet.options import SheetOptions
from geounfold.methods.thesis import ThesisOptions
from geounfold.surfaces.hull import HullOptions
from geounfold.unfolding import gone_options
from geounfold.unfolding.options import UnfoldOptions
from geounfold.unfolding.options_toml import from_toml, template, to_toml

CHANGED = UnfoldOptions(
    method="thesis",
    flattener="spring_dynamic",
    flattener_options=SpringDynamicOptions(stop_rule="thesis", damping=0.25),
    hull="alpha",
    up=(0.1 + 0.2, -1e-17, 5e-324),  # no short decimals
    datum="proportional",
    body="all",
    reach=1 / 3,
    allow_uncertified=True,
    hull_options=HullOptions(alpha=2.0 / 7, level=0.4),
    sheet_options=SheetOptions(merge_above=70_000),
    thesis_options=ThesisOptions(trim=0),
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
    for options in _dataclasses(UnfoldOptions()):
        documented = " ".join(
            inspect.cleandoc(base.__doc__ or "") for base in type(options).__mro__[:-1]
        )
        for field in fields(options):
            if is_dataclass(getattr(options, field.name)) or field.name == "flattener_options":
                assert f".{field.name}]" in text or f"[{field.name}]" in text
                continue
            where = f"{type(options).__name__}.{field.name}"
            assert re.search(rf"^(# )?{field.name} = ", text, re.MULTILINE), where
            assert re.search(rf"\b{field.name}\b", documented), f"{where} has no description"
    assert max(map(len, text.splitlines())) <= 96


@pytest.mark.parametrize("name", FLATTENERS)
def test_options_of_flatteners_stand_in_one_line_and_are_read(name: str) -> None:
    line = re.search(rf"^# {name}: (.*)$", template(), re.MULTILINE)
    assert line is not None
    options = FLATTENERS[name].options
    words = [] if line[1] == "none" else line[1].split(", ")
    assert [word.split(" = ")[0] for word in words] == [field.name for field in fields(options)]
    given = [word for word in words if " = " in word]
    text = "\n".join([f'flattener = "{name}"', "[flattener_options]", *given])
    assert from_toml(text) == UnfoldOptions(flattener=name, flattener_options=options())


def test_what_is_left_out_has_its_default() -> None:
    assert from_toml("") == UnfoldOptions()
    assert from_toml("[hull_options]\nedge = 2") == UnfoldOptions(
        hull_options=HullOptions(edge=2.0)
    )


def test_a_dict_makes_the_options_of_a_stage() -> None:
    made = UnfoldOptions(
        flattener="arap",
        flattener_options={"tol": 1e-3},
        hull_options={"level": 0.4},  # type: ignore[arg-type]
    )
    assert made.flattener_options == ArapOptions(tol=1e-3)
    assert made.hull_options == HullOptions(level=0.4)
    for wrong, words in (
        (
            {"lvel": 0.4},
            "no option hull_options.lvel .did you mean 'level'.*; valid in hull_options: level",
        ),
        ({"level": 2}, "hull_options.level must be a number between 0 and 1, but is 2"),
        ({"sigma": 1}, "hull_options.sigma is called hull_options.blur since 0.2.0"),
        (3, "hull_options must be HullOptions, but is 3"),
    ):
        with pytest.raises(OptionError, match=words):
            UnfoldOptions(hull_options=wrong)  # type: ignore[arg-type]


def test_numpy_values_and_odd_texts_are_written() -> None:
    options = UnfoldOptions(up=np.array([0, 0, 2]), neighbours=np.int64(5))  # type: ignore[arg-type]
    read = tomllib.loads(to_toml(options))
    assert (read["up"], read["neighbours"]) == ([0, 0, 2], 5)
    with pytest.raises(OptionError, match=r'but is \'a\\\\"b\\x07\''):
        from_toml('method = "a\\\\\\"b\\u0007"')


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("reach = ]", "c: not valid TOML: Invalid value (at line 1, column 9)"),
        (f"reach = {'9' * 5000}", "c: not valid TOML: "),
        (
            "reech = 3",
            "c: there is no option reech (did you mean 'reach'?); valid: method,",
        ),
        (
            "[thesis_options]\ntrimm = 3",
            "no option thesis_options.trimm (did you mean 'trim'?); valid in thesis_options: ",
        ),
        ("[sheet]\nx = 1", "c: there is no option sheet; valid: method"),
        ("reach = '3'", "c: reach must be a number of 0 or more, but is '3'"),
        ("reach = true", "c: reach must be a number of 0 or more, but is True"),
        ("reach = nan", "c: reach must be a number of 0 or more, but is nan"),
        (f"reach = {'9' * 400}", f"c: reach must be a number of 0 or more, but is {'9' * 60}..."),
        ("neighbours = 2.5", "c: neighbours must be a whole number of 1 or more, but is 2.5"),
        ("neighbours = 0", "c: neighbours must be a whole number of 1 or more, but is 0"),
        ("allow_uncertified = 1", "c: allow_uncertified must be true or false, but is 1"),
        ("up = [0, 1]", "c: up must be a list of 3 numbers, but is [0, 1]"),
        ("up = [0, 0, 0]", "c: up must be a list of 3 numbers, not all 0, but is [0.0, 0.0, 0.0]"),
        ("up = 'z'", "c: up must be a list of 3 numbers, but is 'z'"),
        ("body = 1.5", "c: body must be a whole number of 0 or more, 'all' or None, but is 1.5"),
        ("body = true", "c: body must be a whole number of 0 or more, 'all' or None, but is True"),
        ("hull = {a = 1}", "c: hull must be one of auto, density, alpha, ball_pivoting, poisson, "),
        ("hull = ['alpha']", "but is ['alpha']"),
        ("hull_options = 3", "c: hull_options must be a table of options, but is 3"),
        (
            "[hull_options]\nlevel = 2",
            "c: hull_options.level must be a number between 0 and 1, but is 2",
        ),
        (
            "[hull_options]\nalpha = 'a'",
            "c: hull_options.alpha must be a number above 0 or None, but is 'a'",
        ),
        (
            "datum = 'middle'",
            "c: datum must be one of mid, top, bottom, proportional, but is 'midd",
        ),
        (
            "flattener = 'x'\nflattener_options.tol = 1",
            "c: flattener must be one of spring, spring_dynamic, arap",
        ),
        (
            "flattener = 'arap'\nflattener_options.landmarks = 5",
            "no option flattener_options.landmarks; valid in flattener_options: tol, max_iter",
        ),
        (
            "[flattener_options]\ntol = -1",
            "c: flattener_options.tol must be a number above 0, but is -1",
        ),
        ("flattener_options = 1", "c: flattener_options must be a table of options, but is 1"),
        ("reach = 1979-05-27", "c: reach must be a number of 0 or more, but is datetime.date(1979"),
    ],
)
def test_what_cannot_be_used_is_one_line(text: str, words: str) -> None:
    with pytest.raises(OptionError) as caught:
        from_toml(text, "c")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "[hull_options]\nshell = 0.8",
            "hull_options.shell is gone since 0.2.0: leave it out (its default was 0.9)",
        ),
        (
            "[hull_options]\nsigma = 0.8",
            "hull_options.sigma is called hull_options.blur since 0.2.0: write it there",
        ),
        (
            "[thesis_options]\nflattener = 'arap'",
            "thesis_options.flattener is called flattener since 0.2.0: write it there",
        ),
        (
            "[thesis_options.flattener_options]\ntol = 1",
            "thesis_options.flattener_options is called flattener_options since 0.2.0: "
            "write it there",
        ),
        (
            "[flattener_options]\nwarm_tol = 1e-3",
            "flattener_options.warm_tol is gone since 0.2.0: leave it out (its default was 0.001)",
        ),
        (
            "[sheet_options.coarse]\nlayers = 2.0",
            "sheet_options.coarse.layers is gone since 0.2.0: leave it out (its default was 1.0)",
        ),
        (
            "[sheet_options.coarse]\nblocks = 9",
            "sheet_options.coarse.blocks is called sheet_options.merge_above since 0.2.0: "
            "write it there",
        ),
        ("[sheet_options.coarse]", "sheet_options.coarse is gone since 0.2.0: leave it out"),
    ],
)
def test_an_option_that_is_gone_is_told_in_one_line(text: str, sentence: str) -> None:
    with pytest.raises(OptionError) as caught:
        from_toml(text, "c.toml")
    assert str(caught.value) == f"c.toml: {sentence}"


def test_every_option_of_0_1_0_that_is_not_one_now_is_told() -> None:
    def check(table: dict[str, Any], path: str) -> None:
        for name, value in table.items():
            if isinstance(value, dict):
                check(value, f"{path}{name}.")
            else:
                assert str(value) in str(gone_options.gone(f"{path}{name}", 1))

    check(tomllib.loads(gone_options._FORMER), "")
    for former, present in gone_options.RENAMED.items():
        assert present in str(gone_options.gone(former, 1))
    assert gone_options.gone("sheet", {"fit": {}}) is None


def test_the_same_sentence_from_python_a_file_and_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad: list[tuple[str, Any, str]] = [
        ("datum", "sea", "datum must be one of mid, top, bottom, proportional, but is 'sea'"),
        ("reach", "far", "reach must be a number of 0 or more, but is 'far'"),
        ("reach", -1, "reach must be a number of 0 or more, but is -1"),
        ("neighbours", 0, "neighbours must be a whole number of 1 or more, but is 0"),
        ("neighbours", 2.5, "neighbours must be a whole number of 1 or more, but is 2.5"),
        ("body", "x", "body must be a whole number of 0 or more, 'all' or None, but is 'x'"),
        ("up", [0, 1], "up must be a list of 3 numbers, but is [0, 1]"),
        ("up", [0, 0, "z"], "up must be a list of 3 numbers, but is [0, 0, 'z']"),
    ]
    points = tmp_path / "p.csv"
    points.write_text("x,y,z\n0,0,0\n")
    for name, value, sentence in bad:
        with pytest.raises(OptionError) as caught:
            UnfoldOptions(**{name: value})
        assert str(caught.value) == sentence
        with pytest.raises(OptionError) as caught:
            from_toml(f"{name} = {value!r}", "c")
        assert str(caught.value) == f"c: {sentence}"
        word = ",".join(map(str, value)) if isinstance(value, list) else str(value)
        out = str(tmp_path / "out.csv")
        assert main(["unfold", str(points), "-o", out, f"--{name}={word}"]) == 2
        assert capsys.readouterr().err.strip() == f"geounfold: error: --{sentence}"


def test_the_template_fits_on_two_screens() -> None:
    nested = [field for field in fields(SheetOptions) if field.default is MISSING]
    assert len(template().splitlines()) <= 100 or nested


def test_the_summary_repeats_the_run() -> None:
    folded = gu.simulate("sim_case_1", blocks=2000).folded
    first = gu.unfold(folded, flattener="arap", datum="top", flattener_options=_arap())
    text = first.summary()["config"]
    again = gu.unfold(folded, from_toml(text))
    assert again.options == first.options
    np.testing.assert_array_equal(again.points, first.points)
    np.testing.assert_array_equal(again.columns["shear"], first.columns["shear"])
    assert again.summary()["config"] == text


def _arap() -> ArapOptions:
    return ArapOptions(max_iter=7)


def test_init_writes_what_config_reads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "options.toml"
    assert main(["init", "-o", str(path)]) == 0
    assert path.read_text() == template()
    assert main(["init", "-o", str(path)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert main(["init"]) == 0
    assert capsys.readouterr().out == template()
    assert main(["init", "-o", str(tmp_path / "options.ini")]) == 2
