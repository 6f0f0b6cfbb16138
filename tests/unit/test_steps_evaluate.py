"""Evaluate and compare: each figure against its definition, on a run whose errors are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import report_examples
import store_examples as examples
from core_jobs import curves

import pulsetrainer as pt
from pulsetrainer.artefacts import Evaluation, Extension, Parameter, Playback, Run
from pulsetrainer.cli.next_step import with_files
from pulsetrainer.core.initial_state import left_out_words
from pulsetrainer.core.memory import positive_saturation
from pulsetrainer.diagnosis.prediction import operator_of
from pulsetrainer.errors import ArgumentError, DataError, UsageError
from pulsetrainer.files.store import read
from pulsetrainer.report.text import tables_of
from pulsetrainer.steps.compare import compare
from pulsetrainer.steps.diagnose import diagnose
from pulsetrainer.steps.evaluate import breaches, evaluate
from pulsetrainer.steps.identify import identify

FOLDER = Path(__file__).parents[1] / "data/files-0.1"
MODEL = examples.model(6)
U = 0.5 + 0.5 * curves(1000, 6, 4)
WAVE = 0.2 * np.sin(np.arange(1000) / 7.0) + 0.3 * (np.arange(1000) >= 500)


def _run(error=WAVE, u=U) -> Run:
    clean = MODEL.predict(u, dt_s=1e-3)
    return Run(np.arange(u.size) / 1000.0, u, clean + error)


def test_prediction_errors_are_what_they_are_called():
    """Rms, largest, offset, shape, and the second half with the zero of the first; in percent of the span."""
    run = _run()
    found = evaluate(run, MODEL).models[0]
    span = np.ptp(run.output)
    assert found.rms == pytest.approx(np.sqrt(np.mean(WAVE**2)))
    assert found.rms_percent == pytest.approx(100.0 * found.rms / span)
    assert found.max_percent == pytest.approx(100.0 * np.abs(WAVE).max() / span)
    assert found.offset == pytest.approx(WAVE.mean())
    assert found.shape_rms_percent == pytest.approx(100.0 * np.std(WAVE) / span)
    second = WAVE[500:] - WAVE[:500].mean()
    assert found.second_half_percent == pytest.approx(100.0 * np.sqrt(np.mean(second**2)) / span)
    assert (found.outside_percent, found.gain_percent, found.start) == (0.0, 0.0, "known")
    np.testing.assert_array_equal(found.output, run.output)
    np.testing.assert_allclose(found.predicted, run.output - WAVE)
    np.testing.assert_array_equal(found.time_s, run.time_s)


def test_a_run_that_the_model_was_fitted_to_is_no_test_of_it():
    """It is said; of another run of the same input it is not."""
    rng = np.random.default_rng(3)
    runs = [_run(0.01 * rng.standard_normal(U.size)) for _ in range(2)]
    model = identify(runs[0], levels=6)
    notes = [evaluate(run, model, names=["a"], model_names=["m"]).notes for run in runs]
    assert notes[0] == ("m was fitted to a: only another run shows how good it is",)
    assert notes[1] == ()


@pytest.mark.parametrize(("noise", "said"), [(0.0, False), (0.01, True)])
def test_the_fit_of_an_input_without_its_noise_is_better_than_the_prediction_from_it(noise, said):
    """`evaluate` and `diagnose` told another error of one model and run than `identify`, without a reason."""
    rng = np.random.default_rng(5)
    u = np.repeat(U, 2)
    run = _run(0.001 * rng.standard_normal(u.size), u)
    run = replace(run, input=u + noise * np.ptp(u) * rng.standard_normal(u.size))
    model = identify(run, levels=12, form="direct")
    names = {"names": ["a"], "model_names": ["m"]}
    told = [evaluate(run, model, **names).notes, diagnose(run, model, quick=True, names=["a", "m"]).notes]
    assert [any("took the noise of the input out" in note for note in notes) for notes in told] == [said] * 2
    other = replace(run, output=run.output + 0.001)
    assert not any("its fit" in note for note in evaluate(other, model, **names).notes)


@pytest.mark.parametrize(
    ("at", "said"), [([], ()), ([300], ("1 sample looks",)), ([300, 700], ("2 samples look",))]
)
def test_wild_samples_of_a_run_are_told(at, said):
    """They are not the model's fault; a clean run has none."""
    error = 0.01 * np.random.default_rng(4).standard_normal(U.size)
    error[at] += 0.5 * np.ptp(_run().output)
    notes = evaluate(_run(error), MODEL, names=["a"]).notes
    assert notes == tuple(f"{one} wild in a, and count in its errors" for one in said)


