"""The conductor without a device: changes at the next beat, no step beyond the slew limit, rests, pauses."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.core.heartbeat import Pulse
from pulsetrainer.core.rhythm import Rhythm
from pulsetrainer.device.trace import Block, Trace
from pulsetrainer.diagnosis.prediction import extended_of
from pulsetrainer.errors import DataError, UsageError
from pulsetrainer.files.pulses import read_pulse
from pulsetrainer.steps.beat_errors import Ledger
from pulsetrainer.steps.conductor import COOL, HOT, RATE_HZ, Conductor, Play, Rest
from pulsetrainer.steps.invert import DEVICE_SLEW_A_PER_S
from pulsetrainer.steps.invertible import major_loop
from pulsetrainer.steps.performance import Performance
from pulsetrainer.steps.programme import Change, Programme
from pulsetrainer.steps.recording import PAUSE_S
from pulsetrainer.steps.session import check_model, reach_of
from pulsetrainer.steps.steering import AMPLITUDE_STEP, RATE_STEP_BPM, Steering, keys_in

KEPT = Path(__file__).resolve().parents[1] / "data" / "files-0.1"
NAMES = ("normal", "bifid", "parvus-et-tardus")
PULSES = [Pulse(read_pulse(name)) for name in NAMES]
TAU_S = 100.0


@pytest.fixture(scope="module", params=["model.h5", "model-extended.h5"])
def model(request):
    """A static model and an extended one."""
    return pt.load(KEPT / request.param)


def _conductor(model, decide, give, *, rhythm=None, heat=0.0, warms=0.0):
    return Conductor(
        extended_of(model),
        PULSES,
        reach_of(model, PULSES, (75.0,)),
        rhythm or Rhythm(),
        decide,
        give,
        heat=heat,
        heated=lambda current, rate: warms * np.cumsum(current**2) / rate,
        cooling_s=TAU_S,
    )


def _conducted(model, decide, *, longest_s=900.0, **options):
    """Play everything; return the conductor, the pieces and the parts' currents."""
    given, parts = [], []
    conductor = _conductor(model, decide, given.append, **options)
    while not conductor.ended:
        parts.append(np.concatenate(list(conductor.part(longest_s))))
        assert len(parts) < 100
    return conductor, given, parts


def _random(seed, minutes):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.3, 2.0, 40))
    return Programme(
        NAMES,
        minutes=minutes,
        changes=[
            Change(float(t), float(rng.uniform(20, 240)), float(rng.uniform(1, 100)), NAMES[rng.integers(3)])
            for t in times
        ],
    )


def _beats_over_the_range(model, pulse):
    """Force (beats, n) of five minutes of a pulse that is the input itself, over the whole range."""
    low, high = model.edges[[0, -1]]
    record = low + (high - low) * pulse.record(pulse.own_bpm / 75.0, RATE_HZ)
    current = np.tile(record, round(300 * RATE_HZ / record.size))
    lead = major_loop(low, high, RATE_HZ)
    return model.predict(np.append(lead, current), 1 / RATE_HZ)[lead.size :].reshape(-1, record.size)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3))])
def test_no_change_is_a_step(model, seed):
    """Changes of rate, amplitude and pulse, at any time, move the current no faster than the slew limit."""
    rhythm = Rhythm(0.1, 0.1, 0.2, seed)
    _, given, parts = _conducted(model, _random(seed, minutes=0.5 if seed else 0.2), rhythm=rhythm)
    (current,) = parts
    assert np.abs(np.diff(current)).max() <= DEVICE_SLEW_A_PER_S / RATE_HZ * (1 + 1e-9)
    assert current[0] == current[-1] == model.edges[0]
    assert current.min() >= model.edges[0]
    assert current.max() <= model.edges[-1]
    target = np.concatenate([g.target for g in given if g.beat])
    reach = reach_of(model, PULSES, (75.0,))
    low, high = reach.low, reach.high
    each = [reach_of(model, [pulse], (75.0,)) for pulse in PULSES]
    assert (low, high) == (max(one.low for one in each), min(one.high for one in each))
    for pulse, own in zip(PULSES, each, strict=True):  # cold, and once its slowest cause has settled
        beats = _beats_over_the_range(model, pulse)[[1, -1]]
        assert own.low == pytest.approx(beats.min(axis=1).max(), abs=1e-3)
        assert own.high == pytest.approx(beats.max(axis=1).min(), abs=1e-3)
    assert low - 1e-9 <= target.min() <= target.max() <= high + 1e-9


