"""A real browser, and three reports that the program made: of pulses, of models on a run, of a diagnosis."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from program import pulsetrainer

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
# one short record for all: six seconds of the device, twelve levels
EVALUATED = (
    "capture identification --levels 12 --speed 3 -o run.h5",
    "identify run.h5 --levels 12 -o model.h5",
    "invert normal --model model.h5 -o drive.h5",
    "invert bifid --model model.h5 -o drive2.h5",
    "play drive.h5 --repeats 2 -o played.h5",
    "play drive2.h5 --repeats 2 -o played2.h5",
    "evaluate played.h5 played2.h5 -o evaluation.h5 --html evaluation.html",
)
DIAGNOSED = (
    "diagnose run.h5 --model model.h5 -o diagnosis.h5 --html diagnosis.html",
    "extend diagnosis.h5 --model model.h5 -o extended.h5",
    "evaluate run.h5 --model model.h5 --model extended.h5 -o prediction.h5 --html prediction.html",
)


@dataclass(frozen=True)
class Report:
    """One page and the artefact that it is about."""

    kind: str
    html: Path
    h5: Path
    figures: int


@pytest.fixture(scope="session")
def evaluated(made_once) -> Path:
    """A folder in which the program has made the report of pulses."""
    return made_once("report-of-pulses", lambda here: _make(here, EVALUATED))


@pytest.fixture(scope="session")
def diagnosed(evaluated, made_once) -> Path:
    """A folder in which the program has made all reports."""

    def fill(here: Path) -> None:
        shutil.copytree(evaluated, here, dirs_exist_ok=True)
        _make(here, DIAGNOSED)

    return made_once("reports", fill)


def _make(folder: Path, steps: tuple[str, ...]) -> None:
    for step in steps:
        done = pulsetrainer(folder, *step.split(), env={"PULSETRAINER_PORT": "bench:?seed=1&field-lag=0.02"})
        assert done.code == 0, (step, done)


SLOW = pytest.mark.slow  # a browser takes its time; the first page has every part of a page
REPORTS = ("evaluation", pytest.param("prediction", marks=SLOW), pytest.param("diagnosis", marks=SLOW))


@pytest.fixture(scope="session", params=REPORTS)
def report(request) -> Report:
    """Each report in turn."""
    kind = request.param
    folder = request.getfixturevalue("evaluated" if kind == "evaluation" else "diagnosed")
    figures = {"evaluation": 2 + 2 * 2 + 2, "prediction": 2 + 1, "diagnosis": 1 + 5 + 1}[kind]
    return Report(kind, folder / f"{kind}.html", folder / f"{kind}.h5", figures)


@pytest.fixture(scope="package")
def browser():
    """A headless Chromium of this machine; without one these tests cannot say anything."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed (Debian: apt-get install chromium)")
    with playwright.sync_playwright() as play:
        # in a container there is no user namespace for the sandbox, and the page is our own
        started = play.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def opened(browser, report):
    """Open the report without a network; what the console says and what is asked for is kept."""
    contexts = []

    def open_page(width: int = 1280, height: int = 900, scheme: str = "light"):
        context = browser.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, offline=True
        )
        contexts.append(context)
        page = context.new_page()
        page.said, page.asked = [], []
        page.on("console", lambda message: page.said.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: page.said.append(f"error: {error}"))
        page.on("request", lambda request: page.asked.append(request.url))
        page.goto(report.html.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
