"""``tune`` from the command line: its figures, the file of settings, and who uses it."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import pulsetrainer as pt

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


def test_an_earlier_entry_is_replaced_only_if_asked(run, tmp_path):
    """Refused before anything is measured; with --overwrite that entry changes and nothing else."""
    path = tmp_path / "pulsetrainer.toml"
    path.write_text(MINE.replace("[limits]", '[tuned."BENCH-0"]\npid_kp = 1\n\n[limits]'))
    before = path.read_bytes()
    refused = run("tune", "--port", COIL, "-o", "pulsetrainer.toml", "--json")
    assert (refused.code, refused.json["error"]["kind"]) == (2, "usage")
    assert path.read_bytes() == before
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


def test_what_went_wrong_writes_nothing(run, tmp_path):
    """No coil: exit 4 and no file."""
    done = run("tune", "--port", "bench:?resistance=100000", "-o", "pulsetrainer.toml", "--json")
    assert (done.code, done.json["error"]["kind"]) == (4, "device")
    assert not (tmp_path / "pulsetrainer.toml").exists()
