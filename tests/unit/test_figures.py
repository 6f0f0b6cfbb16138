"""Figures: every kind has one, every axis has its unit, and nothing that matters is lost in thinning."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import report_examples as examples
import store_examples as stored
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib import rcParams
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.figure import Figure

from pulsetrainer.artefacts import Evaluation, Profile, Recorded, Run, units
from pulsetrainer.errors import DataError
from pulsetrainer.report import comparison_figure, diagnosis_figures, figures, panels, planned
from pulsetrainer.report.directions import directions, turns
from pulsetrainer.report.facts import coil_words, run_facts
from pulsetrainer.report.fewer_points import MOST_OF_A_LOOP, MOST_POINTS, extremes, path
from pulsetrainer.report.render import encode, inline_svg
from pulsetrainer.report.results import identified
from pulsetrainer.report.style import THEME, VERMILION, label
from pulsetrainer.report.text import tables_of
from wording import raises


@pytest.fixture(autouse=True)
def _no_warnings():
    """A warning of matplotlib or numpy while drawing is a fault of the drawing."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


ARTEFACTS = {
    "run": examples.run,
    "run without time": lambda: examples.run(time=False),
    "model": lambda: examples.model(n_h=12),
    "model without fit": lambda: examples.model(n_h=12, with_fit=False),
    "extended model": examples.extended_model,
    "waveform": examples.waveform,
    "playback": examples.playback,
    "evaluation of waveforms": lambda: Evaluation(waveforms=examples.evaluation().waveforms[:1]),
    "evaluation of models": examples.model_comparison,
}


