"""What a command may write: never over its own inputs, and under a name that says what the file holds."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import suppress
from os.path import realpath  # a link to itself is refused when it is read
from pathlib import Path

import typer

from pulsetrainer.errors import EndingError, UsageError
from pulsetrainer.files.output_name import FORMATS, check_artefact_name, free, is_no_file

_IN_PLACE = {"refine"}  # what it writes takes the place of what it was given
_WRITE_NO_ARTEFACT = {"compare", "export", "plot"}
_FIGURES = ("png", "svg", "pdf")


def check_keeps_inputs(outputs: Sequence[Path], inputs: Sequence[Path], context: typer.Context) -> None:
    """Refuse an output that is an input of the command as well: it would be lost."""
    in_place = context.info_name in _IN_PLACE
    for path in () if in_place and context.params["overwrite"] else outputs:
        if any(realpath(path) == realpath(given) for given in inputs):
            raise UsageError(
                f"{path} is what {context.info_name} works on and would be lost"
                + ": it cannot be the output" * (not in_place),
                hint=f"name another file, such as {shlex.quote(str(free(path)))}"
                + ", or give --overwrite to replace it" * in_place,
            )


def check_ending(path: Path, context: typer.Context) -> None:
    """Refuse an output whose name promises another format than it gets."""
    command, ending = context.info_name, path.suffix.lower()
    if str(path) == str(context.params.get("html")):
        print_it = "; a browser prints it to PDF" * (ending == ".pdf")
        _check_text(path, "a page is written as HTML", ".html", print_it)
    elif command == "tune":
        _check_text(path, "settings are written as TOML", ".toml", "")
    elif command not in _WRITE_NO_ARTEFACT:
        then = "; pulsetrainer export makes a table of it, and pulsetrainer plot a figure"
        if ending == ".html" and "html" in context.params:
            then = f", and the page with --html {path}"
        check_artefact_name(path, f"{command} writes HDF5", then=then)


def _check_text(path: Path, what: str, right: str, then: str) -> None:
    """Refuse the ending of another format: by it a browser, or a person, knows the file."""
    ending = path.suffix.lower()
    if is_no_file(path):
        return
    if ending in FORMATS | {""} and not (ending and right.startswith(ending)):  # .htm is a page too
        raise EndingError(path, what, right, then=then)


def figure_format(path: Path, what: str, *more: str) -> str:
    """Return the format that the name of a figure asks for; ``more`` are those that are no figures.

    EndingError where it is none of them.
    """
    form, known = path.suffix.lower().lstrip("."), (*_FIGURES, *more)
    if form in known:
        return form
    with suppress(OSError):  # a folder is refused later, by its own words
        if path.is_dir():
            return _FIGURES[0]
    written_as = f"{what} is written as {', '.join(known[:-1])} or {known[-1]}"
    raise EndingError(path, written_as, ".png", usual="figure")
