"""``tune`` from the command line: its figures, the file of settings, and who uses it."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import pulsetrainer as pt
from pulsetrainer.device.limits import Limits
from pulsetrainer.files.tuning import write_tuned
from wording import refusal

KEYS = {"resistance_ohm", "inductance_H", "gains", "tracking_percent", "settle_ms", "overshoot_percent"}
MINE = '# mine\nlevels = 12  # few\n\n[limits]\ncurrent_A = 1.5\n\n[tuned."OTHER"]\npid_kp = 1\n'
COIL = "bench:?resistance=4&inductance=0.08&supply=18"


def test_the_contract(run, tmp_path):
    """Every key; the file has gains and measurement under the serial number; its owner's words stay."""
    (tmp_path / "pulsetrainer.toml").write_text(MINE)
    done = run("tune", "--port", COIL, "-o", "pulsetrainer.toml", "--json")
    assert done.code == 0, done.err
    assert set(done.json) >= KEYS
    assert set(done.json["tracking_percent"]) == {"before", "after"}
    text = (tmp_path / "pulsetrainer.toml").read_text()
    assert text.startswith(MINE)
    entry = tomllib.loads(text)["tuned"]["BENCH-0"]
    assert entry == done.json["gains"] | {
        name: done.json[name] for name in ("resistance_ohm", "inductance_H")
    }


def test_a_dry_run_says_what_is_played_and_touches_nothing(run, tmp_path):
    """Steps, currents and times as in the tuning itself, at the limit in force; no port, no file."""
    words = ("tune", "--limit-current", 1.2, "-o", "pulsetrainer.toml")
    plan = run(*words, "--dry-run", "--json", "--port", "/dev/absent").json
    assert list(tmp_path.iterdir()) == []
    assert (plan["dry_run"], plan["current_limit_A"], plan["peak_current_A"]) == (True, 1.2, 1.2)
    assert plan["seconds"] == pytest.approx(sum(step["seconds"] for step in plan["steps"]))
    with pt.open_device("bench:", limits=Limits(1.2)) as device:
        played, play = [], device.play

        def noted(reference, rate_Hz, **more):
            played.append((np.size(reference) / rate_Hz, float(np.max(reference))))
            return play(reference, rate_Hz, **more)

        device.play = noted
        pt.tune(device)
    looks = len(played) - len(plan["steps"]) + 1  # the first look is a play for each try
    assert looks > 1
    planned = [(step["seconds"], step["peak_A"]) for step in plan["steps"]]
    assert played[0] == pytest.approx(planned[0])
    assert sum(seconds for seconds, _ in played[1 : 1 + looks]) <= planned[1][0]
    for (seconds, peak_A), one in zip(played[1 + looks :], plan["steps"][2:], strict=True):
        assert seconds == pytest.approx(one["seconds"], abs=2e-3)
        assert one["what"] == "coil" or peak_A == pytest.approx(one["peak_A"])  # a hold's is a duty
    assert run(*words, "--dry-run").code == 0


def test_a_dry_run_refuses_gains_that_are_there(run, tmp_path):
    """Where the port tells which device it is; of another one it is said which devices the file knows."""
    (tmp_path / "pulsetrainer.toml").write_text('[tuned."BENCH-0"]\npid_kp = 1\n')
    words = ("tune", "-o", "pulsetrainer.toml", "--dry-run", "--json")
    refused = run(*words)
    assert (refused.code, refused.json["error"]["kind"]) == (2, "usage")
    assert run(*words, "--overwrite").code == 0
    elsewhere = run(*words, "--port", "/dev/absent")
    assert (elsewhere.code, "BENCH-0" in elsewhere.err) == (0, True)
    assert "BENCH-0" not in run(*words, "--port", "/dev/absent", "--overwrite").err


def test_a_coil_is_measured_below_a_lowered_limit_that_its_duty_would_pass(run):
    """A duty goes over the wire as a current: what the limit cuts off of it is done without."""
    done = run("tune", "--port", "bench:?resistance=24", "--limit-current", 0.5, "--json")
    assert done.code == 0, done.err
    assert done.json["resistance_ohm"] == pytest.approx(24.0, rel=0.01)


def test_a_limit_that_leaves_no_current_to_measure_is_refused(run):
    """Before anything is driven, and in a dry run."""
    for more in ((), ("--dry-run",)):
        done = run("tune", "--limit-current", 0.04, "--json", *more)
        refusal(done, 3, "too small a range to tune", limit="0.04", least="0.05")