@pytest.mark.parametrize("make", ARTEFACTS.values(), ids=ARTEFACTS.keys())
def test_draw_gives_every_kind_a_figure_with_units(make):
    """Each axis that is labelled names a unit in brackets, or says that it counts samples.

    The axes fill the figure, and nothing that is drawn lies beyond them.
    """
    figure = figures.draw(make())
    extents = np.array([axes.get_window_extent().extents for axes in figure.axes]) / np.tile(
        figure.bbox.max, 2
    )
    assert np.all(extents[:, :2].min(axis=0) < 0.15)
    assert np.all(extents[:, 2:].max(axis=0) > 0.85)
    for axes in figure.axes:
        shown, drawn = axes.viewLim, axes.dataLim
        assert np.all(drawn.min >= shown.min - 1e-9 * shown.size)
        assert np.all(drawn.max <= shown.max + 1e-9 * shown.size)
    labels = [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
    assert len(labels) >= 2
    for text in labels:
        assert re.search(r"\[[^\]]+\]$", text) or text == "sample number", text
    for axes in figure.axes:
        # a shared time axis is labelled once, at the bottom
        assert axes.get_ylabel()
    assert encode(figure, "png").startswith(b"\x89PNG")


def test_the_cells_of_a_plane_lie_within_its_outline():
    """The triangle above the diagonal, over the range of the model."""
    model = examples.model(n_h=6)
    (outline,) = figures.preisach_density(model).axes[0].patches
    low, high = model.edges[[0, -1]].tolist()
    assert set(map(tuple, outline.get_xy().tolist())) == {(low, low), (low, high), (high, high)}


@pytest.mark.parametrize(
    "make",
    [
        lambda: figures.preisach_density(examples.model(n_h=6)),
        lambda: figures.identification(examples.fit(300)),
        lambda: figures.identification(examples.fit(300, time=False)),
        lambda: figures.tracking(examples.waveform_evaluation()),
        lambda: figures.methods([examples.waveform_evaluation()] * 5),
        lambda: figures.loops([examples.waveform_evaluation()]),
        lambda: figures.prediction(examples.model_evaluation(time=False)),
    ],
)
def test_single_figures_render(make):
    """The figures of the report stand alone, and the same figure is the same bytes."""
    assert encode(make(), "svg") == encode(make(), "svg")


def test_pdf_and_svg_carry_no_date():
    """Two files of one figure differ only if the figure does."""
    figure = figures.loops([examples.waveform_evaluation()])
    assert b"CreationDate" not in encode(figure, "pdf")
    assert b"dc:date" not in encode(figure, "svg")


def test_drawing_leaves_the_settings_of_matplotlib_alone():
    """A user's notebook looks the same before and after."""
    before = dict(rcParams)
    encode(figures.draw(examples.run(500)), "png")
    assert dict(rcParams) == before


def test_draw_refuses_what_it_does_not_know():
    """An evaluation of nothing, and a thing that is no artefact."""
    with raises(DataError, "nothing to draw"):
        figures.draw(Evaluation())
    with raises(DataError, "no figure of it", got="str"):
        figures.draw("text")


def _mesh(figure):
    return next(c for axes in figure.axes for c in axes.collections if isinstance(c, QuadMesh))


def test_density_puts_each_cell_in_its_place():
    """Cell k = i (i + 1) / 2 + j lies at row i (alpha) and column j (beta); below the diagonal is nothing."""
    base = examples.model(n_h=4, with_fit=False)
    shown = replace(base, weights=np.arange(10.0), covered=np.ones(10, dtype=bool))
    field = _mesh(figures.preisach_density(shown)).get_array()
    k = 0
    for i in range(4):
        for j in range(4):
            if j <= i:
                assert field[i, j] == k
                k += 1
            else:
                assert field.mask[i, j]


def test_density_marks_cells_that_were_not_switched():
    """A weight that no data speak for is hatched, not coloured."""
    base = examples.model(n_h=4, with_fit=False)
    covered = np.ones(10, dtype=bool)
    covered[[6, 9]] = False  # cell (3, 0), a square, and cell (3, 3), a triangle
    figure = figures.preisach_density(replace(base, weights=np.ones(10), covered=covered))
    field = _mesh(figure).get_array()
    assert field.mask[3, 0]
    assert field.mask[3, 3]
    hatched = [
        c for c in figure.axes[0].collections if isinstance(c, PolyCollection) and not isinstance(c, QuadMesh)
    ]
    corners = [len(path.vertices) - 1 for path in hatched[0].get_paths()]
    assert corners == [4, 3]
    assert "8 switched,\nhatched: not switched" in figure.axes[0].texts[0].get_text()


def test_density_scale_is_not_set_by_the_reversible_diagonal():
    """A large reversible part does not darken the density; what is beyond the scale shows as such."""
    base = examples.model(n_h=8, with_fit=False)
    i, j = np.tril_indices(8)
    weights = np.where(i == j, 500.0, 1.0 + 0.1 * j)
    figure = figures.preisach_density(replace(base, weights=weights, covered=np.ones(36, dtype=bool)))
    assert _mesh(figure).norm.vmax < 3.0
    assert figure.axes[0].collections[0].colorbar.extend == "max"


@pytest.mark.parametrize("weights", [np.zeros(10), np.full(10, 1e-12), np.eye(1, 10, 9).ravel()])
def test_density_of_nothing_or_next_to_nothing(weights):
    """A model of zeros is drawn without a warning."""
    base = examples.model(n_h=4, with_fit=False)
    encode(figures.preisach_density(replace(base, weights=weights, covered=np.ones(10, dtype=bool))), "png")


def test_density_says_when_the_loop_falls():
    """Polarity is a fact of the model and stands with it."""
    shown = replace(examples.model(n_h=4, with_fit=False), polarity=-1)
    assert "output falls" in figures.preisach_density(shown).axes[0].texts[0].get_text()


def test_units_of_any_bench():
    """A record of field and flux density is labelled in its own units."""
    h = np.linspace(-100, 100, 50)
    record = Run(
        time_s=None,
        input=h,
        output=np.tanh(h / 40),
        input_unit="A/m",
        output_unit="T",
        input_quantity="field",
        output_quantity="flux density",
    )
    text = [axes.get_ylabel() for axes in figures.draw(record).axes]
    assert text == ["field [A/m]", "flux density [T]", "flux density [T]"]


def test_names_from_users_are_not_read_as_formulas():
    """Dollars, underscores and brackets of a file name are drawn as they are."""
    odd = "_a$\\frac{1}$_<b>&[red]"
    encode(figures.draw(replace(examples.run(200), signal=odd)), "svg")
    named = replace(examples.model_evaluation(), name=odd)
    svg = inline_svg(figures.prediction(named), identifier="x", title=odd, description=odd)
    assert odd in "".join(ET.fromstring(svg).itertext())
    encode(figures.loops([replace(examples.waveform_evaluation("normal", "relay", 1.0, 0), name=odd)]), "svg")


def test_lost_samples_leave_a_gap():
    """NaN in input and output, in a short record and in a thinned one."""
    for n in (1000, 50_000):
        base = examples.run(1000)
        record = Run(
            time_s=np.arange(n) * 0.001,
            input=np.resize(base.input, n).copy(),
            output=np.resize(base.output, n).copy(),
        )
        record.output[n // 2 : n // 2 + n // 20] = np.nan
        record.input[:10] = np.nan
        figure = figures.draw(record)
        drawn = figure.axes[1].lines[0].get_ydata()
        assert np.isnan(drawn).any()
        encode(figure, "png")


def test_samples_taken_out_are_no_data_in_the_figure_of_a_run():
    """What was filled in for them is a dotted line with a name; the loop has a gap there."""
    plain = examples.run(1000)
    run = replace(plain, masked=np.arange(plain.input.size) % 100 < 20)
    _, below, loop = figures.run(run).axes
    measured, filled = (np.asarray(line.get_ydata()) for line in below.lines)
    np.testing.assert_array_equal(np.isnan(measured), run.masked)
    np.testing.assert_array_equal(np.isnan(filled), ~run.masked)
    np.testing.assert_array_equal(np.isnan(loop.lines[0].get_ydata()), run.masked)
    assert [text.get_text() for text in below.get_legend().get_texts()] == ["taken out"]
    assert figures.run(plain).axes[1].get_legend() is None


def test_all_samples_lost():
    """A record of nothing but NaN is an empty figure, not an error."""
    nothing = np.full(100, np.nan)
    encode(figures.draw(Run(time_s=np.arange(100.0), input=nothing, output=nothing)), "png")


def test_a_million_samples_are_drawn_by_their_envelope():
    """At most 4000 points per line, 16000 of a loop, and a single-sample spike survives."""
    n = 1_000_000
    x = np.sin(np.linspace(0, 300, n))
    y = x.copy()
    y[777_777] = 9.0
    figure = figures.draw(Run(time_s=np.arange(n) * 0.001, input=x, output=y))
    lines = [line for axes in figure.axes for line in axes.lines]
    assert all(line.get_xdata().size <= MOST_OF_A_LOOP for line in lines)
    assert all(line.get_xdata().size <= MOST_POINTS for axes in figure.axes[:2] for line in axes.lines)
    assert figure.axes[1].lines[0].get_ydata().max() == 9.0
    assert figure.axes[2].lines[0].get_ydata().max() == 9.0


@given(
    st.lists(st.one_of(st.floats(-1e6, 1e6), st.just(np.nan)), min_size=1, max_size=400),
    st.integers(20, 120),
)
@settings(max_examples=150, deadline=None)
def test_extremes_keep_the_envelope(values, most):
    """Order, ends, least and greatest sample and gaps stay; never more points than allowed."""
    y = np.array(values)
    kept = extremes(y, most=most)
    assert kept.size <= max(most, 1)
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == y.size - 1
    if np.isfinite(y).any():
        assert np.nanmin(y[kept]) == np.nanmin(y)
        assert np.nanmax(y[kept]) == np.nanmax(y)
    assert np.isnan(y[kept]).any() == np.isnan(y).any()


def test_a_thinned_loop_keeps_its_outermost_points():
    """In both directions, whatever the curve."""
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 20_000))
    kept = path(x, y, most=100)
    assert kept.size <= 100
    assert (kept[0], kept[-1]) == (0, x.size - 1)
    for series in (x, y):
        assert series[kept].min() == series.min()
        assert series[kept].max() == series.max()


