"""The page in a real browser, Chromium without a window: it plays, sorts, copies, switches, and can be read by all."""

import importlib.util
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import inhand
from inhand.asterisk_test.beside import Beside
from inhand.asterisk_test.config import AsteriskConfig
from inhand.asterisk_test.report import Run
from inhand.asterisk_test.results import result_of_trial
from inhand.asterisk_test.run import prepare, simulate
from inhand.plots.heatmap import HeatMap
from inhand.plots.intervals import Estimates
from inhand.plots.page.charts import Axis, Chart, Charts, Heats, Intervals, Level, Line, heat_of, line, listing_of
from inhand.plots.page.document import WebPart, html_of
from inhand.plots.page.packed import packed, packed_flags
from inhand.plots.page.solids import Extent3, Solid, SolidFinger, SolidHand, SolidLink, SolidMotion, Solids
from inhand.plots.page.views import View
from page_reader import EVIL, named

pytest.importorskip("selenium", reason="tests in a browser need selenium: pip install selenium")

from selenium import webdriver
from selenium.webdriver.common.keys import Keys

CHROMIUM, DRIVER = (
    next(filter(None, map(shutil.which, names)), None)
    for names in (("chromium", "chromium-browser", "google-chrome"), ("chromedriver",))
)
pytestmark = pytest.mark.skipif(
    CHROMIUM is None or DRIVER is None, reason="tests in a browser need chromium and chromedriver on the PATH"
)
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1280,900",
)  # fmt: skip
PHONE = 390
"""Width of a phone [px]."""
WAIT_S = 5.0
"""How long a page may take to be what it should [s]."""
Driver = Any
"""Selenium's driver; it carries no annotations worth the name."""


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driver]:
    """Return a browser of its own."""
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('browser')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    found = webdriver.Chrome(options=options, service=webdriver.ChromeService(str(DRIVER)))
    yield found
    found.quit()


@pytest.fixture(scope="module")
def finished() -> Run:
    """Return a run of two directions that is told to have kept the object, and beside it one that lost it."""
    config = AsteriskConfig(controller="thesis-ik", directions="Out,Right", trials=1, seed=2)
    lost = simulate(config, prepare(config))
    kept = tuple(replace(trial, outcome="end of grip") for trial in lost)
    results = [tuple(map(result_of_trial, trials)) for trials in (kept, lost)]
    return Run(config, kept, results[0], beside=(Beside("thesis-ik", lost, results[1]),), label="ik")


