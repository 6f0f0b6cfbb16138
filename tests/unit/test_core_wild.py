"""Wild samples are found, left out and counted; clean records lose none."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from functools import cache
from itertools import groupby

import form_devices as devices
import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.core import wild
from pulsetrainer.errors import DataError
from pulsetrainer.report.figures import draw

KINDS = {
    "normal": lambda rng, n: rng.normal(size=n),
    "exponential": lambda rng, n: rng.laplace(size=n) / np.sqrt(2.0),
    "even": lambda rng, n: rng.uniform(-np.sqrt(3.0), np.sqrt(3.0), n),
    "coloured": lambda rng, n: np.convolve(rng.normal(size=n), np.ones(5) / np.sqrt(5.0), "same"),
    "none": lambda rng, n: 0.0 * rng.normal(size=n),
}


@cache
def drawn(seed, n):
    """A device, its input, its output without noise, and the generator as it is afterwards."""
    rng = np.random.default_rng(seed)
    device = (devices.play_sum, devices.stop_sum)[seed % 2](rng)
    u = devices.record(rng, n)
    return device, u, device(u), rng


def clean(seed, n=2000, kind="normal"):
    """A device, its input and its output with noise of 0.3 % of the span."""
    device, u, y, rng = drawn(seed, n)
    rng = deepcopy(rng)
    return device, u, y + 0.003 * np.ptp(y) * KINDS[kind](rng, n), rng


def spoilt(values, share, rng):
    """The same with a share of wild samples, anywhere within three times the range."""
    span = np.ptp(values)
    at = rng.random(values.size) < share
    middle = 0.5 * (values.min() + values.max())
    return np.where(at, middle + rng.uniform(-1.5, 1.5, values.size) * span, values), at


def fitted(u, y):
    """A model of a record."""
    return pt.identify(pt.Run(time_s=np.arange(u.size) / 100.0, input=u, output=y), levels=16)


@cache
def unspoilt(seed):
    """Error of the model of a clean record."""
    device, u, y, _ = clean(seed)
    return error(fitted(u, y), device)


def error(model, device, seed=0):
    """Error on a clean held-out signal, in percent of the span."""
    turns = np.random.default_rng(seed).uniform(0.0, 1.0, 60)
    u = np.interp(np.linspace(0, 62, 3000), np.arange(63), np.concatenate(([0.0, 1.0, 0.0], turns)))
    y = device(u)
    return 100.0 * np.sqrt(np.mean((model.predict(u) - y) ** 2)) / np.ptp(y)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_of_a_clean_record_is_wild(kind):
    """At most one sample of ten thousand, of input, output and residual, under noise of any kind."""
    count = size = 0
    for seed in range(100, 104):
        _, u, y, _ = clean(seed, 10_000, kind)
        (found,) = wild.tame([(u, y)])
        (off,) = wild.off([y], [drawn(seed, 10_000)[2]], float(np.ptp(y)))
        count += int(np.count_nonzero(found.wild_input | found.wild_output | off))
        size += u.size
    assert count <= size / 10_000


def test_coarse_steps_are_not_wild():
    """A converter that flickers between two steps of 5 % of the span."""
    _, u, y, rng = clean(101, 10_000)
    step = 0.05 * np.ptp(y)
    coarse = step * np.round((y + 0.003 * rng.normal(size=y.size)) / step)
    (found,) = wild.tame([(u, coarse)])
    assert not (found.wild_input | found.wild_output).any()


@pytest.mark.parametrize("unit", [0.01, 1.0, 100.0])
def test_a_rare_flicker_of_a_coarse_converter_is_not_wild(unit):
    """Twenty steps of 500 samples; some read the next step. What is further off is wild, in any unit."""
    held = np.repeat(np.arange(20.0), 500)
    flicker = held + (np.arange(held.size) % 125 == 60)
    assert not wild.isolated(unit * flicker).any()
    for far, found in ((1.4, []), (1.6, [4321]), (4.0, [4321])):
        flicker[4321] = held[4321] + far
        assert np.flatnonzero(wild.isolated(unit * flicker)).tolist() == found


@pytest.mark.parametrize("far", [0.0, 10.0])
def test_a_reversal_curve_that_saturates_for_one_sample_is_real(far):
    """A short excursion of the input that the output's memory shows is kept, also beside wild outputs."""
    device, _, _, _ = clean(100)
    back = np.linspace(0.0, 0.95, 30)
    u = np.concatenate([np.concatenate(([1.0], np.linspace(b, b + 0.3, 20))) for b in 0.7 * back])
    u = np.concatenate(([0.0], u))
    assert wild.isolated(u).any()
    y = device(u)
    y[5::21] += far * np.ptp(y)
    (found,) = wild.tame([(u, y)])
    np.testing.assert_array_equal(found.input, u)