def test_a_thinned_loop_has_no_kinks_of_its_own():
    """Noise on a slow triangle: what is drawn lies within the noise, tips at their ends."""
    n, sigma = 100_000, 0.01
    true = np.abs((np.arange(n) / 5000) % 2 - 1)
    y = true + np.random.default_rng(1).normal(0.0, sigma, n)
    kept = path(true, y)
    assert 500 < kept.size < n // 20
    assert np.sqrt(np.mean((y[kept] - true[kept]) ** 2)) < sigma
    tips = np.flatnonzero((true == 0.0) | (true == 1.0))
    assert np.isin(tips[1:-1], kept).all()


def test_a_thinned_loop_keeps_a_wild_sample():
    """One sample far off the curve, though not its greatest."""
    x = np.sin(np.linspace(0, 60, 50_000))
    y = x.copy()
    wild = int(np.argmin(np.abs(x[20_000:22_000]))) + 20_000
    y[wild] = 0.6
    assert wild in path(x, y)


def test_playback_draws_every_repeat_and_shades_the_lead_in():
    """Three repeats of two drives and the target; what is not scored is grey."""
    figure = figures.draw(examples.playback(repeats=3))
    assert len(figure.axes[0].lines) == 1 + 2 * 3
    shaded = figure.axes[0].patches
    assert len(shaded) == 1
    assert shaded[0].get_x() == 0.0
    assert shaded[0].get_x() + shaded[0].get_width() == pytest.approx(0.8)


