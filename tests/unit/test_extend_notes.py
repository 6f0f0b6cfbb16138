"""What `extend` says of causes that were added although something speaks against them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
import store_examples

from pulsetrainer.artefacts import Extension, Parameter
from pulsetrainer.report.diagnosis_results import doubts_of, extended
from pulsetrainer.report.facts import extension_words, facts

MIDDLE = "share of the middle one of several time constants (1: it is the only one)"


def _crept(share: float) -> Extension:
    tau = Parameter("tau", 3.3, "s", 2.7, 3.7, "time constant; of several, the middle one")
    return Extension("creep", (tau, Parameter("middle", share, "1", share, share, MIDDLE)))


def _said(name, *, lacks=(), doubts=(), curves=1, whole=True):
    cause = SimpleNamespace(cause=name, doubts=doubts)
    found = SimpleNamespace(found=(cause,) * curves, lacks=lacks, whole=whole)
    return doubts_of(found, SimpleNamespace(extensions=(cause,)))


@pytest.mark.parametrize(
    ("name", "lacks", "said"),
    [
        ("output-lag", ("rates",), True),
        ("output-lag", ("holds",), False),
        ("thermal-drift", ("rates",), False),
    ],
)
def test_what_widens_the_loop_and_was_seen_at_one_rate_is_a_guess_at_others(name, lacks, said):
    """Nothing in such a record tells a lag from a force that goes with the speed."""
    assert any("one rate of change" in line for line in _said(name, lacks=lacks)) is said


def test_a_cause_in_doubt_is_told_with_its_doubts():
    """Each in words, and of several curves once."""
    (line,) = _said("unlisted", doubts=("it may be nothing", "it wanders"), curves=2)
    assert line.startswith("unlisted is in doubt (it may be nothing; it wanders)")


@pytest.mark.parametrize("whole", [True, False])
def test_where_more_than_noise_is_left_a_run_that_was_not_diagnosed_tells(whole):
    """A viscous part in proportion to the speed, of one with its square: at low speeds it misleads."""
    assert any("not all of the error" in line for line in _said("viscous", whole=whole)) is not whole


def test_parameters_that_were_fitted_again_say_whose_the_intervals_are():
    """Also where a diagnosis does not tell what was chosen, as of one time constant."""
    found = store_examples.diagnosis()
    (one,) = found.extended.extensions
    moved = replace(one.parameters[0], value=1.01 * one.parameters[0].value)
    chosen = Parameter("middle", 1.0, "1", 1.0, 1.0, MIDDLE)
    told = replace(found.found[0], cause=one.cause, parameters=one.parameters)
    found = replace(found, causes=(told,))

    def rows(*parameters):
        model = replace(found.extended, extensions=(Extension(one.cause, parameters),))
        return extended("m.h5", model, found, None, ())[2]

    assert "intervals hold this fit and that of the diagnosis" in rows(moved, chosen)["parameters"]
    assert "parameters" not in rows(*one.parameters, chosen)


def test_of_one_time_constant_nothing_of_several_is_told():
    """Where there are several, it is told which one is meant."""
    assert extension_words(_crept(1.0)) == {"tau": "3.3 s (95 %: 2.7 to 3.7): time constant"}
    assert list(extension_words(_crept(0.2))) == ["tau", "middle"]


def test_a_model_tells_what_it_was_extended_by():
    """The parameters too, for `show` and `print`."""
    said = facts(store_examples.model(extensions=(_crept(1.0),)))
    assert (said["extensions"], said["with creep"]) == (["creep"], "tau 3.3 s (95 %: 2.7 to 3.7)")
