"""Hand-read loops, and records that hold nothing to fit."""

from __future__ import annotations

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.errors import ArgumentError, DataError
from wording import raises


def loop(points):
    """A hand-read loop: there and back, with a width of a tenth."""
    half = points // 2
    u = np.concatenate((np.linspace(0.0, 1.0, half), np.linspace(1.0, 0.0, points - half + 1)[1:]))
    rising = np.arange(points) < half
    y = u + np.where(rising, -0.2, 0.2) * u * (1.0 - u)
    return u, np.round(y, 3)


@pytest.mark.parametrize("points", [20, 41, 60])
def test_a_hand_read_loop_is_data(points):
    """20 to 60 points: as many levels as they support, said, and the loop is met."""
    u, y = loop(points)
    model = pt.identify(pt.Run(time_s=None, input=u, output=y))
    assert model.levels == points // 2
    assert any(str(model.levels) in note for note in model.fit.notes)
    assert model.fit.rms_percent < 1.0
    assert (model.form, model.fit.loop, model.fit.warning) == ("direct", "counterclockwise", "")


def test_levels_that_are_asked_for_are_kept():
    """Nothing is said of them."""
    u, y = loop(60)
    model = pt.identify(pt.Run(time_s=None, input=u, output=y), levels=8)
    assert model.levels == 8
    assert not any("short" in note for note in model.fit.notes)


def test_a_long_record_has_48_levels():
    """As before."""
    u, y = loop(400)
    assert pt.identify(pt.Run(time_s=None, input=u, output=y)).levels == 48


@pytest.mark.parametrize("form", ["auto", "direct", "dual", "signed"])
@pytest.mark.parametrize("points", [1, 2, 3])
def test_a_record_of_next_to_nothing_is_refused(points, form):
    """One to three samples are no loop, of any form."""
    u = np.arange(float(points))
    with pytest.raises((DataError, ArgumentError)):
        pt.identify(pt.Run(time_s=None, input=u, output=u), form=form)


@pytest.mark.parametrize("form", ["auto", "dual", "signed"])
def test_an_output_that_does_not_move_is_refused(form):
    """It has no loop that runs either way."""
    u, y = loop(200)
    with pytest.raises((DataError, ArgumentError)):
        pt.identify(pt.Run(time_s=None, input=u, output=np.ones_like(y)), form=form)


@pytest.mark.parametrize("step", [0.0, -0.1])
def test_time_that_stands_or_goes_back_is_refused(step):
    """Before anything is fitted; the message names the sample."""
    u, y = loop(50)
    time = np.arange(50.0)
    time[20] = time[19] + step
    with raises(DataError, "names it", named="sample 20"):
        pt.Run(time_s=time, input=u, output=y)