def test_clipped_samples_of_a_run_are_told_with_the_way_to_take_them_out():
    """A model is not to blame where the output is cut off; what was taken out is not told again."""
    run = _run(0.01 * np.random.default_rng(4).standard_normal(U.size))
    rail = float(np.quantile(run.output, 0.9))
    clipped = replace(run, output=np.minimum(run.output, rail))
    (note,) = evaluate(clipped, MODEL, names=["a"]).notes
    count, _, rest = note.partition(" samples sit at exactly ")
    assert int(count) == pytest.approx(100, abs=3)
    assert rest.startswith(f"{rail:.4g} N in a, ")
    named = with_files(note, {"inputs": [Path("a.h5")], "model": [Path("m.h5"), Path("n.h5")]})
    assert "diagnose a.h5 --model m.h5 -o" in named
    assert "correct a.h5 --diagnosis" in named
    assert evaluate(replace(clipped, corrected=("saturation",)), MODEL).notes == ()


def test_wild_samples_that_a_diagnosis_finds_are_told_with_the_way_to_take_them_out():
    """Of one or two it finds none: see above."""
    error = 0.01 * np.random.default_rng(4).standard_normal(U.size)
    error[100:900:50] += 0.5 * np.ptp(_run().output)
    (note,) = evaluate(_run(error), MODEL, names=["a"]).notes
    assert note.startswith("16 samples look wild in a, and count in its errors. ")
    assert "correct RUN.h5 --diagnosis" in note


@pytest.mark.parametrize(("at", "size", "told"), [(0, 0.2, True), (0, 0.02, False), (500, 0.2, False)])
def test_the_largest_error_is_placed_where_the_first_stroke_has_it(at, size, told):
    """It dies away too soon to leave the stroke out; of a later or a small one nothing is said."""
    u = np.interp(np.arange(1000), [0, 500, 999], [0.0, 1.0, 0.0])
    noise = 0.01 * np.random.default_rng(6).standard_normal(u.size)
    since = np.arange(u.size) - at
    run = _run(noise + size * np.where(since >= 0, np.exp(-np.maximum(since, 0) / 15.0), 0.0), u)
    notes = evaluate(run, MODEL, names=["a"], model_names=["m"]).notes
    assert len(notes) == told
    if told:
        assert "of m are in the first stroke of a" in notes[0]
        assert "at 0 s after its beginning" in notes[0]
    noise[60] += size
    assert not any("first stroke of" in note for note in evaluate(_run(noise, u), MODEL).notes)