@pytest.mark.parametrize("share", [*(pytest.param(s, marks=pytest.mark.slow) for s in (0.003, 0.01)), 0.03])
@pytest.mark.parametrize("where", ["output", pytest.param("input", marks=pytest.mark.slow)])
def test_wild_samples_do_not_move_the_fit(share, where):
    """Held-out error on clean data at most 1.1 times that of the clean record, over three devices."""
    ratios = []
    for seed in range(200, 203):
        device, u, y, rng = clean(seed)
        bad, at = spoilt(u if where == "input" else y, share, rng)
        model = fitted(bad, y) if where == "input" else fitted(u, bad)
        assert model.fit.masked_samples >= 0.8 * at.sum()
        ratios.append(error(model, device) / unspoilt(seed))
    assert np.median(ratios) <= 1.1


@pytest.mark.parametrize("times", [1e1, 1e3, -1e6, 1e30])
@pytest.mark.parametrize("where", ["input", "output"])
def test_one_sample_far_off_is_found_however_far(where, times):
    """An overflow of the recorder costs its sample and nothing else."""
    _, u, y, _ = clean(0, n=1000)
    at = 500
    spoilt_one = u.copy() if where == "input" else y.copy()
    spoilt_one[at] = times * np.ptp(spoilt_one)
    model = fitted(spoilt_one, y) if where == "input" else fitted(u, spoilt_one)
    assert model.fit.masked_samples == 1
    np.testing.assert_allclose(model.edges[[0, -1]], fitted(u, y).edges[[0, -1]], rtol=1e-3)
    assert model.fit.rms_percent < 0.4


def test_wild_samples_that_lie_close_together_are_found():
    """Four among eleven look like motion; all that are far off are found, and none that is true."""
    _, u, _, rng = clean(523)
    bad, at = spoilt(u, 0.03, rng)
    found = wild.isolated(bad)
    assert found[np.abs(bad - u) > 0.3].all()
    assert not found[~at].any()


@pytest.mark.parametrize("seed", [505, pytest.param(521, marks=pytest.mark.slow)])
def test_a_wild_output_of_the_dual_form_keeps_its_turns(seed):
    """The output is remembered there: at a wild sample the fit takes its place, not the line beside it."""
    device, u, y, rng = clean(seed)
    model = fitted(u, spoilt(y, 0.03, rng)[0])
    assert model.form == "dual"
    assert error(model, device) <= 1.2 * unspoilt(seed)


def test_what_was_left_out_is_counted_kept_and_drawn(tmp_path):
    """In the note, in the file and in the figure."""
    _, u, y, rng = clean(300)
    bad, _ = spoilt(y, 0.01, rng)
    model = fitted(u, bad)
    count = model.fit.masked_samples
    assert any(str(count) in note and "wild" in note for note in model.fit.notes)
    pt.save(model, tmp_path / "m.h5")
    again = pt.load(tmp_path / "m.h5").fit
    assert again.masked_samples == count == again.wild_output.size == again.wild_input.size
    lines = [line for axes in draw(model).axes for line in axes.get_lines()]
    assert any(line.get_label() == "left out" for line in lines)