def test_what_is_not_scored_is_shaded_and_named_once():
    """The lead-in has the name; what does not count later looks the same."""
    drive, axes = examples.waveform(), Figure().subplots()
    scored = np.arange(drive.time_s.size) % (drive.time_s.size // 2) > 3
    panels.unscored(axes, replace(drive, scored=scored))
    first, _ = axes.patches
    assert axes.get_legend_handles_labels() == ([first], ["not scored"])


def test_the_temperature_is_drawn_where_heat_was_tracked():
    """A point for each repeat of a play, a curve for a session; without it the figure is as before."""
    played, session = examples.playback(repeats=3), stored.session()
    kelvin = np.array([0.4, 1.0, 1.5])
    for whole, warm, size in (
        (played, replace(played, temperature_K=kelvin), 3),
        (session, replace(session, temperature_s=np.arange(3.0), temperature_K=kelvin), 3),
    ):
        before, after = figures.draw(whole), figures.draw(warm)
        assert len(after.axes) == len(before.axes) + 1
        (axes,) = (one for one in after.axes if "[K]" in one.get_ylabel())
        (drawn,) = (line for line in axes.lines if line.get_label()[0] != "_")
        np.testing.assert_array_equal(drawn.get_ydata(), kelvin)
        assert len(drawn.get_xdata()) == size
        (guide,) = (line for line in axes.lines if line is not drawn)
        assert set(guide.get_ydata()) == {0.0}  # as warm as at calibration
        assert encode(after, "png").startswith(b"\x89PNG")


def test_the_points_of_a_legend_are_no_beats():
    """One beside the others, as small as they: it looked like the error of a beat."""
    below = figures.draw(stored.session()).axes[1]
    drawn = {line.get_markersize() for line in below.lines}
    assert all(line.get_markersize() > 2 * max(drawn) for line in below.get_legend().get_lines())


def test_a_session_without_a_sample_has_no_figure():
    """It was cut off before it began."""
    session = stored.session()
    nothing = {name: np.zeros(0) for name in ("time_s", "target", "reference", "input", "output")}
    with pytest.raises(DataError):
        figures.draw(replace(session, **nothing))


def test_error_panel_is_in_percent_of_full_force():
    """The curve's maximum is the largest error over the full force."""
    played = examples.waveform_evaluation()
    axes = figures.tracking(played).axes[1]
    scaled = next(line for line in axes.lines if line.get_color() == VERMILION)
    expected = 100 * np.abs(played.scaled.output - played.target).max() / played.full_force
    assert np.abs(scaled.get_ydata()).max() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("unit", "shown"),
    [
        ("A", "A"),
        ("N/A^2", "N/A²"),
        ("N/(A)^2", "N/A²"),
        ("T/(A/m)^2", "T/(A/m)²"),
        ("m**-1", "m⁻¹"),
        ("percent", "%"),
        ("1", ""),
        ("", ""),
        ("N*m", "N·m"),
        ("1/(1)^2", ""),
        ("N/(1)^2", "N"),
    ],
)
def test_units_are_printed_as_people_write_them(unit, shown):
    """Powers are raised, percent is a sign, a pure number has none."""
    assert units.shown(unit) == shown