def test_errors_of_a_playback_are_what_they_are_called():
    """Mean, largest and rms error, noise and spread of the repeats, lag of the current, width of the loop.

    Four beats of 3 - 2 cos, pressed late by 0.1 rad and off by another force in each repeat. The lead-in, far
    off, does not count.
    """
    count, lead, late = 1200, 200, 0.1
    phase = 2.0 * np.pi * (np.arange(count) - lead) / 250.0
    scored = np.arange(count) >= lead
    wave, still = 3.0 - 2.0 * np.cos(phase), np.zeros((3, count))
    off = np.array([[0.0], [0.02], [0.07]])
    pressed = np.where(scored, 3.0 - 2.0 * np.cos(phase - late), 40.0)
    merely = np.where(scored, wave + 0.5 * np.sin(3.0 * phase), 40.0)
    played = read(FOLDER / "played.h5", Playback)
    drive = replace(
        played.waveform, time_s=np.arange(count) / 1e3, target=wave, scored=scored,
        compensated=wave, scaled=wave, predicted=wave,
    )  # fmt: skip
    compensated, scaled = (
        replace(
            played.compensated,
            reference=still,
            input=still + lag * (phase > 9.0),
            output=output + times * off,
        )
        for output, lag, times in ((pressed, -0.03, 1.0), (merely, 0.02, -8.0))
    )
    (found,) = evaluate(
        replace(
            played,
            time_s=drive.time_s,
            waveform=drive,
            input_range=1.5,
            compensated=compensated,
            scaled=scaled,
        )
    ).waveforms
    spreads = []
    for one, given, lag in ((found.compensated, compensated, 2.0), (found.scaled, scaled, 4.0 / 3.0)):
        error = 100.0 * np.abs(given.output - wave)[:, scored] / 5.0
        assert one.mean_abs_error_percent == pytest.approx(error.mean())
        assert one.max_abs_error_percent == pytest.approx(error.max())
        assert one.rms_error_percent == pytest.approx(np.sqrt(np.mean(error**2)))
        assert one.current_tracking_max_percent == pytest.approx(lag)
        np.testing.assert_allclose(one.output, given.output[:, scored].mean(axis=0))
        spreads.append(np.std(error.mean(axis=1), ddof=1))
    assert found.error_spread_percent == pytest.approx(max(spreads)) != pytest.approx(min(spreads), rel=0.5)
    assert found.noise_percent == pytest.approx(100.0 * np.std(off, ddof=1) / 5.0)
    assert found.compensated.hysteresis_percent == pytest.approx(
        100.0 * np.pi * 2.0**2 * np.sin(late) / 5.0**2, rel=1e-3
    )
    reduced = 1.0 - found.compensated.mean_abs_error_percent / found.scaled.mean_abs_error_percent
    assert found.mean_error_reduction_percent == pytest.approx(100.0 * reduced)


def test_figures_of_a_fit_are_those_of_an_evaluation_on_its_record():
    """Over samples that count alike; how many they are, and what it says of the plane."""
    run = _run(0.01 * WAVE)
    model = identify(run, levels=6, smoothing=0.02)
    fit, found = model.fit, evaluate(run, model).models[0]
    assert (fit.rms, fit.rms_percent) == pytest.approx((found.rms, found.rms_percent))
    assert fit.max_percent == pytest.approx(found.max_percent)
    assert fit.max_abs == pytest.approx(found.max_percent / 100.0 * np.ptp(run.output))
    np.testing.assert_allclose(fit.predicted, found.predicted)
    assert (fit.samples, fit.draws, fit.smoothing) == (run.input.size, 0, 0.02)
    assert fit.coverage_percent == 100.0 * np.mean(model.covered)


def test_a_run_of_one_sample_is_refused_by_its_name():
    """Not as a vector of some shape."""
    run = _run(0.01 * WAVE)
    one = pt.Run(time_s=np.zeros(1), input=np.ones(1), output=np.ones(1))
    with pytest.raises(DataError, match="short has one sample"):
        evaluate(one, identify(run, levels=6, smoothing=0.02), names=["short"])


def test_the_name_of_a_file_is_none_of_its_contents():
    """As in a notebook: which function gives what was meant; it was an AttributeError of a text."""
    model, drive = pt.load(FOLDER / "model.h5"), pt.load(FOLDER / "drive.h5")
    for verb, given in (
        (pt.identify, ("run.h5",)),
        (pt.diagnose, (_run(), "model.h5")),
        (pt.evaluate, (_run(), "model.h5")),
        (pt.invert, ("normal", "model.h5")),
        (pt.invert, (model, "normal")),
        (pt.play, (drive, "bench:")),
    ):
        with pytest.raises(ArgumentError, match="expected a"):
            verb(*given)


def test_a_second_model_gains_on_the_first():
    """Its rms against that of the first, in percent."""
    worse = replace(MODEL, offset=MODEL.offset + 1.0)
    found = evaluate(_run(), [worse, MODEL])
    first, second = found.models
    assert found.model is MODEL  # the last one
    assert second.gain_percent == pytest.approx(100.0 * (1.0 - second.rms / first.rms))
    assert second.gain_percent > 0


