"""The noise as it is: its spectrum, its dependence on the level, and its size whatever else is there."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from pulsetrainer.artefacts import Run
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.causes.frame import Frame
from pulsetrainer.diagnosis.causes.outliers import _beyond_the_tail
from pulsetrainer.diagnosis.design import bins_of
from pulsetrainer.diagnosis.noise import Noise, _edges, burstiness, noise_in, quiet_square
from pulsetrainer.diagnosis.thresholds import LIMITS
from pulsetrainer.steps.diagnose import diagnose
from pulsetrainer.steps.identify import identify

COUNT = 8000
LEVEL = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(COUNT) / 500)


def _bins(count: int = COUNT, records: int = 1):
    one = np.arange(float(count))
    return bins_of([Record(one, one, dt_s=5e-3) for _ in range(records)])


def _coloured(rng, how: float) -> np.ndarray:
    return signal.lfilter([1.0], [1.0, -how], rng.standard_normal(COUNT + 500))[500:]


def _told(x: np.ndarray, free=lambda columns: columns) -> Noise:
    return noise_in(x, free, np.zeros((x.size, 0)), _bins(), LEVEL, np.random.default_rng(1))


@pytest.mark.parametrize("how", [0.0, 0.5, 0.95])
def test_the_variance_of_a_sum_is_that_of_many_draws(how):
    """Of a slow column and a fast one, in white and in coloured noise: within what one record tells."""
    rng = np.random.default_rng(2)
    t = np.arange(COUNT) / COUNT
    columns = np.stack((np.cos(2 * np.pi * 5 * t), np.cos(2 * np.pi * 1500 * t)), axis=1)
    drawn = np.stack([columns.T @ _coloured(rng, how) for _ in range(400)], axis=1)
    told = np.mean([np.diagonal(_told(_coloured(rng, how)).covariance(columns)) for _ in range(8)], axis=0)
    assert told == pytest.approx(np.var(drawn, axis=1), rel=0.3)


def test_noise_that_grows_with_the_level_is_larger_there():
    """Ten times as large at the top: so it is along a column that lives there."""
    rng = np.random.default_rng(3)
    x = (0.1 + 0.9 * LEVEL) * rng.standard_normal(COUNT)
    noise = noise_in(
        x, lambda columns: columns, np.zeros((x.size, 0)), _bins(), LEVEL + 5.0, np.random.default_rng(1)
    )
    high, low = (LEVEL > 0.9).astype(float), (LEVEL < 0.1).astype(float)
    spread = np.sqrt(
        np.diagonal(noise.covariance(np.stack((high, low), axis=1) * np.sign(rng.normal(size=(COUNT, 1)))))
    )
    assert 4.0 < spread[0] / spread[1] < 12.0


def test_what_was_taken_away_is_put_back():
    """The cosine of every slow line taken off, half of the noise there: it is put back."""
    rng = np.random.default_rng(4)
    t = np.arange(COUNT) / COUNT
    waves = np.linalg.qr(np.stack([np.cos(2 * np.pi * k * t) for k in range(1, 61)], axis=1))[0]
    told = [
        _told(rng.standard_normal(COUNT), lambda columns: columns - waves @ (waves.T @ columns))
        .at(np.asarray([0.002, 0.003, 0.005]))
        .mean()
        for _ in range(8)
    ]
    assert np.mean(told) == pytest.approx(1.0, rel=0.25)


def test_a_line_is_no_noise():
    """A hum ten times as strong as the noise leaves the density as it is."""
    rng = np.random.default_rng(5)
    x = rng.standard_normal(COUNT) + 10.0 * np.sin(2 * np.pi * 0.1234 * np.arange(COUNT))
    assert _told(x).at(np.asarray([0.1234]))[0] == pytest.approx(1.0, rel=0.3)


@pytest.mark.parametrize("records", [1, 2])
@pytest.mark.parametrize("kind", ["white", "coloured", "tails", "level"])
def test_the_size_of_the_noise_is_heard_beside_an_error_of_the_model(kind, records):
    """Whatever its kind, within a tenth; errors of the moving input do not count, where there is rest."""
    rng = np.random.default_rng(6)
    bins, count = _bins(COUNT, records), COUNT * records
    level = np.tile(LEVEL, records)
    noise = {
        "white": rng.standard_normal(count),
        "coloured": np.concatenate([_coloured(rng, 0.9) for _ in range(records)]),
        "tails": rng.standard_t(4.0, count),
        "level": (0.2 + level) * rng.standard_normal(count),
    }[kind]
    moving = np.tile(np.arange(COUNT) % 1000 < 500, records)
    error = noise.std() * np.sin(np.arange(count) / 9.0) * moving
    speed = np.where(moving, 2.0, 0.0)
    heard = quiet_square(noise + error, bins, level, speed)
    assert np.sqrt(heard.square) == pytest.approx(noise.std(), rel=0.13)


def test_a_slow_error_is_noise_only_where_the_spectrum_goes_on_to_it():
    """Pink noise is all noise; a slow wave on white noise is none of it."""
    rng = np.random.default_rng(7)
    frequency = np.fft.rfftfreq(COUNT)
    frequency[0] = np.inf
    pink = np.fft.irfft(np.fft.rfft(rng.standard_normal(COUNT)) / np.sqrt(frequency), COUNT)
    still = np.zeros(COUNT)
    assert quiet_square(pink, _bins(), LEVEL, still).square == pytest.approx(np.mean(pink**2), rel=0.15)
    wave = 2.0 * np.sin(2 * np.pi * 4 * np.arange(COUNT) / COUNT)
    white = rng.standard_normal(COUNT)
    heard = quiet_square(white + wave, _bins(), LEVEL, still)
    assert heard.square == pytest.approx(1.0, rel=0.25)  # of 3 in all
    assert heard.doubtful > 0.0


def test_wild_samples_stand_apart_from_the_tail():
    """Heavy tails go on and have no limit; a dozen far samples beyond a tail have one."""
    rng = np.random.default_rng(8)
    tail = np.abs(rng.standard_t(3.0, 60_000))
    far = np.sort(tail[tail > 4.0]) / 8.0
    assert _beyond_the_tail(far) is None
    limit = _beyond_the_tail(np.sort(np.append(far, 40.0 + np.arange(12.0))))
    assert limit is not None
    assert np.count_nonzero(np.append(far, 40.0 + np.arange(12.0)) > limit) <= 20
    assert _beyond_the_tail(np.asarray([1.1, 1.2])) is None


def test_a_frequency_chosen_by_the_data_is_no_surprise():
    """Of sixty records of white noise a line is significant at five per cent in about three."""
    rng = np.random.default_rng(9)
    cause, frame = library()["periodic"], _frame(4000)
    small = 0
    for _ in range(60):
        x = rng.standard_normal(4000)
        ((block, _),) = cause.starts([frame], [x])
        turn = 2 * np.pi * block[2] * frame.time_s
        half = abs(np.sum(x * np.exp(1j * turn))) ** 2 / x.size
        surprise = np.log(cause.choices([frame])) + 0.5 * np.log(half) - half
        small += surprise < np.log(0.05)
    assert small <= 8


def _frame(count: int) -> Frame:
    return Frame(1e-2, np.zeros(count), 1.0, 1.0)


@pytest.mark.parametrize("how", [0.0, 0.9, 0.98])
@pytest.mark.parametrize("grows", [0.0, 3.0])
def test_noise_of_any_spectrum_has_the_tails_of_noise(how, grows):
    """Kurtosis 3 in its octaves, also where it is several times larger at one level than at another."""
    noise = _coloured(np.random.default_rng(5), how) * (1.0 + grows * LEVEL)
    assert burstiness(noise, _bins(), LEVEL) == pytest.approx(3.0, abs=0.6)


@pytest.mark.parametrize("slow", ["load", "bursts"])
def test_what_comes_and_goes_has_heavier_tails(slow):
    """A load that is put on and off, and an oscillation now and then, on white noise."""
    rng, t = np.random.default_rng(6), np.arange(COUNT)
    on = np.searchsorted(np.sort(rng.uniform(0, COUNT, 32)), t) % 4 == 1
    there = on * (np.sin(0.3 * t) if slow == "bursts" else 1.0)
    assert burstiness(3.0 * there + 0.3 * rng.standard_normal(COUNT), _bins(), LEVEL) > 5.0


def test_noise_is_no_more_than_all_that_is_left():
    """Steps of a device's own relays are slow: of single samples, such noise was larger than the error."""
    plane = Plane.uniform(0.0, 1.0, 39)
    device = Preisach(plane, np.full(plane.n_q, 1.0 / plane.areas.sum()), reading="relay")
    loops = [corner for k in range(8) for corner in (1 - 0.053 * k, 0.053 * k)]
    corners = [0, 1, 0, *loops, 0, 0.5, 0.13, 0.8, 0.27, 1, 0]
    u = np.concatenate(
        [np.linspace(a, b, max(2, int(abs(b - a) * 100)), endpoint=False) for a, b in pairwise(corners)]
    )
    noise = 0.0025 * np.random.default_rng(2).standard_normal(u.size)
    run = Run(0.5 * np.arange(u.size), u, device(u) + noise)
    found = diagnose(run, identify(run), quick=True)
    assert 0.2 < found.noise_percent <= found.rms_percent


@pytest.mark.parametrize("count", [4, 7, 60, 61, 62, 63, 2000])
def test_every_band_of_a_spectrum_has_lines_enough(count):
    """The last one too, which ends with the spectrum; together they hold each line once."""
    edges = _edges(np.arange(1.0, count + 1.0))
    assert (edges[0], edges[-1]) == (0, count)
    assert min(np.diff(edges)) >= LIMITS.least_lines


@pytest.mark.parametrize(("size", "samples"), [(0.0, 4), (0.005, 4), (0.03, 1)])
def test_a_hum_has_the_finest_averages(size, samples):
    """In averages of two of its periods a hum of five times the noise was noise, and not named."""
    time_s = 1e-3 * np.arange(15_000)
    noise = 0.005 * np.random.default_rng(4).standard_normal(time_s.size)
    y = np.sin(2.0 * time_s) + size * np.sin(2.0 * np.pi * 330.0 * time_s) + noise
    assert bins_of([Record(np.sin(2.0 * time_s), y, dt_s=1e-3)]).width == (samples,)
