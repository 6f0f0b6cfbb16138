"""Names of figures: each has one that the vocabulary knows, and no row of a table is without its unit."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import report_examples as examples
import store_examples

import pulsetrainer as pt
from pulsetrainer.artefacts import DrivePlayback, Evaluation
from pulsetrainer.artefacts.evaluation import METRICS, MODEL_METRICS
from pulsetrainer.artefacts.session import FIGURES
from pulsetrainer.artefacts.waveform import RefinePass
from pulsetrainer.report import figures, html, results, tables
from pulsetrainer.report.facts import facts, run_facts
from pulsetrainer.report.names import FORCE, NAMES, digits, headed, split
from pulsetrainer.report.tables import label, text
from pulsetrainer.report.text import tables_of
from pulsetrainer.steps.compare import compare
from pulsetrainer.steps.import_ import report_of

VOCABULARY = (Path(__file__).parents[2] / "docs" / "vocabulary.md").read_text(encoding="utf-8")
EVALUATION = examples.evaluation()


def test_every_figure_has_a_name():
    """Of playbacks, of models and of sessions."""
    assert {*METRICS, *MODEL_METRICS, *FIGURES} <= set(NAMES)


def test_no_two_figures_of_one_table_have_the_same_name():
    """A row is told from the next."""
    for keys in (METRICS, MODEL_METRICS, FIGURES):
        assert len({NAMES[key] for key in keys}) == len(keys)


def test_the_vocabulary_has_every_name_of_an_evaluation():
    """Each key of the page stands beside the name that a screen has for it."""
    rows = [line.split(" | ") for line in VOCABULARY.splitlines() if line.startswith("| ")]
    named = {key: row[0] for row in rows for key in re.findall(r"`(\w+)`", row[-1])}
    for key in (*METRICS, "max_percent", "rms_percent", "gain_percent", "shape_rms_percent", "noise_percent"):
        assert NAMES[key].words in named[key], key


def test_every_row_of_an_evaluation_has_a_unit():
    """Of pulses: that of the title, or one that the title names for it."""
    for table in tables_of(replace(EVALUATION, models=())):
        title = table.title.replace("\n", " ")
        for row in table.rows:
            named = next(one for one in NAMES.values() if row[0].partition(",")[0] == one.words)
            assert (title.split(", ")[1] if named.unit == FORCE else f"{named.words}: {named.unit}") in title
        assert "of the pulses, % of full force loop area" in title


def test_a_model_alone_has_no_improvement():
    """There is nothing that it could be better than."""
    models = examples.model_comparison().models
    heads = [next(iter(tables_of(Evaluation(models=models[:n])))).columns for n in (1, 2)]
    assert [any("improvement" in head for head in columns) for columns in heads] == [False, True]


def test_a_negative_improvement_is_told_in_words():
    """On the screen and on the page: that the model is worse, and by how much; a better one is not."""
    first, better = examples.model_comparison().models
    same = first.shape_rms_percent
    worse = replace(better, name="worse", gain_percent=-12.5, shape_rms_percent=same)
    told = Evaluation(models=(first, better, worse))
    said = f"worse predicts it worse than {first.name}: its rms error is 12.50 % larger"
    assert results.worse(told) == [said]
    header = {"title": "t", "created": "c", "provenance_json": "{}"}
    assert said in html.render_evaluation(told, **header).replace("\N{NO-BREAK SPACE}", " ")
    moved = Evaluation(models=(first, replace(worse, shape_rms_percent=0.6 * same)))
    assert results.worse(moved) == [f"{said}, but less a constant offset 40.00 % smaller"]
    assert results.worse(Evaluation(models=(first, better))) == []
    hardly = replace(better, name="hardly", gain_percent=-0.0132)  # 2.02 and 2.02 % in the table
    assert results.worse(Evaluation(models=(first, hardly))) == []


@pytest.mark.parametrize(
    ("dotted", "owner", "words"),
    [
        ("normal.closest-match.scaled.hysteresis_percent", "normal.closest-match", "loop area, scaled"),
        ("normal.mean_error_reduction_percent", "normal", "reduction of the mean error"),
        ("model.1.rms_percent", "model.1", "rms error"),
        ("nrmse", "", "rms error"),
    ],
)
def test_a_dotted_name_is_told_in_words(dotted, owner, words):
    """Whose it is, what it is, of which drive."""
    found, named = split(dotted)
    assert (found, named.words) == (owner, words)
    assert label(dotted).startswith(f"{owner}: {words}" if owner else words)


def test_a_title_says_the_kind_once():
    """Most say it themselves."""
    assert headed("diagnosis", "Diagnosis of run") == "Diagnosis of run"
    assert headed("waveform", "normal by refined inversion") == "waveform: normal by refined inversion"


@pytest.mark.parametrize(("spread", "better"), [(0.02, True), (0.2, None)])
def test_no_verdict_within_the_spread_between_repeats(spread, better):
    """A mean error that fell by 0.1 % is better where repeats differ by less."""
    before = replace(EVALUATION.waveforms[0], error_spread_percent=spread)
    mean = before.compensated.mean_abs_error_percent - 0.1
    after = replace(before, compensated=replace(before.compensated, mean_abs_error_percent=mean))
    metrics = compare([Evaluation(waveforms=(one,)) for one in (before, after)])
    name = "compensated.mean_abs_error_percent"
    assert [m.better for m in metrics if m.name.endswith(name)] == [better]


def test_a_small_figure_reads_the_same_wherever_it_is_shown():
    """In the table, on the page, in a figure's legend and in the words beside it; never as nothing."""
    whole = EVALUATION.waveforms[0]
    one = replace(whole, compensated=replace(whole.compensated, hysteresis_percent=0.00553))
    (table,) = tables_of(Evaluation(waveforms=(one,)))
    (row,) = (row for row in table.rows if row[0] == "loop area, compensated")
    legend = " ".join(shown.get_text() for shown in figures.loops([one]).legends[0].get_texts())
    page = html.render_evaluation(Evaluation(waveforms=(one,)), title="", created="", provenance_json="{}")
    shown = [
        text(row[-1]),
        html.metric(one, "compensated.hysteresis_percent", "").text,
        *re.findall(r"compensated: (\S+)", legend),
        *re.findall(r"compensated drive one of (\S+) %", page),
    ]
    assert set(shown) == {"0.00553"}
    assert len(shown) >= 4


