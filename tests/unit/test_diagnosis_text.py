"""A diagnosis in words: whether a cause was found and why not, its parameters with what they are of."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import store_examples

from pulsetrainer.artefacts import Cause, Parameter
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.report import diagnosis_results, tables
from pulsetrainer.report.diagnosis_figures import course, ranked, ranking
from pulsetrainer.report.diagnosis_html import headline
from pulsetrainer.report.diagnosis_text import (
    IN_MODEL,
    answer,
    evidence,
    explains,
    parameters,
    sections,
)

NAN = float("nan")


def _cause(p_value, *, found=False, doubts=()):
    return Cause("creep", found, p_value, 1.0, NAN, doubts=doubts)


def test_a_cause_that_was_not_found_says_why():
    """A small p beside a plain no would be a riddle; each reason has words of its own."""
    small, large = 0.1 * LIMITS.p_max, 10.0 * LIMITS.p_max
    tie = replace(_cause(small, found=True), cause="delay", confounded_with=("creep",))
    whole = replace(store_examples.diagnosis(), causes=(), quick=False)
    quick, tied = replace(whole, quick=True), replace(whole, causes=(tie,))
    other = replace(quick, causes=(_cause(small, found=True),))
    said = [
        answer(_cause(small, found=True), whole),
        answer(_cause(small, found=True, doubts=("it may be nothing",)), whole),
        answer(_cause(small), whole),
        answer(_cause(small), quick),  # nothing was found: no other cause explains more
        answer(_cause(small), other),
        answer(_cause(large), whole),
        answer(_cause(None), whole),
        answer(_cause(large), tied),  # noise does not do as much where it could be instead of a cause
    ]
    assert len(set(said)) == len(said)
    assert [one.startswith("no") for one in said] == [False, False, *[True] * 6]
    assert answer(_cause(LIMITS.p_max), whole) == said[2]  # the limit itself is significant


@pytest.mark.parametrize("verdict", ["none", "inconclusive"])
def test_what_is_seen_but_too_small_to_be_named_is_said_beside_the_verdict(verdict):
    """A verdict of none, and below it a cause that noise does not look like, contradicted each other."""
    small, large = _cause(0.1 * LIMITS.p_max), _cause(10.0 * LIMITS.p_max)
    told = replace(store_examples.diagnosis(), verdict=verdict, causes=(large, small))
    quick = replace(told, quick=True)
    titles = [[part.title for part in sections(one)][1] for one in (told, quick)]
    assert titles == [
        "seen, but not named: creep, which is too small to matter or not confirmed by the refit",
        "seen, but not named: creep, which is too small to matter",
    ]
    assert ("creep" in headline(told), "nothing wrong" in headline(told)) == (True, False)
    assert "could not have shown everything" in headline(replace(told, lacks=("holds",)))
    for other in (
        replace(told, causes=(large,)),
        replace(told, verdict="unknown"),
        replace(told, causes=(small, replace(small, cause="delay", found=True))),
    ):
        assert not any(part.title.startswith("seen") for part in sections(other))


def test_columns_that_would_be_empty_are_left_out():
    """Where nothing is beyond noise no cause has a share: a column of dashes says nothing."""
    whole = replace(store_examples.diagnosis(), static_percent=2.0, floor_percent=1.0)
    within = replace(whole, static_percent=1.0, causes=(_cause(0.5),))
    shown = [{part.title: part for part in sections(one)} for one in (whole, within)]
    assert [len(one["causes, strongest first"].columns) for one in shown] == [4, 2]
    assert ["in this table" in one for one in shown] == [True, False]


@pytest.mark.parametrize("static_percent", [2.0, 0.5])
def test_a_name_in_the_table_says_what_it_is_of(static_percent):
    """Words such as accommodation stood alone. A cause that was found has its own line."""
    other = replace(_cause(0.5), cause="accommodation", text="the loops drift over repeated cycles")
    causes = (replace(_cause(0.0, found=True), text="it creeps"), other)
    told = replace(
        store_examples.diagnosis(), causes=causes, static_percent=static_percent, floor_percent=1.0
    )
    (said,) = (part.rows for part in sections(told) if part.title == "in this table")
    assert said["accommodation"] == "the loops drift over repeated cycles"
    assert "creep" not in said


@pytest.mark.parametrize("doubts", [(), ("it may be nothing", "it wanders")])
@pytest.mark.parametrize("rivals", [(), ("delay", "output-lag")])
def test_a_cause_that_was_found_brings_its_parameters_rivals_and_doubts(doubts, rivals):
    """All of them, and no row for what there is not."""
    tau = Parameter("tau", 1.5, "s", 1.25, 1.75)
    one = replace(_cause(0.0, found=True, doubts=doubts), confounded_with=rivals, parameters=(tau,))
    title = "in doubt:" if doubts else "found:"
    (found,) = (
        part
        for part in sections(replace(store_examples.diagnosis(), causes=(one,)))
        if part.title.startswith(title)
    )
    told = found.rows
    assert set(told) == {"tau"} | ({"or"} if rivals else set()) | ({"why in doubt"} if doubts else set())
    assert all(word in told["or"] for word in rivals)
    assert all(word in told["why in doubt"] for word in doubts)


def test_a_parameter_is_told_with_unit_interval_and_meaning():
    """The interval says of which confidence it is; where none is known nothing is said of it."""
    known = Parameter("tau", 1.5, "s", 1.25, 1.75, "time constant of the lag")
    assert parameters([known])["tau"] == "1.5 s (95 %: 1.25 to 1.75): time constant of the lag"
    assert (
        parameters([Parameter("tau", 1.5, "s", NAN, NAN)])["tau"] == "1.5 s"
    )  # a file of 0.1, a quick screen
    long = parameters([Parameter("tau", 8640.0, "s", 7200.0, 9000.0)])
    assert long["tau"] == "8640 s = 2.4 h (95 %: 7.2e+03 to 9e+03)"
    narrow = parameters([Parameter("f", 7.0, "Hz", 6.9999, 7.0003)])
    assert narrow["f"] == "7 Hz (95 %: ± 0.0003)"  # "7 to 7" told nothing
    none = parameters([Parameter("filter", 6.6e-15, "s", 0.0, 0.0033)])
    assert none["filter"] == "0 s (95 %: 0 to 0.0033)"


def test_what_is_slow_is_told_in_long_times():
    """A disturbance that comes once a day, with an interval whose ends differ as much as the value shows."""
    names = ("sine", "cosine", "frequency", "sine 2", "cosine 2")
    values = (0.218, 0.2661, 1.155e-5, 3.0, 4.0)
    several = [
        Parameter(n, v, "Hz" if n == "frequency" else "%", NAN, NAN)
        for n, v in zip(names, values, strict=True)
    ]
    several[2] = replace(several[2], lower=1.1522e-5, upper=1.1578e-5)
    said = parameters(several)
    assert said["frequency"] == "1.155e-05 Hz = once in 24.1 h (95 %: 1.152e-05 to 1.158e-05)"
    assert said["cosine"].endswith("an amplitude of 0.344 %")
    assert said["cosine 2"].endswith("an amplitude of 5 %")
    assert said["sine"] == "0.218 %"
    rate = Parameter("rate", 1.098e-6, "%/s", 1.07e-6, 1.13e-6)
    assert parameters([rate])["rate"] == "1.098e-06 %/s = 0.095 %/d (95 %: 1.07e-06 to 1.13e-06)"


def test_what_was_measured_comes_before_what_was_chosen():
    """Amplitude and time constant of a creep, then how many time constants it has."""
    chosen, tau = Parameter("middle", 1.0, "1", 1.0, 1.0), Parameter("tau", 1.5, "s", 1.25, 1.75)
    assert list(parameters([chosen, Parameter("amplitude", 0.1, "1", 0.05, 0.15), tau])) == [
        *("amplitude", "tau", "middle")
    ]


def test_a_cause_that_could_be_instead_has_no_share_of_its_own():
    """It explains nothing beside the cause that was found: 0.1 % stood beside "could equally be"."""
    found = replace(
        _cause(0.001, found=True), cause="delay", confounded_with=("creep",), explains_percent=90.0
    )
    other = replace(_cause(0.5), explains_percent=0.1)
    told = replace(store_examples.diagnosis(), causes=(found, other), static_percent=2.0, floor_percent=1.0)
    assert explains(found, told) == 90.0
    assert math.isnan(explains(other, told))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_learned_curve_is_told_by_its_ends_and_not_value_by_value(count):
    """Of the output or its gain, zero at the first knot; several curves and time constants are counted."""
    kept = [Parameter("state", 3.0, "1", 3.0, 3.0), Parameter("low", 0.0, "A", 0.0, 0.0)]
    curves = [
        [Parameter("tau", 2.0, "s", NAN, NAN)]
        + [Parameter(f"{name}{k}", size * (k - 4), unit, NAN, NAN) for k in range(2, 9)]
        for name, size, unit in (("f", 0.1, "N"), ("g", 0.01, "1"), ("f", 0.2, "N"))[:count]
    ]
    said = parameters(sum(curves, kept))
    assert list(said) == [*["tau", "tau 2", "tau 3"][:count], *["curve", "curve 2", "curve 3"][:count]]
    told = [text.partition(";")[0] for name, text in said.items() if name.startswith("curve")]
    adds = "what it adds to the"
    known = [f"-0.2 to 0.4 N: {adds} output", f"-2 to 4 %: {adds} gain", f"-0.4 to 0.8 N: {adds} output"]
    assert told == known[:count]
    assert all(text.endswith("the report (--html) draws it") for text in said.values() if adds in text)
    on_the_page = parameters(sum(curves, kept), drawn="drawn below").values()
    assert all(text.endswith("; drawn below") for text in on_the_page if adds in text)


def test_where_nothing_is_left_no_cause_explains_a_share_of_it():
    """A share of an error that is no larger than noise would say that a cause was there."""
    found = store_examples.diagnosis()
    one = replace(_cause(0.1 * LIMITS.p_max), explains_percent=100.0)
    for left, known in ((0.9, False), (1.0, False), (1.1, True)):
        share = explains(one, replace(found, static_percent=left, floor_percent=1.0))
        assert (share == 100.0) is known
    assert math.isnan(explains(replace(one, p_value=0.5), found))  # noise does as much
    small = replace(found, static_percent=0.9, floor_percent=1.0)
    assert math.isnan(explains(replace(one, found=True), small))
    assert explains(replace(one, found=True, p_value=None), small) == 100.0  # a change of condition
    gate = replace(one, found=True, p_value=None, explains_percent=0.0)
    assert math.isnan(explains(gate, small))


def test_its_tables_fit_a_terminal_of_eighty_columns():
    """With the longest name of a cause and the longest answer; a list of the same is three times as long."""
    longest = replace(_cause(0.1 * LIMITS.p_max), cause="load-dependence", explains_percent=100.0)
    found = replace(store_examples.diagnosis(), causes=(replace(longest, found=True), longest))
    drawn = [
        tables.ESCAPE.sub("", tables.drawn(part.title, part.columns, part.rows))
        for part in sections(found)
        if isinstance(part, tables.Table)
    ]
    assert len(drawn) == 2
    assert max(len(line) for text in drawn for line in text.splitlines()) <= 80


def test_the_chart_shows_what_explains_something():
    """Causes that were found, and those that look like some of it: not the many that explain 0.0 %."""
    found = store_examples.diagnosis()
    strong, weak, none = (
        replace(_cause(0.1 * LIMITS.p_max), cause=name, explains_percent=share)
        for name, share in (("delay", 30.0), ("viscous", 0.2), ("step", 0.04))
    )
    axes = ranking(replace(found, causes=(strong, weak, none))).axes[0]
    assert {label.get_text() for label in axes.get_yticklabels()} == {"delay", "viscous"}


def test_the_chart_says_no_more_than_the_table():
    """Where nothing is beyond noise a cause that was found has no share, in the table and in the chart."""
    found = store_examples.diagnosis()
    told = replace(_cause(0.001, found=True), explains_percent=100.0)
    within = replace(found, causes=(told,), static_percent=1.0, floor_percent=1.0)
    assert ranked(within) == []
    assert ranked(replace(within, static_percent=2.0)) == [told]


@pytest.mark.parametrize("verdict", ["none", "unknown"])
def test_the_figure_bears_the_verdict_of_the_page(verdict):
    """A cause that is told, but is no verdict, is none in the figure's title either."""
    found = replace(store_examples.diagnosis(), verdict=verdict)
    assert course(found).axes[0].get_title("left") == f"Verdict: {verdict}"


