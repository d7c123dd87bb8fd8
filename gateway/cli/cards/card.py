"""A card: a title, and facts that hang behind their keywords, so that they wrap at any width and nothing of them is cut."""

from collections.abc import Iterable, Iterator

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

Fact = tuple[str, str]


def render_card(title: str, facts: Iterable[Fact]) -> Iterator[RenderableType]:
    """Yield the card; a fact without words is left out, and one without a keyword goes on with the one before it."""
    yield Text(title, style="bold")
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    for keyword, words in facts:
        if words:
            grid.add_row(f"  {keyword}", Text(words))
    yield grid


def describe_unknown(name: str, kind: str, known: Iterable[str], verb: str) -> str:
    """Return the sentence about a name that is not known, with the one that was probably meant. kind: `an effect`."""
    from difflib import get_close_matches

    plain = {one.lower().replace("_", "-"): one for one in known}
    wanted = name.lower().replace("_", "-")
    near = get_close_matches(wanted, plain, n=2, cutoff=0.6) or [one for one in plain if wanted in one][:3]
    meant = f"; did you mean {' or '.join(plain[one] for one in near)}?" if near else ";"
    return f"{name} is not {kind}{meant} `force-gateway {verb}` lists them all"