def test_a_median_of_neighbours_is_what_it_says():
    """Isolated samples against a loop over windows: one spike among slow samples, and none."""
    u = np.linspace(0.0, 1.0, 200)
    assert not wild.isolated(u).any()
    u[77] = 3.0
    assert np.flatnonzero(wild.isolated(u)).tolist() == [77]
    assert wild.repaired(u, wild.isolated(u))[77] == pytest.approx(0.5 * (u[76] + u[78]))
    assert not wild.isolated(u[:40]).any()
    u = np.linspace(0.0, 1.0, 200)
    u[77:80] += (2.0, -2.0, 2.0)
    assert np.flatnonzero(wild.isolated(u)).tolist() == [77, 78, 79]
    u[80] -= 2.0  # four in a row are no exceptions
    assert not wild.isolated(u).any()


def _far_one_by_one(values, motion, usual):
    """Sorted windows of seven, mirrored at the ends; quantiles of the usual ones."""
    n = values.size
    around = [values[2 * (n - 1) - k if k >= n else abs(k)] for k in range(-3, n + 3)]
    apart = np.array([abs(values[k] - sorted(around[k : k + 7])[3]) for k in range(n)])
    body = np.quantile(values[usual], 0.99) - np.quantile(values[usual], 0.01)
    tail = 3.2 * np.quantile(apart[usual], 0.95)
    return [apart[k] > max(tail + motion[k], 0.01 * body) for k in range(n)]


@pytest.mark.parametrize(("outermost", "least"), [(15, 0.02), (8, 0.0)])
def test_a_hundredth_of_the_samples_at_either_end_does_not_tell_the_span(outermost, least):
    """Of 1000 samples some rest at -1, as many at 1, all others at 0: from a hundredth on these count."""
    values = np.repeat([-1.0, 0.0, 1.0], [outermost, 1000 - 2 * outermost, outermost])
    for off, found in ((0.99 * least, False), (1.01 * least + 1e-9, True)):
        values[500] = off
        assert wild._far(values, np.zeros(1000))[500] == found


def _exceptions_one_by_one(found):
    """Runs of up to three, unless they are more than a tenth of all."""
    runs = [(flag, len(list(run))) for flag, run in groupby(found.tolist())]
    kept = [flag and count <= 3 for flag, count in runs for _ in range(count)]
    return kept if sum(kept) <= 0.1 * len(kept) else [False] * len(kept)


def _jumps_one_by_one(values):
    """Of the steps that end at either neighbour, the larger one, less the usual step."""
    steps = [abs(values[k + 1] - values[k]) for k in range(values.size - 1)]
    usual = np.median(steps)
    return [
        max([0.0, *(steps[j] - usual for j in (k - 2, k + 1) if 0 <= j < len(steps))])
        for k in range(values.size)
    ]