@pytest.mark.parametrize(
    ("of", "said"),
    [
        (lambda u, y: (u, -y), "the other way"),
        (lambda u, y: (u, 10.0 * y), "varies 10 times as much"),
        (lambda u, y: (u, y + 5.0 * np.ptp(y)), "an offset of +"),
        (lambda u, y: (u, np.sin(np.arange(u.size)) - 5.0), "of another device"),
        (lambda u, y: (5.0 + u, y), "outside the range"),
    ],
)
def test_a_model_that_does_not_describe_the_run_is_told_first(of, said):
    """With the likely reason: sign, gain, zero, range, else another device; nothing of one that does."""
    sound = _run(0.01 * WAVE)
    u, y = of(sound.input, sound.output)
    other = replace(sound, input=u, output=y, output_quantity="force", output_unit="N")
    model = replace(MODEL, output_unit="N")
    found = evaluate(other, [model], names=["a"], model_names=["m"])
    (warning,) = found.warnings
    assert warning.startswith("m does not describe a at all: its rms error is ")
    assert said in warning
    assert evaluate(sound, MODEL).warnings == ()


def test_over_a_model_without_any_error_no_gain_can_be_told():
    """As on a record that the first model itself made."""
    model, other = examples.model(), replace(examples.model(), offset=examples.model().offset + 0.5)
    u = np.concatenate((np.linspace(model.edges[0], model.edges[-1], 200), [model.edges[0]]))
    exact = Run(None, u, model.predict(u, None))
    first, same, worse = evaluate(exact, [model, model, other]).models
    assert (first.rms, first.gain_percent, same.gain_percent) == (0.0, 0.0, 0.0)
    assert np.isnan(worse.gain_percent)


def test_over_a_scaled_drive_without_any_error_no_reduction_can_be_told():
    """As in a simulation of one's own; it is compared all the same."""
    played = read(FOLDER / "played.h5", Playback)
    exact = np.tile(played.waveform.target, (played.scaled.output.shape[0], 1))
    found = evaluate(replace(played, scaled=replace(played.scaled, output=exact)))
    assert np.isnan(found.waveforms[0].mean_error_reduction_percent)
    assert {metric.better for metric in compare([found, found])} == {None}


def test_the_state_before_a_record_is_the_one_that_was_predicted_from():
    """A static model tries several; one with extensions begins at rest, and says so."""
    static = examples.model()
    late = Extension("delay", (Parameter("delay", 0.01, "s", 0.01, 0.01),))
    low, high = static.edges[[0, -1]]
    u = high - (high - low) * (0.3 + 0.2 * np.cos(np.arange(600) / 40.0))
    y = operator_of(static)(u, positive_saturation(low, high))
    run = Run(np.arange(600) / 100.0, u, y)
    found = evaluate(run, [static, replace(static, extensions=(late,))])
    assert [one.start for one in found.models] == [
        "positive saturation, estimated",
        "negative saturation, as for every extended model",
    ]


LAGGING = replace(MODEL, extensions=(Extension("output-lag", (Parameter("tau", 0.03, "s", 0.03, 0.03),)),))
LOOPS = np.interp(np.arange(1350), np.cumsum([0, *[200] * 4, *[80] * 4, *[40] * 6]), np.arange(15) % 2)
ONCE = np.interp(np.arange(2500), [0, 500, 1000, 1500, 2000, 2500], [0, 1, 0.3, 0.8, 0.2, 0.9])


