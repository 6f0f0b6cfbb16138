"""Which form a record asks for, on devices that nothing was tuned to: thresholds were set on other seeds."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import form_devices as devices
import numpy as np
import pytest
from scipy.signal import lfilter

import pulsetrainer as pt
from pulsetrainer.core.dual import Dual
from pulsetrainer.core.fit import fit
from pulsetrainer.core.forms import try_all
from pulsetrainer.core.identification import identify
from pulsetrainer.core.input_noise import white
from pulsetrainer.core.loop import loop_of
from pulsetrainer.core.operator import Preisach
from pulsetrainer.core.plane import Plane
from pulsetrainer.core.record import Record
from pulsetrainer.errors import ArgumentError, DataError
from pulsetrainer.report.facts import facts, loop_words
from pulsetrainer.steps import fit_notes
from wording import raises, tells

NOISE = 0.003  # of the span
SAMPLES = 3000


def measured(draw, seed, n=SAMPLES):
    """A device, an input, its clean output and the size of the noise."""
    rng = np.random.default_rng(seed)
    device = draw(rng)
    u = devices.record(rng, n)
    clean = device(u)
    noise = NOISE * np.ptp(clean)
    return device, u, clean + rng.normal(0.0, noise, n), noise, rng


def run_of(u, y):
    """A run in units of somebody else's bench."""
    return pt.Run(
        time_s=np.arange(u.size) / 100.0, input=u, output=y, input_unit="V", output_unit="mm",
        input_quantity="voltage", output_quantity="stroke",
    )  # fmt: skip


def named(draws, seeds):
    """Forms that the records of these devices ask for."""
    found = []
    for k, seed in enumerate(seeds):
        _, u, y, _, _ = measured(draws[k % len(draws)], seed)
        found.append(try_all([(u, y)], u.min(), u.max()).form)
    return found


def test_a_direct_device_is_called_direct():
    """Planes, sums of plays and falling loops."""
    assert named(devices.DIRECT, range(1000, 1009)) == ["direct"] * 9
    _, u, y, _, _ = measured(devices.DIRECT[0], 1000)
    assert set(try_all([(u, y)], u.min(), u.max()).left) == {"direct", "signed"}  # a look is enough


def late(y, samples):
    """An output that follows with a time constant of so many samples."""
    kept = np.exp(-1 / samples)
    return lfilter([1 - kept], [1, -kept], y, zi=[y[0] * kept])[0]


@pytest.mark.parametrize("count", [6, pytest.param(24, marks=pytest.mark.slow)])
def test_a_direct_device_that_is_late_is_still_called_direct(count):
    """A lag widens the loop as some weights below zero would; it is for diagnose to find, not a form."""
    found = []
    for k in range(count):
        device, u, _, noise, rng = measured(devices.DIRECT[k % 3], 8000 + k)
        y = late(device(u), float(np.exp(rng.uniform(np.log(0.5), np.log(30)))))
        found.append(try_all([(u, y + rng.normal(0, noise, u.size))], u.min(), u.max()).form)
    assert found == ["direct"] * count


def test_what_is_left_out_does_not_decide_the_form():
    """Where clipped outputs were filled in, weights of either sign follow those, and were taken for it."""
    _, u, y, _, _ = measured(devices.DIRECT[0], 1000)
    rail = y.min() + 0.6 * np.ptp(y)
    lost = y > rail
    run = replace(run_of(u, np.where(lost, rail, y)), masked=lost)
    assert pt.identify(run, levels=24).form == "direct"
    assert try_all([(u, run.output)], u.min(), u.max()).form == "signed"
    assert try_all([(u, run.output)], u.min(), u.max(), [~lost]).form == "direct"


@pytest.mark.slow
def test_none_of_200_direct_devices_is_called_anything_else():
    """The same, 200 of them."""
    assert named(devices.DIRECT, range(2000, 2200)) == ["direct"] * 200


