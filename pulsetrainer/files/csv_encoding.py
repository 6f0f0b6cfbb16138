"""Whether a file is text, and in which encoding: told by its first bytes."""

from __future__ import annotations

import re
from pathlib import Path

from pulsetrainer.errors import DataError, NotAnArtefactError
from pulsetrainer.files.input_file import likely_kind

_BYTES = 4096  # that are looked at, at either end
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_JSON = re.compile(rb'\s*(\{\s*"|\[\s*[\[{])')
_ROW_END = re.compile(rb"\d[;,\t]?\r?\n")
# how files begin that are no tables, whatever their names
_FOREIGN = {b"PK\3\4": "an Excel workbook, or a zip file", b"%PDF": "a PDF"}
_FOREIGN |= dict.fromkeys((b"<!do", b"<!DO", b"<htm", b"<HTM"), "a web page")


def encoding_of(path: Path) -> str:
    """Return the encoding of a text; DataError where the file is none, OSError where it cannot be read."""
    with path.open("rb") as stream:
        start = stream.read(_BYTES)
    if start.startswith(_UTF16_MARKS):
        return "utf-16"
    if found := _FOREIGN.get(start.lstrip()[:4]):
        raise DataError(f"{path} is {found}, not a table", hint="export the recording as CSV, and give that")
    if path.suffix.lower() == ".json" or _JSON.match(start):
        hint = "export it as CSV, TSV, .npz, .npy, .mat or .wav"
        raise DataError(f"{path} is JSON, which import cannot read", hint=hint)
    low, high = start[:20:2], start[1:20:2]
    if high and not any(high) and all(low):  # without its mark
        return "utf-16-le"
    ends = start.rstrip(b"\0")  # with them: what a crash left
    if b"\0" in (ends if _ROW_END.search(ends) else start):
        hint = "export the recording as CSV"
        if kind := likely_kind(path):
            hint = f"it is a {kind} already, and only tables are read here: see `pulsetrainer show {path}`"
        elif start.startswith(b"\x89HDF"):
            hint = NotAnArtefactError.foreign_hint
        raise DataError(f"{path} is not a text file", hint=hint)
    return "utf-8-sig"


def end_of(path: Path, encoding: str) -> str:
    """Return the text in the last few kilobytes of a file, from the beginning of a line on."""
    with path.open("rb") as stream:
        start = max(path.stat().st_size - _BYTES, 0)
        stream.seek(start)
        text = stream.read().decode("utf-16-le" if encoding.startswith("utf-16") else "utf-8", "replace")
    return text[text.find("\n") + 1 if start else 0 :]
