"""The reports in a real browser: drawn, silent, readable in the dark, on a phone, on paper, by keyboard."""

from __future__ import annotations

import json
import math
import re
import unicodedata
from dataclasses import replace
from itertools import pairwise
from pathlib import Path, PurePath

import h5py
import numpy as np
import pytest
import report_examples
import store_examples

from pulsetrainer.artefacts import Evaluation, Quiz
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.report.html import render_evaluation
from pulsetrainer.report.score_sheet import render_session
from pulsetrainer.steps.quiz import score

MEASURING = Path(__file__).with_name("measuring.js").read_text()


def measure(page, what, *arguments):
    """Ask the page one of the questions of ``measuring.js``."""
    page.evaluate(MEASURING)
    return page.evaluate(f"(arguments) => measuring.{what}(...arguments)", list(arguments))


def test_nothing_is_asked_of_a_network_and_the_console_is_silent(opened, report):
    """The file itself is the only request, although the whole page was scrolled and unfolded."""
    page = opened()
    page.locator("summary").click()
    page.keyboard.press("End")
    page.wait_for_load_state("networkidle")
    assert page.asked == [report.html.as_uri()]
    assert page.said == []
    assert page.title().startswith("Diagnosis" if report.kind == "diagnosis" else "Evaluation")


def test_figures_are_drawn_and_named(opened, report):
    """Each has a size, a curve that spans it, nothing beyond its frame, and a name for a screen reader."""
    page = opened()
    figures = measure(page, "figures")
    assert len(figures) == report.figures
    for figure in figures:
        assert figure["width"] > 200
        assert figure["height"] > 100
        assert figure["longest"] > figure["width"] / 2
        assert figure["outside"] == 0
        assert figure["texts"] > 4
    images = page.get_by_role("img").and_(page.locator("svg"))
    assert images.count() == report.figures
    names = [page.locator(f"[id='{i}']").first.text_content() for i in _labels(images)]
    assert len(set(names)) == report.figures
    assert all(len(name) > 10 for name in names)


def _labels(images):
    return [image.get_attribute("aria-labelledby").split()[0] for image in images.all()]


@pytest.mark.slow
def test_headings_are_in_order(opened):
    """One first heading, and none skips a level."""
    levels = opened().evaluate("[...document.querySelectorAll('h1,h2,h3,h4')].map(h => +h.tagName[1])")
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b <= a + 1 for a, b in pairwise(levels))


def test_numbers_are_those_of_the_file(opened, report):
    """Read by h5py: each number in the page is the file's to the last bit and is printed as that number."""
    page = opened()
    shown = measure(page, "numbers", "data-metric")
    with h5py.File(report.h5) as file:
        expected = {"evaluation": _evaluation, "prediction": _prediction, "diagnosis": _diagnosis}[
            report.kind
        ](file)
    for one in shown:
        value = expected[one["metric"]]
        assert float(one["value"]) == value, one
        _prints(one["text"], value)
    assert {one["metric"] for one in shown} == set(expected)
    assert len(shown) > 7


def _evaluation(file):
    """Return every number of an evaluation by the name that it has in the page."""
    found = {}
    for group in file["waveforms"].values():
        stem = f"{group.attrs['name']}.{group.attrs['inversion']}"
        found[f"{stem}.repeats"] = float(group.attrs["repeats"])
        for name in ("mean_error_reduction_percent", "noise_percent", "full_force"):
            found[f"{stem}.{name}"] = group[name][()]
        for drive in ("scaled", "compensated"):
            for name, data in group[drive].items():
                if data.shape == ():
                    found[f"{stem}.{drive}.{name}"] = data[()]
    found |= _model(file["model"])
    assert len(found) == 2 * (4 + 2 * 5) + 6
    return found


