"""Settings: flag over environment over file over default; what is unknown is refused, what held is stored."""

from __future__ import annotations

import json
import tomllib

import h5py
import pytest
import typer

from pulsetrainer.cli.app import app
from pulsetrainer.cli.settings import defaults, takers
from pulsetrainer.errors import UsageError
from pulsetrainer.files import settings
from pulsetrainer.files.settings import SETTINGS
from wording import refusal

PLAN = ("capture", "identification", "--dry-run", "--json", "-o", "run.h5")


def test_flag_over_environment_over_file_over_default(run, tmp_path):
    """Each layer hides the ones below it."""
    env = {"PULSETRAINER_CURRENT_MAX_A": "1.1"}
    assert run(*PLAN).json["peak_current_A"] == pytest.approx(1.5)
    (tmp_path / "pulsetrainer.toml").write_text("current_max_A = 1.2\n")
    assert run(*PLAN).json["peak_current_A"] == pytest.approx(1.2)
    assert run(*PLAN, env=env).json["peak_current_A"] == pytest.approx(1.1)
    assert run(*PLAN, "--current-max", "1", env=env).json["peak_current_A"] == pytest.approx(1.0)


def test_a_file_can_be_named(run, tmp_path):
    """By flag and by environment; one that is not there is an error."""
    (tmp_path / "lab.toml").write_text("current_max_A = 0.9\n")
    assert run("--settings", "lab.toml", *PLAN).json["peak_current_A"] == pytest.approx(0.9)
    env = {"PULSETRAINER_SETTINGS": "lab.toml"}
    assert run(*PLAN, env=env).json["peak_current_A"] == pytest.approx(0.9)
    lost = run("--settings", "nowhere.toml", *PLAN)
    refusal(lost, 2, "no file of settings", file="nowhere.toml")
    assert lost.json["command"] == "capture"


@pytest.mark.parametrize(
    ("text", "name", "names"),
    [
        ("lvels = 3\n", "no such setting", {"got": "lvels", "next": "levels"}),
        ("zzz = 3\n", "no such setting", {"got": "zzz", "next": "port"}),
        ("levels = 4.5\n", "not such a setting", {"got": "levels = 4.5", "expected": "whole number"}),
        ("levels = true\n", "not such a setting", {"got": "levels = ", "expected": "whole number"}),
        ("rate_Hz = 0\n", "not such a setting", {"got": "rate_Hz = 0", "expected": "Hz above 0"}),
        ("rate_Hz = nan\n", "not such a setting", {"got": "rate_Hz = nan", "expected": "Hz above 0"}),
        ("port = 3\n", "not such a setting", {"got": "port = 3", "expected": "text"}),
        ("port = \n", "not TOML", {}),
    ],
)
def test_a_wrong_setting_is_refused(run, tmp_path, text, name, names):
    """Exit 2, the file and the key named, the next step."""
    (tmp_path / "pulsetrainer.toml").write_text(text)
    refusal(run(*PLAN), 2, name, **names)
    assert run("capture", "--help").code == 0  # help does not need the file


@pytest.mark.parametrize(
    ("text", "then"),
    [
        ("current_max_A = 1,2\n", "with a point: current_max_A = 1.2"),
        ('[limits]\nport = "bench:"\n', "put port above [limits]"),
        ("levels = 4\nlevels = 5\n", "remove one of the two"),
        ("levels = 4.5\n", "levels = 48"),
        ("rate_Hz = 0\n", "rate_Hz = 1000.0"),
    ],
)
def test_a_slip_in_the_file_is_told_with_its_remedy(run, tmp_path, text, then):
    """A decimal comma, and a setting below the heading of a table; the line is shown."""
    (tmp_path / "pulsetrainer.toml").write_text(text)
    done = run(*PLAN)
    assert done.code == 2
    assert then in done.err.partition("  try: ")[2]
    assert "," not in text or text.strip() in done.err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "levels = 1\n",
            "levels in pulsetrainer.toml (for --levels) must be a whole number from 2 to 10000, got 1",
        ),
        ('port = ""\n', "port in pulsetrainer.toml (for --port) must name a port, got nothing"),
        ("[limits]\nforce_N = 500\n", "(limits.force_N in pulsetrainer.toml)"),
    ],
)
def test_a_wrong_value_of_the_file_is_not_laid_on_an_option(run, tmp_path, text, said):
    """Nobody typed the option, so leaving it out is no advice; where it is typed, it is not the file's."""
    (tmp_path / "pulsetrainer.toml").write_text(text)
    done = run(*PLAN)
    assert said in done.err
    assert "try: correct it there, or give --" in done.err
    assert "pulsetrainer.toml" not in run(*PLAN, "--levels", "0").err or "levels" not in text