def test_label_of_a_pure_number_has_no_brackets():
    """No empty pair of brackets on an axis."""
    assert label("gain", "1") == "gain"


def test_inline_svg_fits_a_page():
    """Own ids, the page's colours and fonts, a text alternative, nothing fetched."""
    svg = inline_svg(
        figures.preisach_density(examples.model(n_h=6)), identifier="a", title="T & t", description="D < d"
    )
    root = ET.fromstring(svg)
    identifiers = [e.get("id") for e in root.iter() if e.get("id")]
    assert len(identifiers) == len(set(identifiers))
    assert all(name.startswith("a-") for name in identifiers)
    for reference in re.findall(r"url\(#([^)]+)\)|href=\"#([^\"]+)\"", svg):
        assert "".join(reference) in identifiers
    assert root.get("role") == "img"
    assert root.get("aria-labelledby") == "a-title a-desc"
    assert root.get("width") is None
    assert [child.text for child in root[:2]] == ["T & t", "D < d"]
    assert "font-family" not in svg
    assert "<style" not in svg
    assert "currentColor" in svg
    for colour in THEME:
        assert f":{colour}" not in svg
    outside = set(re.findall(r"https?://[^\"'\s<]+", svg))
    assert outside <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}


def test_a_run_shows_which_way_its_loop_goes():
    """One arrow up and one down, each in the direction of time; wiggles of noise make no strokes."""
    t = np.linspace(0.0, 4.0 * np.pi, 4000)
    u = 1.0 - np.cos(t) + 0.01 * np.random.default_rng(2).normal(size=t.size)
    axes = Figure().subplots()
    directions(axes, u, np.sin(t - 0.5))
    ends = [(one.xyann[0], one.xy[0]) for one in axes.texts]
    assert len(ends) == 2
    assert ends[0][0] < ends[0][1]
    assert ends[1][0] > ends[1][1]
    assert len(turns(u)) == 5  # four strokes


def test_an_arrow_lies_in_the_middle_of_its_stroke():
    """From 44 to 56 % of the way, however its samples are spaced and however soon the next stroke is over."""
    x = np.array([0.0, *np.linspace(0.3, 1.0, 71), 0.0])
    axes = Figure().subplots()
    directions(axes, x, x)
    assert (axes.texts[0].xyann[0], axes.texts[0].xy[0]) == pytest.approx((0.44, 0.56), abs=0.011)


def test_an_input_that_only_rises_has_one_arrow():
    """And one that stands still has none."""
    for u, count in ((np.linspace(0.0, 1.0, 50), 1), (np.zeros(50), 0)):
        axes = Figure().subplots()
        directions(axes, u, u)
        assert len(axes.texts) == count


def test_a_comparison_shows_what_became_worse_than_nothing():
    """A reduction below zero lies within its panel, as do panels of which no figure is known."""
    rows = {"normal.mean_error_reduction_percent": (-30.0, 20.0), "run.rms_percent": (None, float("nan"))}
    first, second = comparison_figure.draw(["before", "after"], rows).axes
    low, high = first.get_ylim()
    assert low < -30.0 < 20.0 < high
    assert second.get_ylim() == (0.0, 1.0)