@pytest.mark.parametrize("rhythm", [Rhythm(), Rhythm(0.1, 0.1, 0.2, seed=3)])
def test_beats_follow_each_other_without_a_gap(model, rhythm):
    """Sample by sample, and to the rounding of the clock; every interval is the one asked for."""
    _, given, _ = _conducted(model, Programme(NAMES[:1], rate=83.0, beats=15), rhythm=rhythm)
    beats = [g.beat for g in given if g.beat]
    assert len(beats) == 15
    for number, (before, after) in enumerate(itertools.pairwise(beats)):
        timing = rhythm.timing(number, before.start_s)
        assert before.strength == timing.strength
        assert before.first + before.count == after.first
        assert after.start_s - before.start_s == pytest.approx(timing.interval * 60.0 / 83.0, abs=1e-9)
        assert 0 <= after.first / RATE_HZ - after.start_s < 1 / RATE_HZ + 1e-9


@pytest.mark.parametrize(
    ("keys", "pulse", "bpm", "amplitude"),
    [
        ("", 1, 60.0, 1.0),
        ("p", 1, 60.0, 1.0),  # before anything was played it is the first one's turn
        ("pp", 0, 60.0, 1.0),
        ("+", 1, 80.0 + RATE_STEP_BPM, 1.0),  # of the first one's own rate
        ("<", 1, 60.0, 1.0 - AMPLITUDE_STEP),
    ],
)
def test_keys_before_the_first_beat(keys, pulse, bpm, amplitude):
    """They change the first pulse of the library, which nothing was said of yet."""
    steering = Steering(lambda number, time_s: Play(1, bpm=60.0), [80.0, 70.0])
    for key in keys:
        steering.press(key)
    play = steering(0, 0.0)
    assert (play.pulse, play.bpm, play.amplitude) == (pulse, bpm, pytest.approx(amplitude))


def test_a_falling_device_reaches_as_far_as_its_mirror_image():
    """Pressed by pulses that are turned over; also where the input begins elsewhere than at zero."""
    rising = pt.load(KEPT / "model.h5")
    there = reach_of(rising, PULSES[:2], (75.0, 140.0))
    for away in (0.0, 5.0):
        falling = replace(rising, polarity=-1, edges=rising.edges + away)
        here = reach_of(falling, PULSES[:2], (75.0, 140.0))
        assert (here.low, here.high) == pytest.approx((there.low, there.high), abs=1e-3)


def test_a_key_is_in_the_force_of_the_next_beat(model):
    """Whatever is pressed while a beat is given out: the beat after it has it."""
    steering = Steering(Programme(NAMES, rate=75.0, beats=12), [p.own_bpm for p in PULSES])
    pressed = {3: "+", 5: "<", 7: "p"}
    seen = []

    def decide(number, time_s):
        if number in pressed and number not in seen and len(seen_numbers) >= number:
            seen.append(number)
            steering.press(pressed[number])
        return steering(number, time_s)

    seen_numbers: list[int] = []
    given = []

    def give(piece):
        given.append(piece)
        if piece.beat:
            seen_numbers.append(len(seen_numbers))

    conductor = Conductor(
        extended_of(model), PULSES, reach_of(model, PULSES, (75.0,)), Rhythm(), decide, give,
        heat=0.0, heated=lambda current, _rate: np.zeros(current.size), cooling_s=TAU_S,
    )  # fmt: skip
    for _ in conductor.part(900.0):
        pass
    beats = [g.beat for g in given if g.beat]
    assert beats[2].interval_s == pytest.approx(0.8)
    assert beats[3].interval_s == pytest.approx(60 / 80)
    assert (beats[4].play.amplitude, beats[5].play.amplitude) == (1.0, pytest.approx(0.9))
    assert beats[7].play.pulse == (beats[6].play.pulse + 1) % 3


