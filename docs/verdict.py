"""How a verdict is reached: the page, read off the docstrings of the stages and the comments of the thresholds."""  # noqa: INP001 - beside make.py

from __future__ import annotations

import inspect
import re
import textwrap
from typing import TYPE_CHECKING, Any

from pulsetrainer.diagnosis import (
    congruency,
    fitting,
    held_out,
    intervals,
    procedure,
    screening,
    thresholds,
)
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.diagnosis.stages import baseline, raw_data, search

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

VERDICT = """\
# How a verdict is reached

{mark}

`diagnose` asks one question after another. Each stage below is a file of `pulsetrainer/diagnosis/stages`, and what it says here
is what stands at its top; the list itself is `pulsetrainer/diagnosis/procedure.py`. Every number that decides is in one of
the tables at the end, with what it guards. How often the verdict is right is told by [blind.md](blind.md).
"""
METHODS = (screening, fitting, held_out, congruency, intervals)
# name = value  # what it guards
_LINE = re.compile(r"^ *(?P<name>\w+)(?:: [\w\[\], .]+)? = (?P<value>.+?)  # (?P<why>.+)$")
_SECTION = re.compile(r"^    # (?P<title>.+)$")
_BROKEN = re.compile(r"^# (?P<title>.+)$")


def verdict_page(mark: str) -> str:
    """Return the stages, the methods behind them, and the tables of all numbers."""
    full = [inspect.getmodule(stage) for stage, _ in procedure.FULL]
    stages: list[Any] = [raw_data, baseline]
    for module in full:
        stages += [*search.ROUND, module] if module is search else [module]
    quick = [inspect.getmodule(stage) for stage, _ in procedure.QUICK]
    stages += [module for module in quick if module not in stages]
    parts = [VERDICT.format(mark=mark), "## The stages\n"]
    for number, module in enumerate(stages, start=1):
        title, text = _docstring(module)
        parts.append(f"{number}. **{title}.** {textwrap.indent(text, '    ').lstrip()}\n")
    parts.append("## How it is computed\n")
    for module in METHODS:
        title, text = _docstring(module)
        parts.append(f"### {title}\n\n{text}\n")
    parts += ["## The thresholds\n", *_thresholds(), "## The thresholds of each cause\n", *_causes()]
    return "\n".join(parts)


def _docstring(module: ModuleType) -> tuple[str, str]:
    title, _, text = inspect.getdoc(module).partition("\n\n")
    return " ".join(title.split()).rstrip("."), text.replace("``", "`")


def _thresholds() -> Iterator[str]:
    """Yield a table a section of the dataclass."""
    for line in inspect.getsource(thresholds.Thresholds).splitlines():
        section = _SECTION.match(line)
        if section:
            yield f"\n### {section['title']}\n\n| name | value | what it guards |\n|---|---|---|"
        found = _LINE.match(line)
        if found:
            yield _row(found)
    yield ""


def _causes() -> Iterator[str]:
    """Yield a table a cause that has numbers of its own."""
    for name, cause in library().items():
        lines = inspect.getsource(inspect.getmodule(type(cause))).splitlines()
        rows = [found for line in lines if line.startswith("_") and (found := _LINE.match(line))]
        if rows:
            title = cause.title.format(input="input", output="output")
            yield f"### {name}: {title}\n\n`{cause.formula}`\n\n| name | value | what it guards |\n|---|---|---|"
            yield from map(_row, rows)
            yield ""


def _row(found: re.Match[str]) -> str:
    return f"| `{found['name'].lstrip('_')}` | `{found['value']}` | {found['why'].replace('|', '&#124;')} |"