def test_learners_are_points_with_their_intervals():
    """A line from one learner to the next looked like a trend, and the intervals were not drawn."""
    ends = (("", 50.0), ("_from", 20.0), ("_to", 80.0))
    rows = {f"quiz.right{end}_percent": (share, share + 1.0) for end, share in ends}
    (axes,) = comparison_figure.draw(["anna", "ben"], rows).axes
    assert [line.get_linestyle() for line in axes.lines] == ["None"]
    drawn = [segment.tolist() for segment in axes.collections[0].get_segments()]
    assert drawn == [[[0.0, 20.0], [0.0, 80.0]], [[1.0, 21.0], [1.0, 81.0]]]
    assert axes.get_ylim()[1] > 81.0
    assert not axes.lines[0].get_clip_on()  # a point at 0 % was cut in half


def test_each_line_of_a_comparison_looks_unlike_the_others():
    """The fifth pulse was drawn like the first."""
    rows = {f"pulse{k}.continuous.mean_error_reduction_percent": [90.0, 91.0] for k in range(20)}
    (axes,) = comparison_figure.draw(["before", "after"], rows).axes
    looks = {(line.get_color(), line.get_marker()) for line in axes.lines}
    assert len(looks) == 20


def test_an_inversion_keeps_its_line_from_pulse_to_pulse_and_a_repeated_one_has_a_number():
    """Two playbacks of one drive had one name; extended was black for one pulse and green for the next."""
    played = [("normal", "continuous"), ("normal", "continuous"), ("normal", "extended")]
    played += [("bifid", "continuous"), ("bifid", "extended")]
    errors = Evaluation(tuple(examples.waveform_evaluation(*one) for one in played))
    figure = figures.evaluation(errors)
    colours = {}
    for axes in figure.axes:
        for line in axes.lines:
            name = str(line.get_label()).partition(",")[0].partition(":")[0]
            if name in ("continuous", "continuous#2", "extended"):
                colours.setdefault(name, set()).add(line.get_color())
    assert {name: len(several) for name, several in colours.items()} == {
        "continuous": 1,
        "continuous#2": 1,
        "extended": 1,
    }
    assert len(set.union(*colours.values())) == 3
    assert "normal\ncontinuous#2" in next(tables_of(errors, 200)).columns


def test_a_long_name_of_the_input_fits_below_its_figure():
    """The label of an axis has more lines, and none goes beyond the figure."""
    group = np.linspace(0.01, 10.0, 6)
    one = Profile("rate", "1/s", group, group / 1000, group / 1000, output_unit="um")
    for name in ("Spannung", "Drive voltage", "Drive voltage of the amplifier in the other room"):
        figure = diagnosis_figures.profile(one, name, extended=True)
        FigureCanvasAgg(figure).draw()
        box = figure.axes[0].xaxis.label.get_window_extent()
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1


def test_the_main_figures_of_a_run_and_its_heat():
    """By hand: how long, how fast, how many reversals; the temperature from the lowest to the highest."""
    found = run_facts(Run(np.arange(6) / 2.0, np.array([0.0, 1.0, 2.0, 0.5, 1.0, 1.0]), np.zeros(6)))
    assert (found["samples"], found["seconds"], found["rate_Hz"], found["reversals"]) == (6, 2.5, 2.0, 2)
    alone = run_facts(Run(np.zeros(1), np.ones(1), np.ones(1)))
    assert (alone["samples"], alone["seconds"], alone["rate_Hz"], alone["gaps"]) == (1, None, None, None)
    assert coil_words(np.array([-0.04, 3.0, 5.06]))["coil"].startswith("+0.0 to +5.1 K")
    assert coil_words(np.array([0.6, 0.5]))["coil"].startswith("+0.5 to +0.6 K")  # no range upside down


def test_stamps_with_a_date_are_counted_from_the_first_sample():
    """Seconds since 1970 ran into each other below the figure."""
    plain = examples.run()
    dated = replace(plain, time_s=plain.time_s + 1.8e9)
    for run, said in ((plain, "time [s]"), (dated, "time since the first sample [s]")):
        below = figures.run(run).axes[1]
        assert below.get_xlabel() == said
        assert below.get_xlim()[1] < 1.1 * plain.time_s[-1]


