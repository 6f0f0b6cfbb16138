"""Bad numbers are refused where they come in, with the argument's name, what it was, what it should be."""

from __future__ import annotations

import numpy as np
import pytest

from pulsetrainer.core import excitations, inversion, memory, metrics, nnls, pulses
from pulsetrainer.core.coverage import coverage
from pulsetrainer.core.identification import identify
from pulsetrainer.core.operator import Preisach, outputs
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.errors import ArgumentError

PLANE = Plane.uniform(0.0, 1.0, 4)
ONES = np.ones(PLANE.n_q)
OPERATOR = Preisach(PLANE, ONES)
RELAYS = Preisach(PLANE, ONES, reading="relay")
NAN, INF = float("nan"), float("inf")

# What no input of any function may be, and what the message must say of it.
NO_VECTOR = {
    "empty": ([], ["at least", "(0,)"]),
    "two-dimensional": ([[0.1, 0.2], [0.3, 0.4]], ["vector", "(2, 2)"]),
    "a scalar": (0.5, ["vector", "()"]),
    "NaN": ([0.1, NAN, 0.3, 0.4, 0.5], ["finite", "nan", "sample 1", "1 of 5"]),
    "infinite": ([0.1, 0.2, -INF, -INF, 0.5], ["finite", "-inf", "sample 2", "2 of 5"]),
    "text": (["0.1", "much"], ["numbers", "much"]),
    "ragged": ([[0.1], [0.2, 0.3]], ["numbers"]),
}

FIVE = np.arange(5.0)
TAKES_A_VECTOR = {
    "edges": Plane,
    "input": OPERATOR,
    "input, relays": RELAYS,
    "input, many weights": lambda u: outputs(PLANE, ONES[None], np.zeros(1), u),
    "input, coverage": lambda u: coverage(PLANE, [u]),
    "input, record": lambda u: Record(u, FIVE),
    "target": lambda y: inversion.invert(OPERATOR, y),
    "target, closest match": lambda y: inversion.closest_match(RELAYS, y),
    "inputs, slew": lambda u: inversion.slew_limited(u, 1000.0, 1.0),
    "inputs, spline": lambda u: inversion.smoothed(u, FIVE, 0.1, 0.0, 1.0),
    "points": lambda p: excitations.through(p, 1.0, 100.0),
    "time": lambda t: pulses.Shape("pulse", t, FIVE),
    "value": lambda v: pulses.Shape("pulse", FIVE, v),
    "target, tracking": lambda y: metrics.tracking(y, FIVE, 1.0),
    "measured": lambda y: metrics.prediction(y, FIVE),
    "predicted": lambda y: metrics.prediction(FIVE, y),
    "x": lambda x: metrics.loop_area(x, FIVE),
    "y": lambda y: metrics.loop_area(FIVE, y),
    "rhs": lambda f: nnls.solve(np.eye(5), f),
}


@pytest.mark.parametrize(("values", "words"), NO_VECTOR.values(), ids=NO_VECTOR.keys())
@pytest.mark.parametrize("argument", TAKES_A_VECTOR)
def test_every_vector_is_checked(argument, values, words):
    """Empty, shapeless, not finite, no numbers: the message names the argument and shows what it was."""
    with pytest.raises(ArgumentError) as caught:
        TAKES_A_VECTOR[argument](values)
    message = str(caught.value)
    assert argument.split(",")[0] in message
    for word in words:
        assert word in message
    assert caught.value.hint


def shape(**changes):
    """A waveform of four samples with something wrong."""
    return pulses.Shape(**({"name": "p", "time_s": np.arange(4.0), "value": np.arange(4.0)} | changes))


def train(**changes):
    """A pulse train with something wrong."""
    right = {"periods": 1, "rate_Hz": 100.0, "low": 0.0, "high": 1.0}
    return pulses.train(shape(), **(right | changes))


def fit(u, y, *, n_h=4, low=0.0, high=1.0, sample_weight=1.0):
    """A fit of one record."""
    return identify(
        [Record(np.asarray(u, dtype=float), np.asarray(y), sample_weight)], Plane.uniform(low, high, n_h)
    )


SWEEP = np.concatenate((np.linspace(0, 1, 20), np.linspace(1, 0, 20)))

