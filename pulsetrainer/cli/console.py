"""What a command shows: results on stdout, progress and notes on stderr, bars only on a terminal."""

from __future__ import annotations

import json
import math
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pulsetrainer.flows.context import Context, Progress

_PIPE_WIDTH = 110


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
    return value


class Screen:
    """The screen of one command."""

    def __init__(self, command: str, *, as_json: bool) -> None:
        self.command = command
        self.as_json = as_json
        self.width = shutil.get_terminal_size().columns if sys.stdout.isatty() else _PIPE_WIDTH

    def note(self, text: str) -> None:
        """Say one line to the person, beside the results."""
        sys.stderr.write(f"note: {text}\n")

    @contextmanager
    def working(self, label: str) -> Iterator[Context]:
        """Give a flow its context, with a progress bar when stderr is a terminal."""
        with self._bar(label) as progress:
            yield Context(argv=sys.argv[1:], now=lambda: datetime.now(UTC), progress=progress, note=self.note)

    @contextmanager
    def _bar(self, label: str) -> Iterator[Progress]:
        if self.as_json or not sys.stderr.isatty():
            yield lambda _share: None
            return
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
        with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
            task = bars.add_task(label, total=1.0)
            yield lambda share: bars.update(task, completed=min(share, 1.0))

    def result(self, payload: Any) -> None:
        """Write the one JSON object of this command, a mapping or a dataclass, when it was asked for."""
        if self.as_json:
            document = {"schema": 1, "command": self.command} | plain(payload)
            sys.stdout.write(json.dumps(document, ensure_ascii=False) + "\n")

    def facts(self, title: str, rows: Mapping[str, Any]) -> None:
        """Print names and values, one a line, unless JSON was asked for."""
        if self.as_json:
            return
        width = max((len(name) for name in rows), default=0)
        lines = [
            title,
            *(f"  {name.replace('_', ' '):<{width}}  {_text(value)}" for name, value in rows.items()),
        ]
        sys.stdout.write("\n".join(lines) + "\n")

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        """Print a table, unless JSON was asked for; the first column is text, the others are numbers."""
        if self.as_json:
            return
        from rich import box
        from rich.console import Console
        from rich.table import Table
        from rich.text import Text

        table = Table(title=Text(title), title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1))
        for number, name in enumerate(columns):
            table.add_column(Text(name), justify="right" if number else "left", no_wrap=not number)
        for row in rows:
            table.add_row(*(Text(_text(cell)) for cell in row))
        Console(width=self.width, markup=False, highlight=False).print(table)


def _text(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.2f}" if 0.1 <= abs(value) < 1e5 or value == 0 else f"{value:.3g}"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value) or "none"
    return str(value)