def test_a_pause_lets_the_force_go_and_comes_back(model):
    """The current is at its low end, and stays; afterwards the beats go on."""

    def decide(number, time_s):
        if number < 3 or time_s > 6.0:
            return Play(0) if time_s < 9.0 else None
        return Rest()

    _, given, parts = _conducted(model, decide)
    times = np.arange(parts[0].size) / RATE_HZ
    quiet = (times > 4.8) & (times < 5.6)
    assert np.all(parts[0][quiet] == model.edges[0])
    assert sum(g.beat is not None for g in given) >= 5


def test_a_pause_by_key_does_not_count(model):
    """The session of so many minutes has as many beats as without it; how much is over stands still."""
    beats = []
    for paused_s in (0.0, 20.0):
        programme = Programme(NAMES[:1], rate=75.0, minutes=0.2)
        steering, shares = Steering(programme, [75.0]), []

        def decide(number, time_s, steering=steering, paused_s=paused_s, shares=shares):
            if steering.paused != (5.0 < time_s < 5.0 + paused_s):
                steering.press(" ")
            decided = steering(number, time_s)
            shares.append(steering.programme.share_at(steering.without_pauses(time_s)))
            return decided

        conductor, given, _ = _conducted(model, decide)
        beats.append(sum(piece.beat is not None for piece in given))
        assert shares == sorted(shares)
        assert shares[-1] == 1.0 < conductor.time_s / 12.0
        assert programme.share_at(steering.without_pauses(4.0)) == pytest.approx(4.0 / 12.0)  # before it
    assert beats[0] == beats[1]


@pytest.mark.parametrize("keys", ["x", "\x1b", ">>", "<" * 12, "+" * 60, "-" * 60, "p"])
def test_a_key_that_changes_nothing_is_answered(keys):
    """One that is none, one at an end, another pulse where there is one; the others are not."""
    steering = Steering(lambda number, time_s: Play(0), [75.0])
    assert not any(steering.press(key) for key in "<>+-  ")
    assert [steering.press(key) for key in keys][-1]


def test_weaker_is_never_stronger():
    """At a height below the last step: it went up to that."""
    steering = Steering(lambda number, time_s: Play(0, amplitude=0.05), [75.0])
    steering(0, 0.0)
    assert steering.press("<")
    assert steering(1, 1.0).amplitude == 0.05


def test_a_long_session_comes_in_parts_that_end_at_rest(model):
    """No part is longer than the device stays on, and no beat is lost between two."""
    _, given, parts = _conducted(model, Programme(NAMES[:1], beats=15), longest_s=6.0)
    assert len(parts) > 2
    assert all(part.size <= 6.0 * RATE_HZ and part[-1] == model.edges[0] for part in parts)
    assert sum(g.beat is not None for g in given) == 15


def test_a_hot_coil_gets_a_pause_and_it_is_said(model):
    """Long enough to cool, before the device would stop by itself."""
    conductor, given, _ = _conducted(model, Programme(NAMES[:1], beats=15), heat=0.8, warms=0.1)
    assert conductor.pauses
    rests = [g for g in given if g.beat is None and np.all(g.input == model.edges[0]) and g.input.size > 2000]
    assert rests
    assert rests[0].input.size / RATE_HZ == pytest.approx(TAU_S * np.log(HOT / COOL), rel=0.2)


@pytest.mark.parametrize("longest_s", [8.0, 12.0, 20.0])
@pytest.mark.parametrize("heat", [0.0, 0.8])
def test_no_rest_goes_beyond_the_end_of_a_part(model, longest_s, heat):
    """Neither one that was decided nor one to let the coil cool: the device would stop for its on-time."""

    def decide(number, time_s):
        return Rest(30.0) if 3.0 < time_s < 20.0 else Play(0) if time_s < 40.0 else None

    _, given, parts = _conducted(model, decide, longest_s=longest_s, heat=heat, warms=0.1)
    assert all(part.size <= longest_s * RATE_HZ for part in parts)
    assert any(g.beat is not None and g.first > 20.0 * RATE_HZ for g in given)


