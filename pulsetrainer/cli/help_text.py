"""Help that fits the terminal: lines are folded between words, on a narrow terminal too."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from typing import Any

import typer

from pulsetrainer.report.tables import folded

_WIDEST = 78  # longer lines are harder to read
_NARROWEST = 16
_BESIDE = 24  # letters that a meaning needs beside its name; less, and it stands below
_Formatter: Any = typer.Context.formatter_class


class Folded(_Formatter):  # type: ignore[misc] # the parser's own one, wherever typer keeps it
    """The parser's help, which at less than 50 columns would break words."""

    def __init__(self, **given: Any) -> None:
        columns = shutil.get_terminal_size().columns - 2
        super().__init__(**given | {"width": max(min(columns, _WIDEST), _NARROWEST)})

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write how the command is called."""
        self.write(folded(prefix or "Usage: ", f"{prog} {args}", self.width) + "\n")

    def write_text(self, text: str) -> None:
        """Write paragraphs."""
        lead = " " * self.current_indent
        paragraphs = (" ".join(one.split()) for one in text.split("\n\n"))
        self.write("\n\n".join(folded(lead, one, self.width, len(lead)) for one in paragraphs) + "\n")

    def write_dl(self, rows: Sequence[tuple[str, str]], col_max: int = 30, col_spacing: int = 2) -> None:
        """Write names with their meanings beside them, or below them where there is no room."""
        lead = " " * self.current_indent
        column = min(max(len(name) for name, _ in rows), col_max) + col_spacing
        if self.width - column - len(lead) < _BESIDE:
            column = 2
        for name, meaning in rows:
            beside = len(name) + col_spacing <= column
            head = f"{lead}{name:<{column}}" if beside else " " * (len(lead) + column)
            if not beside:
                self.write(folded(lead, name, self.width, len(lead) + 2) + "\n")
            self.write(folded(head, meaning, self.width, len(head)).rstrip() + "\n")


class HelpContext(typer.Context):
    """A context whose help is folded between words."""

    formatter_class = Folded


class Program(typer.core.TyperGroup):
    """The program, with its list of commands."""

    context_class = HelpContext