@pytest.mark.parametrize(
    ("draws", "form", "count"),
    [
        pytest.param(devices.CLOCKWISE, "dual", 12, marks=pytest.mark.slow),
        (devices.BUTTERFLY, "signed", 4),
        pytest.param(devices.BUTTERFLY, "signed", 12, marks=pytest.mark.slow),
        pytest.param(devices.MIXED, "signed", 12, marks=pytest.mark.slow),
    ],
    ids=["clockwise", "some-butterflies", "butterfly", "mixed"],
)
def test_the_form_is_named_right(draws, form, count):
    """Twelve devices of each kind: at most one of twenty may be named wrongly."""
    found = named(draws, range(5000, 5000 + count))
    assert found.count(form) / len(found) >= 0.95


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in (1, 2))])
def test_a_loop_of_sharp_corners_that_leads_is_still_dual(seed):
    """A spring beside one sliding element: on a coarse plane weights of either sign leave half as much.

    On the levels of the command; on twenty of them they still do, and are taken.
    """
    rng = np.random.default_rng(seed)
    u = np.interp(np.linspace(0, 62, 1200), np.arange(63), [0.0, 1.0, 0.0, *rng.uniform(0, 1, 60)])
    force = 0.82 * u - 0.68 * devices.play(u, np.array([0.23]))[:, 0]
    force += rng.normal(0.0, 0.002 * np.ptp(force), u.size)
    tried = try_all([(u, force)], 0.0, 1.0)
    assert (tried.form, tried.to_fit) == ("signed", ("dual", "signed"))
    assert fit([(u, force)], 0.0, 1.0, 48, form="auto").form == "dual"


@pytest.mark.parametrize("spring", [0.0, 0.04])
@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in range(1, 8))])
def test_friction_without_a_stiff_spring_is_not_late(seed, spring):
    """It leads, and hardly has a trend: turned round by the fit of its sign it would lag and be late."""
    rng = np.random.default_rng([seed, 77])
    turns = [0.0, 1.0, 0.0, *rng.uniform(0, 1, 60)]
    u = np.interp(np.linspace(0, 62, SAMPLES), np.arange(63), turns)
    force = np.zeros(u.size)  # Bouc and Wen
    for k, step in enumerate(np.diff(u), start=1):
        z = force[k - 1]
        force[k] = z + 20.0 * step * (1.0 - z * z * (0.7 * np.sign(step * z) + 0.3))
    y = force + spring * 20.0 * u
    y += rng.normal(0.0, NOISE * np.ptp(y), u.size)
    made = fit([(u, y)], 0.0, 1.0, 48, form="auto")
    assert made.form in ("dual", "signed")
    assert np.std(made.residuals[0]) < 0.03 * np.ptp(y)


def test_a_dual_form_is_judged_by_what_it_was_not_fitted_to():
    """There it leaves 1.07 of the noise of these records in the mean; where it was fitted, 1.01."""
    left = []
    for seed in (1, 2, 3, 4):
        rng = np.random.default_rng(seed)
        device = devices.exchanged_plane(rng)
        u = devices.record(rng, 600)
        noise = rng.normal(0.0, 0.02 * np.ptp(device(u)), u.size)
        left.append(try_all([(u, device(u) + noise)], 0.0, 1.0).left["dual"] / np.sqrt(np.mean(noise**2)))
    assert np.mean(left) > 1.04


def test_records_of_unlike_ranges_are_judged_on_one_plane():
    """A second record within a third of the range: what the form leaves is noise, in both."""
    device, u, y, noise, rng = measured(devices.stop_sum, 4000)
    small = device(u / 3) + rng.normal(0.0, noise, u.size)
    tried = try_all([(u, y), (u / 3, small)], u.min(), u.max())
    assert tried.form == "dual"
    assert tried.left["dual"] <= 2.0 * noise
    assert white(np.array([0.0, 0.0, 1.0, 0.0, 0.0])) > 0.0


def held_out(draw, seed):
    """Error on a held-out signal with noise, in units of the noise."""
    device, u, y, noise, rng = measured(draw, seed, 4000)
    model = pt.identify(run_of(u, y))
    turns = rng.uniform(0.0, 1.0, 60)
    unseen = np.interp(np.linspace(0, 62, 3000), np.arange(63), np.concatenate(([0.0, 1.0, 0.0], turns)))
    wanted = device(unseen) + rng.normal(0.0, noise, unseen.size)
    return model, float(np.sqrt(np.mean((model.predict(unseen) - wanted) ** 2)) / noise)


