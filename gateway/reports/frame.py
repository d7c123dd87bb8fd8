"""The frame of every report: a first screen with the answer, sections, and at the end where it comes from.

One HTML file without scripts, nothing loaded; light and dark, and fit for paper.
"""

import platform
import re
import shlex
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from gateway import VERSION
from gateway.reports.style import inline_style

_FRAME: Final = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title><style>{style}</style></head>
<body><main>
{body}
</main></body></html>
"""
_UNIT: Final = re.compile(r"(\d) (?=(?:N|V|s|Hz)\b|%)")
_COMMANDS: Final = ("force-gateway", "reproduce")  # programs whose words are worth repeating
_COUNTED: Final = ("numpy", "scipy")  # packages that numbers come from


@dataclass(frozen=True, slots=True, kw_only=True)
class Head:
    """The first screen. kind: what report it is; answer: one sentence that is true by itself; badge: the verdict's word and its
    colour (good, warn, bad or nothing); sentences: what has to be known beside the answer; facts: what it is about; title: of
    the reader's tab, the answer where empty."""

    kind: str
    answer: str
    badge: tuple[str, str] = ("", "")
    sentences: tuple[str, ...] = ()
    facts: tuple[str, ...] = ()
    title: str = ""


def page(head: Head, parts: Iterable[str], provenance: Mapping[str, object]) -> str:
    """Return the whole page. parts: HTML of tiles and sections, empty ones take no place; provenance: facts by name."""
    body = "\n".join(part for part in (_header(head), *parts, _footer(provenance)) if part)
    return _FRAME.format(title=escape(head.title or f"{head.kind}: {head.answer}"), style=inline_style(), body=body)


def _header(head: Head) -> str:
    word, colour = head.badge
    badge = f"<span class='badge {colour}'>{escape(word)}</span> " if word else ""
    facts = " · ".join(fact for fact in head.facts if fact)
    lines = "".join(
        f"<p class='verdict'>{_keep_units(escape(sentence))}</p>" for sentence in head.sentences if sentence
    )
    about = f"<p>{escape(facts)}</p>" if facts else ""
    kicker = f"<p class='kicker'>{badge}{escape(head.kind)}</p>"
    return f"<header>{kicker}<h1>{_keep_units(escape(head.answer))}</h1>{lines}{about}</header>"


def _keep_units(text: str) -> str:
    """Return the text with every number on one line with its unit."""
    return _UNIT.sub("\\1\N{NO-BREAK SPACE}", text)


def tiles(*figures: tuple[str, str, str]) -> str:
    """Return big numbers as HTML: (name, number, unit and what it is) each."""
    cells = "".join(
        f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd><dd class='unit'>{escape(unit)}</dd></div>"
        for name, value, unit in figures
    )
    return f"<dl class='tiles'>{cells}</dl>" if cells else ""


def notes(sentences: Iterable[str]) -> str:
    """Return what should not be overlooked; empty without any."""
    lines = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<section class='notes'><h2>Notes</h2><ul>{lines}</ul></section>" if lines else ""


def section(title: str, content: str) -> str:
    """Return a section; empty without content, which is HTML."""
    return f"<h2>{escape(title)}</h2>{content}" if content else ""


def table(heads: Iterable[str], rows: Iterable[Iterable[str]], style: str = "") -> str:
    """Return an HTML table that scrolls within itself. Cells are HTML; the first of each row is its heading."""
    body = "".join(_row(list(row)) for row in rows)
    head = "".join(f"<th>{name}</th>" for name in heads)
    whole = f"<table class='{style}'><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f"<div class='wide' tabindex='0'>{whole}</div>"


def _row(cells: list[str]) -> str:
    return f"<tr><th>{cells[0]}</th>" + "".join(f"<td>{cell}</td>" for cell in cells[1:]) + "</tr>"


def _footer(provenance: Mapping[str, object]) -> str:
    facts = {**provenance, "made by": _versions(), "command": command_line()}
    rows = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in facts.items() if value
    )
    return f"<footer><h2>Provenance</h2><table class='facts'><tbody>{rows}</tbody></table></footer>"


def _versions() -> str:
    packages = [f"{name} {known}" for name in _COUNTED if (known := _version(name))]
    return ", ".join((f"force-gateway {VERSION}", *packages, f"Python {platform.python_version()}"))


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def command_line() -> str:
    """Return the command that this process runs, as one would type it; empty where it is a process of the gateway's own."""
    program, *words = sys.argv or [""]
    file = Path(program)
    name = "force-gateway" if (file.parent.name, file.name) == ("gateway", "__main__.py") else file.name
    return shlex.join([name, *words]) if name in _COMMANDS else ""
