"""Write the reference: ``python docs/make.py`` writes the pages that are made from the code.

They are read off the code: the commands off the program's own parser, the format off the annotations that
the store writes by, the verdict off the stages of the diagnosis, the architecture off the imports, the decisions off their titles. ``--check`` writes nothing and exits 1 where a page is not what the code says.
"""  # noqa: INP001 - a folder of pages with its script, not a package

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from api_reference import api_page
from architecture import architecture_page
from demo import readme
from verdict import verdict_page

from pulsetrainer.artefacts import KINDS
from pulsetrainer.cli.app import app
from pulsetrainer.cli.settings import takers
from pulsetrainer.files.schema import FieldPlan, plan_of
from pulsetrainer.files.settings import SETTINGS, VARIABLE
from pulsetrainer.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator

HERE = Path(__file__).parent
MARK = "<!-- made by `make docs` from the code: change the code, not this page -->"


# --- commands ---------------------------------------------------------------------------------------------
COMMANDS = """\
# Commands

{mark}

`pulsetrainer COMMAND --help` shows the same on the screen. Results go to stdout, progress and notes to stderr. Progress bars appear
only on a terminal; with `NO_COLOR` set there are no colours. No command replaces a file without `--overwrite`.

With `--json` a command writes one object to stdout: `{{"schema": 1, "command": ..., ...}}`, and for an error
`"error": {{"kind", "message", "hint"}}`.

| exit code | what happened |
|---|---|
{codes}

`pulsetrainer --install-completion` teaches your shell the commands and options, `--show-completion` shows how.
"""


CODES = {
    0: "success",
    1: "a quality gate failed: a bound of `evaluate --bounds`, or a problem that `doctor` found",
    2: "wrong command line or settings, or an output that already exists",
    3: "something is wrong with an artefact or its data",
    4: "something is wrong with the device or the line to it",
    5: "a fit or an inverse did not converge",
    70: "a bug in this program: `--debug` shows where",
    130: "you stopped it",
    141: "the reader of the output went away, as `head` does: the rest was not printed, and may not have been done",
}
SETTINGS_WORDS = """\
Options set in `pulsetrainer.toml` need not be typed. The file is the one that `--settings` or `PULSETRAINER_SETTINGS` names, or
the one in the folder where you work, or the one in your own configuration folder. An option overrides the environment, the
environment the file, and the file the default; an unknown key is an error. A dot in a key stands for a table of the file:
`limits.force_N` is `force_N` under `[limits]`.
"""


def commands_page() -> str:
    """Return the reference of every command and option."""
    root: Any = typer.main.get_command(app)
    listed = [f"[{name}](#{name})" for name in root.commands]
    codes = "\n".join(f"| {code} | {what} |" for code, what in CODES.items())
    parts = [
        COMMANDS.format(mark=MARK, codes=codes),
        ", ".join(listed) + "\n",
        *_options(root, of="every command"),
    ]
    for name, command in root.commands.items():
        parts += [
            f"## {name}\n",
            *_description(command.help),
            *_arguments(command),
            *_options(command, of=name),
        ]
    return "\n".join(parts + _settings(root))


def _description(text: str) -> Iterator[str]:
    for paragraph in text.strip().split("\n\n"):
        line = " ".join(paragraph.split())
        example = line.removeprefix("Example: ")
        yield f"```console\n$ {example}\n```\n" if example != line else f"{line}\n"


def _arguments(command: Any) -> Iterator[str]:
    listed = [p for p in command.params if p.param_type_name == "argument"]
    if listed:
        yield "| argument | what |\n|---|---|"
        for one in listed:
            name = (one.metavar or one.name.upper()).strip("{}[]")
            yield f"| `{_cell(name)}` | {_cell(one.help or '')}{'' if one.required else ' (may be left out)'} |"
        yield ""


def _options(command: Any, *, of: str) -> Iterator[str]:
    yield f"| option of {of} | what | default |\n|---|---|---|"
    for one in command.params:
        if one.param_type_name == "option" and one.name != "help" and not one.hidden:
            names = ", ".join(f"`{name}`" for name in (*one.opts, *one.secondary_opts))
            variable = f" (environment: `{one.envvar}`)" if one.envvar else ""
            yield f"| {names} | {_cell(one.help or '')}{variable} | {_default(one)} |"
    yield ""


def _default(option: Any) -> str:
    if option.required:
        return "must be given"
    value = option.default
    if value is None or value is False or value in ((), []):
        return ""
    if value is True:
        return f"`{option.opts[0]}`" if option.secondary_opts else ""
    return "" if callable(value) or not isinstance(value, str | int | float) else f"{value}"


