"""A verb with subcommands, such as `calibration`; the command itself is one, of verbs."""

from difflib import get_close_matches

import click


class SubcommandGroup(click.Group):
    """Tells of a subcommand that is none the nearest one, else all that there are. noun: what the message calls one."""

    noun = "subcommand"

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the subcommand; click itself names the nearest one alone."""
        word = args[0]
        if not word.startswith("-") and not ctx.resilient_parsing and self.get_command(ctx, word) is None:
            known = self.list_commands(ctx)
            near = get_close_matches(word, known, n=1)
            meant = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"
            ctx.fail(f"{word} is not a {self.noun}{meant}")
        return super().resolve_command(ctx, args)