def _model(group):
    """Return every number of the model behind an evaluation by the name that it has in the page."""
    found = {
        "model.levels": group["levels"].size - 1,
        "model.cells": group["weights"].size,
        "model.offset": group["offset"][()],
    }
    if "fit" in group:
        for name in ("coverage_percent", "rms", "rms_percent"):
            found[f"model.fit.{name}"] = group["fit"][name][()]
    for extension in group["extensions"].values():
        for parameter in extension["parameters"].values():
            stem = f"model.{extension.attrs['cause']}.{parameter.attrs['name']}"
            for suffix, name in (("", "value"), (".lower", "lower"), (".upper", "upper")):
                found[stem + suffix] = parameter.attrs[name]
    return found


def _prediction(file):
    """Return every number of the models' table by the name that it has in the page."""
    names = ("rms", "rms_percent", "max_percent", "gain_percent", "offset", "shape_rms_percent")
    called = {"offset": "run_offset"}  # a model has an offset of its own
    found = {
        f"{PurePath(group.attrs['name']).stem}.{called.get(name, name)}": group[name][()]
        for group in file["models"].values()
        for name in names
    }
    return found | _model(file["model"])


def _diagnosis(file):
    """Return every number of the two tables of a diagnosis by the name that it has in the page."""
    names = ("rms_percent", "noise_percent", "static_percent", "extended_percent", "floor_percent")
    found = {name: file[name][()] for name in (*names, "extended_rms_percent")}
    listed = [cause.attrs for cause in file["causes"].values()]
    chosen = [one for one in listed if one["found"]]
    chosen += [one for one in listed if not one["found"] and one["explains_percent"] > 0]
    # beside a cause that was found, one that could be instead has no share of its own; nor has what noise
    # explains as well
    instead = {name for one in chosen if one["found"] for name in one["confounded_with"]}
    for one in chosen[:12]:
        for name in ("explains_percent", "held_out_gain_percent"):
            value = float(one[name])
            by_noise = one["p_value"] > LIMITS.p_max
            if name == "explains_percent" and not one["found"] and (by_noise or one["cause"] in instead):
                continue
            if name != "held_out_gain_percent" or (one["found"] and math.isfinite(value)):
                found[f"{one['cause']}.{name}"] = value
    return found


def _prints(text, value):
    """Hold that a text is a number rounded to the digits that it shows."""
    digits = text.replace("−", "-")
    assert re.fullmatch(r"-?\d+(\.\d+)?(e-?\d+)?", digits), text
    exponent = int(digits.partition("e")[2] or 0)
    unit = 10.0 ** (exponent - len(digits.partition("e")[0].partition(".")[2]))
    assert abs(float(digits) - value) <= 0.5 * unit * (1 + 1e-9), (text, value)


@pytest.mark.slow
def test_dark_is_dark_and_both_schemes_can_be_read(opened):
    """WCAG 2.1: 4.5 for every text, those in figures too; 3 for the colours of the curves."""
    seen = {}
    for scheme in ("light", "dark"):
        page = opened(scheme=scheme)
        texts = measure(page, "texts")
        assert len(texts) > 50
        pale = [one for one in texts if one["contrast"] < 4.5]
        assert pale == []
        lines = measure(page, "lines")
        assert [one for one in lines if one["contrast"] < 3.0] == []
        seen[scheme] = (
            page.evaluate("getComputedStyle(document.body).backgroundColor"),
            {one["colour"] for one in texts},
            {one["name"]: one["colour"] for one in lines},
        )
    (light_paper, light_texts, light_lines), (dark_paper, dark_texts, dark_lines) = seen.values()
    assert sum(_rgb(dark_paper)) < 150
    assert sum(_rgb(light_paper)) > 700
    assert not light_texts & dark_texts
    assert all(light_lines[name] != dark_lines[name] for name in light_lines)


def _rgb(colour):
    return [float(part) for part in re.findall(r"[\d.]+", colour)[:3]]