# Each call, and words its message must hold: the argument, what it was, what was expected.
BAD = {
    # the plane
    "no levels": (lambda: Plane(np.array([])), ["edges", "at least 1", "(0,)"]),
    "one level": (lambda: Plane.uniform(0.0, 1.0, 1), ["n_h", "at least 2", "1"]),
    "levels without end": (lambda: Plane.uniform(0.0, 1.0, 10**400), ["n_h", "at most 10000", "10000000"]),
    "no level count": (lambda: Plane.uniform(0.0, 1.0, 0), ["n_h", "at least 2", "0"]),
    "a fraction of a level": (lambda: Plane.uniform(0.0, 1.0, 2.5), ["n_h", "whole", "2.5"]),
    "two edges": (lambda: Plane(np.array([0.0, 1.0])), ["at least 2 levels", "3 edges", "2 edges"]),
    "input range of zero": (lambda: Plane.uniform(1.0, 1.0, 4), ["low < high", "low = 1", "high = 1"]),
    "input range upside down": (lambda: Plane.uniform(2.0, 1.0, 4), ["low < high", "low = 2", "high = 1"]),
    "input range of NaN": (lambda: Plane.uniform(0.0, NAN, 4), ["low < high", "nan"]),
    "input range too small for floats": (lambda: Plane.uniform(1.0, 1.0 + 4e-16, 48), ["edges", "increase"]),
    "infinite input range": (lambda: Plane.uniform(-1e308, 1e308, 4), ["range"]),
    "repeated levels": (lambda: Plane(np.array([0.0, 0.5, 0.5, 1.0])), ["edges", "strictly increase"]),
    "falling levels": (lambda: Plane(np.array([1.0, 0.5, 0.0])), ["edges", "strictly increase", "-0.5"]),
    "masses of the wrong length": (lambda: PLANE.everett_nodes(np.ones(9)), ["(..., 10)", "(9,)"]),
    "nodes of the wrong length": (lambda: PLANE.everett_grid(np.ones(11)), ["(..., 10)", "(11,)"]),
    # the operator
    "weights of the wrong length": (lambda: Preisach(PLANE, np.ones(9)), ["weights", "(10,)", "(9,)"]),
    "square weights": (lambda: Preisach(PLANE, np.ones((4, 4))), ["weights", "(10,)", "(4, 4)"]),
    "negative weights": (
        lambda: Preisach(PLANE, ONES - 2 * (np.arange(10) == 3)),
        ["weights", "-1", "cell 3"],
    ),
    "weights of NaN": (lambda: Preisach(PLANE, ONES * NAN), ["weights", "finite", "nan", "cell 0"]),
    "infinite weights": (lambda: Preisach(PLANE, ONES * INF), ["weights", "finite", "inf", "cell 0"]),
    "offset of NaN": (lambda: Preisach(PLANE, ONES, NAN), ["offset", "finite", "nan"]),
    "polarity of zero": (lambda: Preisach(PLANE, ONES, polarity=0), ["polarity", "1 or -1", "0"]),
    "unknown reading": (lambda: Preisach(PLANE, ONES, reading="fine"), ["reading", "'continuous'", "'fine'"]),
    "many weights of the wrong length": (
        lambda: outputs(PLANE, np.ones((2, 9)), np.zeros(2), [0.5]),
        ["weights", "(b, 10)", "(2, 9)"],
    ),
    "many weights, one offset": (
        lambda: outputs(PLANE, np.ones((2, 10)), np.zeros(1), [0.5]),
        ["offsets", "(b,)", "(1,)"],
    ),
    "many weights, some negative": (
        lambda: outputs(PLANE, -np.ones((2, 10)), np.zeros(2), [0.5]),
        ["weights", "not negative", "-1"],
    ),
    "many offsets, one NaN": (
        lambda: outputs(PLANE, np.ones((2, 10)), np.array([0.0, NAN]), [0.5]),
        ["offsets", "finite"],
    ),
    # the memory
    "empty state": (lambda: memory.State(()), ["state", "at least one", "()"]),
    "state of NaN": (lambda: memory.State((0.0, NAN)), ["state", "finite", "nan"]),
    "state that does not alternate": (lambda: memory.State((0.0, 0.5, 0.7)), ["alternate", "0.7"]),
    "state with a minimum twice": (lambda: memory.State((0.0, 1.0, 0.0)), ["close in"]),
    "state with a maximum twice": (lambda: memory.State((0.0, 1.0, 0.5, 1.0)), ["close in"]),
    "state whose minimum is above its maximum": (lambda: memory.State((0.0, 2.0, 1.5, 1.0)), ["alternate"]),
    "state that opens": (lambda: memory.State((0.0, 0.5, 0.2, 0.6)), ["close in", "0.6"]),
    "state with a repeated extreme": (lambda: memory.State((0.0, 0.5, 0.5)), ["alternate", "0.5"]),
    "saturation of NaN": (lambda: memory.negative_saturation(NAN), ["state", "finite", "nan"]),
    "saturation upside down": (lambda: memory.positive_saturation(1.0, 0.0), ["state", "(1.0, 0.0)"]),
    "demagnetised in no range": (lambda: memory.demagnetised(1.0, 1.0), ["low < high", "1"]),
    # inversion
    "inverse of relays": (lambda: inversion.invert(RELAYS, [0.0]), ["relay", "continuous"]),
    "inverse of nothing": (lambda: inversion.invert(Preisach(PLANE, 0 * ONES), [0.0]), ["weights", "zero"]),
    "match of nothing": (
        lambda: inversion.closest_match(Preisach(PLANE, 0 * ONES, reading="relay"), [0.0]),
        ["weights", "zero"],
    ),
    "spline of too few samples": (
        lambda: inversion.smoothed(np.ones(4), np.arange(4.0), 0.1, 0.0, 1.0),
        ["at least 5", "(4,)"],
    ),
    "spline in standing time": (
        lambda: inversion.smoothed(np.ones(6), np.zeros(6), 0.1, 0.0, 1.0),
        ["time", "increas"],
    ),
    "spline in other times": (
        lambda: inversion.smoothed(np.ones(6), np.arange(7.0), 0.1, 0.0, 1.0),
        ["time", "(7,)", "(6,)"],
    ),
    "spline with no step": (
        lambda: inversion.smoothed(np.ones(6), np.arange(6.0), 0.0, 0.0, 1.0),
        ["step", "positive", "0"],
    ),
    "spline in no range": (
        lambda: inversion.smoothed(np.ones(6), np.arange(6.0), 0.1, 1.0, 0.0),
        ["low < high", "1", "0"],
    ),
    "no slew": (lambda: inversion.slew_limited(np.ones(3), 1000.0, 0.0), ["slew", "positive", "0"]),
    "slew of NaN": (lambda: inversion.slew_limited(np.ones(3), 1000.0, NAN), ["slew", "positive", "nan"]),
    "infinite rate": (lambda: inversion.slew_limited(np.ones(3), INF, 1.0), ["rate", "finite", "inf"]),
    # identification
    "one sample": (lambda: Record(np.zeros(1), np.zeros(1)), ["input", "at least 2", "(1,)"]),
    "two lengths": (lambda: Record(np.zeros(3), np.zeros(2)), ["one length", "(3,)", "(2,)"]),
    "output of NaN": (lambda: Record(np.zeros(3), np.array([0.0, NAN, 1.0])), ["output", "finite", "nan"]),
    "negative sample weight": (
        lambda: Record(np.zeros(3), np.zeros(3), np.array([1.0, -1.0, 1.0])),
        ["weight", "negative", "-1"],
    ),
    "no records": (lambda: identify([], PLANE), ["at least one sample", "0 records"]),
    "nothing but masked samples": (
        lambda: fit(SWEEP, SWEEP, sample_weight=0 * SWEEP),
        ["at least one", "counts"],
    ),
    "constant input": (lambda: fit(np.full(40, 0.5), SWEEP), ["input", "not vary", "0.5", "40"]),
    "input outside the levels": (lambda: fit(SWEEP, SWEEP, low=2.0, high=3.0), ["input", "not vary", "2"]),
    "constant output": (lambda: fit(SWEEP, np.full(40, 0.7)), ["output", "not vary", "0.7", "40"]),
    "fewer samples than levels": (lambda: fit(SWEEP[:6], SWEEP[:6], n_h=8), ["at least", "8 levels", "6"]),
    # the solver
    "solver, not square": (lambda: nnls.solve(np.ones((3, 2)), np.ones(3)), ["gram", "(3, 3)", "(3, 2)"]),
    "solver, two sizes": (lambda: nnls.solve(np.eye(3), np.ones(2)), ["gram", "(2, 2)", "(3, 3)"]),
    "solver, NaN": (lambda: nnls.solve(np.eye(3) * NAN, np.ones(3)), ["gram", "finite"]),
    "solver, infinite": (lambda: nnls.solve(np.diag([1.0, INF, 1.0]), np.ones(3)), ["gram", "finite"]),
    "solver, guess of another size": (
        lambda: nnls.solve(np.eye(3), np.ones(3), passive=np.ones(2, dtype=bool)),
        ["passive", "(3,)", "(2,)"],
    ),
    # signals and waveforms
    "signal at no speed": (
        lambda: excitations.identification(0.0, 1.0, n_h=4, speed=0.0, rate_Hz=100.0),
        ["speed", "positive", "0"],
    ),
    "signal at no rate": (
        lambda: excitations.identification(0.0, 1.0, n_h=4, speed=1.0, rate_Hz=NAN),
        ["rate", "positive", "nan"],
    ),
    "signal of one level": (
        lambda: excitations.identification(0.0, 1.0, n_h=1, speed=1.0, rate_Hz=100.0),
        ["n_h", "at least 2", "1"],
    ),
    "signal of no range": (
        lambda: excitations.identification(1.0, 1.0, n_h=4, speed=1.0, rate_Hz=100.0),
        ["low < high", "1"],
    ),
    "path at no speed": (lambda: excitations.through(np.arange(3.0), 0.0, 100.0), ["speed", "positive", "0"]),
    **{
        f"record with a time step of {step}": (
            lambda step=step: Record(FIVE, FIVE, dt_s=step),
            ["dt_s", "positive", f"{step:g}"],
        )
        for step in (0.0, -1.0, INF)
    },
    "path in steps beyond every float": (
        lambda: excitations.through(np.arange(3.0), 1e300, 1e-300),
        ["samples", "at most 1e+08", "1e+300"],
    ),
    "path at infinite speed": (lambda: excitations.through(np.arange(3.0), INF, 100.0), ["speed", "finite"]),
    "negative rest": (
        lambda: excitations.conditioning(0.0, 1.0, speed=1.0, rate_Hz=100.0, rest_s=-1.0),
        ["rest", "negative", "-1"],
    ),
    "conditioning in no range": (
        lambda: excitations.conditioning(1.0, 0.0, speed=1.0, rate_Hz=100.0, rest_s=1.0),
        ["low < high", "1", "0"],
    ),
    "diagnostic in no range": (lambda: excitations.diagnostic(1.0, 1.0, rate_Hz=100.0), ["low < high", "1"]),
    "diagnostic at no rate": (lambda: excitations.diagnostic(0.0, 1.0, rate_Hz=0.0), ["rate", "0"]),
    "constant pulse": (lambda: shape(value=np.ones(4)), ["constant", "1"]),
    "pulse of three samples": (
        lambda: shape(time_s=np.arange(3.0), value=np.arange(3.0)),
        ["at least 4", "(3,)"],
    ),
    "pulse of two lengths": (lambda: shape(time_s=np.arange(5.0)), ["value", "time", "(5,)", "(4,)"]),
    "pulse in standing time": (lambda: shape(time_s=np.array([0.0, 1.0, 1.0, 2.0])), ["increas", "time"]),
    "pulse of infinite length": (
        lambda: shape(time_s=np.array([-1e308, 0.0, 1.0, 1e308])),
        ["too long", "inf s, 3"],
    ),
    "pulse of infinite height": (
        lambda: shape(value=np.array([-1e308, 0.0, 1.0, 1e308])),
        ["too high", "4 s, inf"],
    ),
    "more periods than memory": (lambda: train(periods=10**9), ["1000000000 times 400", "100,000,000"]),
    "no periods": (lambda: train(periods=0), ["period", "0"]),
    "no range of force": (lambda: train(low=1.0), ["low < high", "1"]),
    "train at no rate": (lambda: train(rate_Hz=0.0), ["rate", "positive", "0"]),
    "train without one sample": (lambda: train(rate_Hz=0.01), ["rate", "sample"]),
    # metrics
    "nothing measured": (lambda: metrics.tracking(np.zeros(3), np.full(3, NAN), 1.0), ["0 measured"]),
    "no full force": (lambda: metrics.tracking(np.zeros(3), np.zeros(3), 0.0), ["full", "0"]),
    "full force of NaN": (lambda: metrics.tracking(np.zeros(3), np.zeros(3), NAN), ["full", "nan"]),
    "measured at other times": (
        lambda: metrics.tracking(np.zeros(3), np.zeros((2, 4)), 1.0),
        ["measured", "(..., 3)", "(2, 4)"],
    ),
    "constant measured output": (lambda: metrics.prediction(np.ones(3), np.zeros(3)), ["not vary", "1"]),
    "prediction of another length": (
        lambda: metrics.prediction(np.arange(3.0), np.zeros(4)),
        ["predicted", "(3,)", "(4,)"],
    ),
    "curve of two lengths": (lambda: metrics.loop_area(np.zeros(3), np.zeros(4)), ["(3,)", "(4,)"]),
    "repeats without a time": (lambda: metrics.repeat_spread(np.zeros(3)), ["(r, n)", "(3,)"]),
}


