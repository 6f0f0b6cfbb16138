"""The report: valid, self-contained, accessible, repeatable, and its numbers are the evaluation's."""

from __future__ import annotations

import json
import math
import re
import warnings
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import pytest
import report_examples as examples
import store_examples

from pulsetrainer.artefacts import Evaluation, Parameter
from pulsetrainer.report.diagnosis_html import headline, render_diagnosis
from pulsetrainer.report.diagnosis_text import sections
from pulsetrainer.report.html import offset, render_evaluation

PUBLISHED = {
    "normal": {
        "mean_error_reduction_percent": 73.9,
        "scaled.max_abs_error_percent": 28.7,
        "compensated.max_abs_error_percent": 7.8,
    },
    "bifid": {"mean_error_reduction_percent": 70.3},
}
PROVENANCE = json.dumps({"program": "pulsetrainer", "version": "0.1.0", "argv": ["evaluate", "a<b>.h5"]})
VOID = {"meta", "link", "br", "hr", "img", "input"}


class Page(HTMLParser):
    """The elements of a page, with a check that each end tag closes the element that is open."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.text = [], [], {}
        self.feed(text)
        self.close()
        assert self.open == [], f"never closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        """Note the element and that it is open."""
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append((tag, len(self.elements) - 1))

    def handle_startendtag(self, tag, attrs):
        """Note an element without content."""
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        """Close the innermost element, which must be this one."""
        assert self.open, f"</{tag}> closes nothing"
        assert self.open[-1][0] == tag, f"</{tag}> closes <{self.open[-1][0]}>"
        self.open.pop()

    def handle_data(self, data):
        """Add the text to every element that is open."""
        for _, index in self.open:
            self.text[index] = self.text.get(index, "") + data

    def of(self, tag):
        """Return (attributes, text) of each element of this name."""
        return [(a, self.text.get(k, "")) for k, (t, a) in enumerate(self.elements) if t == tag]

    def numbers(self, attribute="data-metric"):
        """Return the set of values and the printed texts of every number by name."""
        found = {}
        for k, (_, a) in enumerate(self.elements):
            if attribute in a:
                found.setdefault(a[attribute], []).append((float(a["data-value"]), self.text.get(k, "")))
        return found


def render(evaluation, **changes):
    """Return the page of an evaluation with a fixed header."""
    header = {
        "title": "Evaluation of normal, bifid",
        "created": "2024-05-01T12:00:00Z",
        "provenance_json": PROVENANCE,
        "published": PUBLISHED,
        "history": ("2024-05-01T11:59:00Z pulsetrainer capture identification -o run.h5",),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return render_evaluation(evaluation, **(header | changes))


EVALUATION = examples.evaluation()


@pytest.fixture(scope="module")
def text():
    """The page of the demo's evaluation."""
    return render(EVALUATION)


@pytest.fixture(scope="module")
def one():
    """The page of a single waveform."""
    return render(Evaluation(waveforms=EVALUATION.waveforms[:1]))


@pytest.fixture(scope="module")
def page(text):
    """The page, parsed."""
    return Page(text)


@pytest.fixture(scope="module")
def comparison():
    """The page of two models on a held-out run, the second one extended."""
    return Page(render(replace(examples.model_comparison(), model=examples.extended_model())))


def test_numbers_are_those_of_the_evaluation(page):
    """Every figure of every drive stands in the page, in full precision, and prints as that number."""
    shown = page.numbers()
    for played in EVALUATION.waveforms:
        stem = f"{played.name}.{played.inversion}"
        expected = {
            f"{stem}.mean_error_reduction_percent": played.mean_error_reduction_percent,
            f"{stem}.noise_percent": played.noise_percent,
            f"{stem}.full_force": played.full_force,
            f"{stem}.repeats": played.repeats,
        }
        for name in ("scaled", "compensated"):
            drive = getattr(played, name)
            for field in drive.__dataclass_fields__:
                if field.endswith("_percent"):
                    expected[f"{stem}.{name}.{field}"] = getattr(drive, field)
        assert len(expected) == 14
        for metric, value in expected.items():
            for stored, printed in shown[metric]:
                assert stored == value, metric
                assert float(printed.replace("−", "-")) == pytest.approx(value, abs=0.051), metric


def test_published_figures_stand_beside(page):
    """In the overview, marked as published, and never among the evaluation's own numbers."""
    beside = page.numbers("data-published")
    assert {name: values[0][0] for name, values in beside.items()} == {
        "normal.mean_error_reduction_percent": 73.9,
        "normal.scaled.max_abs_error_percent": 28.7,
        "normal.compensated.max_abs_error_percent": 7.8,
        "bifid.mean_error_reduction_percent": 70.3,
    }
    rows = [text for a, text in page.of("tr") if a.get("class") == "published"]
    assert len(rows) == 2
    without = render(Evaluation(waveforms=EVALUATION.waveforms[:1]), published={})
    assert "published" not in without.partition("</style>")[2]


