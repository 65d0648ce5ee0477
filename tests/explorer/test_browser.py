"""Pages to explore in headless Chromium: they load in silence, and follow pointer, keys, address and colours.

The checker of accessibility is axe-core, as axe-playwright-python brings it.
"""

import importlib.util
import json
import os
import shutil
import time
from importlib.resources import files

import numpy as np
import pytest

import dea_maps as dm

MISSING = [name for name in ("bokeh", "selenium", "axe_playwright_python") if importlib.util.find_spec(name) is None]
MISSING += [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
if MISSING and "CI" not in os.environ:
    pytest.skip(f"needs {', '.join(MISSING)}", allow_module_level=True)

FIELD = np.linspace(0.8, 2.2, 15)
RATE = np.geomspace(1e-2, 1e2, 13)
RATIO = [2.0, 3.85, 6.0]
DUTY, TRAIN_RATIO = [0.25, 0.5], [3.0, 4.0]
OPTIONS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1280,800",
)
# Where a point of the map is in the window; the page itself knows its scales and its frame.
PLACE = """
const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("map"))
const box = view.el.getBoundingClientRect()
const {x_scale, y_scale} = view.frame
return [box.left + x_scale.compute(arguments[0]), box.top + y_scale.compute(arguments[1])]
"""
SAID = "return document.getElementById('said').textContent"
COLUMN = "return Array.from(Bokeh.documents[0].get_model_by_name(arguments[0]).data[arguments[1]])"
# The colour of a pixel of the map.
PIXEL = """
const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("map"))
const {x_scale, y_scale} = view.frame
const canvas = view.canvas_view.compose().canvas ?? view.canvas_view.compose()
const [x, y] = [x_scale.compute(arguments[0]), y_scale.compute(arguments[1])].map((at) => at * devicePixelRatio)
return Array.from(canvas.getContext("2d").getImageData(x, y, 1, 1).data)
"""