@pytest.mark.parametrize("doubts", [(), ("it fits, but does not repeat",)])
def test_what_is_in_doubt_beside_the_verdict_is_not_called_found(doubts):
    """The headline and the figure named both alike, where the terminal said that one is in doubt."""
    step, creep = (
        replace(_cause(0.0, found=True), cause="step"),
        replace(_cause(0.0, found=True), doubts=doubts),
    )
    found = replace(store_examples.diagnosis(), causes=(step, creep), verdict="step")
    between = "; in doubt: " if doubts else ", "
    assert headline(found).startswith(f"Found: step{between}creep")
    assert course(found).axes[0].get_title("left") == f"Verdict: step{between}creep"


def test_the_verdict_names_what_it_could_equally_be():
    """A delay stood alone in the first line, of which the fourth said that it could be four other causes."""
    one = replace(_cause(0.0, found=True), confounded_with=("delay", "viscous", "field-lag"))
    found = replace(store_examples.diagnosis(), causes=(one,), verdict="creep")
    said = "could equally be delay, viscous or field-lag"
    assert next(iter(sections(found))).title == f"verdict: creep ({said})"
    assert headline(found).startswith(f"Found: creep ({said})")


def test_what_the_model_contains_already_is_told_first():
    """A verdict of creep, of a model with creep, read like a fault of that model."""
    found = replace(store_examples.diagnosis(), causes=(_cause(0.0, found=True),), verdict="creep")
    held = replace(found, in_model=("creep",), extended=None, correctable=())
    titles = [next(iter(sections(one))).title for one in (found, held)]
    assert titles == ["verdict: creep", "verdict: creep (the model as given contains it already)"]
    assert [IN_MODEL in headline(one) for one in (found, held)] == [False, True]


def test_evidence_that_stands_with_a_cause_is_not_repeated():
    """The same paragraph stood under found and under evidence."""
    one = replace(_cause(None, found=True), cause="outliers", text="5 isolated samples differ")
    said = ("outliers: 5 isolated samples differ.", "outliers: all in one minute.")
    found = replace(store_examples.diagnosis(), causes=(one,), evidence=said)
    assert evidence(found) == ["outliers: all in one minute."]
    assert evidence(replace(found, causes=())) == list(said)


@pytest.mark.parametrize(("name", "before"), [("step", True), ("offset-drift", False)])
def test_an_extended_model_is_of_the_time_before_a_step(name, before):
    """If the device itself changed then, it is no model of what the device is now."""
    found = store_examples.diagnosis()
    told = replace(_cause(0.001, found=True), cause=name)
    told = replace(found, causes=(told,), correctable=(name,))
    row = diagnosis_results._apart(told, store_examples.model(6))[f"left out {name}"]
    assert ("of the time before it" in row) is before
