"""Settings: what a bench's owner writes once into pulsetrainer.toml instead of on every command line.

A flag wins over the environment, the environment over the file, the file over the default. The file is
``--settings FILE``, else PULSETRAINER_SETTINGS, else ``pulsetrainer.toml`` in the folder one works in,
else the one in the user's own configuration folder; files are not mixed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pulsetrainer.errors import UsageError
from pulsetrainer.files.input_file import permit

FILE_NAME = "pulsetrainer.toml"
_OURS = "PULSETRAINER_"  # what all our variables begin with
VARIABLE = f"{_OURS}SETTINGS"
_TOML_LINES = {
    "settings": 'port = "/dev/ttyUSB0"',
    "bounds": '"normal.continuous.mean_error_reduction_percent" = [90, 100]',
}


@dataclass(frozen=True, slots=True)
class Setting:
    """One key of the file; the options of its environment variable take its value."""

    key: str  # dotted where it is in a table of the file
    kind: type
    unit: str
    what: str
    usual: str  # as it is written in the file

    @property
    def variable(self) -> str:
        """Environment variable of the same meaning."""
        return variable(self.key)


def variable(key: str) -> str:
    """Environment variable of a key: ``limits.current_A`` is PULSETRAINER_LIMITS_CURRENT_A."""
    return _OURS + key.upper().replace(".", "_")


SETTINGS = (
    Setting("port", str, "", "the device", '"bench:"'),
    Setting("levels", int, "", "levels of the plane", "48"),
    Setting("current_max_A", float, "A", "top of the range of a capture", "1.5"),
    Setting("speed_A_per_s", float, "A/s", "speed of identification", "0.75"),
    Setting("rate_Hz", float, "Hz", "sample rate", "1000.0"),
    Setting("slew_A_per_s", float, "A/s", "fastest that a drive may move", "30.0"),
    Setting("periods", int, "", "periods of a pulse", "4"),
    Setting("repeats", int, "", "how often a drive is played", "5"),
    Setting("limits.current_A", float, "A", "highest current that the device accepts", "1.5"),
    Setting("limits.force_N", float, "N", "force above which the device switches off", "15.0"),
)


def find(named: str | None, environment: Mapping[str, str]) -> Path | None:
    """Return the file of settings that counts, or None.

    UsageError where one is named that is not there, or a variable of ours is no setting.
    """
    _check_variables(environment)
    if named is not None and not named.strip():
        raise UsageError(
            "--settings must name a file, got an empty name", hint="leave it out, or name the file"
        )
    chosen = named or environment.get(VARIABLE)
    if chosen:
        if not Path(chosen).is_file():
            is_what = "is a folder" if Path(chosen).is_dir() else "does not exist"
            raise UsageError(
                f"the settings file {chosen} {is_what}",
                hint="check its name, or leave --settings out"
                if named
                else f"check its name, or unset the variable {VARIABLE}",
            )
        return Path(chosen)
    from platformdirs import user_config_path  # noqa: PLC0415 - a file that is named needs no search

    places = (Path(FILE_NAME), user_config_path("pulsetrainer", appauthor=False) / FILE_NAME)
    try:
        return next((place for place in places if place.is_file()), None)
    except PermissionError as error:
        raise UsageError(
            f"you have no permission to look for settings in {places[1].parent}",
            hint="check that the variable HOME is your own folder, or name a file: --settings FILE",
        ) from error


def _check_variables(environment: Mapping[str, str]) -> None:
    """Refuse a misspelt variable: a force limit that is ignored presses a finger."""
    known = {name.removeprefix(_OURS): name for name in (VARIABLE, *(one.variable for one in SETTINGS))}
    for name in environment:
        if name.upper().startswith(_OURS) and name not in known.values():
            near = _nearest(name.upper().removeprefix(_OURS), known)
            meant = (
                f"did you mean {known[near]}?" if near else f"the variables are {', '.join(known.values())};"
            )
            raise UsageError(
                f"the environment variable {name} is not a setting",
                hint=f"{meant} take it away: unset {name}",
            )


def _nearest(name: str, known: Iterable[str]) -> str:
    """Return the known name that is most like another; empty where none is."""
    import difflib  # noqa: PLC0415 - needed by a mistake only

    return next(iter(difflib.get_close_matches(name, known, n=1, cutoff=0.5)), "")


def read_toml(path: Path | str, what: str = "settings") -> dict[str, Any]:
    """Return the content of a file of settings, say; UsageError where it cannot be read, or is no TOML."""
    import tomllib  # noqa: PLC0415 - most benches have no such file

    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        if isinstance(error, PermissionError):
            raise UsageError(f"you have no permission to read {path}", hint=permit(path)) from error
        if isinstance(error, UnicodeDecodeError):
            raise UsageError(
                f"{path} has no {what} in it: it is not a text file",
                hint=f"name another file, of lines such as: {_TOML_LINES[what]}",
            ) from error
        line = _line_of(error, path)
        if "overwrite" in str(error):  # as the reader of TOML calls what stands there twice
            number = re.search(r"line \d+", str(error))
            raise UsageError(
                f"{path} sets {line.partition('=')[0].strip()} a second time in "
                f"{number[0] if number else 'it'}: {line}",
                hint="remove one of the two",
            ) from error
        comma = re.fullmatch(r"\s*(\S+\s*=\s*-?\d+),(\d+)\s*", line)
        raise UsageError(
            f"the {what} in {path} cannot be read: {error}" + (f": {line.strip()}" if line else ""),
            hint=f"write the number with a point: {comma[1]}.{comma[2]}"
            if comma
            else "put text with backslashes in single quotes"
            if "\\" in line
            else f"write it as TOML, one {what.rstrip('s')} a line, such as: {_TOML_LINES[what]}",
        ) from error


def _line_of(error: Exception, path: Path | str) -> str:
    """Return the line that a reader of TOML stumbled over; empty where it tells of none."""
    at = re.search(r"\(at line (\d+), ", str(error))
    return Path(path).read_text(encoding="utf-8").splitlines()[int(at[1]) - 1] if at else ""


def read(path: Path) -> dict[str, Any]:
    """Return the settings of a file by dotted key.

    UsageError where the file cannot be read, is no TOML, has a key that is not known, or a value of the wrong
    type.
    """
    tree = read_toml(path)
    tree.pop("tuned", None)  # what `tune` wrote: looked at when a device is opened
    return {key: _value(path, key, value) for key, value in leaves(tree)}


def leaves(tree: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    """Return the values in a TOML file, each with its key; tables in tables are joined by dots."""
    found: list[tuple[str, Any]] = []
    for name, value in tree.items():
        found += leaves(value, f"{above}{name}.") if isinstance(value, dict) else [(above + name, value)]
    return found


def _value(path: Path, key: str, value: Any) -> Any:
    known = {setting.key: setting for setting in SETTINGS}
    if key not in known:
        near = _nearest(key, known)
        hint = f"did you mean {_in_its_table(near)}?" if near else f"the settings are {', '.join(known)}"
        table, _, name = key.rpartition(".")
        if name in known:
            hint = f"put {name} above [{table}]: all that is below that line belongs to [{table}]"
        raise UsageError(f"{path} sets {key!r}, which is not a setting", hint=hint)
    setting = known[key]
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if setting.kind is float and number:
        value = float(value)
    if type(value) is not setting.kind or (isinstance(value, int | float) and not value > 0):
        wanted = {str: "text", int: "a whole number above 0", float: f"a number of {setting.unit} above 0"}
        name, usual, how = key.rpartition(".")[2], setting.usual, "write, for instance,"
        if setting.kind is not str and re.fullmatch(r"\d+(\.\d+)?" * isinstance(value, str), str(value)):
            usual, how = value, "remove the quotes:"
        raise UsageError(
            f"{path} sets {key} = {value!r}; it must be {wanted[setting.kind]}",
            hint=f"{how} {_in_its_table(key, f'{name} = {usual}')}",
        )
    return value


def _in_its_table(key: str, words: str = "") -> str:
    """Return a key, or ``words`` of it, as written in the file: ``current_A under [limits]``."""
    table, _, name = key.rpartition(".")
    return (words or name) + (f" under [{table}]" if table else "")


def effective(file: Path | None, environment: Mapping[str, str]) -> list[tuple[Setting, Any, str]]:
    """Return every setting that is set, its value, and where it comes from: environment or file."""
    values = read(file) if file else {}
    rows = []
    for setting in SETTINGS:
        if setting.variable in environment:
            rows.append((setting, environment[setting.variable], setting.variable))
        elif setting.key in values:
            rows.append((setting, values[setting.key], str(file)))
    return rows
