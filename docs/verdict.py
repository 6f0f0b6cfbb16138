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

`diagnose` asks one question after another. Each stage below is a file in `pulsetrainer/diagnosis/stages`, and its text here
stands at the top of that file; the list of the stages is `pulsetrainer/diagnosis/procedure.py`. Every number that decides is in
one of the tables at the end, with what it guards. How often the verdict is right is in [blind.md](blind.md).

Beside those of the [vocabulary](vocabulary.md) these words are used throughout:

- **left out**: not used in a fit, but predicted by it. *Blocks* are left out in two alternating halves; *pieces*, or stretches,
  are each a fifth of the time.
- **reducible part**: what can be lowered (stage 2). The held-out error has such a part as well.
- **noise from sample to sample**, or *quick* noise: what the differences of neighbouring samples show. Slower noise may also be
  an error of the model.
- **null**: noise like that of the record, drawn again and again, in which there is no cause.
- **linearised**: fitted as if the output changed in proportion to a parameter.
- **free beginning**: a few decays that are fitted to the beginning of each record, for what the device did before it.
- **device of another kind**: one that is no Preisach operator. Some were simulated to set the numbers.
- **decision**: a page in [decisions](decisions/README.md) that says why.
"""
METHODS = (screening, fitting, held_out, congruency)
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