@pytest.mark.parametrize(
    ("seconds", "unit", "one"), [(500.0, "s", 1), (1200.0, "min", 60), (1e4, "h", 3600), (3e5, "d", 86400)]
)
def test_an_axis_of_time_is_read_in_the_unit_that_fits_its_length(seconds, unit, one):
    """One of 2.8 hours went to ``1e4 s``; its ticks are round in its unit, on both axes that share it."""
    run = replace(examples.run(), reference=None)
    figure = figures.run(replace(run, time_s=np.linspace(0.0, seconds, run.input.size)))
    FigureCanvasAgg(figure).draw()
    above, below, _ = figure.axes
    assert below.get_xlabel() == f"time [{unit}]"
    ticks = [tick.get_text() for tick in below.get_xticklabels()]
    np.testing.assert_allclose([one * float(tick.replace("−", "-")) for tick in ticks], below.get_xticks())
    assert len(ticks) > 3
    assert max(map(len, ticks)) <= 4
    assert list(above.get_xticks()) == list(below.get_xticks())


def test_the_prediction_of_one_model_fills_its_figure():
    """The right half of the picture was empty."""
    alone = figures.evaluation(Evaluation(models=(examples.model_evaluation(),)))
    assert alone.get_size_inches()[0] < figures.evaluation(examples.model_comparison()).get_size_inches()[0]
    assert len(alone.axes) == 2


def test_a_prediction_names_the_quantity_as_the_model_does():
    """A magnet's said "output [mT]"."""
    model = replace(stored.model(), output_quantity="flux density")
    one = replace(examples.model_evaluation(), output_unit="mT")
    for models in ((one,), (one, one)):
        drawn = figures.evaluation(Evaluation(models=models, model=model))
        assert {a.get_ylabel() for a in drawn.axes} == {"flux density [mT]", "residual [mT]"}


def test_a_drive_names_its_quantities_as_the_model_does():
    """That of a piezo said "output [µm]" where its model says stroke."""
    model = replace(stored.model(), input_quantity="voltage", output_quantity="stroke")
    drawn = figures.draw(replace(examples.waveform(), model=model, input_unit="V", output_unit="um"))
    assert [a.get_ylabel() for a in drawn.axes[:2]] == ["stroke [um]", "drive: voltage [V]"]


def test_a_diagnosis_without_time_draws_none():
    """Its samples were called seconds, and groups of one place were drawn as a point."""
    group, one = np.arange(3.0), np.full(3, np.nan)
    one[1] = 1.0
    timed = replace(
        stored.diagnosis(),
        records=(Recorded("", 0.1),),
        profiles=(
            Profile("rate", "1/s", group, group, group),
            Profile("level", "A", group, group, group),
            Profile("direction", "1", group, one, one),
        ),
    )
    timeless = replace(timed, records=(Recorded("", float("nan")),))
    assert [shown.name for shown in diagnosis_figures.profiles(timed)] == ["rate", "level"]
    assert [shown.name for shown in diagnosis_figures.profiles(timeless)] == ["level"]
    said = [diagnosis_figures.course(found).axes[1].get_xlabel() for found in (timed, timeless)]
    assert said == ["time [s]", "sample number"]