def test_a_part_that_is_too_short_for_anything_is_idle(model):
    """It is the loop alone: a session that went on like this would have no end."""
    conductor = _conductor(model, Programme(NAMES[:1], beats=1), lambda _given: None)
    list(conductor.part(3.0))
    assert conductor.idle
    list(conductor.part(30.0))
    assert not conductor.idle


def test_the_ledger_finds_what_was_done_to_a_force():
    """A force that is late, weak and noisy by known amounts is told so, sample by sample counted."""
    static = pt.load(KEPT / "model.h5")
    _, given, _ = _conducted(static, Programme(NAMES, rate=75.0, beats=60))
    ledger = Ledger()
    rng = np.random.default_rng(4)
    target = np.concatenate([g.target for g in given])
    time = np.arange(target.size)
    force = 0.98 * np.interp(time - 0.7, time, target) + 0.02 * rng.normal(size=target.size)
    begun = 0
    for piece in given:
        ledger.give(piece)
    while begun < time.size:
        step = int(rng.integers(1, 90))
        block = slice(begun, begun + step)
        shown, _, _ = ledger.measure(time[block], force[block])
        np.testing.assert_array_equal(shown, target[block])
        begun += step
    figures, beats = ledger.figures(), ledger.beats("N")
    assert beats.start_s.size == 60
    assert figures["beat_timing_max_ms"] == pytest.approx(0.7, abs=0.15)
    assert np.median(beats.late) == pytest.approx(0.7e-3, abs=2e-5)
    assert np.median(beats.gain) == pytest.approx(0.98, abs=1e-3)
    error = np.concatenate([abs(force - target)[g.first : g.first + g.input.size] for g in given if g.beat])
    full = max(g.target.max() for g in given if g.beat)
    assert figures["mean_abs_error_percent"] == pytest.approx(100 * error.mean() / full, rel=1e-9)
    assert figures["max_abs_error_percent"] == pytest.approx(100 * error.max() / full, rel=1e-9)
    assert figures["augmentation_index_error_percent"] < 3.0


def test_a_beat_that_was_cut_has_no_height_and_no_time():
    """The end of a question left 16 ms of a foot: height and time of its noise were those of the session."""

    def decide(number, time_s):
        return None if number > 9 else Play(0, 1.0, 75.0, time_s + 0.016 if number == 5 else np.inf)

    _, given, _ = _conducted(pt.load(KEPT / "model.h5"), decide)
    ledger = Ledger()
    for piece in given:
        ledger.give(piece)
    target = np.concatenate([g.target for g in given])
    noise = 0.02 * np.random.default_rng(5).normal(size=target.size)
    ledger.measure(np.arange(target.size), target + noise)
    figures, beats = ledger.figures(), ledger.beats("N")
    assert beats.interval_s[5] == pytest.approx(0.016)
    assert np.flatnonzero(np.isnan(beats.gain)).tolist() == [5]
    assert np.isfinite(beats.mean_error).all()
    assert figures["amplitude_cv_percent"] < 0.5
    assert figures["beat_timing_max_ms"] < 1.0