@pytest.mark.parametrize(
    "width", [320, *(pytest.param(width, marks=pytest.mark.slow) for width in (360, 412))]
)
def test_a_phone_never_scrolls_sideways(opened, width):
    """Wide tables scroll by themselves; text stays large enough, in figures too."""
    page = opened(width=width, height=740)
    page.locator("summary").click()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert measure(page, "beyond") == []
    if width >= 360:
        assert [one for one in measure(page, "texts") if one["px"] < 7.0] == []


def test_a_command_is_broken_between_words(opened, report):
    """On a phone too: of a line that ended in -- nobody knew whether a blank belonged there."""
    page = opened(width=390)
    broken = """codes => codes.flatMap(code => [...code.querySelectorAll("span:not(.line)")])
        .filter(word => word.textContent.length < 30 && word.getClientRects().length > 1 ||
            getComputedStyle(word).display !== "inline-block").map(word => word.textContent)"""
    assert page.eval_on_selector_all("pre:not([id])", broken) == []
    plain = "codes => codes.filter(code => !code.querySelector('.line')).map(code => code.textContent)"
    assert page.eval_on_selector_all("pre:not([id])", plain) == []


@pytest.mark.slow
def test_paper_has_everything(opened, report):
    """The PDF of a dark screen: dark on light, every section and command; nothing that is for machines."""
    pypdf = pytest.importorskip("pypdf", reason="pypdf is not installed")
    page = opened(scheme="dark")
    page.emulate_media(media="print", color_scheme="dark")
    assert sum(_rgb(page.evaluate("getComputedStyle(document.body).color"))) < 200
    assert page.evaluate("getComputedStyle(document.documentElement).colorScheme") == "light"
    assert measure(page, "beyond") == []
    headings = page.locator("h1, h2").all_text_contents()
    pdf = report.html.with_suffix(".pdf")
    page.pdf(path=pdf, prefer_css_page_size=True)
    document = pypdf.PdfReader(pdf)
    # ligatures are letters, and where a line is broken is the printer's business
    text = unicodedata.normalize("NFKC", "".join(sheet.extract_text() for sheet in document.pages))
    squeezed = re.sub(r"\s+", "", text)
    assert '"libraries"' in page.locator("#provenance-json").text_content()
    assert "libraries" not in squeezed
    for words in (*headings, page.locator("pre.history").text_content()):
        assert re.sub(r"\s+", "", unicodedata.normalize("NFKC", words)) in squeezed
    assert 2 <= len(document.pages) <= 8
    squeezed_headings = tuple(re.sub(r"\s+", "", unicodedata.normalize("NFKC", one)) for one in headings)
    for sheet in document.pages:
        said = re.sub(r"\s+", "", unicodedata.normalize("NFKC", sheet.extract_text()))
        assert not said.endswith(squeezed_headings)  # a heading stays with what it is of
        # the errors of a drive and their figures are not torn apart
        assert said.count("Errorswithandwithoutcompensation") == said.count("Hysteresisopensaloop")


HEADER = {"title": "On paper", "created": "2026-01-02T03:04:05Z", "history": ["pulsetrainer session"] * 3}


def sheets_of(browser, folder, html):
    """Print a page; return what stands on each sheet, without blanks."""
    pypdf = pytest.importorskip("pypdf", reason="pypdf is not installed")
    (folder / "page.html").write_text(html)
    page = browser.new_page()
    page.goto((folder / "page.html").as_uri())
    page.pdf(path=folder / "page.pdf", prefer_css_page_size=True)
    page.close()
    texts = [sheet.extract_text() for sheet in pypdf.PdfReader(folder / "page.pdf").pages]
    return [re.sub(r"\s+", "", unicodedata.normalize("NFKC", text)) for text in texts]