def test_numbers_of_models_on_a_run(comparison):
    """The table of predictions, by the stem of the model's file; extensions with their intervals."""
    shown = comparison.numbers()
    for model in examples.model_comparison().models:
        stem = model.name.removesuffix(".h5")
        assert shown[f"{stem}.run_offset"][0][0] == model.offset
        for field in ("rms", "rms_percent", "max_percent", "gain_percent", "shape_rms_percent"):
            assert shown[f"{stem}.{field}"][0][0] == getattr(model, field)
    assert shown["model.creep.amplitude"][0] == (0.051, "0.05100")
    assert shown["model.creep.amplitude.lower"][0][0] == 0.047


def test_an_offset_that_is_rounding_is_none_and_one_of_an_older_file_is_not_known():
    """A model on its own run has none: 4.8e-14 was what the numbers could not hold."""
    for value, said in ((4.8e-14, "0"), (-0.0123, "−0.0123"), (float("nan"), "")):
        one = replace(examples.model_evaluation(), offset=value)
        assert offset(one, "model.run_offset").text == said


def test_model_numbers(page):
    """Levels, cells, offset and the quality of the fit."""
    shown = page.numbers()
    assert shown["model.levels"][0][0] == 48
    assert shown["model.cells"][0][0] == 1176
    assert shown["model.offset"][0][0] == EVALUATION.model.offset
    assert shown["model.fit.rms"][0][0] == EVALUATION.model.fit.rms


def test_every_figure_is_there(page, comparison):
    """One beat per pulse, two per waveform, two of the model; one per compared model."""
    pulses = len({one.name for one in EVALUATION.waveforms})
    assert len(page.of("figure")) == len(page.of("svg")) == pulses + 2 * 4 + 2
    assert len(comparison.of("figure")) == 2 + 1
    assert all(text.strip() for _, text in page.of("figcaption"))


def test_ids_are_unique_and_references_resolve(page, comparison):
    """Several inline SVGs and a dozen tables share one name space."""
    for one in (page, comparison):
        ids = [a["id"] for _, a in one.elements if "id" in a]
        assert len(ids) == len(set(ids))
        for _, attributes in one.elements:
            for key in ("aria-labelledby", "aria-describedby"):
                for name in attributes.get(key, "").split():
                    assert name in ids
            for key in ("href", "xlink:href"):
                if attributes.get(key, "").startswith("#"):
                    assert attributes[key][1:] in ids
            for name in re.findall(r"url\(#([^)]+)\)", " ".join(v or "" for v in attributes.values())):
                assert name in ids


def test_two_playbacks_of_one_waveform_do_not_collide():
    """Two weeks of the same pulse in one report."""
    twice = Evaluation(waveforms=(EVALUATION.waveforms[1], EVALUATION.waveforms[1]))
    ids = [a["id"] for _, a in Page(render(twice)).elements if "id" in a]
    assert len(ids) == len(set(ids))


def test_each_figure_of_repeated_playbacks_and_models_has_a_name_of_its_own():
    """Two weeks of one pulse, and two models of one file name: a name has one value, that of the file."""
    one = EVALUATION.waveforms[1]
    later = replace(
        one, compensated=replace(one.compensated, mean_abs_error_percent=2.5), repeats=one.repeats + 1
    )
    models = examples.model_comparison().models
    twice = Evaluation(waveforms=(one, later), models=(models[0], replace(models[1], name=models[0].name)))
    values = {}
    for _, attributes in Page(render(twice)).elements:
        if "data-metric" in attributes:
            values.setdefault(attributes["data-metric"], set()).add(float(attributes["data-value"]))
    assert all(len(known) == 1 for known in values.values()), values
    for name, value in twice.figures().items():
        assert values.get(name, {value}) == {value}
    assert any("#2" in name and name.startswith(one.name) for name in values)
    assert any("#2" in name and name.startswith(models[0].short_name) for name in values)


def test_nothing_is_fetched(text):
    """No address but the names of XML name spaces, no script, no import."""
    outside = set(re.findall(r"(?:https?:)?//[\w.-]+\.\w+[^\"'\s<)]*", text))
    assert outside <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert "<script" not in text
    assert "@import" not in text
    for source in re.findall(r"(?:src|href)=\"([^\"]*)\"", text):
        assert source.startswith(("#", "data:"))


def test_structure_for_keyboard_and_screen_reader(page):
    """Language, title, one h1, a skip link first, named figures and tables, headers with a scope."""
    assert page.of("html")[0][0]["lang"] == "en"
    assert page.of("title")[0][1] == "Evaluation of normal, bifid"
    assert len(page.of("h1")) == 1
    first_link = page.of("a")[0][0]
    assert first_link["href"] == "#main"
    assert page.of("main")[0][0]["id"] == "main"
    for attributes, text in page.of("svg"):
        assert attributes["role"] == "img"
        assert attributes["aria-labelledby"]
        assert text.strip()
    assert len(page.of("caption")) == len(page.of("table")) == 1 + 4
    assert all(a.get("scope") for a, _ in page.of("th"))
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch(r"h[1-6]", tag)]
    assert all(b - a <= 1 for a, b in pairwise(levels))
    assert page.of("details")
    regions = [a for a, _ in page.of("div") if a.get("role") == "region"]
    assert all(a["tabindex"] == "0" for a in regions)


