"""Pages to explore in headless Chromium: they load in silence, the slider moves the map, a click draws the curve."""

import importlib.util
import json
import os
import shutil
import time

import numpy as np
import pytest

import dea_maps as dm

MISSING = [name for name in ("bokeh", "selenium") if importlib.util.find_spec(name) is None]
MISSING += [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
if MISSING and "CI" not in os.environ:
    pytest.skip(f"needs {', '.join(MISSING)}", allow_module_level=True)

FIELD = np.linspace(0.8, 2.2, 15)
RATE = np.geomspace(1e-2, 1e2, 13)
RATIO = [2.0, 3.85, 6.0]
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

    def __init__(self, browser, path):
        self.browser = browser
        browser.get(path.as_uri())
        self.until(lambda: self.run("return !!window.Bokeh?.documents[0]?.is_idle && !!Bokeh.documents[0].roots()"))
        self.until(lambda: "Click" in self.said())

    def run(self, script, *arguments):
        return self.browser.execute_script(script, *arguments)

    def until(self, holds, seconds=20):
        end = time.monotonic() + seconds
        while not holds():
            assert time.monotonic() < end, "the page did not get there"
            time.sleep(0.02)

    def said(self):
        return self.run("return Bokeh.documents[0].get_model_by_name('said').text")

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
    return folder


def clicked(page, x, y):
    before = page.said()
    time.sleep(0.4)  # two clicks at once would be a double click
    page.pointer(x, y, click=True)
    page.until(lambda: page.said() != before)


def curve_shown(page):
    visible = page.run("return Bokeh.documents[0].get_model_by_name('trajectory').visible")
    return (page.column("curve", "time"), page.column("curve", "stretch")) if visible else None


def test_it_loads_in_silence_and_asks_for_nothing(browser, folder):
    for name in ("cube", "film", "step", "curve"):
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
        return page.run("return Bokeh.documents[0].get_model_by_name('slider').value")

    assert slider() == "3.85"
    map_is(3.85)
    pixel = page.run(PIXEL, 1.9, 100.0)
    page.run(
        """
        const view = Bokeh.index.find_one(Bokeh.documents[0].get_model_by_name("slider"))
        view.shadow_el.querySelector("[tabindex='0']").focus()
        """
    )
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
        assert page.column("failure", "time").tolist() == [time_shown[-1]]
        assert f"It fails after {float(cell.time_to_failure):.4g} τ" in page.said()
    clicked(page, 0.9, 1.0)
    cell = cube.sel(field=0.9, rate=1.0, modulus_ratio=3.85, method="nearest")
    np.testing.assert_allclose(curve_shown(page)[1][-1], float(cell.final_stretch), rtol=1e-3)
    assert page.column("failure", "time").size == 0
    assert "It survives" in page.said()


def test_the_chosen_film_follows_the_slider(browser, folder, cube):
    page = Page(browser, folder / "cube.html")
    clicked(page, 1.5, 1.0)
    page.run("Bokeh.documents[0].get_model_by_name('slider').value = '6'")
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
