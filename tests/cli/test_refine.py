"""`refine` at the command line: learns on the bench, tells its passes, leaves nothing when it fails."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

import pulsetrainer as pt
from program import pulsetrainer
from pulsetrainer.errors import Interrupted
from wording import refusal, tells

KEPT = Path(__file__).parents[1] / "data/files-0.1"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="the bench needs a pty")


def test_a_refined_drive_is_better_where_it_is_played(tmp_path):
    """Played again beside the drive it came from, and figured by `evaluate`."""
    drive = KEPT / "drive.h5"
    done = pulsetrainer(tmp_path, "refine", drive, "-o", "refined.h5", "--port", "bench:?seed=3", "--json")
    assert done.code == 0, done.err
    passes, kept = done.json["passes"], done.json["kept"]
    assert {"mean_abs_error_percent", "max_abs_error_percent"} <= set(passes[0])
    mean = [one["mean_abs_error_percent"] for one in passes]
    assert len(passes) <= 5
    assert mean[kept - 1] == min(mean)
    for name, file in (("before", drive), ("after", "refined.h5")):
        words = ("play", file, "-o", f"{name}.h5", "--repeats", 2, "--port", "bench:?seed=3")
        assert pulsetrainer(tmp_path, *words).code == 0
    before, after = (
        pt.evaluate(pt.load(tmp_path / f"{name}.h5")).waveforms[0].compensated for name in ("before", "after")
    )
    assert after.mean_abs_error_percent < 0.5 * before.mean_abs_error_percent
    assert pulsetrainer(tmp_path, "plot", "refined.h5", "-o", "refined.png").code == 0
    shown = pulsetrainer(tmp_path, "show", "refined.h5", "--json")
    assert f"pass {kept} of {len(passes)}" in str(shown.json)


def test_a_first_pass_alone_gains_nothing_and_says_so(tmp_path):
    """No error fell: the drive is kept as it was."""
    done = pulsetrainer(tmp_path, "refine", KEPT / "drive.h5", "--passes", 1, "-o", "refined.h5")
    assert done.code == 0, done.err
    tells(done.err, "nothing gained")


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("drive.h5", "--port", "bench:?break=force-zero@0"), 4),
        (("drive.h5", "--port", "bench:?break=force-frozen@2"), 4),
        (("drive.h5", "--passes", "0"), 2),
        (("model.h5",), 3),
        (("drive.h5", "--port", "bench:?nonsense=1"), 2),
    ],
    ids=["no sensor", "stuck sensor", "no pass", "a model", "no such bench"],
)
def test_what_cannot_be_refined_writes_nothing(tmp_path, words, code):
    """Exit code and an empty folder."""
    done = pulsetrainer(tmp_path, "refine", KEPT / words[0], *words[1:], "-o", "refined.h5")
    assert done.code == code, done.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "code"),
    [((), 0), (("--passes", "0"), 2), (("--limit-current", "1"), 3), (("--limit-force", "5"), 4)],
)
def test_a_dry_run_says_what_refining_would_play_and_fails_as_it(tmp_path, words, code):
    """No port is opened: that it is absent does not matter; nothing is written."""
    words = ("refine", KEPT / "drive.h5", "-o", "refined.h5", *words)
    done = pulsetrainer(tmp_path, *words, "--dry-run", "--port", "/dev/absent", "--json")
    assert done.code == code, done
    if code:
        assert pulsetrainer(tmp_path, *words).code == code
    else:
        drive = pt.load(KEPT / "drive.h5")
        assert done.json["dry_run"] is True
        assert done.json["peak_current_A"] == pytest.approx(float(drive.compensated.max()))
    assert list(tmp_path.iterdir()) == []


def test_what_is_learnt_stays_below_the_limit_in_force(tmp_path):
    """A drive that the limit just lets through is refined to its end: what it lacks in current stays."""
    drive = pt.load(KEPT / "drive.h5")
    low = replace(drive, compensated=0.5 * drive.compensated)
    limit = float(low.compensated.max()) + 1e-4
    pt.save(replace(low, predicted=drive.model.predict(low.compensated, 1e-3)), tmp_path / "low.h5")
    words = ("refine", "low.h5", "-o", "out.h5", "--passes", 2, "--limit-current", limit, "--json")
    done = pulsetrainer(tmp_path, *words)
    assert done.code == 0, done.err
    assert len(done.json["passes"]) == 2
    assert pt.load(tmp_path / "out.h5").compensated.max() <= limit


@pytest.mark.slow
def test_what_was_learnt_is_asked_for_in_another_pulse(tmp_path):
    """A refined drive gives its share: the error of another pulse, noise included, falls by a third."""
    port, model = ("--port", "bench:"), ("--model", KEPT / "model.h5")
    jobs = (
        ("invert", "normal", *model, "-o", "normal.h5"),
        ("refine", "normal.h5", "-o", "refined.h5", *port),
        ("invert", "bifid", *model, "-o", "before.h5"),
        ("invert", "bifid", *model, "--learnt", "refined.h5", "-o", "after.h5"),
    )
    for words in jobs:
        done = pulsetrainer(tmp_path, *words)
        assert done.code == 0, done.err
    errors = []
    for name in ("before", "after"):
        assert pulsetrainer(tmp_path, "play", f"{name}.h5", "-o", f"{name}-played.h5", *port).code == 0
        played = pt.load(tmp_path / f"{name}-played.h5")
        errors.append(pt.evaluate(played).waveforms[0].compensated.mean_abs_error_percent)
    assert pt.load(tmp_path / "after.h5").inversion == "transferred"
    assert "by the model, which lacks what was learnt" in " ".join(done.out.split())
    assert errors[1] < errors[0] / 1.5


def test_a_drive_that_was_not_refined_has_nothing_to_give(tmp_path):
    """Exit 3, nothing written."""
    words = ("invert", "bifid", "--model", KEPT / "model.h5", "--learnt", KEPT / "drive.h5")
    done = pulsetrainer(tmp_path, *words, "-o", "bifid.h5", "--json")
    assert (done.code, done.json["error"]["kind"]) == (3, "data")
    assert list(tmp_path.iterdir()) == []


def test_a_limit_below_the_drive_is_named_with_what_helps(tmp_path):
    """Before anything is played: the current, the limit in force, and both ways out."""
    words = ("refine", KEPT / "drive.h5", "-o", "r.h5", "--limit-current", 0.4)
    done = pulsetrainer(tmp_path, *words)
    refusal(done, 3, "limit below the model's range", limit="0.4", got="1.2")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("passes", [1, 2])
def test_what_was_learnt_is_kept_when_it_is_stopped(passes):
    """From the second pass on the error carries the best drive; after the first there is nothing."""
    told = []

    def stop(share):
        told.append(share)
        if len(told) == passes:
            raise KeyboardInterrupt

    with pt.open_device("bench:?seed=3") as device, pytest.raises(Interrupted) as caught:
        pt.refine(pt.load(KEPT / "drive.h5"), device, progress=stop)
    kept = caught.value.kept
    assert (kept is None) == (passes == 1)
    if kept is not None:
        assert (len(kept.passes), kept.kept, kept.inversion) == (2, 2, "refined")


def test_a_drive_for_another_device_is_told(run, tmp_path):
    """By the serial number of its model; on its own device nothing is said."""
    model = pt.load(KEPT / "model.h5")
    pt.save(pt.invert("normal", replace(model, serial="BENCH-0"), periods=1), tmp_path / "drive.h5")
    for seed, told in ((0, False), (4, True)):
        for verb in ("play", "refine"):
            given = ("--passes", 1) if verb == "refine" else ("--repeats", 1)
            done = run(verb, "drive.h5", "-o", f"{verb}-{seed}.h5", *given, "--port", f"bench:?seed={seed}")
            assert done.code == 0, done.err
            assert ("the model is of BENCH-0, but this is BENCH-4" in done.err) is told