@pytest.mark.parametrize(("call", "words"), BAD.values(), ids=BAD.keys())
@pytest.mark.filterwarnings("error")
def test_bad_arguments_are_told_from_one_another(call, words):
    """The error is one of ours and a ValueError; it names what it was, what it should be, what to do."""
    with pytest.raises(ArgumentError) as caught:
        call()
    assert isinstance(caught.value, ValueError)
    assert caught.value.exit_code == 3
    for word in words:
        assert word in str(caught.value), word
    assert caught.value.hint


# --- little, but enough ---------------------------------------------------------------------------------


def test_a_single_sample_is_an_input():
    """One sample is simulated and inverted like many."""
    assert OPERATOR([0.5]).shape == (1,)
    assert RELAYS([0.5]).shape == (1,)
    found = inversion.invert(OPERATOR, [0.0])
    assert OPERATOR(found.input)[0] == pytest.approx(0.0, abs=1e-14)
    assert inversion.closest_match(RELAYS, [0.0]).input.shape == (1,)
    assert inversion.slew_limited(np.array([0.5]), 1000.0, 1.0).tolist() == [0.5]


@pytest.mark.parametrize("slew", [1e6, 1e9, 1e12, 1e16, 1e100, 1e308])
def test_a_huge_slew_is_no_limit(slew):
    """Beside a ramp so steep the digits of the input would be lost."""
    u = np.array([0.0, 1.0, 0.3, 0.7, 0.0])
    assert inversion.slew_limited(u, 1000.0, slew).tolist() == u.tolist()


