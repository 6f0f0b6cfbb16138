"""The page of the architecture, read off the code: a drawing of the imports, every module in a sentence."""  # noqa: INP001 - a folder of pages with its scripts, not a package

from __future__ import annotations

import ast
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import grimp

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1]
PACKAGE = "pulsetrainer"
PAGE = """\
# Architecture

{mark}

A command is one verb with files: it loads what its arguments name, calls one function of `steps`, saves the result and
prints it. The nouns (`artefacts`) are frozen dataclasses that know no file. The verbs (`steps`) go from nouns to nouns.
[CONTRIBUTING.md](CONTRIBUTING.md) says which files to touch for a new command, cause, artefact or pulse,
[docs/decisions](docs/decisions/README.md) why things are as they are.

## Who imports whom

An arrow points from a part to a part that it imports. An arrow that follows from others is left out; the table has all.

```mermaid
{drawing}
```

| part | imports |
|---|---|
{imports}

## The rules

Checked by `make lint` (`lint-imports`; the contracts are in `pyproject.toml`):

{contracts}

Held by `tests/unit/test_house_rules.py`: outside `cli` nothing prints or exits; random numbers come from a generator that
is passed in or has a fixed seed; the core and the diagnosis read no clock and no environment. Errors are one family
(`pulsetrainer/errors.py`). `pulsetrainer/cli/guard.py` turns those that are raised into exit codes; a failed quality gate
exits in `pulsetrainer/cli/console.py`, after its result was shown.

The firmware in `firmware/` is C99 without a heap: `core` (protocol, control, safety; no hardware), `hal` (what a port must
offer), `port` (the host's pseudo-terminal, an emulated Cortex-M4F, the dsPIC33), `plant` (the simulated solenoid).
[PROTOCOL.md](firmware/PROTOCOL.md) is what both sides speak.

The pages are made by scripts in `docs/`: `make.py` writes all that come from the code, with `architecture.py` (this page),
`verdict.py` (how a verdict is reached) and `api_reference.py` (the Python API); `site.py` gathers them for the site.
`docs/decisions`, `docs/how-to`, `docs/theory.md` and `docs/blind.md` are written by hand.

## Where to find what

{modules}

{firmware}

### waveforms

The pulses, as CSV files that [make.py](waveforms/make.py) writes from their formulas.

### tests

- `unit`: one module at a time. The rules above are in `test_house_rules.py`.
- `law`: equations that hold for any input, tried by Hypothesis; `tests/oracle.py` has slow, obvious twins of fast routines.
- `cli`, `api`: commands as a user types them, and the Python API. The words of every error message, with what to do next, are
  in one table, `tests/wording.py`; a line for each command is in `tests/command_lines.py`.
- `firmware`, `link`: the firmware in C, and the host talking to it; what may not happen to a finger: `link/test_safety.py`.
- `blind`: how often the diagnosis is right about effects that are hidden from it.
- `faults`, `mutation`: kills, full disks and damaged files; small faults put into the code, to see which tests notice.
- `docs`, `browser`, `workflow`: what the pages promise, the reports in a browser, batches.
- `regression`: the demo's figures against `bounds.toml`.
- `data`: measured records of others, with [their sources](tests/data/SOURCES.md).
"""


def architecture_page(mark: str) -> str:
    """Return the page: drawing, contracts and modules."""
    graph = grimp.build_graph(PACKAGE, include_external_packages=False)
    imports = _imports(graph)
    return PAGE.format(
        mark=mark,
        drawing="\n".join(_drawing(imports)),
        imports="\n".join(
            f"| `{part}` | {', '.join(f'`{one}`' for one in sorted(below)) or 'nothing of the package'} |"
            for part, below in sorted(imports.items())
        ),
        contracts="\n".join(f"- {name}." for name in _contracts()),
        modules="\n".join(_modules()).rstrip(),
        firmware="\n".join(_firmware()).rstrip(),
    )


def _imports(graph: grimp.ImportGraph) -> dict[str, set[str]]:
    """Return the direct imports between the parts: the folders and modules right below the package."""
    parts = {child for child in graph.find_children(PACKAGE) if not child.endswith("__main__")}
    for part in parts:
        if graph.find_children(part):
            graph.squash_module(part)
    return {
        _short(part): {
            _short(one) for one in graph.find_modules_directly_imported_by(part) & (parts - {part})
        }
        for part in parts
    }


def _short(module: str) -> str:
    return module.removeprefix(f"{PACKAGE}.")


def _drawing(imports: dict[str, set[str]]) -> Iterator[str]:
    """Yield a flow chart of the imports without those that follow from others."""
    yield "flowchart TD"
    for part, below in sorted(imports.items()):
        for one in sorted(below):
            if not any(one in _reached(other, imports) for other in below - {one}):
                yield f"  {part} --> {one}"


def _reached(part: str, imports: dict[str, set[str]]) -> set[str]:
    """Return all parts that a part imports, directly or through others."""
    found: set[str] = set()
    todo = [part]
    while todo:
        for one in imports[todo.pop()] - found:
            found.add(one)
            todo.append(one)
    return found


def _contracts() -> list[str]:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return [contract["name"] for contract in settings["tool"]["importlinter"]["contracts"]]


def _modules() -> Iterator[str]:
    """Yield every module with the first sentence of its docstring, folder by folder."""
    root = ROOT / PACKAGE
    folders = [root, *sorted(path.parent for path in root.rglob("__init__.py") if path.parent != root)]
    for folder in folders:
        yield f"### {folder.relative_to(ROOT)}\n"
        yield f"{_sentence(folder / '__init__.py')}\n"
        for path in sorted(folder.glob("*.py")):
            if path.name not in ("__init__.py", "__main__.py"):
                yield f"- [{path.name}]({path.relative_to(ROOT)}): {_sentence(path)}"
        yield ""


def _firmware() -> Iterator[str]:
    """Yield every header of the firmware with the first paragraph of its first comment."""
    for folder in ("core", "hal", "plant", "port"):
        yield f"### firmware/{folder}\n"
        for path in sorted((ROOT / "firmware" / folder).rglob("*.h")):
            comment = path.read_text(encoding="utf-8").removeprefix("/*").partition("*/")[0]
            first = comment.partition("\n *\n")[0].replace("\n *", " ")
            name = path.relative_to(ROOT / "firmware" / folder)
            yield f"- [{name}]({path.relative_to(ROOT)}): {' '.join(first.split())}"
        yield ""


def _sentence(path: Path) -> str:
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(text.partition("\n\n")[0].split()).replace("``", "`")