@pytest.mark.parametrize("seed", range(12))
def test_what_is_far_off_sample_by_sample(seed):
    """Against loops over the samples: distances, short runs, jumps of a prediction, and all together."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(50, 90))
    wild_ones = rng.random(n) < 0.08 * (1 + seed % 2)
    said = np.cumsum(rng.laplace(size=n)) * (10.0 if seed % 3 else 0.5)
    values = 0.05 * rng.normal(size=n) * (seed % 4 > 1) + wild_ones * 10.0 ** rng.uniform(-3.0, 1.0, n)
    doubt = (rng.random(n) < (0.3 if seed % 3 else 1.0)) & wild_ones
    motion = rng.uniform(0.0, 1.0, n) * (seed % 3)
    moved = values + 0.01 * np.arange(n)
    assert wild._far(moved, motion, ~doubt).tolist() == _far_one_by_one(moved, motion, ~doubt)
    for found in (wild_ones, rng.random(n) < 0.3 * rng.random()):
        assert wild._exceptions(found).tolist() == _exceptions_one_by_one(found)
    assert wild._jumps_beside(said) == pytest.approx(_jumps_one_by_one(said))
    span = 10.0
    expected = np.array(_far_one_by_one(values, 0.1 + np.array(_jumps_one_by_one(said)), ~doubt))
    alone = _exceptions_one_by_one(expected & ~doubt)
    (found,) = wild.off([said + values], [said], span, [doubt])
    assert found.tolist() == ((expected & doubt) | alone).tolist()


TURNING = np.interp(np.arange(2000), np.arange(0, 2040, 40), np.arange(51) % 2)  # a turn every 40 samples


@pytest.mark.parametrize(
    ("found", "left"),
    [
        ([1, 42, 81, 120, 200, 444], []),  # at a turn, or just after one
        ([*range(40, 400, 40), 420, 460], [420, 460]),  # two of them between turns
        ([20, 60, 100, 140, 200], [20, 60, 100, 140, 200]),  # one of five, as chance has it
        ([42, 81], [42, 81]),  # two are no more than chance
    ],
)
def test_what_comes_at_turns_is_not_wild(found, left):
    """Where it does so more often than chance has it; a share of 7 in 40 of all samples is at a turn.

    The unit of the input does not matter.
    """
    mask = np.zeros(TURNING.size, dtype=bool)
    mask[found] = True
    for unit in (1.0, 0.01, 100.0):
        assert np.flatnonzero(wild.by_chance(mask, unit * TURNING, unit)).tolist() == left


def test_a_kick_after_every_turn_is_not_wild():
    """A fifth of the span, and over within a few samples: of 60 turns, some 170 samples were left out."""
    rng = np.random.default_rng(4)
    after = np.arange(3000) % 50
    ends = np.concatenate(([0.0, 1.0], np.resize((0.1, 0.9), 59) + rng.uniform(-0.1, 0.1, 59)))
    u = np.interp(np.arange(3000), np.arange(0, 3050, 50), ends)
    y = devices.bump_plane(rng)(u)
    kick = 0.2 * np.exp(-after / 2.0) + rng.normal(0.0, 0.002, u.size)
    assert fitted(u, y / np.ptp(y) + kick).fit.masked_samples < 20


@pytest.mark.parametrize(("n", "level", "told"), [(50, 0.49, True), (49, 0.49, False), (50, 0.51, False)])
def test_a_fit_that_tells_nothing_returns_what_was_doubtful(n, level, told):
    """Fewer than fifty samples, or a residual of more than a twentieth of the span."""
    doubt = np.arange(n) == 7
    left = np.full(n, level)
    left[20] = 5.0
    (found,) = wild.off([left], [np.zeros(n)], 10.0, [doubt])
    assert np.flatnonzero(found).tolist() == [20 if told else 7]


@pytest.mark.parametrize("at", [98, 99, 100, 101, 102])
@pytest.mark.parametrize("off", [-0.05, 0.05, 2.0])
@pytest.mark.parametrize("motion", ["straight", "round"])
def test_a_turn_keeps_its_extreme(at, off, motion):
    """A wild sample at a turn or beside it is found, and the turn is where both sides meet."""
    u = 1.0 - np.abs(np.linspace(-1.0, 1.0, 201))
    if motion == "round":
        u = np.cos(np.linspace(-1.0, 1.0, 201))
    bad = u.copy()
    bad[at] += off
    for sign in (1.0, -1.0):  # a top and a bottom
        found = wild.isolated(sign * bad)
        assert np.flatnonzero(found).tolist() == [at]
        np.testing.assert_allclose(wild.through_turns(sign * bad, found), sign * u, atol=1e-4)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ((0.8, 0.9, 1.0), (1.0, 0.9, 0.8), (1.1, 1.1)),  # a turn
        ((0.8, 0.9, 1.0), (0.85, 0.75, 0.65), (1.05, 0.95)),  # the nearer of the two paths
        ((1.0, 1.0, 1.0), (0.7, 0.6, 0.5), (0.9, 0.8)),  # a rest before it
        ((0.8, 0.9, 1.0), (0.7, 0.5, 0.6), (0.9, 0.8)),  # no path behind it
        ((0.9, 1.0), (1.0, 0.9, 0.8), (1.0, 1.0)),  # too near to the begin
    ],
)
def test_a_path_is_continued_where_both_sides_move_to_one_extreme(before, after, expected, sign):
    """Else the samples lie on the line between their neighbours."""
    values = sign * np.array([*before, 9.0, 9.0, *after])
    found = wild.through_turns(values, np.abs(values) > 5.0)
    assert sign * found[len(before) : -len(after)] == pytest.approx(np.array(expected))


def test_a_stroke_of_one_sample_is_no_peak():
    """Down for one sample between two turns, no faster than elsewhere."""
    u = np.concatenate((np.linspace(0.0, 1.0, 101), [0.99], np.linspace(1.0, 0.0, 101)))
    assert not wild.isolated(u).any()


def test_a_wild_sample_beside_three_others_does_not_hide_them():
    """Three far off and a fourth that is a little off: the fit shows the fourth."""
    _, u, y, _ = clean(310)
    bad = y.copy()
    bad[468:472] += np.ptp(y) * np.array([-1.6, -1.5, -1.0, 0.08])
    assert wild.isolated(bad)[468:471].all()
    assert error(fitted(u, bad), clean(310)[0]) <= 1.1 * unspoilt(310)


def test_sharp_turns_of_the_output_count_again():
    """What looks wild beside its neighbours and is what the fit says: the cusps of a fast butterfly."""
    rng = np.random.default_rng(906)
    device = devices.rectified(rng)
    u = devices.record(rng, 1000)
    y = device(u)
    (tamed,) = wild.tame([(u, y)])
    assert tamed.wild_output.any()
    assert fitted(u, y).fit.masked_samples == 0


@pytest.mark.parametrize("at", [0, 1, 199, 198])
def test_the_ends_of_a_record_have_neighbours_too(at):
    """A wild sample that is the first or the last one is as far from the others as any."""
    u = np.linspace(0.0, 1.0, 200)
    u[at] -= 0.7
    assert np.flatnonzero(wild.isolated(u)).tolist() == [at]
    (found,) = wild.off([u], [np.linspace(0.0, 1.0, 200)], 1.0)
    assert np.flatnonzero(found).tolist() == [at]


def test_a_wild_output_does_not_change_the_form():
    """A loop that leads remains dual: the form is decided anew without the wild samples."""
    for seed in (201, 203):
        _, u, y, rng = clean(seed)
        assert fitted(u, spoilt(y, 0.03, rng)[0]).form == "dual"


def test_a_fit_that_describes_nothing_calls_nothing_wild():
    """The same spike beside a small residual and beside a large one."""
    rng = np.random.default_rng(1)
    small = 0.003 * rng.normal(size=500)
    large = small + 0.3 * np.sin(np.arange(500) / 20.0)
    for residual in (small, large):
        residual[250] += 0.9
    found = wild.off([small, large], [np.zeros(500)] * 2, 1.0)
    assert [int(one.sum()) for one in found] == [1, 0]


def test_a_record_in_which_all_samples_are_wild_is_refused():
    """An error of the data; of several parts, those with samples are fitted."""
    _, u, y, _ = clean(310)
    run = pt.Run(time_s=np.arange(u.size) / 100.0, input=u, output=y)
    nothing = replace(run, masked=np.ones(u.size, dtype=bool))
    with pytest.raises(DataError):
        pt.identify(nothing, levels=8)
    assert pt.identify([run, nothing], levels=8).fit.samples == pt.identify(run, levels=8).fit.samples
    model = pt.identify(run, levels=8)
    with pytest.raises(DataError):
        pt.diagnose(nothing, model, quick=True)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_noise_that_goes_with_the_level_is_not_wild(seed):
    """What is quiet elsewhere tells nothing of a loud place: none of 5000 samples is called wild."""
    rng = np.random.default_rng(seed)
    print(f"seed {seed}")
    level = 0.5 - 0.5 * np.cos(np.arange(5000) * 2 * np.pi / 700)
    assert wild.isolated(level + 0.03 * level * rng.standard_normal(level.size)).sum() == 0
