"""The site of the documentation in a real browser: whole, quiet, fit for a phone, with its search."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).parents[2]
PAGES = (
    "index.html",
    "docs/tutorial.html",
    "docs/api.html",
    "docs/commands.html",
    "docs/format.html",
    "docs/theory.html",
    "docs/how-to/batches.html",
    "docs/notebooks/first-pulse.html",
    "docs/notebooks/your-own-record.html",
)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(made_once) -> Path:
    """The site as `make site` makes it, but for the notebooks, which tests/docs runs; a warning fails."""

    def fill(here: Path) -> None:
        subprocess.run([sys.executable, ROOT / "docs" / "site.py"], check=True, cwd=ROOT)
        words = [
            sys.executable,
            "-m",
            "mkdocs",
            "build",
            "--quiet",
            "--config-file",
            ROOT / "build" / "mkdocs.yml",
        ]
        environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
        done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        shutil.copytree(ROOT / "build" / "site", here, dirs_exist_ok=True)

    return made_once("site", fill)


@pytest.fixture(scope="module")
def served(site) -> Iterator[str]:
    """The address of the site, served by this computer to itself."""
    handler = partial(Quiet, directory=site)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class Quiet(SimpleHTTPRequestHandler):
    """A server of files that writes no log."""

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def visit(browser, served, request):
    """Open a page of the site at a phone's width; what the console says and what is asked for is kept."""
    scheme = getattr(request, "param", "light")
    context = browser.new_context(viewport={"width": 390, "height": 844}, color_scheme=scheme)

    def open_page(name: str):
        page = context.new_page()
        page.said, page.asked = [], []
        page.on(
            "console", lambda message: page.said.append(message.text) if message.type == "error" else None
        )
        page.on("pageerror", lambda error: page.said.append(str(error)))
        page.on("request", lambda request: page.asked.append(request.url))
        page.goto(f"{served}/{name}")
        return page

    yield open_page
    context.close()


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_quiet_and_fits_a_phone(visit, served, name):
    """No error, nothing asked of a network, nothing that scrolls sideways, every picture there."""
    page = visit(name)
    assert page.said == []
    assert [url for url in page.asked if not url.startswith((served, "data:"))] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    pictures = page.evaluate("[...document.images].map(i => [i.src, i.complete && i.naturalWidth > 0])")
    assert [source for source, drawn in pictures if not drawn] == []


@pytest.mark.parametrize("visit", ["light", "dark"], indirect=True)
@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing(visit, name):
    """The rules of axe-core, in both schemes: names, contrast, links that are seen, the keyboard."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
    found = axe.Axe().run(visit(name)).response["violations"]
    assert [(one["id"], [node["html"][:120] for node in one["nodes"]]) for one in found] == []


def test_every_link_within_the_site_leads_to_a_page(site):
    """Those of the notebooks too, of which the builder of the site knows none."""
    dead = {
        (page.relative_to(site).as_posix(), link)
        for page in site.rglob("*.html")
        if page.name != "404.html"
        for link in re.findall(r'<a [^>]*href="([^":#]+)[#"]', page.read_text(encoding="utf-8"))
        if not (page.parent / unquote(link)).exists()
    }
    assert dead == set()


def test_the_search_works_without_a_network(visit):
    """A word of the theory leads to its page."""
    page = visit("index.html")
    page.click("label.md-header__button[for=__search]")
    # Typed, not filled in: the page looks at the field when a key goes up.
    page.locator("input.md-search__input").press_sequentially("wiping-out")
    page.wait_for_selector("a.md-search-result__link", timeout=20_000)
    found = page.eval_on_selector_all("a.md-search-result__link", "links => links.map(l => l.href)")
    assert any("theory.html" in link for link in found)


def test_the_api_page_has_every_name(visit):
    """Each public verb and artefact, with what it takes."""
    import pulsetrainer as pt

    text = visit("docs/api.html").inner_text("article")
    for name in pt.__all__:
        assert f"pt.{name}" in text or name.startswith("_"), name
    assert "Parameters" in text or "PARAMETER" in text.upper()