@pytest.mark.parametrize(
    ("tau_s", "first", "said"), [(0.03, 0.5, True), (0.03, 0.05, False), (0.003, 0.5, False)]
)
def test_a_run_that_begins_elsewhere_does_not_show_what_a_slow_cause_was_before(tau_s, first, said):
    """A piezo that creeps, from the middle of its range on: an exactly right model was called 159 % worse."""
    lag = Extension("output-lag", (Parameter("tau", tau_s, "s", tau_s, tau_s),))
    late = replace(MODEL, extensions=(lag,))
    u = np.concatenate(([first], LOOPS))
    run = Run(np.arange(u.size) / 1000.0, u, MODEL.predict(u))
    notes = evaluate(run, [MODEL, late], names=["a"], model_names=["m", "x"]).notes
    assert [note for note in notes if "begins away" in note] == [
        (
            f"a begins away from the low end of its input, where x begins at rest: until about "
            f"{1000 * 3 * tau_s:g} ms have passed, its output-lag may be another than the device's"
        )
    ] * said


def _first_apart(u, until, size):
    """What the first stroke of a device that was never cycled adds to its later ones."""
    return size * np.clip(1.0 - np.arange(u.size) / until, 0.0, None)


def test_a_first_stroke_that_a_lag_hides_is_left_out_of_all_models():
    """By the lag strokes differ at other rates, too; less what it adds, only the first does."""
    y = LAGGING.predict(LOOPS, dt_s=1e-3) + _first_apart(LOOPS, 150, 0.1)
    run = Run(np.arange(y.size) / 1000.0, LOOPS, y)
    alone = evaluate(run, MODEL)
    both = evaluate(run, [MODEL, LAGGING], names=["a"])
    assert not alone.notes
    assert both.notes == (f"a: {left_out_words(199)}",)
    assert both.models[0].output.size == both.models[1].output.size == LOOPS.size - 199
    assert both.models[1].rms_percent < 1e-6 < both.models[0].rms_percent


@pytest.mark.parametrize(
    ("size", "model", "counted"), [(2.0, LAGGING, 2004), (0.0, LAGGING, 2500), (0.0, MODEL, 2500)]
)
def test_the_only_first_stroke_is_left_out_where_every_model_misses_it(size, model, counted):
    """No later stroke is there to compare it with; a model that alone is wrong there still counts it."""
    y = LAGGING.predict(ONCE, dt_s=1e-3) + _first_apart(ONCE, 400, size)
    found = evaluate(Run(np.arange(y.size) / 1000.0, ONCE, y), [MODEL, model])
    assert {one.output.size for one in found.models} == {counted}


@pytest.mark.parametrize(("size", "counted"), [(2.0, 1151), (0.5, 1350)])
def test_a_first_stroke_that_later_ones_hide_is_left_out_where_every_model_misses_it(size, counted):
    """The strokes of a piezo crept apart, and only to the models its first one stood out."""
    other = 0.6 * (np.arange(LOOPS.size) > 1250)  # one that lies apart as well, by less
    y = MODEL.predict(LOOPS) + _first_apart(LOOPS, 150, size) + other
    (found,) = evaluate(Run(np.arange(y.size) / 1000.0, LOOPS, y), MODEL).models
    assert found.output.size == counted


def test_samples_outside_the_model_are_counted():
    """A little noise beyond the range is none; at both ends; it is said of one sample in a thousand."""
    u = U.copy()
    u[200:210], u[300:320], u[400] = 1.02, -0.02, 1.004
    assert evaluate(_run(0.0 * WAVE, u), MODEL).models[0].outside_percent == pytest.approx(3.0)
    said = []
    for most in (1.004, 1.011):
        u = U.copy()
        u[500] = most
        said.append(
            [note for note in evaluate(_run(0.0 * WAVE, u), MODEL).notes if "outside the range" in note]
        )
    assert [len(one) for one in said] == [0, 1]
    assert said[1][0].startswith("0.1 % of the input")


def test_a_long_prediction_is_thinned_for_the_figures():
    """Every other sample of twice as many as are kept; the figures are those of all."""
    u = np.tile(U, 12)
    run = _run(np.tile(WAVE, 12), u)
    found = evaluate(run, MODEL).models[0]
    np.testing.assert_array_equal(found.output, run.output[::2])
    np.testing.assert_array_equal(found.time_s, run.time_s[::2])
    assert found.rms == pytest.approx(np.sqrt(np.mean(WAVE**2)))