@pytest.mark.parametrize(
    "draw", [devices.exchanged_plane, pytest.param(devices.stop_sum, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("seed", [4000, pytest.param(4001, marks=pytest.mark.slow)])
def test_a_dual_model_predicts_within_the_noise(draw, seed):
    """Held-out error at most 1.3 times the noise."""
    model, error = held_out(draw, seed)
    assert (model.form, model.fit.loop) == ("dual", "clockwise")
    assert error <= 1.3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7301, *range(7500, 7512)])
def test_steep_branches_of_a_dual_model_are_predicted_within_the_noise(seed):
    """The output is remembered with its noise, which a fit to the input takes for exact."""
    model, error = held_out(devices.steep_exchanged_plane, seed)
    assert model.form == "dual"
    assert error <= 1.5


@pytest.mark.parametrize(
    "draw",
    [
        devices.butterfly_density,
        *(pytest.param(draw, marks=pytest.mark.slow) for draw in (devices.mixed_plays, devices.mixed_planes)),
    ],
)
def test_a_signed_model_predicts_within_twice_the_noise(draw):
    """Held-out error at most 2 times the noise."""
    model, error = held_out(draw, 4002)
    assert model.form == "signed"
    assert error <= 2.0


def test_a_device_that_is_driven_sample_by_sample_keeps_its_turns():
    """Tips between its samples, where the lines on both sides meet, are none that it saw: 1.74 with them."""
    assert held_out(devices.butterfly_density, 7001)[1] <= 1.2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("draws", "most"),
    [
        ((devices.exchanged_plane, devices.stop_sum), 1.3),
        ((devices.butterfly_density,), 2.0),
        ((devices.mixed_plays, devices.mixed_planes), 2.0),
    ],
    ids=["clockwise", "butterfly", "mixed"],
)
def test_twelve_devices_are_predicted(draws, most):
    """Twelve drawn devices of each kind that has a form; Bouc-Wen and |P[u]| have none (decision 070)."""
    errors = [held_out(draws[k % len(draws)], 7000 + k)[1] for k in range(12)]
    print(f"seeds 7000..7011: {np.mean(errors):.2f} of the noise in the mean, {max(errors):.2f} at most")
    assert max(errors) <= most


@pytest.fixture(scope="module")
def butterfly():
    """A signed model of a butterfly."""
    _, u, y, _, _ = measured(devices.butterfly_density, 4003)
    return pt.identify(run_of(u, y), levels=24)


@pytest.fixture(scope="module")
def clockwise():
    """A dual model."""
    _, u, y, _, _ = measured(devices.stop_sum, 4004)
    return pt.identify(run_of(u, y), levels=24)


@pytest.mark.slow
def test_units_of_a_dual_model_are_exchanged(clockwise):
    """Edges are of the output, the offset of the input."""
    assert (clockwise.edges_unit, clockwise.offset_unit) == ("mm", "V")
    assert clockwise.weights_unit == "V/(mm)^2"


def test_forms_are_kept_in_files(tmp_path, butterfly, clockwise):
    """What is loaded predicts the same."""
    u = np.concatenate((np.linspace(0, 1, 50), np.linspace(1, 0.2, 50)))
    for model in (butterfly, clockwise):
        pt.save(model, tmp_path / f"{model.form}.h5")
        again = pt.load(tmp_path / f"{model.form}.h5")
        assert (again.form, again.fit.loop, again.captured) == (model.form, model.fit.loop, False)
        np.testing.assert_array_equal(again.predict(u), model.predict(u))


def test_both_forms_are_drawn_and_printed(butterfly, clockwise):
    """A figure, and the form among the facts."""
    for model in (butterfly, clockwise):
        assert model.form in str(model)
        mostly = loop_words(replace(model, fit=replace(model.fit, loop="clockwise")))
        assert mostly.startswith("mostly clockwise") is (model is butterfly)
        assert model.plot() is not None


@pytest.mark.parametrize(("draw", "seed", "runs"), [
    (devices.DIRECT[0], 1000, "falling, clockwise, the output lags"),
    (devices.stop_sum, 4004, "falling, counterclockwise, the output leads"),
])  # fmt: skip
def test_a_falling_loop_is_said_to_run_as_it_is_drawn(draw, seed, runs):
    """The mirror image of a loop runs the other way: in `identify`, in `show` and in the note of the form."""
    _, u, y, _, _ = measured(draw, seed)
    model = pt.identify(run_of(u, -np.sign(np.corrcoef(u, y)[0, 1]) * y), levels=16)
    assert loop_words(model) == runs
    way = runs.split(", ")[1]
    assert facts(model)["loop"] == way
    assert all(f"runs {way}:" in note for note in model.fit.notes if "its loop runs" in note)