def test_a_setting_that_is_there_twice_is_told_with_its_line(run, tmp_path):
    """In words, not in those of the reader of TOML."""
    (tmp_path / "pulsetrainer.toml").write_text("levels = 4\nlevels = 5\n")
    assert "pulsetrainer.toml sets levels a second time in line 2: levels = 5" in run(*PLAN).err


def test_a_wrong_variable_is_named(run):
    """Nobody typed --levels."""
    done = run(*PLAN, env={"PULSETRAINER_LEVELS": "many"})
    assert done.code == 2
    assert "the variable PULSETRAINER_LEVELS (for --levels) must be a whole number" in done.err
    assert "unset PULSETRAINER_LEVELS" in done.err


@pytest.mark.parametrize(
    ("name", "then"),
    [
        ("PULSETRAINER_LIMIT_FORCE_N", "did you mean PULSETRAINER_LIMITS_FORCE_N?"),
        ("pulsetrainer_port", "did you mean PULSETRAINER_PORT?"),
        ("PULSETRAINER_COLOUR", "the variables are PULSETRAINER_SETTINGS, PULSETRAINER_PORT"),
    ],
)
def test_a_variable_that_is_no_setting_is_refused(run, name, then):
    """A misspelt limit of the force was ignored, and the device pressed with its own."""
    done = run(*PLAN, env={name: "8"})
    assert done.code == 2
    assert f"the environment variable {name} is not a setting\n  try: {then}" in done.err
    assert f"unset {name}" in done.err


def test_effective_values_are_in_the_provenance(run, tmp_path):
    """Those of the file too: what was in force can be read off the artefact."""
    (tmp_path / "pulsetrainer.toml").write_text(
        "levels = 6\ncurrent_max_A = 0.5\nspeed_A_per_s = 3\n[limits]\ncurrent_A = 0.6\n"
    )
    assert run("capture", "identification", "-o", "run.h5").code == 0
    assert run("identify", "run.h5", "-o", "model.h5").code == 0
    with h5py.File(tmp_path / "run.h5") as file:
        captured = json.loads(file.attrs["provenance"])["parameters"]
    assert captured["levels"] == 6
    assert captured["current_max_A"] == 0.5
    assert captured["limit_current_A"] == 0.6
    with h5py.File(tmp_path / "model.h5") as file:
        identified = json.loads(file.attrs["provenance"])["parameters"]
    assert identified["levels"] == 6


def test_limits_are_in_force_on_the_device(run, tmp_path):
    """What goes beyond is refused before anything moves; a force beyond switches off."""
    capture = ("capture", "identification", "--json")
    lowered = run(*capture, "--limit-current", "0.4", "--current-max", "0.5", "-o", "a.h5")
    refusal(lowered, 3, "beyond the limit", limit="0.4", got="0.5")
    assert "--limit-current to 0.5" in lowered.err
    never = run(*capture, "--current-max", "12", "-o", "a.h5")
    refusal(never, 3, "beyond the limit", limit="1.5", got="12")
    assert "--limit-current" not in never.err, "no device allows 12 A"
    refusal(run(*capture, "--limit-force", "5", "-o", "b.h5"), 4, "tripped while conditioning")
    refusal(run(*capture, "--limit-current", "9", "-o", "c.h5"), 3, "limit raised")


def test_dry_run_touches_nothing(run, tmp_path):
    """No port is opened, no file written, and an output that exists is still refused."""
    done = run("capture", "diagnostic", "--dry-run", "--port", "/dev/ttyNOWHERE", "-o", "run.h5")
    assert done.code == 0, done
    assert list(tmp_path.iterdir()) == []
    plan = run("capture", "diagnostic", "--dry-run", "--json", "-o", "run.h5").json
    assert plan["dry_run"] is True
    assert 80 < plan["seconds"] < 120
    assert plan["peak_current_A"] <= 1.5
    (tmp_path / "run.h5").write_text("mine")
    assert run(*PLAN).code == 2


@pytest.mark.parametrize(("signal", "noted"), [("identification", False), ("diagnostic", True)])
def test_an_option_that_does_not_count_is_told(run, signal, noted):
    """The diagnostic signal has its own speeds: --speed was taken in silence."""
    done = run("capture", signal, "--speed", "3", "--dry-run", "-o", "out.h5")
    assert done.code == 0
    assert ("--speed does not count here" in done.err) == noted


def test_levels_of_a_signal_that_has_its_own_are_told(run):
    """They were taken in silence, and count for the plane alone."""
    done = run("capture", "diagnostic", "--levels", "12", "--dry-run", "-o", "out.h5")
    assert done.code == 0
    assert "--levels does not count here but for the count of cells" in done.err