def _settings(root: Any) -> list[str]:
    rows = [
        f"| `{one.key}` | {one.unit} | {one.what} | "
        + ", ".join(sorted(takers(one, root.commands)))
        + f" | `{one.variable}` |"
        for one in SETTINGS
    ]
    return [
        "## Settings\n",
        SETTINGS_WORDS,
        "| key | unit | what | taken by | environment |\n|---|---|---|---|---|",
        *rows,
        "",
    ]


# --- format -----------------------------------------------------------------------------------------------
FORMAT = """\
# The files

{mark}

Every artefact is one HDF5 file. Any HDF5 reader opens it; axes are dimension scales, so xarray
(`xarray.open_dataset("run.h5", engine="h5netcdf")`) finds them by name, and pint parses every unit.

- **Root attributes**: `kind` ({kinds}), `format_version` (1), `title`, `created` (UTC, ISO 8601), `history` (one line for each
  command, oldest first), `provenance` (JSON: program, version, argv, effective parameters, seed, sha256 of the inputs,
  versions of the libraries, serial number and firmware of the device), `samples` where there is a time axis.
- **Datasets** have the attributes `units` and `quantity` (in words). Numbers are 64-bit floats; yes and no are 8-bit
  integers with the attribute `dtype` = `bool`. NaN stands for a lost sample; drives and the parts of a model
  contain neither NaN nor infinity.
- **Units** come with the data: where a table below gives `input_unit` as the unit, the attribute of that name in the same group holds it.
- **Groups** hold parts; groups named `0000`, `0001`, ... form a list. What is marked *optional* may be missing.
- An axis is the dataset of its name: `time` in seconds, or an index (`level`, `cell`, `repeat`, `group`, `beat`, `question`). Time may be
  missing in a run that was imported without one.
- Files are written under another name and renamed when they are complete: a killed command leaves the old file or none. A
  capture keeps its samples in `NAME.partial` until it ends; stopped by a fault or Ctrl-C, it has `complete` = 0. After a kill
  or a power cut `NAME.partial` is left: every command that reads a run reads it, and `capture --resume` continues it.
  What is left of a session is read as a session, up to where it stopped.

Cells of the Preisach plane are numbered k = i (i + 1) / 2 + j, i >= j: the relays that switch up between levels i and i + 1,
down between levels j and j + 1 ([theory](theory.md)).

`pulsetrainer show FILE.h5` prints what a file holds, `pulsetrainer plot FILE.h5 -o figure.png` draws it.
"""


# attributes have no words of their own in the file
WORDS = {
    "answered": "names answered, question by question",
    "as_measured": "whether the signs of parameters are those of the output as measured",
    "asked": "names asked, question by question",
    "begin_s": "s, start of the record since that of the first one, as if they had been made one after another",
    "captured": "whether it was recorded on our own device",
    "choices": "names that could be answered",
    "detectable_from_percent": "smallest effect that would have shown, rms, % of the span",
    "doubts": "what speaks against a cause that was found, in words",
    "edges_unit": "unit of the edges: that of the input, or of the output of a dual model",
    "false_reversals": "reversals made by noise, taken out of the input before the fit",
    "fault": "why the device stopped early; empty if it did not",
    "stopped_by_key": "where a key stopped the session, in words; empty if none did",
    "form": "direct, dual or signed",
    "learner": "who answered",
    "left_out_rows": "rows of the imported table that lacked a number",
    "loop": "counterclockwise, clockwise, butterfly or none; of a falling output once it is turned to rise",
    "masked_samples": "wild samples, left out of the fit",
    "meaning": "the parameter in words",
    "minor_percent": "cells that minor loops tell apart, % of those within the range; NaN where unknown",
    "notes": "what a person should know about it",
    "offset_unit": "unit of the offset: that of the output, or of the input of a dual model",
    "offsets": "offset of each run's output from their mean; zeros where one offset serves all",
    "period_s": "s, length of one beat",
    "pulses": "names of the pulses",
    "serial": "serial number of the device",
    "spacing": "of the levels: even, or crowded where the loop is steep",
    "state": "the state in words",
    "stiffness": "how alike the density is along the diagonal; 0: it is free",
    "tau_s": "s, time constant of the state",
    "underruns": "times that the reference did not arrive in time",
    "warning": "that this kind of model is the wrong one, in words; empty if it is not",
    "whole": "no while what is left is more than noise",
    "start": "state before the run: known, or which one was estimated",
    "cause": "id of the cause",
    "clipped_samples": "targets outside the reachable range",
    "complete": "whether the recording was not interrupted",
    "confounded_with": "causes that these runs cannot tell apart from it",
    "draws": "refits of the block bootstrap, 0 for none",
    "dropped_samples": "lost on the wire; the others are right",
    "evidence": "reasons for the verdict, in words",
    "explains_percent": "of what can be explained of the squared error",
    "found": "whether it was found",
    "held_out_gain_percent": "of what can be explained, on blocks that were not fitted; NaN where not measured",
    "input_quantity": "what the input is",
    "input_unit": "unit of the input",
    "inversion": "continuous, closest-match, extended, refined or transferred",
    "kept": "number of the pass whose drive this is, from 1; 0 for a drive that was not refined",
    "iterations": "of the solver",
    "model": "of a diagnosis: fingerprint of the model",
    "fingerprint": "digest of the samples",
    "step_s": "s, of the averages that causes were sought in; NaN where there is no time",
    "correctable": "faults of the measurement that were found and can be taken out",
    "corrected": "causes that were taken out of the run",
    "lacks": "what the runs do not have: rates, holds, length",
    "lower": "lower end of the interval",
    "method": "joint or alternating",
    "name": "its name",
    "next_experiment": "what to measure next, in words",
    "output_quantity": "what the output is",
    "output_unit": "unit of the output",
    "p_value": "over the whole library; missing where no null was drawn",
    "polarity": "1; or -1 where the output falls as the input rises",
    "quick": "screened only",
    "repeats": "how often each drive was played",
    "reading": "how the weights are read: continuous or relay",
    "samples": "of the records that were fitted",
    "signal": "the excitation, or the table that was imported",
    "smoothing": "length below which the density was smoothed, share of the input's range",
    "source": "where the shape comes from, in words",
    "text": "the cause in words",
    "unit": "unit of the value",
    "upper": "upper end of the interval",
    "value": "the value",
    "verdict": "id of the strongest cause, none or unknown",
    "weights_unit": "unit of the weights: output over input squared",
}


