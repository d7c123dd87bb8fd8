"""`effects`: the catalogue of physical causes that `diagnose` knows."""

import json
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_effects
from gateway.cli.options import json_option

if TYPE_CHECKING:
    from rich.table import Table

    from gateway.catalogue.effect import Effect

FORMAT = 1


EXAMPLES = ("effects", "effects leak")


@click.command()
@click.argument("name", required=False, shell_complete=complete_effects)
@json_option
def command(*, name: str | None, as_json: bool) -> None:
    """List the effects that diagnose can name, or show one.

    For each: what it is, what it looks like, what a recording must contain to show it, and its parameters. With NAME: the
    experiment that shows it, what control does about it, and the effects that it is easily taken for, too.
    """
    from gateway.catalogue.all_effects import EFFECTS

    if name is not None:
        _show_card(name, as_json=as_json)
        return
    if as_json:
        document = {"format": FORMAT, "effects": [_facts(effect) for effect in EFFECTS]}
        click.echo(json.dumps(document, indent=2, ensure_ascii=False))
        return
    from rich.console import Console

    console = Console()
    for family in dict.fromkeys(effect.family for effect in EFFECTS):
        console.print(_table(family, [effect for effect in EFFECTS if effect.family == family]))
        console.print()
    console.print(
        f"{len(EFFECTS)} effects; all are off in a plant that does not name them", style="dim", highlight=False
    )


def _show_card(name: str, *, as_json: bool) -> None:
    """Print one effect; UsageError with the nearest names where there is none of this name."""
    from rich.console import Console

    from gateway.catalogue.all_effects import EFFECTS
    from gateway.cli.cards.card import describe_unknown, render_card
    from gateway.cli.cards.effect_card import effect_facts

    found = next((effect for effect in EFFECTS if effect.name == name.lower().replace("_", "-")), None)
    if found is None:
        known = [effect.name for effect in EFFECTS]
        raise click.UsageError(describe_unknown(name, "an effect that diagnose knows", known, "effects"))
    if as_json:
        more = {"experiment": found.experiment, "number": found.number}
        more |= {"treatments": [{"by": one.by.value, "why_not": one.why_not or None} for one in found.treatments]}
        click.echo(json.dumps({"format": FORMAT} | _facts(found) | more, indent=2, ensure_ascii=False))
        return
    console = Console()
    for part in render_card(found.name, effect_facts(found)):
        console.print(part, highlight=False)


def _facts(effect: "Effect") -> dict[str, Any]:
    """The contract's fields; family and needs besides. A group holds the own name, as in the JSON of a diagnosis."""
    return {
        "name": effect.name,
        "family": effect.family,
        "what": effect.what,
        "signature": effect.signature,
        "excitation": effect.excitation,
        "needs": list(effect.needs),
        "parameters": [
            {"name": parameter.name, "unit": parameter.unit, "section": parameter.section, "null": parameter.null}
            for parameter in effect.parameters
        ],
        "group": [effect.name, *(name for name in effect.group if name != effect.name)],
    }


def _table(family: str, effects: "list[Effect]") -> "Table":
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, header_style="dim", title_justify="left")
    table.add_column(family, no_wrap=True, min_width=23)
    table.add_column("what it is")
    for effect in effects:
        parameters = ", ".join(f"{parameter.name} ({parameter.unit or '1'})" for parameter in effect.parameters)
        needs = f"; needs the column {' and '.join(effect.needs)}" if effect.needs else ""
        texts = Text(effect.what)
        for keyword, text in (
            ("seen as", effect.signature),
            ("record", effect.excitation + needs),
            ("sized by", parameters),
        ):
            texts.append(f"\n{keyword}: {text}", style="dim")
        table.add_row(Text(effect.name, style="bold"), texts)
    return table