def test_a_constant_input_gives_a_constant_output():
    """An input at rest is no mistake of the operator's: the output rests too."""
    for operator in (OPERATOR, RELAYS):
        assert np.ptp(operator(np.full(5, 0.3))) == 0
    assert np.ptp(inversion.invert(OPERATOR, np.full(5, 0.3)).input) == 0


def test_integers_and_lists_are_numbers():
    """Inputs need not be float arrays."""
    plane = Plane([0, 1, 2])
    operator = Preisach(plane, [1, 1, 1])
    assert operator([0, 1, 2]).tolist() == operator(np.array([0.0, 1.0, 2.0])).tolist()
    assert outputs(plane, [[1, 1, 1]], [0], [0, 1, 2]).tolist() == [operator([0, 1, 2]).tolist()]


def test_arguments_are_left_as_they_were():
    """No function writes into what it is given."""
    u, y = SWEEP.copy() * 1.5 - 0.2, OPERATOR(SWEEP)
    kept = u.copy(), y.copy()
    OPERATOR(u), RELAYS(u), inversion.invert(OPERATOR, y), inversion.closest_match(RELAYS, y)
    inversion.slew_limited(u, 1.0, 0.1), coverage(PLANE, [u]), identify([Record(u, y)], PLANE)
    outputs(PLANE, ONES[None], np.zeros(1), u)
    assert np.array_equal(u, kept[0])
    assert np.array_equal(y, kept[1])


@pytest.mark.parametrize("n", [4, 6, 9])
def test_fewer_samples_than_cells_still_fit(n):
    """Down to one sample a level the fit explains what there is; cells not asked for stay empty."""
    u = np.linspace(0.0, 1.0, n)
    y = OPERATOR(u)
    found = identify([Record(u, y)], PLANE)
    assert found.samples == n < PLANE.n_q
    assert found.operator(u) == pytest.approx(y, abs=1e-6)


def test_a_zero_plane_without_weights_rests_at_its_offset():
    """Weights of zero are no mistake of the operator's: the output is y0."""
    assert Preisach(PLANE, 0 * ONES, 0.3)(SWEEP).tolist() == [0.3] * SWEEP.size