def test_an_earlier_entry_is_replaced_only_if_asked(run, tmp_path):
    """Refused before anything is measured; with --overwrite that entry changes and nothing else."""
    path = tmp_path / "pulsetrainer.toml"
    path.write_text(MINE.replace("[limits]", '[tuned."BENCH-0"]\npid_kp = 1\n\n[limits]'))
    before = path.read_bytes()
    refused = run("tune", "--port", COIL, "-o", "pulsetrainer.toml", "--json")
    assert (refused.code, refused.json["error"]["kind"]) == (2, "usage")
    assert path.read_bytes() == before
    assert "--overwrite" in refused.json["error"]["hint"]
    assert "the rest of the file stays" in refused.json["error"]["hint"]
    done = run("tune", "--port", COIL, "-o", "pulsetrainer.toml", "--json", "--overwrite")
    assert done.code == 0, done.err
    tree = tomllib.loads(path.read_text())
    assert tree["tuned"]["BENCH-0"]["pid_kp"] == done.json["gains"]["pid_kp"]
    assert (tree["levels"], tree["limits"], tree["tuned"]["OTHER"]) == (12, {"current_A": 1.5}, {"pid_kp": 1})
    assert "# mine\nlevels = 12  # few" in path.read_text()


def test_the_gains_survive_a_restart_of_the_host(run, tmp_path):
    """A capture on that coil tracks with the file and does not without."""
    assert run("tune", "--port", COIL, "-o", "bench.toml", "--json").code == 0
    worst = {}
    for settings in ((), ("--settings", "bench.toml")):
        words = ("--port", COIL, "-o", "run.h5", "--overwrite", "--levels", 4, "--speed", 20)
        done = run(*settings, "capture", "identification", *words)
        assert done.code == 0, done.err
        assert ("bench.toml" in done.err) is bool(settings)
        run_of = pt.load(tmp_path / "run.h5")
        worst[settings] = np.quantile(np.abs(run_of.input - run_of.reference), 0.8)  # corners aside
    assert worst["--settings", "bench.toml"] < 0.5 * worst[()]


def test_gains_of_another_device_are_not_used_and_it_is_said(run, tmp_path):
    """The serial number decides."""
    (tmp_path / "pulsetrainer.toml").write_text(
        '[tuned."OTHER"]\npid_kp = 1\npid_ki = 1\nfeed_resistance = 1\nfeed_inductance = 1\nfeed_offset = 1\n'
    )
    done = run("capture", "identification", "-o", "run.h5", "--levels", 4, "--speed", 20)
    assert done.code == 0, done.err
    assert "OTHER" in done.err
    assert "BENCH-0" in done.err


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        ("pid_kp = 99999\npid_ki = 1\nfeed_resistance = 1\nfeed_inductance = 1\nfeed_offset = 1\n", 2),
        ("pid_kp = 5\n", 2),
        ('pid_kp = "x"\n', 2),
    ],
)
def test_a_damaged_entry_is_refused_before_anything_is_driven(run, tmp_path, entry, code):
    """Out of range, half of it missing, or no number."""
    (tmp_path / "pulsetrainer.toml").write_text(f'[tuned."BENCH-0"]\n{entry}')
    done = run("capture", "identification", "-o", "run.h5", "--json")
    assert (done.code, done.json["error"]["kind"]) == (code, "usage")
    assert not (tmp_path / "run.h5").exists()


@pytest.mark.parametrize(
    ("device", "said"),
    [
        ("resistance=100000", "no coil"),
        ("resistance=0.1&inductance=0.0001", "shorted"),
        ("resistance=10&supply=9", "(voltage)"),
        ("condition-offset=1.6", "where nothing should press"),
    ],
    ids=["no coil", "a shorted coil", "a saturated supply", "a finger on it"],
)
def test_what_went_wrong_writes_nothing(run, tmp_path, device, said):
    """Exit 4, the reason, and no file."""
    done = run("tune", "--port", f"bench:?{device}", "-o", "pulsetrainer.toml", "--json")
    assert (done.code, done.json["error"]["kind"]) == (4, "device")
    assert said in done.json["error"]["message"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "before", ["", "\n# mine\n[identify]\n\nlevels = 12  # few\n", "[tuned.B]\nohm = 2.0\n"]
)
@pytest.mark.parametrize("blank", ["", "\n\n"])
def test_an_entry_takes_the_place_of_the_one_before_it(tmp_path, before, blank):
    """One blank line above it, however many there were; everything else stays, to the letter."""
    path = tmp_path / "own.toml"
    path.write_text(before + blank)
    for ohm in (5.0, 6.25):
        write_tuned(path, "A", {"ohm": ohm, "henry": 0.02}, overwrite=True)
        assert path.read_text() == before + "\n" * bool(before) + f'[tuned."A"]\nohm = {ohm}\nhenry = 0.02\n'
