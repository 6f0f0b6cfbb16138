"""The contract of the command line: JSON keys, quiet pipes, bars on a terminal, make, an installed wheel."""

from __future__ import annotations

import os
import pty
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from program import PROGRAM, cold, program_on_path, pulsetrainer

ROOT = Path(__file__).resolve().parents[2]
WAVEFORM_KEYS = {"mean_abs_error_percent", "max_abs_error_percent"}


@pytest.mark.slow
def test_identify_reports_the_agreed_keys(as_built):
    """levels, cells, offset, fit, coverage, iterations, seconds."""
    done = pulsetrainer(as_built, "identify", "run.h5", "-o", "again.h5", "--json")
    document = done.json
    assert document["schema"] == 1
    assert document["command"] == "identify"
    assert document["levels"] == 48
    assert document["cells"] == 1176
    assert document["coverage_percent"] == 100.0
    assert 0 < document["fit_rms_percent"] < 1
    assert {"offset", "fit_rms", "iterations", "seconds"} <= set(document)


def test_evaluate_reports_the_agreed_keys(built_small):
    """Of a playback: both drives and the reduction; of a run: every model with its gain over the first."""
    done = pulsetrainer(built_small, "evaluate", "played-normal-continuous.h5", "--json")
    (waveform,) = done.json["waveforms"]
    assert set(waveform["scaled"]) >= WAVEFORM_KEYS
    assert set(waveform["compensated"]) >= WAVEFORM_KEYS
    assert "mean_error_reduction_percent" in waveform
    models = ["--model", "model-relay.h5", "--model", "model-continuous.h5"]
    done = pulsetrainer(built_small, "evaluate", "run.h5", *models, "--json")
    relay, continuous = done.json["models"]
    assert {"rms", "rms_percent", "max_percent", "gain_percent"} <= set(relay)
    assert relay["gain_percent"] == 0.0
    assert continuous["gain_percent"] == pytest.approx(100 * (1 - continuous["rms"] / relay["rms"]))
    assert continuous["gain_percent"] > 30


def test_show_and_plot_take_every_kind(built_small):
    """run, model, waveform, playback, evaluation."""
    kinds = {
        "run.h5": "run",
        "model-relay.h5": "model",
        "drive-normal-relay.h5": "waveform",
        "played-normal-relay.h5": "playback",
        "evaluation-relay.h5": "evaluation",
    }
    for name, kind in kinds.items():
        shown = pulsetrainer(built_small, "show", name, "--json").json
        assert shown["kind"] == kind
        assert any("capture identification" in line for line in shown["history"])
        assert pulsetrainer(built_small, "show", name).code == 0
        done = pulsetrainer(built_small, "plot", name, "-o", f"{name}.png")
        assert done.code == 0, done
        assert (built_small / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    done = pulsetrainer(built_small, "plot", "run.h5", "--overwrite", "--json")
    assert done.json["output"] == "run.png"  # beside it, when no name is given
    assert (built_small / "run.png").read_bytes().startswith(b"\x89PNG")


def test_show_tells_the_error_that_a_drive_is_expected_to_have(built_small):
    """As ``invert`` told it; of a playback the same."""
    made = ["invert", "normal", "--model", "model-relay.h5", "-o", "again.h5"]
    told = pulsetrainer(built_small, *made, "--json").json["predicted_max_error_percent"]
    for name in ("again.h5", "played-normal-relay.h5"):
        shown = pulsetrainer(built_small, "show", name, "--json").json["facts"]
        assert shown["predicted_max_error_percent"] == pytest.approx(told)
    assert "max error expected, % of full force" in pulsetrainer(built_small, "show", "again.h5").out


def test_a_pipe_gets_no_bar_and_a_terminal_does(tmp_path):
    """Progress is for people: nothing of it in a pipe, a moving bar on a terminal, none with --json."""
    words = ["capture", "identification", "--levels", "6", "--speed", "12", "--overwrite", "-o", "run.h5"]
    done = pulsetrainer(tmp_path, *words)
    assert done.err == ""
    assert "\x1b" not in done.out
    for extra, bar in (([], True), (["--json"], False)):
        ours, theirs = pty.openpty()
        process = subprocess.Popen(
            [*PROGRAM, *words, *extra],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=theirs,
            env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
        )
        os.close(theirs)
        seen = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # Linux: the other end was closed
                break
            if not part:
                break
            seen += part
        process.communicate()
        os.close(ours)
        assert process.returncode == 0
        assert (b"capturing" in seen) is bar, seen


@pytest.mark.slow
def test_make_redoes_only_what_is_stale(tmp_path):
    """The demo as file rules: nothing twice; a changed pulse redoes that pulse and the report."""
    make = shutil.which("make")
    assert make, "make is part of the set-up"
    venv = tmp_path / "venv"
    venv.mkdir()
    (venv / "bin").symlink_to(program_on_path())
    (venv / "installed").touch()
    build = tmp_path / "demo"
    words = [make, "-C", str(ROOT), "demo", f"D={build}", f"VENV={venv}", "-o", str(venv / "installed")]
    clean = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")}
    first = subprocess.run(words, capture_output=True, text=True, check=False, env=clean)
    assert first.returncode == 0, first.stderr
    assert (build / "report.html").stat().st_size > 100_000
    assert "reduction of the mean error" in first.stdout

    def planned(*more: str) -> list[str]:
        done = subprocess.run([*words, "-n", *more], capture_output=True, text=True, check=True, env=clean)
        return [line.split()[1] for line in done.stdout.splitlines() if "/bin/pulsetrainer" in line]

    tables = ["evaluate", "evaluate"]  # of the pulses, and of the models on an unseen run
    assert planned() == tables, "only the tables are printed again"
    methods = ["paper", "continuous", "extended"]
    assert sorted(planned("-W", "waveforms/bifid.csv")) == sorted(
        ["invert", "play"] * len(methods) + ["evaluate", *tables]
    )


@pytest.mark.slow
def test_a_wheel_carries_firmware_and_waveforms(tmp_path):
    """Away from the checkout the package still builds its bench and knows its pulses."""
    build = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--wheel-dir",
        str(tmp_path),
        str(ROOT),
    ]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("pulsetrainer-*.whl")
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    (page,) = site.glob("*.data/data/share/man/man1/pulsetrainer.1")
    assert page.read_text() == (ROOT / "docs" / "pulsetrainer.1").read_text()
    env = {"PYTHONPATH": str(site)}
    where = [sys.executable, "-c", "import pulsetrainer; print(pulsetrainer.__file__)"]
    found = subprocess.run(
        where, cwd=tmp_path, capture_output=True, text=True, check=True, env={**os.environ, **env}
    )
    assert found.stdout.startswith(str(site)), "the wheel is what runs"
    env["XDG_CACHE_HOME"] = str(tmp_path / "cache")  # so that the firmware is compiled from the wheel
    for words in (
        ["capture", "identification", "--speed", "12", "--levels", "12", "-o", "run.h5"],
        ["identify", "run.h5", "--levels", "12", "-o", "model.h5"],
        ["invert", "bifid", "--model", "model.h5", "-o", "drive.h5"],
    ):
        done = cold(tmp_path, *words, env=env)
        assert done.code == 0, done
    assert list((tmp_path / "cache").rglob("host-*")), "the bench was built in the cache"
