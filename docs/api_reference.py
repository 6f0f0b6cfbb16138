"""The page of the Python API, off the docstrings."""  # noqa: INP001 - a folder of pages with its script

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

import pulsetrainer as pt
from pulsetrainer.steps.arguments import readable

HEAD = """\
# The Python API

{mark}

```python
import pulsetrainer as pt

run = pt.load("run.h5")
model = pt.identify(run)
drive = pt.invert("normal", model)
with pt.open_device("bench:") as device:
    played = pt.play(drive, device)
print(pt.evaluate(played))
```

Verbs are pure functions from artefacts to artefacts: each command of the command line is one of them, with
files around it, and both give the same bits. Artefacts are frozen dataclasses of numpy arrays with units in
their fields' names or in `..._unit`. `print` shows one as `pulsetrainer show` does, a notebook adds its figure, and
`.plot()` returns matplotlib axes. Errors are Python exceptions of one family, `pulsetrainer.errors`; wrong
arguments are also `ValueError`. Nothing here prints, exits or reads the clock but `save`.

"""
_SECTIONS = ("Parameters", "Raises", "Examples")
VERBS = (
    "load", "save", "read_table", "open_device", "capture", "identify", "invert", "play", "evaluate", "compare",
    "diagnose", "extend", "correct", "refine", "transfer", "session", "tune", "check",
)  # fmt: skip
NOUNS = ("Run", "Model", "Waveform", "Playback", "Evaluation", "Diagnosis", "Session")


def api_page(mark: str) -> str:
    """Return the reference of every public name."""
    parts = [HEAD.format(mark=mark), "## Verbs\n"]
    for name in VERBS:
        parts += _entry(f"pt.{name}", getattr(pt, name))
    parts.append("## Artefacts\n")
    for name in NOUNS:
        noun = getattr(pt, name)
        parts += [f"### pt.{name}\n", f"{inspect.getdoc(noun)}\n"]
        parts.append(f"Its fields, with units and shapes: [the files](format.md#{noun.kind}).\n")
        for member, value in vars(noun).items():
            if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                parts += _member(name, member, value)
    return "\n".join(parts)


def _member(noun: str, name: str, value: Any) -> Iterator[str]:
    if isinstance(value, property):
        yield f"- `{noun}.{name}`: {_sentence(value)}\n"
    else:
        yield from _entry(f"{noun}.{name}", value, level=4)


def _sentence(value: Any) -> str:
    return (inspect.getdoc(value) or "").partition("\n\n")[0].replace("\n", " ")


def _entry(name: str, verb: Any, level: int = 3) -> Iterator[str]:
    """Yield a heading, the signature, and the docstring with its sections as lists."""
    yield f"{'#' * level} {name}\n"
    yield f"```python\n{name}{readable(verb)}\n```\n"
    section = ""
    for block in (inspect.getdoc(verb) or "").split("\n\n"):
        head, _, rest = block.partition("\n")
        if head in _SECTIONS:
            section = head
            yield f"**{head}**\n"
        said = rest.partition("\n")[2] if head in _SECTIONS else block
        if section == "Examples":
            yield f"```pycon\n{said}\n```\n"
        elif section in ("Parameters", "Raises") and not said.startswith("Source:"):
            yield from _items(said)
        elif said.startswith("    "):
            yield f"```text\n{inspect.cleandoc(said)}\n```\n"
        else:
            section = ""
            yield f"{_code(' '.join(said.split()))}\n"


def _items(block: str) -> Iterator[str]:
    """Yield the names of a section, each with its words."""
    found = re.findall(r"^(\S[^\n]*)\n((?:    [^\n]*\n?)+)", block, flags=re.MULTILINE)
    yield "".join(f"- `{name}`: {_code(' '.join(words.split()))}\n" for name, words in found)


def _code(text: str) -> str:
    return text.replace("``", "`")