def test_a_home_that_may_not_be_looked_into_is_told(monkeypatch):
    """As root everything may be, so the system's answer is made up."""

    def refuse(_path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.is_file", refuse)
    with pytest.raises(UsageError) as caught:
        settings.find(None, {})
    assert "no permission to look for settings in" in caught.value.message
    assert "HOME" in caught.value.hint


@pytest.mark.parametrize(("speed", "noted"), [("31", False), ("32", True)])
def test_a_signal_that_skips_levels_is_told(run, speed, noted):
    """1.5 A over 48 levels at 1000 samples a second: a level is 0.03125 A."""
    done = run("capture", "identification", "--speed", speed, "--dry-run", "-o", "out.h5")
    assert done.code == 0
    assert ("past a level of 0.0312 A: lower --speed, or raise --rate" in done.err) == noted


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("0,0.5\n1,0.5\n2,0.5\n", "the current stays at 0.5 A: no model can be identified"),
        ("0,0\n0.01,1.2\n1,0\n", "moves at up to 120 A/s, and a coil as delivered follows at up to 100"),
        ("0,0\n0.0125,1.2\n1,0\n", ""),
    ],
)
def test_a_signal_that_tells_little_is_told(run, tmp_path, table, said):
    """Of a constant, or of what no coil follows; nothing of the others."""
    (tmp_path / "own.csv").write_text(f"t_s,current_A\n{table}")
    done = run("capture", "own.csv", "--dry-run", "-o", "out.h5")
    assert done.code == 0
    assert said in done.err
    assert ("note:" in done.err) is bool(said)


def test_dry_run_of_a_play_is_what_the_play_does(run, tmp_path):
    """Duration and peak current of the plan are those of the playback."""
    short = ("--levels", "8", "--current-max", "1", "--speed", "3")
    assert run("capture", "identification", *short, "-o", "run.h5").code == 0
    assert run("identify", "run.h5", "--levels", "8", "--smoothing", "0", "-o", "model.h5").code == 0
    assert run("invert", "normal", "--model", "model.h5", "-o", "drive.h5").code == 0
    plan = run("play", "drive.h5", "--repeats", "2", "--dry-run", "--json", "-o", "played.h5").json
    assert not (tmp_path / "played.h5").exists()
    played = run("play", "drive.h5", "--repeats", "2", "--json", "-o", "played.h5").json
    assert plan["seconds"] == pytest.approx(played["seconds"], rel=1e-3)
    assert plan["samples"] == played["samples"]
    with h5py.File(tmp_path / "played.h5") as file:
        peak = max(file["compensated/reference"][()].max(), file["scaled/reference"][()].max())
    assert plan["peak_current_A"] == pytest.approx(peak, abs=2e-4)


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda one: one.key)
def test_the_example_of_a_setting_is_what_the_commands_take_without_it(setting):
    """Who obeyed it got a capture of thirteen samples."""
    parameters = [p for one in typer.main.get_command(app).commands.values() for p in one.params]
    usual = [p.default for p in parameters if p.envvar == setting.variable and p.default is not None]
    value = tomllib.loads(f"usual = {setting.usual}")["usual"]
    assert type(value) is setting.kind
    assert set(usual) <= {value}


def test_every_setting_reaches_all_commands_that_take_it():
    """A limit, a port: wherever there is the option; the first command of each setting is named here."""
    commands = typer.main.get_command(app).commands
    plays = {name for name, one in commands.items() if {p.name for p in one.params} & {"limit_force_N"}}
    assert plays == {"capture", "play", "session", "refine", "check", "tune", "doctor"}
    reach = {one.key: set(takers(one, commands)) for one in SETTINGS}
    assert reach["limits.current_A"] == reach["limits.force_N"] == plays
    assert reach["port"] == plays
    assert reach["levels"] == {"capture", "identify"}
    assert {key for key, names in reach.items() if not names} == set()
    given = defaults({"limits.force_N": 5.0, "port": "bench:"}, commands)
    assert given["session"] == {"limit_force_N": 5.0, "port": "bench:"}
    assert given["doctor"] == given["session"]


def test_every_variable_of_an_option_is_that_of_a_setting():
    """The table of settings names all of them; --html of a session had one of its own."""
    commands = typer.main.get_command(app).commands.values()
    variables = {one.envvar for command in commands for one in command.params if one.envvar}
    assert variables == {one.variable for one in SETTINGS}


def test_verbose_says_what_is_done_on_stderr(run):
    """Each step with its time; stdout stays the same."""
    words = ("capture", "identification", "--levels", "4", "--speed", "3", "--current-max", "0.5", "--json")
    done = run(*words, "-o", "run.h5", "--verbose")
    assert done.code == 0
    assert done.json["samples"] > 0
    assert "firmware" in done.err
    assert "conditioning" in done.err
    quiet = run(*words, "-o", "run2.h5")
    assert quiet.err == ""