def test_what_is_shown_of_a_file_is_what_it_holds():
    """Each fact by the name of a field is that field; the others by their definition."""
    passes = tuple(RefinePass(repeats, 9.0 / repeats, 10.0 / repeats, 0.1) for repeats in (2, 5, 3))
    drive = replace(examples.waveform(), passes=passes, kept=2)
    gap = np.append(np.arange(50.0), 60.0 + np.arange(50.0)) / 50.0
    run = pt.Run(5.0 + gap, np.abs(np.arange(100) % 40 - 20.0), np.arange(100.0))
    played, session = examples.playback(repeats=3), store_examples.session()
    others = (
        (run, {"samples": 100, "seconds": gap[-1], "rate_Hz": 50.0, "gaps": 1, "reversals": 4}),
        (drive, {"samples": drive.target.size, "mean_abs_error_percent": 1.8, "max_abs_error_percent": 2.0}),
        (played, {"samples": drive.target.size, "seconds": drive.time_s[-1], "repeats": 3}),
        (session, {"beats": session.beats.start_s.size, "seconds": np.ptp(session.time_s)}),
        (examples.model(), {"cells": 48 * 49 // 2}),
        (store_examples.diagnosis(), {}),
    )
    for artefact, expected in others:
        shown = facts(artefact)
        for name, value in expected.items():
            assert shown[name] == pytest.approx(value), name
        fields = {name for name in shown if isinstance(getattr(artefact, name, None), str | int | float)}
        fields -= {"offset"}  # in words, with its unit
        assert fields
        assert {name: shown[name] for name in fields} == {name: getattr(artefact, name) for name in fields}


@pytest.mark.parametrize("heading", ["U_a", "input (Spannung U_a)", "output (coil_force)", "Spannung U_a"])
def test_a_heading_of_somebodys_table_stays_as_it_is(heading):
    """Its underscore is part of the name, as on the axes of a figure."""
    assert label(heading) == heading
    assert (label("dropped_samples"), label("fast_rate_Hz")) == ("dropped samples", "fast rate, Hz")


def test_reversals_are_counted_as_import_counts_them():
    """Those of noise are none: one number for one record."""
    rng = np.random.default_rng(0)
    u = np.abs(np.mod(np.linspace(0.0, 6.0, 3000), 2.0) - 1.0) + rng.normal(0.0, 0.003, 3000)
    run = pt.Run(time_s=np.arange(3000) / 100, input=u, output=u)
    assert run_facts(run)["reversals"] == report_of(run).reversals == 5


def test_what_was_played_took_both_drives_as_often_as_they_were_repeated():
    """To the last sample of each, without the pauses between them."""
    playback = store_examples.playback(n=20, repeats=3)
    told, _, _ = results.played(Path("played.h5"), playback, "serial", "firmware")
    assert told["seconds"] == pytest.approx(0.19 * 3 * 2)


@pytest.mark.parametrize(("force", "said"), [(0.8, "0.8 of 1.0 N at 1 A, the highest current"), (0.995, "")])
def test_what_a_warm_coil_lacks_at_the_top_is_told(force, said):
    """It is sent the highest current where the cold coil needed less; half a per cent is not told."""
    drive = store_examples.playback()
    target, cold = np.linspace(0.0, 1.0, 20), np.linspace(0.0, 0.9, 20)
    waveform = replace(drive.waveform, target=target, compensated=cold, scored=np.ones(20, bool))
    sent, measured = np.minimum(cold / 0.85, 1.0), np.minimum(target, force)
    warm = DrivePlayback(*(np.tile(one, (2, 1)) for one in (sent, sent, measured)))
    played = replace(drive, waveform=waveform, compensated=warm, temperature_K=np.array([10.0, 11.0]))
    rows = results.played(Path("played.h5"), played, "serial", "firmware")[2]
    assert rows.get("too warm", "").startswith(said)
    assert ("too warm" in rows) == bool(said)
    assert "too warm" not in results.played(Path("p.h5"), replace(played, temperature_K=None), "", "")[2]


def test_a_range_has_three_decimals_or_as_many_as_tell_its_ends_apart():
    """Narrower than a tenth it would read as one number."""
    assert results._range_words((1.0, 1.11), "A", 1.2) == ("1.000 .. 1.110 A", "1.200 A")
    assert results._range_words((1.0, 1.0004), "A", 1.00052) == ("1 .. 1.0004 A", "1.00052 A")


def test_a_list_is_aligned_by_the_longest_of_its_headings():
    """That of the names is none of them: each name has a line of its own."""
    lines = list(tables.listed("title", ["the name", "long one", "b"], [["x", 1, 2]]))
    assert lines == ["title", "  x", "    long one  1", "    b         2"]


@pytest.mark.parametrize(("width", "said"), [(12, "t\n  ab  c\n"), (11, "t\n  ab\n    c\n")])
def test_figures_stand_beside_their_names_where_there_is_room(width, said):
    """Twice the longest name and eight letters are room; else they stand below."""
    assert tables.rendered(tables.Facts("t", {"ab": "c"}), width) == said


def test_the_length_and_the_rate_of_a_slow_run_are_told_in_long_times():
    """A month at two samples an hour; as figures they stay seconds and Hz."""
    said = tables.rendered(tables.Facts("t", {"seconds": 2.59e6, "rate_Hz": 1 / 1800}))
    assert said == "t\n  seconds   2.59e+06 = 30 d\n  rate, Hz  0.000556 = once in 30 min\n"


def test_a_figure_has_as_many_digits_as_tell_something():
    """A model was `304.05 %` worse than another."""
    known = {93.944: "93.94", 99.99: "99.99", 99.996: "100", -304.05: "-304", 0.01234: "0.0123", 0.0: "0.00"}
    assert {value: digits(value) for value in known} == known