def test_a_loop_too_narrow_to_be_one_runs_no_way():
    """The note of the dual form has the direction of `core.loop`, as the facts have: here there is none."""
    plane = Plane.uniform(0.0, 1.0, 8)
    i, j = plane.cell_indices
    for off_diagonal, runs in ((0.0, False), (0.3, True)):
        inner = Preisach(plane, np.where(i == j, 1.0, off_diagonal))
        fitted = SimpleNamespace(form="dual", operator=Dual(inner), identified=SimpleNamespace(ridge=0.0))
        (note,) = fit_notes.of_form(fitted, run_of(np.linspace(0, 1, 9), np.linspace(0, 1, 9)), "auto")
        assert ("its loop runs clockwise" in note) is runs


def test_a_dual_model_is_inverted_exactly(clockwise):
    """What the drive is expected to give is the target."""
    drive = pt.invert("normal", clockwise)
    assert drive.predicted_max_error_percent < 1e-6
    assert drive.clipped_samples == 0


def test_a_signed_model_is_inverted_within_its_range(butterfly):
    """The range is named, kept, and nothing beyond it is promised."""
    drive = pt.invert("normal", butterfly)
    note = next(note for note in drive.notes if "inverse exists" in note)
    for end in (drive.compensated.min(), drive.compensated.max()):
        assert f"{end:.4g}" in note
    assert drive.predicted_max_error_percent < 5.0
    assert drive.clipped_samples == 0
    with pytest.raises(DataError):
        pt.invert("normal", butterfly, force_max=float(drive.target[drive.scored].max()) + 10.0)


def test_closest_match_is_for_direct_models(clockwise):
    """The relays of the paper know one form."""
    with pytest.raises(pt.errors.UsageError):
        pt.invert("normal", clockwise, method="closest-match")


def test_evaluate_knows_every_form(clockwise, butterfly):
    """The error on the record itself is that of the fit."""
    for draw, seed, model in (
        (devices.stop_sum, 4004, clockwise),
        (devices.butterfly_density, 4003, butterfly),
    ):
        _, u, y, _, _ = measured(draw, seed)
        found = pt.evaluate(run_of(u, y), model).models[0]
        assert found.rms_percent == pytest.approx(model.fit.rms_percent, rel=0.05)


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in (3, 5))])
def test_a_signed_model_of_a_spoilt_record_stays_in_the_recorded_range(seed):
    """Stairs tell few weights apart, and a step of the zero bends them: the rest must not run off."""
    rng = np.random.default_rng(seed)
    device = devices.MIXED[seed % len(devices.MIXED)](rng)
    turns = np.concatenate((np.linspace(0, 1, 9), np.linspace(1, 0, 9)[1:], [0.5, 0.25, 0.75, 1, 0.5, 0]))
    u = np.interp(np.linspace(0, turns.size - 1, 2000), np.arange(turns.size), turns)
    span = float(np.ptp(device(u)))
    y = device(u) + rng.normal(0.0, 0.003 * span, u.size)
    y[1000:] += 0.06 * span
    model = pt.identify(run_of(u, y), form="signed")
    unseen = np.interp(np.linspace(0, 40, 2000), np.arange(41), rng.uniform(0.0, 1.0, 41))
    wrong = model.predict(unseen) - device(unseen)
    assert np.std(wrong) < 0.12 * span, f"seed {seed}"  # 1.1 to 1.5 times the span before
    assert "held back" in " ".join(model.fit.notes)


