"""Figures as files and as parts of a page: the same figure is the same bytes, without a date."""

from __future__ import annotations

import io
import re
from typing import Final
from xml.etree import ElementTree as ET

from matplotlib import rc_context
from matplotlib.figure import Figure

from pulsetrainer.report.style import SETTINGS, THEME

_DPI: Final = 200
# keys that each format would otherwise fill with the time of writing
_UNDATED: Final[dict[str, dict[str, str | None]]] = {
    "png": {},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None, "ModDate": None},
}

_SVG: Final = "http://www.w3.org/2000/svg"
_XLINK: Final = "http://www.w3.org/1999/xlink"
_LONG_NUMBER: Final = re.compile(r"-?\d+\.\d{3,}(?!\d*e)")
_REFERENCE: Final = re.compile(r"url\(#([^)]+)\)")
_COLOUR: Final = re.compile(r"#[0-9a-f]{6}\b")


def encode(figure: Figure, form: str) -> bytes:
    """Return ``figure`` as a file on white: png, svg or pdf."""
    file = io.BytesIO()
    with rc_context(SETTINGS):  # ticks are made while drawing, and take the settings of that moment
        figure.savefig(file, format=form, dpi=_DPI, facecolor="white", metadata=_UNDATED[form])
    return file.getvalue()


def inline_svg(figure: Figure, *, identifier: str, title: str, description: str) -> str:
    """Return ``figure`` as an ``<svg>`` element to be put into a page.

    Its ids all begin with ``identifier`` (several figures share a page), colours are the page's
    (``currentColor`` and CSS variables, see ``style.THEME``), fonts are the page's, the background is
    transparent, and ``title`` and ``description`` are its text alternative.
    """
    file = io.StringIO()
    with rc_context(SETTINGS):
        figure.savefig(file, format="svg", dpi=_DPI, transparent=True, metadata=_UNDATED["svg"])
    root = ET.fromstring(file.getvalue())  # noqa: S314 - our own output, written a line above
    _drop(root, "metadata")
    _drop(root, "style")  # a rule for every element of the page, and not ours to give
    for element in root.iter():
        _adapt(element, identifier)
    # the size is the page's business; the view box keeps the proportions
    for name in ("width", "height", "version"):
        root.attrib.pop(name, None)
    root.set("role", "img")
    root.set("class", "plot")
    root.set(
        "preserveAspectRatio", "xMinYMin meet"
    )  # lowered to fit a page, it begins where its caption does
    wide, tall = figure.get_size_inches()
    # inches: at this size its letters are as in SETTINGS
    root.set("style", f"--wide:{wide:g};--tall:{tall:g}")
    root.set("aria-labelledby", f"{identifier}-title {identifier}-desc")
    for name, text in (("desc", description), ("title", title)):
        child = ET.Element(f"{{{_SVG}}}{name}", {"id": f"{identifier}-{name}"})
        child.text = text
        root.insert(0, child)
    ET.register_namespace("", _SVG)
    ET.register_namespace("xlink", _XLINK)
    return ET.tostring(root, encoding="unicode")


def _drop(root: ET.Element, name: str) -> None:
    for parent in list(root.iter()):
        for child in [c for c in parent if c.tag == f"{{{_SVG}}}{name}"]:
            parent.remove(child)


def _adapt(element: ET.Element, identifier: str) -> None:
    """Make one element fit a page: ids, references, colours, fonts; and make it shorter."""
    for key, value in list(element.attrib.items()):
        if key == "id":
            element.set(key, f"{identifier}-{value}")
        elif key in ("href", f"{{{_XLINK}}}href"):
            if value.startswith("#"):  # else an image in the page itself
                element.set(key, f"#{identifier}-{value[1:]}")
        elif key == "style":
            element.set(key, _page_style(_REFERENCE.sub(rf"url(#{identifier}-\1)", value)))
        else:
            short = _LONG_NUMBER.sub(lambda long: f"{float(long[0]):.2f}".rstrip("0").rstrip("."), value)
            short = " ".join(short.split())
            element.set(key, _REFERENCE.sub(rf"url(#{identifier}-\1)", short))
    # indentation is a fifth of the file; the text of a label is not indentation
    if element.text is not None and not element.text.strip():
        element.text = None
    if element.tail is not None and not element.tail.strip():
        element.tail = None


def _page_style(style: str) -> str:
    """Return the style with the page's colours, and without font families: the page's font is inherited."""
    kept = []
    for declaration in style.split(";"):
        name, _, value = (part.strip() for part in declaration.partition(":"))
        if name == "font":  # the short form of older matplotlib: style, weight, size, families
            weight = re.search(r"\b(bold|[1-9]00)\b", value)
            size = re.search(r"[\d.]+px", value)
            kept += [f"font-weight:{weight[0]}"] if weight else []
            kept += [f"font-size:{size[0]}"] if size else []
        elif name and name != "font-family":
            kept.append(f"{name}:{_COLOUR.sub(lambda m: THEME.get(m[0], m[0]), value)}")
    return ";".join(kept)