def test_no_line_goes_from_one_recording_to_the_next():
    """What was recorded on another day looked like a jump of the output."""
    found = stored.diagnosis()
    middle = found.time_s[found.time_s.size // 2]
    two = replace(found, records=(Recorded("a", 0.1), Recorded("b", 0.1, float(middle))))
    for drawn, holes in ((found, 0), (two, 1)):
        for axes in diagnosis_figures.course(drawn).axes:
            lines = [line.get_ydata() for line in axes.lines if line.get_ydata() is not None]
            curves = [y for y in lines if len(y) > 2]
            assert curves
            assert all(np.count_nonzero(np.isnan(y)) == holes for y in curves)


def test_the_rounding_of_a_rest_is_no_speed():
    """A table of four decimals rests at 1e-15 ranges a second: fifteen labels stood on one another."""
    for slowest, scale in ((0.2, "linear"), (0.002, "symlog")):
        at = np.array([1e-15, slowest, 0.5, 1.0])
        group = Profile("rate", "1/s", at, at, at)
        axes = diagnosis_figures.profile(group, "voltage", extended=False).axes[0]
        assert axes.get_xscale() == scale
        assert np.count_nonzero(axes.get_xticks() > 0) < 8


@pytest.mark.parametrize(("form", "of"), [("direct", "current"), ("dual", "force")])
def test_smoothing_is_a_share_of_the_range_of_the_plane(form, of):
    """The plane of a dual model is that of the output; its smoothing was told of the input."""
    model = examples.model(6)
    model = replace(model, form=form, fit=replace(model.fit, smoothing=0.1))
    rows = identified(Path("m.h5"), model, 1.0)[2]
    assert rows["smoothing"] == f"0.1 of the range of the {of}"
    rows = identified(Path("m.h5"), replace(model, input_quantity="I", output_quantity="I"), 1.0)[2]
    assert rows["smoothing"] == "0.1 of the range of the 'I'"  # a heading is no English word


def test_the_title_of_a_loop_stays_within_its_figure():
    """Of a pulse with a long name it was cut: "one bea"."""
    played = examples.waveform_evaluation("premature-atrial", "closest-match", 1.0, 0)
    figure = Figure(figsize=(3.4, 3.0), layout="constrained")
    panels.loops(figure, [played])
    FigureCanvasAgg(figure).draw()
    assert figure.axes[0].title.get_window_extent().x1 <= figure.bbox.x1


def test_the_legend_of_the_coil_lies_above_its_line():
    """In the low panel of a session it lay on it."""
    warm = replace(stored.session(), temperature_s=np.arange(30.0), temperature_K=np.full(30, 15.0))
    figure = figures.draw(warm)
    FigureCanvasAgg(figure).draw()
    (axes,) = (one for one in figure.axes if "[K]" in one.get_ylabel())
    assert axes.get_xlabel() == "time [s]"
    assert axes.get_legend().get_window_extent().y0 > axes.transData.transform((0.0, 15.0))[1]


def test_the_axis_of_a_record_is_its_time_counted_from_the_first_sample_where_it_has_a_date():
    """And the number of the sample where it has none."""
    (number, words), (plain, time), (dated, since) = (
        panels.abscissa(stamps, 3)
        for stamps in (None, np.asarray([2.0, 2.5, 3.0]), np.asarray([1.7e9, 1.7e9 + 1, 1.7e9 + 2]))
    )
    assert (number.tolist(), plain.tolist(), dated.tolist()) == ([0, 1, 2], [2.0, 2.5, 3.0], [0, 1, 2])
    assert "number" in words
    assert "since" in since
    assert "since" not in time
    # half an hour from 23:35 on, and one that began ten minutes after the clock
    assert panels.abscissa(84_900.0 + 1800.0 * np.asarray([0.0, 0.5, 1.0]), 3)[0].tolist() == [0, 900, 1800]
    assert panels.abscissa(600.0 + 1800.0 * np.asarray([0.0, 0.5, 1.0]), 3)[1] == "time"


def test_what_tuning_would_play_is_told_with_the_gains_of_each_step():
    """But where there are none."""
    played = SimpleNamespace(what="resistance", seconds=1.0, peak_A=0.5, gains="none")
    tried = SimpleNamespace(what="trial", seconds=1.0, peak_A=0.5, gains="those found")
    plan = SimpleNamespace(
        steps=(played, tried), seconds=2.0, current_limit_A=1.0, force_limit_N=9.0, heat_percent=3.0
    )
    said = planned.to_be_tuned(plan)
    assert said["1. resistance"] == "1.00 s up to 0.500 A"
    assert said["2. trial"] == "1.00 s up to 0.500 A, gains those found"