@pytest.mark.slow
@pytest.mark.parametrize("questions", [4, 8, 12, 20])
def test_a_score_sheet_is_one_sheet_of_paper(browser, tmp_path, questions):
    """Up to twelve questions; the second was nearly empty. Of twenty the provenance stands together."""
    names = ("normal", "bifid")
    quiz = Quiz(names, names * (questions // 2), names * (questions // 2), np.ones(questions))
    session = replace(store_examples.session(), quiz=quiz)
    header = {
        **HEADER,
        "provenance_json": json.dumps({f"key {k}": "a value of some length" for k in range(40)}),
    }
    sheets = sheets_of(browser, tmp_path, render_session(session, score(quiz), {}, **header))
    (at,) = [k for k, said in enumerate(sheets) if "Provenance" in said]
    assert all(words in sheets[at] for words in ("pulsetrainersession", "Augmentationindex", "531-540"))
    assert at == len(sheets) - 1 == (questions > 12)
    assert "key39" not in "".join(sheets)  # a paragraph for machines, which the file has
    assert "normal:1beat,bifid:1beat." in sheets[0]


@pytest.mark.slow
def test_the_result_of_six_inversions_is_one_sheet(browser, tmp_path):
    """As of the demo: three rows of its table began the next sheet, on which a part had no room then."""
    played = tuple(
        report_examples.waveform_evaluation(name, inversion, 1.0, seed)
        for seed, name in enumerate(("normal", "bifid"))
        for inversion in ("closest-match", "continuous", "extended")
    )
    sheets = sheets_of(
        browser, tmp_path, render_evaluation(Evaluation(waveforms=played), **HEADER, provenance_json="{}")
    )
    assert sheets[0].count("publisheddevice") == 2
    assert [said.count("Errorswithandwithoutcompensation") for said in sheets[:4]] == [0, 2, 2, 2]


def test_words_beside_numbers_are_no_column_of_syllables(opened, report):
    """On a phone the parameters of a model's extensions had 95 of 350 pixels."""
    cells = "[aria-labelledby=model] table tbody th"
    widths = opened(width=380).evaluate(
        "css => [...document.querySelectorAll(css)].map(cell => cell.clientWidth)", cells
    )
    assert widths or report.kind != "prediction"
    assert min(widths, default=140) > 130


@pytest.mark.slow
def test_letters_on_paper_can_be_read(opened):
    """Of the text and of all figures, at the width of a sheet: five points at least."""
    page = opened(width=round(182 / 25.4 * 96))
    page.emulate_media(media="print")
    assert [one for one in measure(page, "texts") if 0.75 * one["px"] < 5.0] == []


@pytest.mark.slow
def test_the_keyboard_reaches_everything_in_order(opened):
    """Tab visits what a mouse can use, in the order of the page, each with a ring around it."""
    page = opened(width=360, height=740)
    page.locator("summary").click()  # what is folded away counts too
    page.evaluate("document.activeElement.blur()")
    page.mouse.click(1, 1)
    expected = measure(page, "interactive")
    visited = []
    for _ in range(expected):
        page.keyboard.press("Tab")
        visited.append(page.evaluate("document.activeElement.dataset.order"))
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    assert visited == [str(k) for k in range(expected)]
    assert expected > 8


@pytest.mark.slow
def test_the_first_key_leads_past_the_head(opened):
    """The skip link shows when it has the focus, and leads to the result."""
    page = opened()
    page.keyboard.press("Tab")
    skip = page.get_by_role("link", name="Skip to the result")
    assert skip.bounding_box()["x"] >= 0
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "main"
    folded = page.locator("details")
    assert folded.get_attribute("open") is None
    page.locator("summary").focus()
    page.keyboard.press("Enter")
    assert folded.get_attribute("open") is not None


def test_axe_finds_nothing(opened):
    """The rules of axe-core, an independent judge of accessible pages."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
    page = opened()
    page.locator("summary").click()
    found = axe.Axe().run(page).response["violations"]
    assert [(one["id"], one["nodes"][0]["html"][:120]) for one in found] == []
