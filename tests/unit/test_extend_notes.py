"""What `extend` says of causes that were added although something speaks against them."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from pulsetrainer.cli.extend import _doubts


def _said(name, *, lacks=(), doubts=(), curves=1, whole=True):
    cause = SimpleNamespace(cause=name, doubts=doubts)
    found = SimpleNamespace(found=(cause,) * curves, lacks=lacks, whole=whole)
    return _doubts(found, SimpleNamespace(extensions=(cause,)))


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
