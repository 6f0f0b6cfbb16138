"""What `doctor` finds: each trouble with its fix, nothing where there is none."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from program import PROGRAM, pulsetrainer
from pulsetrainer import doctor
from pulsetrainer.simulation import build
from wording import tells


def _named(done):
    return {one["name"]: one for one in done.json["findings"]}


def test_a_sound_bench_has_no_findings(run):
    """Everything that is looked at is named, and in order."""
    done = run("doctor", "--port", "bench:", "--json")
    assert done.code == 0, done
    found = _named(done)
    for name in ("versions", "compiler", "folder", "settings", "device", "link", "force noise", "saturation"):
        assert found[name]["state"] == "ok", found[name]
    assert done.json["problems"] == 0
    assert "numpy" in found["versions"]["found"]
    assert "firmware" in found["device"]["found"]
    tells(found["current tracking"]["found"], "follows half the range")


@pytest.mark.parametrize(
    ("setting", "name", "state"),
    [
        ("saturation=6", "saturation", "problem"),
        ("noise=0.02", "force noise", "warning"),
        ("wire=0.002&wire-seed=2", "link", "warning"),
    ],
)
def test_troubles_of_the_device_are_found(run, setting, name, state):
    """A force that is cut off, a noisy sensor, a bad wire."""
    done = run("doctor", "--port", f"bench:?{setting}", "--json")
    finding = _named(done)[name]
    assert finding["state"] == state, finding
    assert finding["found"]
    assert finding["fix"]
    assert done.code == (1 if state == "problem" else 0)


def test_lost_samples_are_no_noise_of_the_current(run):
    """What comes behind them is later than its place in the list: the way down was taken for noise."""
    lossy, whole = (
        _named(run("doctor", "--port", f"bench:?{wire}", "--json"))["current noise"]
        for wire in ("wire=0.0001", "wire=0")
    )
    said = [float(one["found"].split()[0]) for one in (lossy, whole)]
    assert said[0] == pytest.approx(said[1], rel=0.1)


def test_the_gains_of_tune_are_in_force(run):
    """A coil on which the delivered gains ring is followed, and it is said which gains are in force."""
    coil = "bench:?resistance=3&inductance=0.008&supply=24"
    assert run("tune", "--port", coil, "-o", "tuned.toml", "--json").code == 0
    for words, state in (((), "warning"), (("--settings", "tuned.toml"), "ok")):
        found = _named(run(*words, "doctor", "--port", coil, "--json"))
        assert found["current tracking"]["state"] == state
        assert ("tuned.toml" in found["gains"]["found"]) == bool(words)


def test_the_limits_of_the_settings_hold(run, tmp_path):
    """It pressed 6.3 N where the file allowed 3, and told the device's own limits as those in force."""
    (tmp_path / "pulsetrainer.toml").write_text("[limits]\ncurrent_A = 1.0\nforce_N = 3.0\n")
    found = _named(run("doctor", "--port", "bench:", "--json"))
    assert found["device"]["found"].endswith("limits 1 A and 3 N")
    assert "force above its limit" in found["short capture"]["found"]
    gentle = _named(run("doctor", "--port", "bench:", "--limit-current", 0.3, "--json"))
    assert gentle["saturation"]["found"].startswith("none up to 0.3 A")


@pytest.mark.parametrize("broken", ["current-zero", "stuck-on"])
def test_a_fault_that_ends_the_look_has_a_fix(run, broken):
    """A frozen current sensor was a problem without one, and the advice was to follow the fixes."""
    found = _named(run("doctor", "--port", f"bench:?break={broken}@0.5", "--json"))
    assert found["short capture"]["fix"]


def test_an_absent_port_is_a_problem_with_a_fix(run):
    """As text, as a person reads it; nothing is captured."""
    done = run("doctor", "--port", "/dev/ttyNOWHERE")
    assert done.code == 1
    assert "PROBLEM  device" in done.out
    assert "fix: " in done.out
    assert "link" not in done.out
    found = [re.match(r"\S+ +\S.*?  +", line) for line in done.out.splitlines() if line[:1].isalpha()]
    assert len({one.end() for one in found if one}) == 1  # below one another


def test_in_one_pipe_what_was_found_comes_before_what_is_wrong():
    """The count of the problems stood above the list of them."""
    words = [*PROGRAM, "doctor", "--port", "/dev/ttyNOWHERE"]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.stdout.index("PROBLEM  device") < done.stdout.index("error: ")


def test_a_parameter_of_another_port_is_told_as_it_is_typed(run):
    """The option is --port here, though in Python it is an argument."""
    done = run("doctor", "--port", "qemu:?seed=3")
    assert done.code == 1
    assert "--port: the emulated device (qemu:) has no parameter 'seed'" in done.out
    assert '--port "bench:?seed=3' in done.out
    assert "`port`" not in done.out


def test_without_a_compiler_the_fix_is_named(run, tmp_path):
    """An empty PATH: no compiler, no emulator."""
    done = run(
        "doctor", "--no-capture", "--json", env={"PATH": str(tmp_path), "CC": "", "PULSETRAINER_PORT": "x"}
    )
    found = _named(done)
    if found["compiler"]["state"] == "ok":
        assert "ziglang" in found["compiler"]["found"]
    else:
        assert "apt install" in found["compiler"]["fix"]
    assert found["emulator"]["state"] == "warning"
    assert "apt install" in found["emulator"]["fix"]


def test_a_compiler_that_python_brings_is_named(monkeypatch):
    """The first word of its command is Python's, which says nothing."""
    monkeypatch.setattr(build, "find_compiler", lambda: ["/opt/python", "-m", "ziglang", "cc"])
    (found,) = doctor._compiler()
    assert found.found == "/opt/python -m ziglang cc, for the virtual bench"


def test_a_folder_that_cannot_be_written_is_a_problem():
    """Said before an hour of capture has nowhere to go; not even root may write in /proc."""
    done = pulsetrainer(Path("/proc"), "doctor", "--no-capture", "--json")
    found = _named(done)["folder"]
    assert found["state"] == "problem"
    assert "/proc" in found["found"]
    assert found["fix"]
    assert done.code == 1


def test_no_capture_leaves_the_coil_alone(run):
    """Only who the device is."""
    found = _named(run("doctor", "--port", "bench:", "--no-capture", "--json"))
    assert "device" in found
    assert "link" not in found
