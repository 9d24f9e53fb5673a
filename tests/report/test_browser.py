"""The report in a browser: it draws, picks, colours, slices and turns, by mouse and by keys.

Driven through Playwright in the system's Chromium, with the network off.  Screenshots go to the
folder that GEOUNFOLD_ARTEFACTS names, by default one of pytest's own.
"""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from geounfold.errors import MissingDependencyError
from geounfold.report import CarriedFaults, CarriedHoles, CarriedPoints, write_report
from geounfold.report.plots.rendering import check_rendering
from geounfold.report.plots.style import ViewOptions
from geounfold.synthetic.faulted import simulate_faulted

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next((found for name in BROWSERS if (found := shutil.which(name))), None)
# Software GL, no sandbox (containers run as root), nothing that a browser asks of the network.
ARGUMENTS = [
    *("--no-sandbox", "--disable-gpu-sandbox", "--disable-dev-shm-usage"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--disable-background-networking", "--no-first-run"),
]


def _missing() -> str:
    """Return why no browser can be driven here, or nothing."""
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return "playwright is not installed (extra dev)"
    if BROWSER is None:
        return "no Chromium on the path (Debian: apt-get install chromium)"
    try:
        check_rendering()
    except MissingDependencyError as error:
        return str(error)
    return ""


CANNOT = _missing()
pytestmark = pytest.mark.skipif(bool(CANNOT), reason=CANNOT or "nothing is missing")

SHAPE = (30, 12, 5)
RADIUS = 20.0
HOSTILE = "</script><script>window.broken = true</script>"


def _flat() -> np.ndarray:
    axes = [np.arange(float(n)) for n in SHAPE]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def _rolled(points: np.ndarray) -> np.ndarray:
    """Return points of a slab rolled up about y, by x / RADIUS."""
    angle, r = points[:, 0] / RADIUS, RADIUS + points[:, 2]
    return np.column_stack([r * np.sin(angle), points[:, 1], r * np.cos(angle)])


FLAT, FOLDED = _flat(), _rolled(_flat())


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    n = len(FLAT)
    columns = {
        "stratigraphic": FLAT[:, 2] / 4,
        "location": np.where(FLAT[:, 0] < 1, "extrapolated", "inside"),
        "grade": np.where(np.arange(n) % 50 == 0, np.nan, np.sin(FLAT[:, 0])),
        "rock": np.where(FLAT[:, 1] < 6, "ore <b>", "waste"),
        HOSTILE: np.arange(n, dtype=float),
    }
    line = np.column_stack([np.full(30, 5.0), np.full(30, 5.0), np.linspace(-4, 9, 30)])
    grades = {"cu": np.linspace(0, 1, 30)}
    hole = ["DH-1"] * 30
    holes = CarriedHoles(
        CarriedPoints(hole, _rolled(line), line),
        CarriedPoints(hole, _rolled(line), line, grades),
    )
    summary = {
        "injective": True,
        "inverted_folded": 0,
        "inverted_unfolded": 0,
        "input": {"file": "blocks.csv", "unit": "m"},
        "config": 'method = "sheet"\n',
        "command": "geounfold unfold blocks.csv -o flat.csv",
    }
    write_report(path, summary, FOLDED, FLAT, columns, holes=holes, view=ViewOptions(size=(80, 60)))
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        driven = playwright.chromium.launch(executable_path=BROWSER, args=ARGUMENTS)
        yield driven
        driven.close()


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    named = os.environ.get("GEOUNFOLD_ARTEFACTS")
    folder = Path(named) if named else tmp_path_factory.mktemp("artefacts")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _opened(browser: Any, report: Path, width: int = 1280, scheme: str = "light") -> Any:
    """Return a page that is ready; its errors and requests are kept with it."""
    context = browser.new_context(
        viewport={"width": width, "height": 900},
        color_scheme=scheme,
        reduced_motion="reduce",
        offline=True,
    )
    page = context.new_page()
    page.complaints, page.requests = [], []
    page.on("console", lambda said: page.complaints.append(said.text))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("request", lambda request: page.requests.append(request.url))
    page.goto(report.as_uri())
    page.wait_for_selector("html[data-ready]")
    return page


@pytest.fixture
def page(browser: Any, report: Path) -> Iterator[Any]:
    opened = _opened(browser, report, 800)
    yield opened
    assert opened.complaints == []
    asked = [url for url in opened.requests if not url.startswith("data:")]
    assert asked == [report.as_uri()]
    opened.context.close()


def _settled(page: Any) -> None:
    """Wait until what was asked for has been drawn."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)))")


def _seen(page: Any, space: str) -> bytes:
    """Return a view's pixels, without its rounded border."""
    _settled(page)
    picture = imread(io.BytesIO(page.locator(f"#{space} canvas").screenshot()))
    return bytes(picture[4:-4, 4:-4].tobytes())


def _facts(page: Any) -> dict[str, str]:
    names = page.locator("#facts dt").all_text_contents()
    return dict(zip(names, page.locator("#facts dd").all_text_contents(), strict=True))


def test_it_draws_without_complaint_or_network(page: Any) -> None:
    assert page.evaluate("document.documentElement.dataset.ready") == "true"
    assert page.evaluate("window.broken") is None
    assert "1,800 shown" in page.locator("#shown").text_content()
    options = page.locator("#colour option").all_text_contents()
    assert HOSTILE in options
    assert any("8 bands" in option for option in options)


def test_a_click_picks_a_block_and_marks_its_twin(page: Any, pictures: Path) -> None:
    before = {space: _seen(page, space) for space in ("folded", "unfolded")}
    box = page.locator("#unfolded canvas").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    _settled(page)
    facts = _facts(page)
    row = int(page.locator("#row").input_value())
    # 16 bits of sides of 4 to 29 m: 0.0005 m at most; shown to the next decimal.
    for space, places in (("folded", FOLDED), ("unfolded", FLAT)):
        shown = [float(facts[f"{space} {axis}"].removesuffix(" m")) for axis in "xyz"]
        np.testing.assert_allclose(shown, places[row - 1], atol=0.001)
    assert facts["rock"] in ("ore <b>", "waste")
    assert facts[HOSTILE] == f"{row - 1:,}"
    for space in ("folded", "unfolded"):
        assert page.locator(f"#{space} .ring").is_visible()
        assert _seen(page, space) != before[space]
    # The ring of the view that was clicked is round the place that was clicked, to a block's size.
    ring = page.locator("#unfolded .ring").bounding_box()
    off = np.hypot(
        ring["x"] + ring["width"] / 2 - box["x"] - box["width"] / 2,
        ring["y"] + ring["height"] / 2 - box["y"] - box["height"] / 2,
    )
    assert off < 30  # a block is at most 15 pixels wide: 30 of them and more in a view of 400
    page.screenshot(path=pictures / "report_picked.png")
    page.keyboard.press("Escape")
    _settled(page)
    assert not page.locator("#folded .ring").is_visible()
    assert _facts(page) == {}


def test_the_first_block_is_found_by_its_row(page: Any) -> None:
    page.locator("#row").fill("1")
    page.keyboard.press("Enter")
    assert _facts(page)["unfolded x"] == "0.0000 m"
    page.locator("#row").fill("99999")
    page.keyboard.press("Enter")
    assert "no such row" in page.locator("#found").text_content()


def test_another_column_changes_colours_and_legend(page: Any) -> None:
    before = _seen(page, "folded"), _seen(page, "unfolded")
    page.locator("#colour").select_option(label="grade")
    after = _seen(page, "folded"), _seen(page, "unfolded")
    assert all(a != b for a, b in zip(before, after, strict=True))
    assert "36 without a value" in page.locator("#legend").text_content()  # 1,800 / 50
    page.locator("#colour").select_option(label="rock")
    assert "ore <b>" in page.locator("#legend").text_content()
    page.locator("#colour").select_option(label=HOSTILE)
    assert "1st to the 99th percentile" in page.locator("#legend").text_content()
    one = _seen(page, "folded")
    page.locator("#palette").select_option("diverging")
    assert _seen(page, "folded") != one


def test_keys_turn_zoom_and_reset_both_views(page: Any) -> None:
    page.locator("#folded canvas").focus()
    before = start = _seen(page, "folded"), _seen(page, "unfolded")
    for key in ("ArrowLeft", "ArrowUp", "+", "Shift+ArrowRight"):
        page.keyboard.press(key)
        after = _seen(page, "folded"), _seen(page, "unfolded")
        assert all(a != b for a, b in zip(before, after, strict=True)), key
        before = after
    page.keyboard.press("Home")
    assert (_seen(page, "folded"), _seen(page, "unfolded")) == start
    page.locator("#linked").uncheck()
    page.locator("#folded canvas").focus()
    before = _seen(page, "folded"), _seen(page, "unfolded")
    page.keyboard.press("ArrowLeft")
    assert _seen(page, "folded") != before[0]
    assert _seen(page, "unfolded") == before[1]


def test_slices_show_the_same_blocks_in_both_views(page: Any) -> None:
    before = _seen(page, "folded"), _seen(page, "unfolded")
    page.locator("#unfolded-axis").select_option(label="across x")
    page.locator("#unfolded-keep").select_option("below")
    after = _seen(page, "folded"), _seen(page, "unfolded")
    assert all(a != b for a, b in zip(before, after, strict=True))
    # The slider stands in the middle of 0 to 29: blocks at 0 to 14, of 12 by 5.
    assert page.locator("#shown").text_content().startswith("900 of 1,800 blocks")
    page.locator("#unfolded-at").focus()
    page.keyboard.press("Home")
    assert page.locator("#shown").text_content().startswith("60 of 1,800")
    page.locator("#unfolded-axis").select_option(label="by height")
    page.locator("#unfolded-keep").select_option("slab")
    assert page.locator("#shown").text_content().startswith("360 of 1,800")  # the lowest layer
    page.locator("#unfolded-axis").select_option("")
    assert "outer blocks" in page.locator("#shown").text_content()


def test_a_slice_leads_and_the_other_view_follows(page: Any) -> None:
    page.select_option("#folded-axis", "0")
    page.select_option("#unfolded-axis", "1")
    assert page.input_value("#folded-axis") == ""  # the slice set last leads
    for keep in ("below", "above", "slab"):
        page.select_option("#unfolded-keep", keep)
        for at in ("0", "333", "1000"):
            page.evaluate(
                """at => { const s = document.getElementById("unfolded-at"); s.value = at;
                s.dispatchEvent(new Event("input")); }""",
                at,
            )
            assert int(page.inner_text("#shown").split()[0].replace(",", "")) > 0


def test_a_length_is_as_long_in_both_views(page: Any) -> None:
    for tall in ("1", "5"):
        page.select_option("#tall", tall)
        ends = "height × 5" if tall == "5" else " m"
        page.wait_for_function(
            "ends => document.querySelector('.scale span').textContent.endsWith(ends)", arg=ends
        )
        widths = page.evaluate(
            """[...document.querySelectorAll(".scale i")].map(e => e.style.width)"""
        )
        words = page.evaluate(
            """[...document.querySelectorAll(".scale span")].map(e => e.textContent)"""
        )
        assert widths[0] == widths[1]
        assert words[0] == words[1]


def test_holes_are_named_and_north_is_shown(page: Any) -> None:
    names = page.locator(".hole:visible")
    assert names.all_inner_texts() == ["DH-1", "DH-1"]
    page.uncheck("#names")
    page.wait_for_selector(".hole:not([hidden])", state="detached")
    assert page.text_content("#folded .north") == "N"


def test_a_picture_of_both_views_is_saved(page: Any, pictures: Path) -> None:
    with page.expect_download() as saved:
        page.click("#picture")
    path = pictures / "saved.png"
    saved.value.save_as(path)
    assert saved.value.suggested_filename == "unfolding.png"
    image = imread(path)
    high, wide = image.shape[:2]
    assert wide > 1.5 * high  # two views side by side
    for half in (image[:, : wide // 2], image[:, wide // 2 :]):
        assert len(np.unique(half.reshape(-1, half.shape[2]), axis=0)) > 100  # a body in each


def test_samples_are_coloured_hidden_and_picked(page: Any) -> None:
    before = _seen(page, "folded")
    page.locator("#sample-colour").select_option(label="cu")
    coloured = _seen(page, "folded")
    assert coloured != before
    page.locator("#samples").uncheck()
    page.locator("#traces").uncheck()
    assert _seen(page, "folded") != coloured


def test_everything_is_reached_by_tab_and_labelled(page: Any) -> None:
    unlabelled = page.evaluate(
        """() => [...document.querySelectorAll("select, input, button, canvas")].filter((e) =>
        !(e.labels && e.labels.length) && !e.getAttribute("aria-label") && !e.textContent.trim())
        .map((e) => e.outerHTML.slice(0, 80))"""
    )
    assert unlabelled == []
    reached = []
    page.locator("body").click(position={"x": 2, "y": 2})
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
    order = ["theme", "colour", "palette", "range", "sample-colour", "CANVAS", "folded-axis"]
    assert [name for name in reached if name in order][: len(order)] == order
    assert {"row", "linked", "edges", "unfolded-axis"} <= set(reached)
    ring = page.evaluate(
        """() => { const c = document.querySelector("#folded canvas"); c.focus();
        return getComputedStyle(c.parentElement).outlineStyle; }"""
    )
    assert ring == "solid"


@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_readable_wide_and_narrow_light_and_dark(
    browser: Any, report: Path, pictures: Path, width: int, scheme: str
) -> None:
    page = _opened(browser, report, width, scheme)
    page.screenshot(path=pictures / f"report_{width}_{scheme}.png", full_page=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for space in ("folded", "unfolded"):
        box = page.locator(f"#{space} canvas").bounding_box()
        assert 0 <= box["x"]
        assert box["x"] + box["width"] <= width
    assert _contrast(page) >= 4.5  # WCAG 2.1, level AA, for text
    page.locator("#theme").select_option("dark" if scheme == "light" else "light")
    assert _contrast(page) >= 4.5
    assert page.complaints == []
    page.context.close()


def _contrast(page: Any) -> float:
    """Return the least contrast of the text's colours on the backgrounds that they stand on."""
    colours = page.evaluate(
        """() => { const s = getComputedStyle(document.documentElement);
        return Object.fromEntries(["page", "card", "port", "ink", "soft", "good", "care", "bad"]
        .map((n) => [n, s.getPropertyValue("--" + n).trim()])); }"""
    )
    light = {name: _luminance(colour) for name, colour in colours.items()}
    pairs = [(a, b) for a in ("ink", "soft", "good", "care", "bad") for b in ("page", "card")]
    pairs.append(("ink", "port"))
    return min(
        (max(light[a], light[b]) + 0.05) / (min(light[a], light[b]) + 0.05) for a, b in pairs
    )


def _luminance(colour: str) -> float:
    """Return the relative luminance of a colour (WCAG 2.1)."""
    parts = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_without_webgl_it_says_so_and_shows_stills(browser: Any, report: Path) -> None:
    context = browser.new_context(offline=True)
    page = context.new_page()
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(report.as_uri())
    page.wait_for_selector('html[data-ready="without-views"]')
    assert "no WebGL 2" in page.locator("#unable").text_content()
    assert page.locator("#stills img").first.is_visible()
    assert not page.locator("#stage").is_visible()
    context.close()


def test_options_are_copied(browser: Any, report: Path) -> None:
    page = _opened(browser, report)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.locator('button[data-copy="config"]').click()
    page.wait_for_function(
        "() => document.querySelector('button[data-copy=config]').textContent === 'Copied'"
    )
    assert page.evaluate("navigator.clipboard.readText()") == 'method = "sheet"\n'
    page.context.close()


def test_faults_are_drawn_in_both_views_and_can_be_taken_away(
    browser: Any, tmp_path: Path, pictures: Path
) -> None:
    body = simulate_faulted("graben", steps=(20.0, 20.0, 10.0))
    table = []
    for fault, slip in body.slips.items():
        own = slip.blocks == slip.blocks[0]
        rows = np.flatnonzero(own.all(axis=1) & (np.abs(slip.flat[:, 2]) < 5))
        places = {"foot_": slip.footwall, "hanging_": slip.hanging_wall,
                  "foot_unfolded_": slip.flat, "hanging_unfolded_": slip.flat}  # fmt: skip
        table.append(
            pd.DataFrame({
                "fault": fault, "footwall_block": slip.blocks[rows, 0],
                "hanging_wall_block": slip.blocks[rows, 1], "stratigraphic": 0.5,
                "throw": slip.throw[rows], "strike_slip": 0.0, "gap": 1.0,
                **{f"{wall}{axis}": P[rows, k] for wall, P in places.items()
                   for k, axis in enumerate("xyz")},
            })
        )  # fmt: skip
    faults = CarriedFaults(body.surfaces, pd.concat(table))
    columns = {"fault_block": body.fault_block, "stratigraphic": body.level}
    path = tmp_path / "faults.html"
    write_report(path, {"injective": True}, body.folded, body.truth, columns, faults=faults)
    opened = _opened(browser, path, 1000)
    assert opened.complaints == []
    assert "fault_block" in opened.locator("#legend").text_content()
    opened.screenshot(path=pictures / "report_faults.png", full_page=True)
    before = [_seen(opened, space) for space in ("folded", "unfolded")]
    opened.locator("#faults").uncheck()
    after = [_seen(opened, space) for space in ("folded", "unfolded")]
    assert all(a != b for a, b in zip(before, after, strict=True))
    assert opened.locator("figure.map svg").is_visible()
    opened.context.close()


def test_a_body_without_faults_offers_none(page: Any) -> None:
    assert not page.locator("#faults").is_visible()
    assert page.locator("figure.map").count() == 0