@pytest.mark.parametrize("other", ["dual", "signed"])
@pytest.mark.parametrize("option", [{"reading": "relay"}, {"method": "alternating"}])
def test_other_forms_are_fitted_jointly_and_continuously(other, option):
    """Relays and the paper's alternation know the direct form only."""
    _, u, y, _, _ = measured(devices.play_sum, 1, 500)
    with pytest.raises(ArgumentError):
        pt.identify(run_of(u, y), levels=8, form=other, **option)
    assert pt.identify(run_of(u, y), levels=8, **option).form == "direct"
    with pytest.raises(ArgumentError):
        identify([Record(u, y)], Plane.uniform(0.0, 1.0, 8), signed=True, **option)
    found = identify([Record(u, y)], Plane.uniform(0.0, 1.0, 8), signed=True)
    assert (found.iterations, found.kkt, found.stiffness) == (1, 0.0, 0.0)  # one solution of linear equations


def test_an_unknown_form_is_refused():
    """By its name."""
    _, u, y, _, _ = measured(devices.play_sum, 1, 500)
    with raises(ArgumentError, "not such an argument", argument="form", got="'sideways'"):
        pt.identify(run_of(u, y), form="sideways")


def velocity(u, rng):
    """A damper: the output follows the speed."""
    return np.tanh(80.0 * np.gradient(u)) + 0.02 * rng.normal(size=u.size)


def second_input(u, rng):
    """Half of the output comes from elsewhere."""
    return u + np.sin(np.linspace(0.0, 57.0, u.size) ** 1.1) + 0.0 * rng.normal(size=u.size)


def nothing(u, rng):
    """Noise alone."""
    return rng.normal(size=u.size) + 0.0 * u


@pytest.mark.parametrize("output", [velocity, second_input, nothing])
def test_a_record_that_no_form_describes_is_said_to_be_one(output):
    """The plain sentence; and no inverse, unless it is asked for."""
    rng = np.random.default_rng(5)
    u = 0.5 - 0.5 * np.cos(np.linspace(0.0, 60.0, 2000)) * np.linspace(1.0, 0.4, 2000)
    model = pt.identify(run_of(u, output(u, rng)), levels=16)
    assert model.fit.warning
    assert model.fit.warning in str(model)
    with pytest.raises(DataError):
        pt.invert("normal", model)
    assert pt.invert("normal", model, despite_warning=True).compensated.size


@pytest.mark.parametrize(
    "draws",
    [
        *(devices.DIRECT, devices.CLOCKWISE, devices.BUTTERFLY),
        pytest.param(devices.MIXED, marks=pytest.mark.slow),
    ],
)
def test_a_record_that_a_form_describes_has_no_warning(draws):
    """The sentence is for others."""
    _, u, y, _, _ = measured(draws[0], 7)
    fit = pt.identify(run_of(u, y), levels=24).fit
    assert fit.warning == ""
    assert not any("diagnose" in note for note in fit.notes)


@pytest.fixture(scope="module")
def square():
    """The square of what lags, and its model."""
    _, u, y, _, _ = measured(devices.squared, 2403)
    return run_of(u, y), pt.identify(run_of(u, y), levels=24)


def test_loops_that_are_not_congruent_are_said_to_be_so(square):
    """By identify, evaluate and diagnose; and no inverse unless it is asked for."""
    run, model = square
    assert model.form == "signed"
    assert model.fit.rms_percent < 1.0  # the fit itself tells nothing
    tells(model.fit.warning, "not congruent")
    assert any(model.fit.warning in said for said in pt.evaluate(run, model).warnings)
    assert model.fit.warning in pt.diagnose(run, model, quick=True).evidence[0]
    with pytest.raises(DataError):
        pt.invert("normal", model)
    assert pt.invert("normal", model, despite_warning=True).compensated.size


@pytest.mark.slow
@pytest.mark.parametrize(
    ("draws", "least", "most"),
    [(devices.NOT_CONGRUENT, 10, 12), ((devices.butterfly_density,), 0, 0), (devices.MIXED, 0, 0)],
    ids=["not congruent", "butterfly", "mixed"],
)
def test_only_loops_that_are_not_congruent_are_called_so(draws, least, most):
    """Of twelve devices each, on seeds that nothing was set on."""
    said = []
    for k in range(12):
        _, u, y, _, _ = measured(draws[k % len(draws)], 7100 + k)
        said.append(bool(pt.identify(run_of(u, y), levels=24, form="signed").fit.warning))
    assert least <= sum(said) <= most