def format_page() -> str:
    """Return the description of every kind of artefact."""
    parts = [FORMAT.format(mark=MARK, kinds=", ".join(KINDS))]
    parents: list[type] = []
    for kind, cls in KINDS.items():
        parts += [f"## {kind}\n", f"{_first_line(cls)}\n", *_table(cls)]
        parents += [inner for inner in _parts(cls) if inner not in parents]
    parents = [cls for cls in parents if not hasattr(cls, "kind")]
    for cls in parents:
        parts += [f"## Part: {cls.__name__}\n", f"{_first_line(cls)}\n", *_table(cls)]
    return "\n".join(parts)


def _first_line(cls: type) -> str:
    return (cls.__doc__ or "").strip().partition("\n\n")[0].replace("\n", " ")


def _parts(cls: type) -> list[type]:
    """Return the dataclasses that a class is made of, at any depth."""
    direct = [plan.type for plan in plan_of(cls) if plan.role in ("group", "groups")]
    return [found for inner in direct for found in (inner, *_parts(inner))]


def _table(cls: type) -> Iterator[str]:
    yield "| name | holds | axes | units | what |\n|---|---|---|---|---|"
    for plan in plan_of(cls):
        holds = _holds(plan) + (", optional" if plan.optional else "")
        yield f"| `{plan.path}` | {holds} | {' × '.join(plan.dims)} | {_units(plan)} | {_quantity(plan)} |"
    yield ""


def _holds(plan: FieldPlan) -> str:
    names = {float: "float", int: "integer", bool: "yes or no", str: "text"}
    match plan.role:
        case "array":
            return "dataset, yes or no" if plan.type.__name__.startswith("bool") else "dataset"
        case "number":
            return "dataset, one number"
        case "attribute":
            return f"attribute, {names[plan.type]}"
        case "list":
            return f"attribute, list of {names[plan.type]}"
        case "group":
            return f"group: {_link(plan.type)}"
        case "groups":
            return f"list of groups: {_link(plan.type)}"


def _link(cls: type) -> str:
    kind = getattr(cls, "kind", None)
    return f"[{kind}](#{kind})" if kind else f"[{cls.__name__}](#part-{cls.__name__.lower()})"


def _units(plan: FieldPlan) -> str:
    if plan.data is None:
        return ""
    unit = plan.data.units
    return f"`{unit[1:]}`" if unit.startswith("@") else unit


def _quantity(plan: FieldPlan) -> str:
    if plan.data is None:
        return "" if plan.role in ("group", "groups") else WORDS.get(plan.name, plan.name.replace("_", " "))
    words = plan.data.quantity
    return f"as `{words[1:]}` says" if words.startswith("@") else _cell(words)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