def test_a_bound_holds_on_both_sides():
    """Its ends included; one of a figure that is not there is no bound."""
    evaluation = report_examples.evaluation()
    name, value = next(iter(evaluation.figures().items()))
    assert breaches(evaluation, {name: (value, value)}) == ()
    for low, high in ((value + 1e-9, value + 1.0), (value - 1.0, value - 1e-9)):
        (broken,) = breaches(evaluation, {name: (low, high)})
        assert (broken.metric, broken.value, broken.low, broken.high) == (name, value, low, high)
    with pytest.raises(UsageError) as caught:
        breaches(evaluation, {"none.such": (0.0, 1.0)})
    assert "none.such" in caught.value.message


def test_a_pulse_that_was_played_twice_has_all_its_figures():
    """By one inversion: each in the table, under a name of its own, and none is kept from a bound."""
    good = read(FOLDER / "played.h5", Playback)
    weak = replace(good.compensated, output=0.9 * good.compensated.output)
    both = evaluate([replace(good, compensated=weak), good])
    metric = "compensated.mean_abs_error_percent"
    worse, better = (one.compensated.mean_abs_error_percent for one in both.waveforms)
    assert worse > 1.5 * better
    figures = both.figures()
    assert (figures[f"pulse.continuous.{metric}"], figures[f"pulse.continuous#2.{metric}"]) == (worse, better)
    (table,) = tables_of(both)
    shown = [row[1:] for row in table.rows]
    assert (worse, better) in shown
    for order in ([replace(good, compensated=weak), good], [good, replace(good, compensated=weak)]):
        (broken,) = breaches(evaluate(order), {f"pulse.continuous.{metric}": (0.0, 1.2 * better)})
        assert broken.value == worse
    assert {m.better for m in compare([both, both], everything=True)} == {None}


def test_models_are_compared_by_their_place():
    """One model an evaluation is called model, whatever its file; several keep their names."""
    one, other = (evaluate(_run(), MODEL, model_names=[f"{name}.h5"]) for name in ("old", "new"))
    both = evaluate(_run(), [MODEL, MODEL], model_names=["old.h5", "new.h5"])
    assert {m.name.split(".")[0] for m in compare([one, other], everything=True)} == {"model"}
    assert {m.name.split(".")[0] for m in compare([both, both], everything=True)} == {"old", "new"}
    with pytest.raises(DataError):
        compare([one, Evaluation()])


def test_a_change_is_better_or_worse_or_none():
    """Errors shall fall and reductions rise; what stays the same is neither."""
    worse = replace(MODEL, offset=MODEL.offset + 1.0)
    before, after = evaluate(_run(), worse), evaluate(_run(), MODEL)
    change = {m.name: m for m in compare([before, after])}
    rms = change["model.rms_percent"]
    assert (rms.better, rms.values[1] - rms.values[0]) == (True, pytest.approx(rms.change))
    assert {m.better for m in compare([after, after])} == {None}
    assert {m.name: m.better for m in compare([after, before])}["model.rms_percent"] is False


@pytest.mark.parametrize("times", [0.9, 1.1])
def test_a_change_within_the_spread_of_the_repeats_is_none(times):
    """Errors of 4 and 1 of a full force: a spread of 0.1 is one of 2.5 % in the reduction."""
    (one,) = evaluate(read(FOLDER / "played.h5", Playback)).waveforms
    scaled, error = (replace(one.scaled, mean_abs_error_percent=size) for size in (4.0, 1.0))
    before, after = (
        Evaluation(
            waveforms=(
                replace(
                    one,
                    scaled=scaled,
                    compensated=replace(error, mean_abs_error_percent=1.0 - less),
                    mean_error_reduction_percent=75.0 + 25.0 * less,
                    error_spread_percent=0.1,
                ),
            )
        )
        for less in (0.0, 0.1 * times)
    )
    better = {m.name.removeprefix("pulse."): m.better for m in compare([before, after])}
    expected = True if times > 1.0 else None
    assert better["mean_error_reduction_percent"] is expected
    assert better["compensated.mean_abs_error_percent"] is expected