def test_figures_of_a_session_are_what_they_are_called():
    """Beats that are weak and late by turns; after a rest all are later, which is no change of the rate."""

    def decide(number, time_s):
        return None if time_s > 12.0 else Rest() if 5.0 < time_s < 6.5 else Play(0)

    _, given, _ = _conducted(pt.load(KEPT / "model.h5"), decide)
    ledger = Ledger()
    target = np.concatenate([g.target for g in given])
    force, time, rested = target.copy(), np.arange(target.size), False
    for number, piece in enumerate(given):
        ledger.give(piece)
        rested = rested or (piece.beat is None and piece.first > 4.0 * RATE_HZ)
        own = slice(piece.first, piece.first + piece.input.size)
        late = 20.0 * rested + 3.0 * (number % 2)
        force[own] = (1.0 - 0.02 * (number % 3)) * np.interp(time[own] - late, time, target)
    ledger.measure(time, force)
    figures, beats = ledger.figures(), ledger.beats("N")
    asked = np.concatenate([target[g.first : g.first + g.input.size] for g in given if g.beat])
    error = np.concatenate([(force - target)[g.first : g.first + g.input.size] for g in given if g.beat])
    assert figures["nrmse"] == pytest.approx(np.sqrt(np.mean(error**2)) / np.ptp(asked))
    assert (ledger.full_force, ledger.mean_force) == pytest.approx((asked.max(), asked.mean()))
    first = np.array([g.beat.start_s for g in given if g.beat])
    after = int(np.argmax(np.diff(first))) + 1  # the rest
    assert 3 < after < beats.start_s.size - 3
    gap = beats.late[after:].mean() - beats.late[:after].mean()
    assert gap == pytest.approx(0.02, abs=0.003)
    runs = slice(after), slice(after, None)
    rate = np.concatenate([1.0 / (np.diff(first[k]) + np.diff(beats.late[k])) for k in runs])
    assert figures["rate_cv_percent"] == pytest.approx(100.0 * np.std(rate) / np.mean(rate), rel=0.02)
    assert figures["amplitude_cv_percent"] == pytest.approx(100.0 * np.std(beats.gain) / beats.gain.mean())
    assert figures["beat_timing_max_ms"] == pytest.approx(1e3 * np.abs(beats.late).max())


def test_a_beat_after_which_nothing_is_given_out_yet_is_no_rest():
    """As on a busy computer: "at rest" was shown between two beats, and taken for the pause."""
    _, given, _ = _conducted(pt.load(KEPT / "model.h5"), Programme(NAMES[:1], beats=2))
    ledger = Ledger()
    assert ledger.under_way is None
    for piece in given:
        ledger.give(piece)
        samples = piece.first + np.arange(piece.input.size)
        ledger.measure(samples, piece.target)
        assert ledger.under_way is piece.beat


def test_lost_samples_are_left_out():
    """A beat with a gap is judged on what came; one with little left is not judged."""
    static = pt.load(KEPT / "model.h5")
    _, given, _ = _conducted(static, Programme(NAMES[:1], beats=6))
    ledger = Ledger()
    for piece in given:
        ledger.give(piece)
    target = np.concatenate([g.target for g in given])
    sample = np.arange(target.size)
    beats = [g.beat for g in given if g.beat]
    lost = (sample >= beats[2].first) & (sample < beats[2].first + 400)
    lost |= (sample >= beats[4].first + 10) & (sample < beats[4].first + 20)
    ledger.measure(sample[~lost], target[~lost])
    found = ledger.beats("N")
    assert np.isnan(found.gain[2])
    np.testing.assert_allclose(np.delete(found.gain, 2), 1.0, atol=1e-9)


def test_beats_that_were_lost_as_a_whole_have_no_figures():
    """Not even a full force."""
    _, given, _ = _conducted(pt.load(KEPT / "model.h5"), Programme(NAMES[:1], beats=2))
    ledger = Ledger()
    for piece in given:
        ledger.give(piece)
    ledger.measure(np.asarray([given[-1].first]), np.zeros(1))
    assert ledger.beats("N").start_s.size == 2
    assert np.isnan([ledger.full_force, ledger.mean_force, *ledger.figures().values()]).all()


@pytest.mark.parametrize(
    "options",
    [
        {"rate": 19.0},
        {"rate": 241.0},
        {"rate": float("nan")},
        {"amplitude": 0.0},
        {"amplitude": 101.0},
        {"beats": 0},
        {"minutes": -1.0},
        {"beats": 5, "minutes": 5.0},
        {"changes": [Change(1.0, rate=300.0)]},
        {"changes": [Change(1.0, pulse="normla")]},
    ],
)
def test_what_cannot_be_played_is_refused(options):
    """Rates outside 20 to 240, more than the reach, two ends or a bad one, a pulse that is not there."""
    with pytest.raises(UsageError):
        Programme(NAMES, **options)


