"""Tables and lines of text: what a screen, a pipe and a notebook's ``print`` show of figures."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from typing import Any

from pulsetrainer.report.names import NAMES, digits, split, told

ESCAPE = re.compile(r"\x1b\[[0-9;]*m")
_BROAD = 10_000  # as wide as the table needs: figures are never cut
_NARROWEST = 24  # beside a lead; less, and the lines go on further left


@dataclass(frozen=True, slots=True)
class Facts:
    """Names and values, one a line; what is None is left out."""

    title: str
    rows: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Table:
    """A table: the first column is text, the others are numbers or words."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]


def picked(noun: Any, *names: str) -> dict[str, Any]:
    """Return some attributes by name."""
    return {name: getattr(noun, name) for name in names}


def folded(lead: str, text: str, width: int | None, indent: int | None = None) -> str:
    """Return a line, folded between words to a width; None: not folded."""
    if width is None or len(lead) + len(text) <= width:
        return lead + text
    if indent is None:
        indent = len(lead) if width - len(lead) >= _NARROWEST else 4
        if len(lead) + len(text.partition(" ")[0]) > width:  # the lead is the first words of the text
            text, lead = " ".join([*lead.split(), text]), lead[: -len(lead.lstrip()) or None]
    return textwrap.fill(
        text,
        width,
        initial_indent=lead,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def drawn(title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a table, no wider than its figures, without blanks at the ends of its lines."""
    # half a tenth of a second, which a command without a table need not wait
    from rich import box  # noqa: PLC0415
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1))
    for number, name in enumerate(columns):
        words = number == 0 or name == "unit" or any(text(row[number])[:1].isalpha() for row in rows)
        table.add_column(Text(name), justify="left" if words else "right", no_wrap=True)
    for row in rows:
        table.add_row(*(Text(text(cell)) for cell in row))
    # in a notebook the text is part of a page: nothing is to be shown beside it
    console = Console(width=_BROAD, markup=False, highlight=False, force_jupyter=False)
    with console.capture() as captured:
        console.print(table)
    lines = [line.rstrip() for line in captured.get().splitlines()]
    while lines and not ESCAPE.sub("", lines[0]).strip():
        lines.pop(0)
    return "\n".join([title, *lines]) + "\n"


def listed(title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> Iterator[str]:
    """Yield a table as a list: each row's name, below it its figures with the names of their columns."""
    heads = [name.replace("-\n", "-").replace("\n", " ") for name in columns]
    width = max((len(head) for head in heads[1:]), default=0)
    yield from title.splitlines()
    for row in rows:
        yield f"  {text(row[0])}"
        for head, cell in zip(heads[1:], row[1:], strict=True):
            if cell not in (None, ""):
                yield f"    {cell}" if head == "unit" else f"    {head:<{width}}  {text(cell)}"


def rendered(part: Facts | Table, width: int | None = None) -> str:
    """Return facts or a table as lines that fit a ``width``: facts are folded, a table becomes a list."""
    if isinstance(part, Table):
        lines = drawn(part.title, part.columns, part.rows)
        if width is not None and max(map(len, ESCAPE.sub("", lines).splitlines())) > width:
            words = ((line, line.lstrip()) for line in listed(part.title, part.columns, part.rows))
            indents = ((line[: -len(said)], said) for line, said in words)
            lines = "\n".join(folded(lead, said, width, len(lead) + 2) for lead, said in indents) + "\n"
        return lines
    named = [(label(name), _told(name, value)) for name, value in part.rows.items() if value is not None]
    longest = max((len(name) for name, _ in named), default=0)
    if width is not None and 2 * longest + 8 > width:  # no room beside the names: below them
        rows = [folded(*one, width) for name, value in named for one in (("  ", name), ("    ", value))]
    else:
        rows = [folded(f"  {name:<{longest}}  " if longest else "  ", value, width) for name, value in named]
    return "\n".join([folded("", part.title, width, indent=2), *rows, ""])


def _told(name: str, value: Any) -> str:
    """Return a value as a person reads it: a long time, a low rate also in other units."""
    said = text(told(name, value))
    unit = {"seconds": "s", "rate_Hz": "Hz"}.get(name)
    if unit is None:
        return said
    from pulsetrainer.artefacts.units import more_easily  # noqa: PLC0415  # with it comes numpy

    return " = ".join(filter(None, (said, more_easily(value, unit))))


def label(name: str) -> str:
    """Return the name of a figure as a person writes it, its unit behind a comma."""
    owner, named = split(name)
    if name.rpartition(".")[2] in NAMES:
        return (f"{owner}: " if owner else "") + ", ".join(filter(None, named))
    for ending, unit in (("_percent", "%"), ("_Hz", "Hz")):
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')}, {unit}"
    # the heading of a column of somebody's table stays as it is: U_a, input (Spannung U_a)
    return name.replace("_", " ") if name.islower() and "(" not in name else name


def text(value: Any) -> str:
    """Return a value as a cell of a table; what is not known, None or NaN, is a dash."""
    if value is None or (isinstance(value, float) and isnan(value)):
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return digits(value) if abs(value) < 1e5 else f"{value:.3g}"
    if isinstance(value, list | tuple):
        return ", ".join(text(item) for item in value) or "none"
    return str(value)