# --- the manual page -----------------------------------------------------------------------------------------
# click-man would write one, but not from typer's own parser, and without settings and exit codes.
MANUAL = """\
.\\" made by `make docs` from the code: change the code, not this page
.TH PULSETRAINER 1 "" "pulsetrainer {version}" "User Commands"
.SH NAME
pulsetrainer \\- measure, model, invert, play and evaluate a hysteretic solenoid
.SH SYNOPSIS
.B pulsetrainer
.RI [ OPTION ]...
.I COMMAND
.RI [ ARGUMENT ]...
.SH DESCRIPTION
"""


def manual_page() -> str:
    """Return the manual page, in the macros of man(7)."""
    root: Any = typer.main.get_command(app)
    lines = [MANUAL.format(version=__version__) + _roff(root.help), ".SH OPTIONS", *_listed(root)]
    lines.append(".SH COMMANDS")
    for name, command in root.commands.items():
        lines.append(f".SS {name}")
        for number, paragraph in enumerate(command.help.strip().split("\n\n")):
            line = _roff(paragraph)
            example = line.removeprefix("Example: ")
            lines += [".PP"] if number and example == line else []
            lines += [line] if example == line else [".PP", ".EX", example, ".EE"]
        lines += _listed(command)
    lines += [".SH SETTINGS", _roff(SETTINGS_WORDS)]
    for one in SETTINGS:
        unit = f", {one.unit}" if one.unit else ""
        commands = ", ".join(sorted(takers(one, root.commands)))
        lines += [".TP", f".B {_roff(one.key)}", _roff(f"{one.what}{unit}; for {commands}.")]
    lines.append(".SH ENVIRONMENT")
    for one in SETTINGS:
        lines += [".TP", f".B {_roff(one.variable)}", _roff(f"as {one.key} in the settings.")]
    lines += [".TP", f".B {_roff(VARIABLE)}", "file of settings."]
    lines += [".TP", ".B NO_COLOR", "no colours, whatever its value."]
    lines.append(".SH EXIT STATUS")
    for code, what in CODES.items():
        lines += [".TP", f".B {code}", _roff(what)]
    return "\n".join(lines) + "\n"


def _roff(text: str) -> str:
    """Return words as the macros take them: one line, nothing in it taken for a request."""
    line = " ".join(text.replace("`", "").split()).replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{line}" if line.startswith((".", "'")) else line


def _listed(command: Any) -> Iterator[str]:
    """Yield the arguments and options of a command, each with what it is."""
    for one in command.params:
        if one.name == "help" or getattr(one, "hidden", False):
            continue
        if one.param_type_name == "argument":
            head = f".I {_roff((one.metavar or one.name.upper()).strip('{}[]'))}"
        else:
            head = f".B {_roff(', '.join((*one.opts, *one.secondary_opts)))}"
        default = _default(one) if one.param_type_name == "option" else ""
        said = f" Default: {default}." if default and default != "must be given" else ""
        variable = f" Environment: {one.envvar}." if one.envvar else ""
        yield from (".TP", head, _roff(f"{one.help or ''}{said}{variable}"))


# --- decisions --------------------------------------------------------------------------------------------
DECISIONS = """\
# Decisions

{mark}

A page each: what was decided, why, and what else was tried.

"""


def decisions_page() -> str:
    """Return the list of all decisions."""
    pages = sorted((HERE / "decisions").glob("[0-9]*.md"))
    titles = [page.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ").strip() for page in pages]
    lines = [f"- [{title}]({page.name})\n" for title, page in zip(titles, pages, strict=True)]
    return DECISIONS.format(mark=MARK) + "".join(lines)


PAGES = {
    "commands.md": commands_page,
    "pulsetrainer.1": manual_page,
    "format.md": format_page,
    "decisions/README.md": decisions_page,
    "api.md": lambda: api_page(MARK),
    "how-a-verdict-is-reached.md": lambda: verdict_page(MARK),
    "../ARCHITECTURE.md": lambda: architecture_page(MARK),
    "../README.md": readme,
}


def main() -> int:
    """Write the pages, or with ``--check`` name those that are out of date."""
    stale = []
    for name, make in PAGES.items():
        text, path = make(), HERE / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if "--check" not in sys.argv:
                path.write_text(text, encoding="utf-8")
                print(f"wrote {path.resolve().relative_to(HERE.parent)}")
    if stale and "--check" in sys.argv:
        print(f"out of date: {', '.join(stale)}; run `make docs`", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