def test_a_model_of_another_device_is_refused():
    """Units are looked at, and the reading."""
    good = pt.load(KEPT / "model.h5")
    check_model(good)
    for bad in (
        replace(good, input_unit="V"),
        replace(good, output_unit="T"),
        replace(good, reading="relay"),
    ):
        with pytest.raises(DataError):
            check_model(bad)


@dataclass
class _Losing:
    """A device that is its model, stays on for 6 s, and loses 60 samples a part on the way."""

    model: pt.Model
    sound: int = 9  # parts before one that ends with a fault

    info = SimpleNamespace(tick_rate_Hz=10.0 * RATE_HZ)
    heat, longest_play_s = 0.0, 6.0

    def stream(self, take, rate_Hz, *, lead_s, decimation, on_block, should_stop) -> Trace:
        """Hand over what it kept, a hundred samples at a time; the second and the last are short."""
        pieces = []
        while (piece := take()) is not None:
            pieces.append(piece)
        current = np.concatenate(pieces)
        columns = np.stack((current, current, self.model.predict(current, 1.0 / rate_Hz), 0.0 * current))
        came = np.ones(current.size, dtype=bool)
        came[110:160] = came[-10:] = False
        for block in np.array_split(np.arange(current.size), current.size // 100):
            kept = block[came[block]]
            on_block(Block(decimation * kept, *columns[:, kept]))
        self.sound -= 1
        nothing = np.empty((4, 0))
        return Trace(
            np.zeros(0, dtype=np.int64),
            *nothing,
            self.info.tick_rate_Hz,
            60,
            complete=self.sound >= 0,
            fault="" if self.sound >= 0 else "force trip",
            samples=current.size - 60,
        )


def test_lost_samples_are_counted_while_they_are_lost(model):
    """What is kept of a session that breaks off knows them; of two parts each, those at its end too."""
    told, times = [], []
    sink = SimpleNamespace(
        append=lambda time_s, *_: times.append(time_s),
        judge=lambda fields: told.append(fields["dropped_samples"]),
    )
    reach = reach_of(model, PULSES[:1], (75.0,))
    programme = Programme(NAMES[:1], rate=75.0, beats=5)
    session = Performance(
        model, _Losing(model), PULSES[:1], Rhythm(), programme, sink, reach, lambda _now: None
    )
    found = session.run(0.1)
    assert (found.parts, found.fault, found.dropped_samples) == (2, "", 120)
    assert sorted(set(told)) == [0, 50, 110]
    time_s = np.concatenate(times)
    gaps = np.diff(np.round(time_s * RATE_HZ)).astype(int)
    assert gaps[gaps > 1].tolist() == [51, 11 + round(PAUSE_S * RATE_HZ), 51]


def test_a_fault_says_when_the_part_began_in_which_it_came(model):
    """In the time of the samples, with the pauses between parts; nothing is pressed after it."""
    times = []
    sink = SimpleNamespace(append=lambda time_s, *_: times.append(time_s), judge=lambda _fields: None)
    reach, programme = reach_of(model, PULSES[:1], (75.0,)), Programme(NAMES[:1], rate=75.0, beats=30)
    device = _Losing(model, sound=2)
    found = Performance(model, device, PULSES[:1], Rhythm(), programme, sink, reach, lambda _now: None).run(
        0.1
    )
    time_s = np.concatenate(times)
    begun_s = time_s[1:][np.diff(time_s) > PAUSE_S][-1]
    assert found.parts == 3
    assert found.fault.startswith("force trip")
    assert f" {begun_s:.1f} s" in found.fault


@pytest.mark.parametrize("width", [48, 58, 78, 100])
def test_the_line_of_keys_fits_and_names_the_one_that_stops(width):
    """At widths of terminals from the smallest on; it was cut there."""
    line = keys_in(width)
    assert len(line) <= width
    assert line.endswith("q stop")
