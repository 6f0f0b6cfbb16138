"""Gather the pages of the site: ``python docs/site.py`` fills build/site-pages and writes build/mkdocs.yml.

With ``--run`` the notebooks among them are run, all at a time; without it they show no results. The pages are those of the repository in the same folders, so that each link works in both places. The Python
API alone is made anew: of the docstrings, by mkdocstrings.
"""  # noqa: INP001 - a folder of pages with its scripts, not a package

from __future__ import annotations

import re
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import nbformat
from api_reference import HEAD, NOUNS, VERBS
from nbclient import NotebookClient

import pulsetrainer as pt

ROOT = Path(__file__).parents[1]
SITE = ROOT / "build" / "site-pages"
PAGES = (
    "*.md",
    "docs/**/*.md",
    "docs/site.css",
    "docs/site.js",
    "docs/notebooks/*.ipynb",
    "firmware/PROTOCOL.md",
    "waveforms/README.md",
)
LINK = re.compile(r"(\]\(|src=\"|srcset=\")([^)#\"]+)")
# what GitHub draws by a program that the site would have to fetch, with the paragraph about it; a table says the same
DRAWING = re.compile(r"(?:[^\n]+\n)+\n```mermaid\n.*?\n```\n\n", re.DOTALL)
DATA = re.compile(r"(?:\.\./)+tests/data/[\w.]+")  # what a notebook reads
LISTS = {"HOW_TO": "docs/how-to/*.md", "DECISIONS": "docs/decisions/*.md"}


def gather() -> None:
    """Copy the pages, and every file that one of them links to."""
    shutil.rmtree(SITE, ignore_errors=True)
    pages = {page for pattern in PAGES for page in ROOT.glob(pattern)}
    for file in sorted(pages.union(*map(linked, pages))):
        copy = SITE / file.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".ipynb":  # its links to others: there they are pages
            text = file.read_text(encoding="utf-8")
            copy.write_text(re.sub(r"(\]\([^):]+)\.(?:ipynb|md)\)", r"\1.html)", text), encoding="utf-8")
        elif file.suffix == ".md":
            copy.write_text(DRAWING.sub("", file.read_text(encoding="utf-8")), encoding="utf-8")
        else:
            shutil.copyfile(file, copy)
    (SITE / "docs" / "api.md").write_text(api(), encoding="utf-8")


def linked(page: Path) -> set[Path]:
    """Return the files of the repository that a page links to."""
    text = page.read_text(encoding="utf-8")
    found = {(page.parent / target).resolve() for _, target in LINK.findall(text)}
    found |= {(page.parent / path).resolve() for path in DATA.findall(text)}
    return {there for there in found if there.is_file() and there.is_relative_to(ROOT)}


def api() -> str:
    """Return the page of the Python API: the same head and names as docs/api.md, its entries off the docstrings."""
    parts = [HEAD.format(mark=""), "## Verbs\n"]
    for heading, names in (("", VERBS), ("## Artefacts\n", NOUNS)):
        parts.append(heading)
        for name in names:
            thing = getattr(pt, name)
            parts.append(f"### pt.{name}\n\n::: {thing.__module__}.{thing.__qualname__}\n")
    return "\n".join(parts)


def run(notebook: Path) -> None:
    """Run a copied notebook and keep its results in it."""
    content = nbformat.read(notebook, 4)
    folder = {"metadata": {"path": str(notebook.parent)}}
    quiet = ["--log-level=40"]  # a kernel warns of its port, which is this computer's own
    client = NotebookClient(
        content, timeout=600, startup_timeout=300, extra_arguments=quiet, resources=folder
    )
    client.execute()
    nbformat.write(content, notebook)


def settings() -> str:
    """Return docs/mkdocs.yml with its lists of pages filled in, its folders seen from build/."""
    text = (ROOT / "docs" / "mkdocs.yml").read_text(encoding="utf-8").replace("../build/", "")
    for word, pattern in LISTS.items():
        pages = sorted(page.relative_to(ROOT).as_posix() for page in ROOT.glob(pattern))
        indent = re.search(rf"^( *)- .*{word}$", text, re.MULTILINE)[1]
        listed = "".join(f"\n{indent}    - {page}" for page in pages)
        text = text.replace(f" {word}", listed)
    return text


if __name__ == "__main__":
    gather()
    if "--run" in sys.argv:
        with ProcessPoolExecutor() as processes:
            list(processes.map(run, sorted(SITE.glob("docs/notebooks/*.ipynb"))))
    (ROOT / "build" / "mkdocs.yml").write_text(settings(), encoding="utf-8")