@pytest.fixture(scope="module")
def place(finished: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the page of the run, in a folder whose name is as bad as can be."""
    folder = tmp_path_factory.mktemp("pages") / EVIL.replace("/", "")
    folder.mkdir()
    (folder / "report.html").write_text(finished.html(), encoding="utf-8")
    return folder / "report.html"


def shown(driver: Driver, place: Path, theme: str = "light", width: int = 1280) -> None:
    """Show a page from the disk, for a system that is light or dark."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    media = {"features": [{"name": "prefers-color-scheme", "value": theme}]}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    driver.get(place.as_uri())
    until(lambda: driver.execute_script("return document.documentElement.dataset.ready === 'yes'"))


def until(true: Callable[[], object]) -> None:
    """Wait until something is true."""
    end = time.monotonic() + WAIT_S
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def complaints(driver: Driver) -> list[str]:
    return [entry["message"] for entry in driver.get_log("browser")]


def text(driver: Driver, selector: str) -> str:
    return str(driver.execute_script("return document.querySelector(arguments[0]).textContent", selector))


def press(driver: Driver, selector: str, *keys: str) -> None:
    """Focus a node as a keyboard would and press keys there, one after another, wherever they lead."""
    driver.execute_script("document.querySelector(arguments[0]).focus()", selector)
    for key in keys:
        driver.switch_to.active_element.send_keys(key)


def test_a_trial_plays_to_its_end_and_can_be_scrubbed(driver: Driver, place: Path, finished: Run) -> None:
    shown(driver, place)
    assert text(driver, ".told-trial").startswith("ik, Out, trial 1: end of grip")
    driver.find_element("css selector", ".play").click()
    until(lambda: not text(driver, ".clock").startswith("0.00 s"))
    assert text(driver, ".play") == "Pause"
    driver.find_element("css selector", ".play").click()
    set_range = "const r = document.querySelector('.controls input'); r.value = arguments[0] ?? r.max;"
    driver.execute_script(set_range + "r.dispatchEvent(new Event('input'))", None)
    path, _, _ = finished.trials[0].manipulated_path()
    assert f"manipulate · {path[-1, 1]:.1f} mm" in text(driver, ".clock")
    driver.execute_script(set_range + "r.dispatchEvent(new Event('input'))", 0)
    assert "place" in text(driver, ".clock")
    assert not complaints(driver)


def test_directions_and_trials_are_picked_and_laid_over_each_other(driver: Driver, place: Path) -> None:
    shown(driver, place)
    press(driver, ".picker [role=radio][tabindex='0']", Keys.ARROW_RIGHT)
    assert text(driver, ".told-trial").startswith("ik, Right, trial 1")
    script = "return [...document.querySelectorAll('.direction.chosen')].map(n => n.getAttribute('aria-label'))"
    chosen = driver.execute_script(script)
    assert len(chosen) == 3
    assert all(label.startswith("Right") for label in chosen)
    assert len(driver.find_elements("css selector", ".stage .body")) == 1
    lay = "const s = document.querySelectorAll('.picker select')[1]; s.value = arguments[0];"
    driver.execute_script(lay + "s.dispatchEvent(new Event('change'))", "2")
    assert len(driver.find_elements("css selector", ".stage .body.over")) == 1
    driver.find_element("css selector", ".chip").click()
    assert text(driver, ".told-trial").startswith("thesis-ik, Out, trial 1: lost contact")
    assert not complaints(driver)


def test_nothing_hides_the_numbers_of_rings_and_a_limit_is_told_once(driver: Driver, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    page.write_text(inhand.reach(directions="Out,In").html(), encoding="utf-8")
    shown(driver, page)
    order = "return [...document.querySelectorAll('.asterisk .scene, .asterisk .ring-text')].map(n => n.tagName)"
    drawn = driver.execute_script(order)
    assert set(drawn[drawn.index("text") :]) == {"text"}
    assert text(driver, ".panel:has(.ways) h3") == "The hand's limit [mm]"
    assert text(driver, ".ways .value") == "65.5"
    assert not complaints(driver)


def test_values_stand_under_the_pointer(driver: Driver, place: Path, finished: Run) -> None:
    shown(driver, place)
    point = """
    const svg = document.querySelectorAll('.panel .asterisk')[1];
    const { left, top, width, height } = svg.getBoundingClientRect();
    const at = { clientX: left + width / 2 + 40, clientY: top + arguments[0] * height, bubbles: true };
    svg.querySelector('svg').dispatchEvent(new PointerEvent('pointermove', at));
    return document.querySelector('.tip').innerText;
    """
    told = driver.execute_script(point, 0.4)
    name, way, count, at = told.splitlines()
    result = next(each for each in finished.results if each.direction == name)
    assert way.endswith(f"of the limit {result.limit:.1f} mm")
    assert count == "1 trial: end of grip"
    assert at.startswith("pointer at ")


def test_tables_are_sorted_and_copied(driver: Driver, place: Path) -> None:
    shown(driver, place)
    column = "return [...document.querySelectorAll('tbody tr')].map(r => r.cells[arguments[0]].textContent)"
    press(driver, "thead th:nth-child(2) .sort", Keys.ENTER)
    first = driver.execute_script(column, 0)
    press(driver, "thead th:nth-child(2) .sort", Keys.ENTER)
    assert driver.execute_script(column, 0) == first[::-1]
    assert driver.execute_script("return document.querySelectorAll('th')[1].getAttribute('aria-sort')") == "descending"
    copied = "const kept = []; window.kept = kept; navigator.clipboard.writeText = async t => { kept.push(t) };"
    driver.execute_script(copied)
    for button in driver.find_elements("css selector", ".tools .small")[:2]:
        driver.execute_script("arguments[0].click()", button)
    until(lambda: driver.execute_script("return window.kept.length === 2"))
    csv, latex = driver.execute_script("return window.kept")
    assert csv.splitlines()[0].startswith("Direction,ik [mm],thesis-ik [mm],Limit [mm],Of limit")
    assert latex.startswith("\\begin{tabular}{lrrrr")
    assert "& Outcome \\\\" in latex
    assert not complaints(driver)


def test_light_and_dark_follow_the_system_until_the_reader_chooses(driver: Driver, place: Path) -> None:
    paper = "return getComputedStyle(document.body).backgroundColor"
    shown(driver, place, "dark")
    assert driver.execute_script(paper) == "rgb(16, 21, 27)"
    press(driver, "#theme", Keys.ENTER)
    assert driver.execute_script(paper) == "rgb(255, 255, 255)"
    shown(driver, place, "dark")
    assert driver.execute_script(paper) == "rgb(255, 255, 255)"
    press(driver, "#theme", Keys.ENTER)
    assert text(driver, "#theme") == "Light"


def test_the_keyboard_alone_reaches_and_works_everything(driver: Driver, place: Path) -> None:
    shown(driver, place)
    watch = "window.seen = []; document.addEventListener('focusin', e => seen.push(e.target.className.baseVal ??"
    driver.execute_script(f"{watch} (e.target.className || e.target.id || e.target.tagName.toLowerCase())))")
    driver.switch_to.active_element.send_keys(Keys.TAB * 40)
    seen = driver.execute_script("return seen")
    assert {"skip", "theme", "direction", "select", "play", "table", "sort", "small"} <= {
        word for name in seen for word in name.split()
    }
    press(driver, ".controls input", "k")
    until(lambda: text(driver, ".play") == "Pause")
    press(driver, ".controls input", "k", ".")
    before = text(driver, ".clock")
    press(driver, ".controls input", ",")
    assert text(driver, ".play") == "Play"
    assert text(driver, ".clock") != before


def test_names_do_nothing_but_stand_there(driver: Driver, finished: Run, tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text(named(finished, EVIL).html(), encoding="utf-8")
    shown(driver, tmp_path / "report.html")
    assert driver.execute_script("return document.images.length") == 0
    assert text(driver, "h1") == f"Asterisk Test: {EVIL} on {EVIL} with {EVIL}"
    assert driver.execute_script("return document.querySelector('optgroup[label]').label") == EVIL
    assert EVIL in text(driver, ".panel h3")
    assert not complaints(driver)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a page with all that the pages of trainings and studies draw."""
    values, names = np.array([[0.5, np.nan], [1.0, 0.0]]), ("first", "second")
    heat = heat_of(
        HeatMap(names, ("a", "b"), values, [["\u00b1 0.1\n2 failed", "cannot run"], ["", ""]]), "Heat", "told"
    )
    estimates = Estimates("ik", np.array([0.4, np.nan]), np.array([0.1, np.nan]), np.array([0.6, np.nan]), "3 lost")
    x = np.array([0.0, 1.0, 2.0])
    drawn = (line("policy", x, x**2 + 0.1), line("raw", x, x, faint=True))
    band = Line("band", (0.0, 1.0), (0.5, None), 1, low=(0.4, None), high=(0.6, None), dots=True)
    points = Line("hands", (1.0, 2.0), (3.0, 4.0), 2, points=True, names=names, symbol="square")
    axis = Axis("episode", 0.0)
    charts = (
        Chart("Share", axis, Axis("share"), (*drawn, band), (Level(1.0),)),
        Chart("Loss", axis, Axis("loss", log=True), drawn[:1]),
        Chart("Hands", Axis("length"), Axis("reach"), (points,), scatter=True),
        Chart("Nothing", axis, Axis("loss"), ()),
    )
    views: list[WebPart] = [View("heat", Heats((heat,)), "Heat maps"), View("charts", Charts(charts), "Curves")]
    views.append(View("intervals", Intervals((listing_of(names, estimates),), -1.0, 1.0), "Estimates"))
    views.append(View("player", in_space(), "Replay"))
    place = tmp_path_factory.mktemp("study") / "report.html"
    place.write_text(html_of("A study", ["# Study", *views]), encoding="utf-8")
    return place


def in_space() -> Solids:
    """Return a trial of a finger of one link and an object, which is carried up."""
    link = SolidLink((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0), ((0.0, 0.0, 0.0, 0.0, 0.0, 40.0, 8.0),))
    palm = (0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 20.0, 20.0, 0.0)
    hand = SolidHand((palm,), (SolidFinger("a", 0, (link,), (0.0, 0.0, 40.0), 9.0),))
    face = (0.0, 0.0, 50.0, 30.0, 0.0, 50.0, 30.0, 30.0, 50.0, 0.0, 30.0, 50.0)
    rows = np.zeros((50, 1 + 7 + 1))
    rows[:, [3, 4]] = np.stack([np.linspace(0.0, 20.0, 50), np.ones(50)], axis=1)
    trial = SolidMotion(
        name="Up, trial 1",
        group="ik",
        direction="Up",
        along=(0.0, 0.0, 1.0),
        hand=0,
        object=0,
        rows=50,
        start=0,
        period=0.02,
        phases=((0, "manipulate"),),
        outcome="reached",
        failed=False,
        told="reached",
        target=(0.0, 0.0, 0.0, 0.0, 0.0, 20.0),
        packed=packed(rows),
        contact=packed_flags(np.ones((50, 1), dtype=bool)),
    )
    return Solids((hand,), (Solid((face,)),), (trial,), Extent3((0.0, 0.0, 30.0), 60.0))


def test_a_trial_in_space_plays_and_turns(driver: Driver, study: Path) -> None:
    shown(driver, study)
    picture = "return document.querySelector('canvas').toDataURL()"
    pictures = [driver.execute_script(picture)]
    press(driver, "canvas", Keys.ARROW_RIGHT)
    pictures.append(driver.execute_script(picture))
    driver.execute_script(
        "const r = document.querySelector('.controls input'); r.value = 49; r.dispatchEvent(new Event('input'))"
    )
    pictures.append(driver.execute_script(picture))
    assert len(set(pictures)) == 3
    assert text(driver, ".clock").startswith("0.98 s · manipulate · 20.0 mm")
    assert not complaints(driver)


def test_curves_heat_maps_and_estimates_are_drawn(driver: Driver, study: Path) -> None:
    shown(driver, study)
    assert len(driver.find_elements("css selector", ".charts .chart svg")) == 4
    assert len(driver.find_elements("css selector", ".charts .chart polyline.line")) == 4
    texts = "return [...document.querySelectorAll(arguments[0])].map(c => c.dataset.text ?? c.textContent)"
    assert driver.execute_script(texts, ".heat td") == ["0.50", "\N{EN DASH}", "1.00", "0.00"]
    assert driver.execute_script(texts, ".estimate .value") == ["0.40 (0.10 to 0.60)", "not told"]
    point = """
    const svg = document.querySelectorAll('.charts .chart svg')[arguments[0]];
    const { left, top, width, height } = svg.querySelector('.dot, .line').getBoundingClientRect();
    const at = { clientX: left + width, clientY: top + height / 2, bubbles: true };
    svg.dispatchEvent(new PointerEvent('pointermove', at));
    return document.querySelector('.tip').innerText;
    """
    assert driver.execute_script(point, 0).splitlines()[:2] == ["episode: 2.0", "policy: 4.10"]
    assert driver.execute_script(point, 2).splitlines() == ["first", "length: 1.0", "reach: 3.0"]
    assert not complaints(driver)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("kind", ["place", "study"])
def test_it_is_readable_on_a_phone_and_by_everybody(
    driver: Driver, kind: str, theme: str, request: pytest.FixtureRequest
) -> None:
    spec = importlib.util.find_spec("axe_selenium_python")
    if spec is None or spec.origin is None:
        pytest.skip("axe-core is not here: pip install axe-selenium-python")
    shown(driver, request.getfixturevalue(kind), theme, PHONE)
    assert driver.execute_script("return document.documentElement.scrollWidth") == PHONE
    axe = Path(spec.origin).parent / "node_modules" / "axe-core" / "axe.min.js"
    driver.execute_script(axe.read_text(encoding="utf-8"))
    found = driver.execute_async_script("axe.run().then(arguments[arguments.length - 1])")
    bad = {f"{each['id']}: {node['html'][:120]}" for each in found["violations"] for node in each["nodes"]
           if each["impact"] in {"serious", "critical"}}  # fmt: skip
    assert not bad
    assert len(found["passes"]) > 15