class Page:
    """A page in a browser, and what a visitor does there."""

    def __init__(self, browser, path, fragment=""):
        self.browser = browser
        browser.get("about:blank")  # another fragment alone would not load the page again
        browser.get(path.as_uri() + fragment)
        self.until(lambda: self.run("return !!window.Bokeh?.documents[0]?.is_idle && !!Bokeh.documents[0].roots()"))
        self.until(lambda: self.said() != "")

    def run(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def until(self, holds, seconds=20):
        end = time.monotonic() + seconds
        while not holds():
            assert time.monotonic() < end, "the page did not get there"
            time.sleep(0.02)

    def said(self):
        return self.run(SAID)

    def column(self, model, name):
        return np.array(self.run(COLUMN, model, name), dtype=float)

    def pointer(self, x, y, click):
        from selenium.webdriver.common.action_chains import ActionChains

        chain = ActionChains(self.browser, duration=10)
        chain.w3c_actions.pointer_action.move_to_location(*(round(at) for at in self.run(PLACE, x, y)))
        if click:
            chain.w3c_actions.pointer_action.click()
        chain.perform()

    def press(self, keys):
        from selenium.webdriver.common.action_chains import ActionChains

        ActionChains(self.browser).send_keys(keys).perform()

    def focus(self, name):
        self.run("document.getElementById(arguments[0]).focus()", name)

    def click(self, name):
        self.run("document.getElementById(arguments[0]).click()", name)

    def table(self):
        """Return the rows of the table of values."""
        rows = self.run("return Array.from(values.rows, (row) => Array.from(row.cells, (cell) => cell.textContent))")
        return {name: values for name, *values in rows}

    def faults(self):
        """Return the rules that axe-core finds broken, and how serious each is."""
        if not self.run("return !!window.axe"):
            self.run(files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8"))
        found = self.browser.execute_async_script("axe.run().then(arguments[arguments.length - 1])")
        assert found["passes"], "nothing was checked"
        return {rule["id"]: rule["impact"] for rule in found["violations"]}

    def tooltip(self):
        """Return the words of all tooltips, through the roots of the shadows that Bokeh puts them in."""
        return self.run(
            """
            const found = []
            const visit = (node) => {
              if (node.classList?.contains("bk-Tooltip")) found.push(node.shadowRoot.textContent)
              for (const child of [...node.children, ...(node.shadowRoot?.children ?? [])]) visit(child)
            }
            visit(document.body)
            return found.join(" ")
            """
        )


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    assert not MISSING, f"the tests in the browser need {', '.join(MISSING)}"
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for option in (*OPTIONS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def cube():
    return dm.sweep(dm.RampHold(), field=FIELD, rate=RATE, modulus_ratio=RATIO)


@pytest.fixture(scope="module")
def folder(cube, tmp_path_factory):
    from dea_maps.explorer.export import explore

    folder = tmp_path_factory.mktemp("pages")
    explore(cube, folder / "cube.html")
    explore(dm.physical(cube, dm.VHB, 100e-6), folder / "film.html")
    explore(dm.sweep(dm.Step(), field=FIELD, modulus_ratio=[2.0, 3.0, 4.0]), folder / "step.html")
    explore(dm.sweep(dm.Step(), field=FIELD, modulus_ratio=3.0), folder / "curve.html")
    explore(
        dm.sweep(dm.PulseTrain(), field=FIELD, period=[0.5, 1.0, 2.0], duty=DUTY, modulus_ratio=TRAIN_RATIO),
        folder / "train.html",
    )
    return folder


@pytest.fixture
def screen(browser):
    """Set width of the window and colours of the reader; both are set back."""

    def show(width, colours):
        size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        features = [{"name": "prefers-color-scheme", "value": colours}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    yield show
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def clicked(page, x, y):
    before = page.said()
    time.sleep(0.4)  # two clicks at once would be a double click
    page.pointer(x, y, click=True)
    page.until(lambda: page.said() != before)


def curve_shown(page):
    hidden = page.run("return document.getElementById('curves').hidden")
    return None if hidden else (page.column("chosen curve", "time"), page.column("chosen curve", "y"))


def test_it_loads_in_silence_and_asks_for_nothing(browser, folder):
    for name in ("cube", "film", "step", "curve", "train"):
        browser.get_log("browser"), browser.get_log("performance")
        page = Page(browser, folder / f"{name}.html")
        assert page.run("return document.title").startswith("Phase diagram")
        assert [entry for entry in browser.get_log("browser") if entry["level"] in {"WARNING", "SEVERE"}] == []
        events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
        asked = [event["params"] for event in events if event["method"] == "Network.requestWillBeSent"]
        addresses = [each["request"]["url"] for each in asked]
        assert addresses, "the requests were not seen"
        assert [url for url in addresses if not url.startswith(("file:", "data:", "blob:"))] == []
        assert len([url for url in addresses if url.startswith("file:")]) == 1


def test_the_slider_moves_the_map(browser, folder, cube):
    from selenium.webdriver.common.keys import Keys

    page = Page(browser, folder / "cube.html")

    def map_is(ratio):
        part = cube.sel(modulus_ratio=ratio).transpose("rate", "field")
        np.testing.assert_array_equal(page.column("cells", "outcome"), part.outcome.values.ravel())
        np.testing.assert_allclose(page.column("cells", "time_to_failure"), part.time_to_failure.values.ravel(), 1e-6)

    def slider():
        return page.run("return document.getElementById('value-0').textContent")

    assert slider() == "3.85"
    map_is(3.85)
    pixel = page.run(PIXEL, 1.9, 100.0)
    page.focus("across-0")
    page.press(Keys.ARROW_RIGHT)
    page.until(lambda: slider() == "6")
    map_is(6.0)
    page.until(lambda: page.run(PIXEL, 1.9, 100.0) != pixel)
    page.press(Keys.ARROW_LEFT)
    page.press(Keys.ARROW_LEFT)
    page.until(lambda: slider() == "2")
    map_is(2.0)


def test_values_are_under_the_pointer(browser, folder, cube):
    page = Page(browser, folder / "cube.html")
    page.pointer(1.5, 1.0, click=False)
    page.until(lambda: "fails later" in page.tooltip())
    cell = cube.sel(field=1.5, rate=1.0, modulus_ratio=3.85, method="nearest")
    words = page.tooltip()
    for value in (1.5, 1.0, 3.85, float(cell.time_to_failure), float(cell.critical_stretch)):
        assert f"{value:.4g}" in words
    page.pointer(0.9, 1.0, click=False)
    page.until(lambda: "survives" in page.tooltip())
    cell = cube.sel(field=0.9, rate=1.0, modulus_ratio=3.85, method="nearest")
    assert f"{float(cell.final_stretch):.4g}" in page.tooltip()


def test_a_click_draws_the_curve_of_that_film(browser, folder, cube):
    page = Page(browser, folder / "cube.html")
    assert curve_shown(page) is None
    for field, rate in ((1.5, 1.0), (2.18, 90.0), (1.1, 0.011)):
        clicked(page, field, rate)
        cell = cube.sel(field=field, rate=rate, modulus_ratio=3.85, method="nearest")
        time_shown, stretch = curve_shown(page)
        assert time_shown[0] == 0.0
        assert (np.diff(stretch) >= 0.0).all()
        np.testing.assert_allclose(time_shown[-1], float(cell.time_to_failure), rtol=1e-6)
        np.testing.assert_allclose(stretch[-1], float(cell.critical_stretch), rtol=3e-5)
        assert page.column("chosen end", "time").tolist() == [time_shown[-1]]
        assert f"It fails after {float(cell.time_to_failure):.4g} τ" in page.said()
    clicked(page, 0.9, 1.0)
    cell = cube.sel(field=0.9, rate=1.0, modulus_ratio=3.85, method="nearest")
    np.testing.assert_allclose(curve_shown(page)[1][-1], float(cell.final_stretch), rtol=1e-3)
    assert page.column("chosen end", "time").size == 0
    assert "It survives" in page.said()


def test_the_chosen_film_follows_the_slider(browser, folder, cube):
    page = Page(browser, folder / "cube.html")
    clicked(page, 1.5, 1.0)
    page.focus("across-0")
    page.press("\ue014")  # the arrow to the right
    cell = cube.sel(field=1.5, rate=1.0, modulus_ratio=6.0, method="nearest")
    page.until(lambda: "μU/μR = 6" in page.said())
    np.testing.assert_allclose(curve_shown(page)[0][-1], float(cell.time_to_failure), rtol=1e-6)


def test_a_film_that_fails_at_once_has_a_sentence(browser, folder):
    page = Page(browser, folder / "step.html")
    clicked(page, 2.1, 3.0)
    assert "It fails at once" in page.said()
    assert curve_shown(page) is None


def test_volts_and_seconds(browser, folder, cube):
    page = Page(browser, folder / "film.html")
    film = dm.physical(cube, dm.VHB, 100e-6).sel(modulus_ratio=3.85).isel(field=7, rate=6)
    clicked(page, float(film.voltage), float(film.voltage_rate))
    np.testing.assert_allclose(curve_shown(page)[0][-1], float(film.seconds_to_failure), rtol=1e-6)
    assert f"{float(film.seconds_to_failure):.4g} s" in page.said()
    page.until(lambda: f"{float(film.critical_voltage):.4g}" in page.tooltip())


def test_a_map_over_one_parameter_is_a_curve(browser, folder):
    page = Page(browser, folder / "curve.html")
    ds = dm.sweep(dm.Step(), field=FIELD, modulus_ratio=3.0)
    clicked(page, 1.3, 0.5)
    np.testing.assert_allclose(
        curve_shown(page)[0][-1], float(ds.time_to_failure.sel(field=1.3, method="nearest")), 1e-6
    )


def test_arrow_keys_choose_a_film(browser, folder, cube):
    from selenium.webdriver.common.keys import Keys

    page = Page(browser, folder / "cube.html")
    assert page.run("const map = document.getElementById('map'); return [map.tabIndex, !!map.ariaLabel]") == [0, True]
    assert page.run("return document.getElementById('said').getAttribute('role')") == "status"  # it is read out
    page.focus("map")
    column, row = FIELD.size // 2, RATE.size // 2
    steps = [
        (Keys.ARROW_LEFT, 0, 0), (Keys.ARROW_RIGHT, 1, 0), (Keys.ARROW_UP, 0, 1), (Keys.ARROW_DOWN, 0, -1),
        (Keys.END, 99, 0), (Keys.ARROW_RIGHT, 1, 0), (Keys.HOME, -99, 0),
    ]  # fmt: skip
    for key, right, up in steps:
        page.press(key)
        column = min(max(column + right, 0), FIELD.size - 1)
        row += up
        cell = cube.sel(modulus_ratio=3.85).isel(field=column, rate=row)
        page.until(
            lambda: page.run("return Bokeh.documents[0].get_model_by_name('cells').selected.indices[0]") is not None
        )
        assert f"field E/Ec = {FIELD[column]:.4g}, ramp rate k τ/Ec = {RATE[row]:.4g}," in page.said()
        assert page.table()["outcome"] == ["survives" if cell.outcome == 0 else "fails later"]
    name = page.run("return document.getElementById('trajectory').getAttribute('aria-label')")
    assert name.startswith("Stretch against time t/τ: from 1 to ")


def test_the_checker_finds_nothing(browser, folder, screen):
    for width, colours, name in ((390, "dark", "film"), (1280, "light", "train")):
        screen(width, colours)
        page = Page(browser, folder / f"{name}.html")
        page.focus("map")
        page.press("\ue012")
        page.click("keep")
        page.press("\ue012")
        assert len(page.table()["outcome"]) == 2
        assert page.faults() == {}
    page.run("document.querySelector('label').remove()")
    assert page.faults()["label"] == "critical"


def test_the_page_follows_the_colours_of_the_reader(browser, folder, screen):
    def brightness():
        paper = page.run("return getComputedStyle(document.body).backgroundColor")
        return max(json.loads(paper.replace("rgb(", "[").replace(")", "]"))), max(page.run(PIXEL, 0.9, 1.0)[:3])

    screen(1280, "dark")
    page = Page(browser, folder / "cube.html")
    page.until(lambda: max(brightness()) < 100)
    screen(1280, "light")
    page.until(lambda: min(brightness()) > 200)


def test_a_phone_shows_the_page_without_scrolling_sideways(browser, folder, screen):
    screen(390, "light")
    for name in ("film", "train", "curve"):
        page = Page(browser, folder / f"{name}.html")
        page.focus("map")
        page.press("\ue012")
        page.click("keep")
        page.until(lambda page=page: len(page.table()) > 3)
        assert page.run("return document.documentElement.scrollWidth") <= 390


def test_two_films_are_compared_and_the_address_remembers(browser, folder, cube):
    page = Page(browser, folder / "cube.html")
    assert page.run("return document.getElementById('keep').disabled")
    clicked(page, 1.5, 1.0)
    first = page.column("chosen curve", "y")
    page.click("keep")
    clicked(page, 2.0, 10.0)
    np.testing.assert_array_equal(page.column("kept curve", "y"), first)
    assert page.column("chosen curve", "y")[-1] != first[-1]
    page.run("quantity.value = 'area_strain'; quantity.dispatchEvent(new Event('change'))")
    page.focus("across-0")
    page.press("\ue012")  # the kept film stays at its modulus ratio
    page.run("const {x_range} = Bokeh.documents[0].get_model_by_name('map'); x_range.start = 1.25")
    kept = cube.sel(field=1.5, rate=1.0, modulus_ratio=3.85, method="nearest")
    np.testing.assert_allclose(page.column("kept curve", "y")[-1], float(kept.critical_stretch) ** 2 - 1.0, rtol=1e-4)
    table, said = page.table(), page.said()
    assert table["modulus ratio μU/μR"] == ["2", "3.85"]
    assert table["time to failure t/τ"][1] == f"{float(kept.time_to_failure):.4g}"
    page.until(lambda: "zoom=1.25" in page.run("return location.hash"))
    fragment = page.run("return location.hash")
    assert "modulus_ratio=2" in fragment and "field=2" in fragment
    again = Page(browser, folder / "cube.html", fragment)
    again.until(lambda: again.said() == said)
    assert again.table() == table
    assert again.run("return quantity.value") == "area_strain"
    assert again.run("return Bokeh.documents[0].get_model_by_name('map').x_range.start") == 1.25
    again.click("keep")
    assert again.column("kept curve", "time").size == 0


def test_an_address_of_something_else_is_ignored(browser, folder):
    page = Page(browser, folder / "cube.html", "#field=x&rate=&kept=1 2&zoom=3 1 2 1&curve=no&modulus_ratio=1e9")
    assert page.said().startswith("Click a film")
    assert page.run("return document.getElementById('value-0').textContent") == "6"
    assert curve_shown(page) is None


def test_every_dimension_has_a_slider_and_the_program_is_drawn(browser, folder):
    page = Page(browser, folder / "train.html")
    labels = page.run(
        "return Array.from(document.querySelectorAll('input[type=range]'), (each) => each.labels[0].textContent)"
    )
    assert labels == ["duty d", "modulus ratio μU/μR"]
    for name in ("across-0", "across-1"):
        page.focus(name)
        page.press("\ue012")
    clicked(page, 1.1, 1.0)
    assert page.table()["duty d"] == ["0.25"] and page.table()["modulus ratio μU/μR"] == ["3"]
    time_shown, field = page.column("chosen curve", "time"), page.column("chosen curve", "field")
    assert (time_shown[-1], field[0]) == (pytest.approx(3.0), 0.0)
    for repetition in range(3):
        inside = time_shown - repetition
        np.testing.assert_allclose(field[(inside > 0.01) & (inside < 0.24)], 1.1, rtol=1e-4)
        np.testing.assert_allclose(field[(inside > 0.26) & (inside < 0.99)], 0.0, atol=1e-4)
    ds = dm.sweep(dm.PulseTrain(), field=1.1, period=1.0, duty=0.25, modulus_ratio=3.0)
    assert f"between {float(ds.steady_stretch_min):.4g} and {float(ds.steady_stretch_max):.4g}" in page.said()


def test_where_breakdown_comes_first_cells_are_hatched(browser, tmp_path):
    from dea_maps.explorer.export import explore

    ds = dm.breakdown(dm.sweep(dm.Step(), field=[0.7, 1.2, 1.5, 1.9], modulus_ratio=[3.0, 4.0, 5.0]), 3.2)
    explore(ds, tmp_path / "broken.html")
    page = Page(browser, tmp_path / "broken.html")
    hatch = page.run(
        """
        const renderers = Bokeh.documents[0].get_model_by_name("map").renderers
        return renderers.map(({name, glyph}) => [name, glyph.hatch_pattern.value ?? ""])
        """
    )
    assert ["outcome 4", "x"] in hatch and ["outcome 1", ""] in hatch
    clicked(page, 1.5, 4.0)
    broken = ds.sel(field=1.5, modulus_ratio=4.0)
    assert f"It breaks down after {float(broken.time_to_breakdown):.4g} τ" in page.said()
    assert page.table()["outcome"] == ["breaks down first"]
