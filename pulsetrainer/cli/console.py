"""What a command shows, on stdout, stderr and terminal; and its exit when a quality gate failed."""

from __future__ import annotations

import json
import math
import re
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from pulsetrainer.errors import QualityError
from pulsetrainer.report import tables
from pulsetrainer.steps.progress import Progress

if TYPE_CHECKING:
    from rich.console import RenderableType

_PIPE_WIDTH = 110
# commands, which a person copies
_COMMAND = re.compile(r"`[^`]*`|(?:\b\w+=\S+ )?\bpulsetrainer(?: (?:[^,;()`]|,(?=\S))*|$)")
_KEPT = "\0"  # stands for a blank at which no line may end


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: paths as text, NaN and infinity as null, dataclasses as objects."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return plain(value.tolist()) if hasattr(value, "tolist") else value  # an array: no numpy to ask here


def say(lead: str, text: str) -> None:
    """Write a line to stderr, on a terminal folded between words; a command in it stays in one piece."""
    width = shutil.get_terminal_size().columns if sys.stderr.isatty() else None
    whole = _COMMAND.sub(lambda command: command[0].replace(" ", _KEPT), text)
    sys.stderr.write(tables.folded(lead, whole, width, indent=2).replace(_KEPT, " ") + "\n")


def shows_unicode() -> bool:
    """Tell whether stderr, where live views are drawn, can show more than ASCII."""
    return (sys.stderr.encoding or "").lower().startswith("utf")


@contextmanager
def drawing() -> Iterator[Callable[[RenderableType], None]]:
    """Give what draws on the terminal, each time in the place of what it drew before; gone at the end."""
    from rich.console import Console
    from rich.live import Live

    with Live(console=Console(stderr=True), transient=True, auto_refresh=False) as screen:
        yield lambda drawn: screen.update(drawn, refresh=True)


class Screen:
    """The screen of one command."""

    def __init__(self, command: str, *, as_json: bool) -> None:
        self.command = command
        self.as_json = as_json
        self.is_terminal = sys.stdout.isatty()
        self.width = shutil.get_terminal_size().columns if self.is_terminal else _PIPE_WIDTH

    @contextmanager
    def bar(self, label: str) -> Iterator[Progress]:
        """Give a callable that takes the share of the work done; on a terminal it moves a bar."""
        if self.as_json or not sys.stderr.isatty():
            yield lambda _share: None
            return
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        # how far it is comes first: a narrow terminal cuts off what comes last
        said = TextColumn("{task.percentage:3.0f} % {task.description}", markup=False)
        columns = (said, BarColumn(), TimeRemainingColumn())
        with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
            task = bars.add_task(label, total=1.0)
            yield lambda share: bars.update(task, completed=min(share, 1.0))

    def result(self, payload: Any, failed: QualityError | None = None) -> None:
        """Write the one JSON object of this command, a mapping or a dataclass, when it was asked for.

        It includes the quality gate that ``failed``; to a person ``end`` tells it.
        """
        if self.as_json:
            document = {"schema": 1, "command": self.command} | plain(payload)
            if failed is not None:
                document["error"] = tables.picked(failed, "kind", "message", "hint")
            is_utf8 = (sys.stdout.encoding or "").lower().replace("-", "") == "utf8"
            sys.stdout.write(json.dumps(document, ensure_ascii=not is_utf8) + "\n")

    def end(self, failed: QualityError | None) -> None:
        """Exit with the code of a quality gate that failed, after everything was said; None: none did."""
        if failed is not None:
            sys.stdout.flush()  # in a pipe what is wrong would come before what was found
            typer.echo(f"error: {failed.message}\n  try: {failed.hint}", err=True)
            raise typer.Exit(failed.exit_code)

    def parts(self, parts: Iterable[tables.Facts | tables.Table]) -> None:
        """Print facts and tables, unless JSON was asked for."""
        for part in () if self.as_json else parts:
            sys.stdout.write(tables.rendered(part, self.width if self.is_terminal else None))

    def facts(self, title: str, rows: Mapping[str, Any]) -> None:
        """Print names and values, one a line, unless JSON was asked for."""
        self.parts([tables.Facts(title, rows)])

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        """Print a table, unless JSON was asked for; the first column is text, the others are numbers.

        Where the terminal is too narrow for it: the same, one figure a line.
        """
        self.parts([tables.Table(title, columns, rows)])

    def line(self, lead: str, text: str) -> None:
        """Print a line; on a terminal that is too narrow, on several, broken between words below ``lead``."""
        self.whole(tables.folded(lead, text, self.width if self.is_terminal else None))

    def whole(self, text: str) -> None:
        """Print a line that is never folded, since a path or a command in it is copied in one piece."""
        if not self.as_json:
            sys.stdout.write(text + "\n")
