"""The program: one typer command per module; heavy imports wait until a command runs."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Annotated, Any

import typer
from typer import Option

from pulsetrainer.cli import guard, settings
from pulsetrainer.cli.help_text import Program
from pulsetrainer.cli.naming import Command
from pulsetrainer.files import settings as setting_files
from pulsetrainer.report.spelling import speak_any_encoding
from pulsetrainer.version import __version__

# Plain help: drawing it with rich would cost a third of the time until it shows.
app = typer.Typer(
    name="pulsetrainer",
    cls=Program,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

# one module each, with a function of its name, in the order of the help; `import` is a word of Python's
_COMMANDS = (
    "capture", "import_", "identify", "invert", "play", "evaluate", "compare", "diagnose", "extend",
    "correct", "export", "session", "refine", "check", "tune", "show", "plot", "ports", "doctor",
)  # fmt: skip
for _name in _COMMANDS:
    _module = import_module(f"pulsetrainer.cli.{_name}")
    app.command(_name.rstrip("_"), cls=Command)(getattr(_module, _name))


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"pulsetrainer {__version__}")
        raise typer.Exit


@app.callback()
def root(
    context: typer.Context,
    version: Annotated[
        bool, Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    settings_file: Annotated[
        str | None,
        Option(
            "--settings",
            help="File of settings; default: pulsetrainer.toml here, or in the user's configuration.",
        ),
    ] = None,
    debug: Annotated[bool, Option("--debug", help="Show the whole traceback of an error.")] = False,
    verbose: Annotated[bool, Option("--verbose", help="Say on stderr what is being done.")] = False,
) -> None:
    """Make a hysteretic solenoid press a true arterial pulse: capture, identify, invert, play, evaluate."""
    if context.resilient_parsing or {"-h", "--help"} & set(sys.argv):
        return  # help and completion need no settings, and a bad file must not hide them
    file = setting_files.find(settings_file, os.environ)
    context.obj = file
    if file is not None:
        program: Any = context.command
        context.default_map = settings.defaults(setting_files.read(file), program.commands)


def main() -> None:
    """Run the program and exit with its code."""
    # many small products: threads of BLAS that wait for each other take two to three times as long, and ten
    # times on a busy computer; who wants them sets the variable
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ["MPLBACKEND"] = "agg"  # figures are written, never shown: no display, no toolkit is needed
    guard.end_like_ctrl_c()
    speak_any_encoding()
    guard.hush_libraries(sys.argv)
    sys.exit(guard.funnel(app, sys.argv[1:]))
