"""`completion`: the line that teaches a shell our verbs."""

import click

from gateway.cli.errors import CliError

EXAMPLES = ("completion bash", "completion fish")


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(context: click.Context, *, shell: str) -> None:
    """Print the completion script of a shell.

    Verbs, options, rigs, registers, effects, codes, recordings, calibrations and files complete from then on.
    """
    from click.shell_completion import get_completion_class

    from gateway.cli.command_line.bash_completion import use_our_bash

    use_our_bash()
    maker = get_completion_class(shell)
    if maker is None:
        raise CliError(f"this version of click has no completion for {shell}")
    root = context.find_root().command
    click.echo(maker(root, {}, "force-gateway", "_FORCE_GATEWAY_COMPLETE").source())