def test_a_butterfly_without_minor_loops_is_said_to_be_a_guess_elsewhere():
    """Nothing in such a record tells what a reversal within does."""
    rng = np.random.default_rng(1)
    u = 0.5 - 0.5 * np.cos(np.linspace(0.0, 6.0 * np.pi, 2000))
    y = devices.butterfly_density(rng)(u)
    fit = pt.identify(run_of(u, y + NOISE * np.ptp(y) * rng.normal(size=u.size)), levels=16).fit
    assert fit.warning == ""
    said = [note for note in fit.notes if "minor loops" in note]
    assert len(said) == 1
    tells(said[0], "no minor loops")


@pytest.mark.parametrize("noise", [0.0, 0.0005, 0.02])
def test_a_record_that_leaves_many_times_its_noise_is_said_to(noise):
    """Static hysteresis behind a lag; where noise is as large as what is left, nothing is said."""
    rng = np.random.default_rng(17)
    u = devices.record(rng, 3000)
    y = lfilter([0.1], [1.0, -0.9], devices.play_sum(rng)(u))
    fit = pt.identify(
        run_of(u, y + noise * np.ptp(y) * rng.normal(size=y.size)), levels=16, form="direct"
    ).fit
    said = [note for note in fit.notes if "diagnose" in note]
    assert len(said) == (noise < 0.02)
    for note in said:
        tells(note, "leaves much")
    assert fit.warning == ""


def test_a_single_valued_curve_has_no_loop():
    """A reversible operator lags nowhere."""
    plane = Plane.uniform(0.0, 1.0, 8)
    i, j = plane.cell_indices
    assert loop_of(Preisach(plane, np.where(i == j, 1.0, 0.0))) == "none"
    assert loop_of(Preisach(plane, np.where(i == j, 1.0, 0.3))) == "counterclockwise"
    assert loop_of(Preisach(plane, np.where(i == j, 1.0, 0.3)), doubt=1.0) == "none"


@pytest.mark.parametrize("way", ["rises", "falls"])
def test_one_stroke_shows_no_loop(way):
    """A loop takes both ways; two records of one stroke each show it."""
    u = np.linspace(0.0, 1.0, 300)
    one = run_of(u, u**2) if way == "rises" else run_of(u[::-1], u[::-1] ** 0.5)
    fit = pt.identify(one, levels=12).fit
    assert fit.loop == "none"
    assert [way in note for note in fit.notes if "only" in note] == [True]
    other = run_of(u[::-1], u[::-1] ** 0.5) if way == "rises" else run_of(u, u**2)
    both = pt.identify([one, other], levels=12).fit
    assert both.loop == "counterclockwise"
    assert not any("only" in note for note in both.notes)


@pytest.mark.parametrize("size", [1e-101, 1e-300, 1e-320])
@pytest.mark.parametrize("what", ["input", "output"])
def test_a_record_whose_squares_are_no_numbers_is_refused(what, size):
    """Down to 1e-100 the unit does not matter."""
    u = np.concatenate([np.linspace(0.0, 1.0, 100), np.linspace(1.0, 0.0, 100)])
    scales = {"input": 1.0, "output": 1.0, what: size}
    with pytest.raises(DataError) as caught:
        pt.identify(run_of(scales["input"] * u, scales["output"] * u**2), levels=8)
    assert what in caught.value.message
    scales[what] = 1e-99
    usual = pt.identify(run_of(u, u**2), levels=8).fit.rms_percent
    small = pt.identify(run_of(scales["input"] * u, scales["output"] * u**2), levels=8).fit.rms_percent
    assert small == pytest.approx(usual, rel=1e-6)


@pytest.mark.parametrize("form", ["dual", "signed"])
@pytest.mark.parametrize(
    ("loop", "asked", "said"),
    [("clockwise", "auto", True), ("butterfly", "auto", False), ("clockwise", "dual", False)],
)
def test_an_output_that_leads_may_be_an_input(monkeypatch, form, loop, asked, said):
    """Columns swapped by mistake look like it, whatever form describes them."""
    monkeypatch.setattr(fit_notes, "loop_of", lambda operator: loop)
    fitted = SimpleNamespace(
        form=form, operator=SimpleNamespace(polarity=1), identified=SimpleNamespace(ridge=0.0)
    )
    run = SimpleNamespace(input_quantity="stroke", output_quantity="voltage")
    assert ("swapped by mistake" in fit_notes.of_form(fitted, run, asked)[0]) is said
