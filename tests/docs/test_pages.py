"""What the pages say is so: links, commands, options, figures, the format."""

from __future__ import annotations

import ast
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import h5py
import pytest
import report_examples
import store_examples
import typer
from pages import PAGES, ROOT, anchors, blocks, links, tables, words

from pulsetrainer.cli.app import app
from pulsetrainer.diagnosis.causes import library
from pulsetrainer.files import store
from pulsetrainer.report.render import encode


def script(name: str):
    """Return a script of docs/ as a module."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_every_column_of_a_table_has_a_heading(page):
    """A screen reader tells it with each cell."""
    heads = re.findall(r"^(\|.*\|)\n\|[-:| ]+\|$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert [head for head in heads if re.search(r"\|\s*\|", head)] == []


def test_the_vocabulary_says_what_every_cause_is():
    """In the words of the program, and whether it belongs into the model or out of the run."""
    page = (ROOT / "docs" / "vocabulary.md").read_text(encoding="utf-8")
    for one in library().values():
        then = "correct" if one.corrects else "extend" if one.lasting else "-"
        assert f"| {one.id} | {one.title.format(input='input', output='output')} | {then} |" in page


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_picture_of_the_readme_is_that_of_the_demo(theme):
    """It shows the beat that is kept, and names the errors of the table below it."""
    kept = json.loads((ROOT / "docs" / "demo.json").read_text(encoding="utf-8"))
    picture = (ROOT / "docs" / "figures" / f"before-after-{theme}.svg").read_text(encoding="utf-8")
    assert f"figures/before-after-{theme}.svg" in (ROOT / "README.md").read_text(encoding="utf-8")
    drawn = re.search(r"<desc>(.*?)</desc>", picture, re.DOTALL)
    assert json.loads(drawn[1]) == kept["beat"]
    errors = kept["played"]["normal.extended"]
    for drive in ("scaled", "compensated"):
        assert f"mean error {errors[f'{drive}.mean_abs_error_percent']:.2g} %" in picture
    assert ("#1b1f24" in picture) is (theme == "light")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    """Each relative link is a file of the project, its anchor a heading of it."""
    for target in links(page):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), f"{target}: no such file"
        assert there.is_relative_to(ROOT)
        assert not anchor or anchor in anchors(there), f"{target}: no such heading"


def test_every_page_can_be_found():
    """From the README, by links alone."""
    seen, todo = set(), [ROOT / "README.md"]
    while todo:
        page = todo.pop()
        seen.add(page)
        for target in links(page):
            there = (page.parent / target.partition("#")[0]).resolve()
            if there.suffix == ".md" and there not in seen and there.exists():
                todo.append(there)
    assert {page for page in PAGES if page.is_relative_to(ROOT / "docs")} <= seen


@pytest.mark.parametrize("name", script("make").PAGES)
def test_reference_is_what_the_code_says(name):
    """A command, option, dataset or unit that changed shows here; `make docs` writes the page."""
    assert (ROOT / "docs" / name).read_text() == script("make").PAGES[name]()


@pytest.mark.skipif(shutil.which("groff") is None, reason="groff is not here; man would format the page")
def test_signatures_in_the_reference_are_python():
    """Defaults and annotations as a reader would write them."""
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    found = re.findall(r"```python\n[\w.]+(\(.*\n(?:.*\n)*?)```", page)
    assert len(found) > 20
    for signature in found:
        ast.parse(f"def verb{signature.strip()}: ...")


def test_manual_page_is_formatted_without_a_warning():
    """What `man pulsetrainer` shows: every command with its example, every exit code."""
    page = ROOT / "docs" / "pulsetrainer.1"
    words_ = ["groff", "-man", "-ww", "-Tascii", "-P-cbou", "-rLL=200n", str(page)]
    done = subprocess.run(words_, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    said = " ".join(done.stdout.split())
    for name, command in typer.main.get_command(app).commands.items():
        example = command.help.rpartition("Example: ")[2]
        assert f"pulsetrainer {name}" in example
        assert " ".join(example.split()) in said
    for code in (0, 1, 2, 3, 4, 5, 70, 130):
        assert re.search(rf"^ +{code} +\w", done.stdout, re.MULTILINE), code


def test_commands_on_all_pages_exist():
    """Every line that calls the program names a command that exists, and options that it has."""
    root = typer.main.get_command(app)
    found = 0
    for page in PAGES:
        for block in blocks(page):
            for line in block.commands if block.language in ("sh", "console", "") else ():
                called = words(line)
                if called[:1] != ["pulsetrainer"] or len(called) < 2 or called[1].startswith("-"):
                    continue
                if called[1].isupper():  # COMMAND in general
                    continue
                assert called[1] in root.commands, f"{page.name}: {line}"
                known = {
                    name for p in root.commands[called[1]].params for name in (*p.opts, *p.secondary_opts)
                }
                used = {word.partition("=")[0] for word in called[2:] if re.match(r"--?[a-z]", word)}
                assert used <= known | {"--help"}, f"{page.name}: {line}"
                found += 1
    assert found > 40


# --- figures ----------------------------------------------------------------------------------------------
BOUNDS = tomllib.loads((ROOT / "tests/regression/bounds.toml").read_text())
ROWS = {
    "mean error, scaled": "scaled.mean_abs_error_percent",
    "mean error, compensated": "compensated.mean_abs_error_percent",
    "reduction of the mean error, % of scaled": "mean_error_reduction_percent",
    "max error, scaled": "scaled.max_abs_error_percent",
    "max error, compensated": "compensated.max_abs_error_percent",
}
COLUMNS = {
    2: "normal.closest-match",
    3: "normal.continuous",
    4: "normal.extended",
    6: "bifid.closest-match",
    7: "bifid.continuous",
    8: "bifid.extended",
}


def _flat(table, prefix=""):
    """Return a nested table as dotted names."""
    flat = {}
    for key, value in table.items():
        flat |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return flat


def test_figures_of_the_readme_are_those_that_are_held():
    """Each number of ours lies within the bounds that `make bounds` holds against the demo."""
    bounds = _flat(BOUNDS)
    table = next(t for t in tables(ROOT / "README.md") if t[0][0] == "% of full force")
    assert [row[0] for row in table[1:]] == list(ROWS)
    for name, *cells in table[1:]:
        for column, stem in COLUMNS.items():
            low, high = bounds[f"{stem}.{ROWS[name]}"]
            assert low <= float(cells[column - 1]) <= high, (name, stem)


def test_figures_of_the_demo_are_within_their_bounds():
    """Those that `make docs` kept: the same bounds, every inversion; on the ideal bench what is promised."""
    kept = json.loads((ROOT / "docs" / "demo.json").read_text())
    bounds = _flat(BOUNDS)
    held = 0
    for name, figures in kept["played"].items():
        for metric, value in figures.items():
            low, high = bounds[f"{name}.{metric}"]
            assert low <= value <= high, (name, metric)
            held += 1
    assert held == len(ROWS) * len(COLUMNS)
    for figures in kept["ideal"].values():
        assert figures["mean_error_reduction_percent"] >= 88.0
        assert figures["compensated.max_abs_error_percent"] <= 2.5
    assert kept["gain_percent"] > 50.0


def test_a_figure_of_the_readme_is_the_one_that_was_kept():
    """A digit changed by hand, in the page or in what is kept, is found."""
    demo = script("demo")
    kept = json.loads(demo.KEPT.read_text())
    page = (ROOT / "README.md").read_text()
    assert demo.block(kept) in page
    kept["played"]["normal.extended"]["compensated.max_abs_error_percent"] += 0.1
    assert demo.block(kept) not in page


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "named", "most"), [("theory", "FIGURES", 60_000), ("measured", "MEASURED_FIGURES", 200_000)]
)
def test_figures_of_a_page_are_drawn_by_the_code(page, named, most):
    """Each figure on the page has its function, and what is written in it is what the function writes."""
    drawn = getattr(script("figures"), named)
    shown = [target for target in links(ROOT / f"docs/{page}.md") if target.endswith(".svg")]
    assert sorted(shown) == sorted(f"figures/{name}.svg" for name in drawn)
    for name, draw in drawn.items():
        made = encode(draw(), "svg").decode()
        kept = (ROOT / "docs" / "figures" / f"{name}.svg").read_text()
        labels = [re.findall(r"<text[^>]*>([^<]*[A-Za-zα-ω][^<]*)</text>", text) for text in (made, kept)]
        assert labels[0] == labels[1]
        assert len(labels[0]) >= 6
        assert len(kept) < most


# --- the format -------------------------------------------------------------------------------------------
def _described() -> dict[str, dict[str, list[str]]]:
    """Return the rows of format.md by kind or part and name."""
    page = (ROOT / "docs/format.md").read_text()
    found = {}
    for section in page.split("\n## ")[1:]:
        title = section.partition("\n")[0].removeprefix("Part: ")
        rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("| `")]
        found[title] = {row[0].strip(" `"): [cell.strip() for cell in row[1:]] for row in rows}
    return found


def _compare(group: h5py.Group, rows: dict[str, list[str]], pages: dict, where: str) -> int:
    """Hold one group of a file against its table, and its parts against theirs; return how many were held."""
    held = 0
    scales = {"time", "level", "cell", "repeat", "group", "beat", "question", "wild"}
    described = {name.partition("/")[0] for name in rows}
    unknown = set(group) - described - scales
    assert not unknown, f"{where}: {unknown} are in the file, not on the page"
    for name, (holds, axes, units, _) in rows.items():
        item = group.get(name)
        if holds.startswith("attribute"):
            assert name in group.attrs, f"{where}: no attribute {name}"
        elif item is None:
            assert "optional" in holds, f"{where}: no {name}"
            continue
        elif holds.startswith("dataset"):
            assert isinstance(item, h5py.Dataset)
            assert [dim.label for dim in item.dims] == [axis for axis in axes.split(" × ") if axis] or (
                name == "time" and axes == "time"
            )
            unit = group.attrs[units.strip("`")] if units.startswith("`") else units
            assert item.attrs["units"] == unit, f"{where}: {name}"
        else:
            part = pages[re.match(r".*\[(\w+)\]", holds)[1]]
            parts = item.values() if holds.startswith("list") else [item]
            held += sum(_compare(one, part, pages, f"{where}/{name}") for one in parts)
        held += 1
    return held


FILES = store_examples.EXAMPLES | {
    "evaluation": report_examples.evaluation,
    "evaluation of models": report_examples.model_comparison,
    "extended model": report_examples.extended_model,
}


@pytest.mark.parametrize("example", FILES)
def test_files_are_as_described(example, tmp_path):
    """An artefact of each kind, read by plain h5py, holds what the page says, with its axes and units."""
    pages = _described()
    path = tmp_path / "example.h5"
    artefact = FILES[example]()
    store.write(path, artefact, store_examples.header())
    with h5py.File(path) as file:
        for name in ("kind", "format_version", "title", "created", "history", "provenance"):
            assert name in file.attrs
        assert _compare(file, pages[artefact.kind], pages, example) >= 5


def test_the_first_picture_comes_first():
    """A fresh machine's way to it is the first block of the README; the whole job and the tests follow."""
    shown = [
        [command.split("#")[0].strip() for command in block.commands] for block in blocks(ROOT / "README.md")
    ]
    assert shown[0][:2] == ["make install", ". .venv/bin/activate"]
    assert shown[0][-1].startswith("pulsetrainer plot ")
    assert shown[2] == ["make demo", "make test"]
    assert shutil.which("make") or Path("/usr/bin/make").exists()