def test_light_dark_and_print(text):
    """One page for all three."""
    style = text.partition("</style>")[0]
    assert "prefers-color-scheme: dark" in style
    assert "@media print" in style
    assert 'name="viewport"' in text


def test_provenance_is_at_the_end_and_whole(page):
    """The JSON comes back as it went in; the history is above it."""
    shown = next(text for a, text in page.of("pre") if a.get("id") == "provenance-json")
    assert json.loads(shown) == json.loads(PROVENANCE)
    assert any("capture identification" in text for _, text in page.of("pre"))
    order = [a["id"] for tag, a in page.elements if tag == "h2"]
    assert order[-1] == "provenance"


def test_provenance_that_is_not_json_is_shown_as_it_is():
    """A damaged header does not cost the report."""
    text = render(Evaluation(), provenance_json="{broken <")
    assert "{broken &lt;" in text


def test_same_evaluation_same_bytes(one):
    """No date, no random id."""
    assert render(Evaluation(waveforms=examples.evaluation().waveforms[:1])) == one


def test_markup_in_names_is_text():
    """A waveform called after a tag is not a tag, in HTML and in SVG."""
    odd = '<script>alert("1")</script>&amp;$x$'
    played = replace(EVALUATION.waveforms[0], name=odd)
    model = replace(examples.model_evaluation(time=False), name=odd)
    text = render(Evaluation(waveforms=(played,), models=(model,)), title=odd, history=(odd,))
    assert "<script" not in text
    page = Page(text)
    assert page.of("h1")[0][1] == odd
    assert f"{odd}.closest-match.noise_percent" in page.numbers()


@pytest.fixture(scope="module")
def odd_numbers():
    """The numbers of a page: a noise that one repeat cannot have, and a compensation that made it worse."""
    played = replace(EVALUATION.waveforms[0], noise_percent=math.nan, mean_error_reduction_percent=-12.346)
    return Page(render(Evaluation(waveforms=(played,)))).numbers()


def test_warnings_stand_before_the_result():
    """Those of the evaluation, each a paragraph; its notes are not warnings."""
    warned = replace(examples.model_comparison(), notes=("warning: a note",), warnings=("model m does not",))
    before = render(warned).partition("<main")[2].partition("<h2")[0]
    assert "<strong>Warning: model m does not</strong>" in before
    assert "a note" not in before


def test_no_value_is_said_in_words(odd_numbers):
    """An error of nothing."""
    value, printed = odd_numbers["normal.closest-match.noise_percent"][0]
    assert math.isnan(value)
    assert printed == "no value"


def test_negative_numbers_carry_a_minus_sign(odd_numbers):
    """What made it worse is shown as such."""
    printed = {text for _, text in odd_numbers["normal.closest-match.mean_error_reduction_percent"]}
    assert printed == {"−12.3", "−12.35"}  # the readout has one digit, the tables two


def test_evaluation_of_nothing_says_so():
    """An empty evaluation is a short page."""
    text = render(Evaluation())
    assert "neither played waveforms nor models" in text
    assert Page(text).of("figure") == []


def test_the_report_does_not_send_to_itself_for_a_curve():
    """On the screen `--html` draws it; here the figure stands below."""
    found = store_examples.diagnosis()
    curve = tuple(Parameter(f"f{k}", 0.1 * k, "N", 0.0, 1.0) for k in (2, 3))
    causes = tuple(replace(one, parameters=curve) for one in found.causes)
    page = render_diagnosis(replace(found, causes=causes), title="", created="", provenance_json="{}")
    assert "what it adds to the output; drawn below" in page.replace("\N{NO-BREAK SPACE}", " ")
    assert "--html" not in page


def test_page_and_terminal_list_the_same_causes():
    """Where no cause had a share of the error, the page had an empty table."""
    found = store_examples.diagnosis()
    names = ("field-lag", *(f"cause {k}" for k in range(9)))
    causes = tuple(replace(found.causes[0], cause=one, found=False, explains_percent=0.0) for one in names)
    for told in (replace(found, verdict="none", causes=causes), found):
        page = Page(render_diagnosis(told, title="", created="", provenance_json="{}"))
        table = next(one for one in sections(told) if one.title.startswith("causes"))
        headings = [text for a, text in page.of("th") if a.get("scope") == "row"]
        assert headings[-len(table.rows) :] == [row[0] for row in table.rows]


def test_the_heading_of_a_diagnosis_is_short():
    """It names what was found; what that means stands below, once for each cause."""
    found = store_examples.diagnosis()
    said = headline(found)
    assert found.verdict in said
    assert not any(one.text and one.text in said for one in found.found)
