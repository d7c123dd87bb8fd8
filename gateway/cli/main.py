"""The command `force-gateway`. A verb's module is imported when that verb is called, so `--help` and `check` start fast
and a verb's libraries cost only those who use it."""

import codecs
import io
import os
import sys
from collections.abc import Iterable
from importlib import import_module
from types import ModuleType
from typing import Any, Final

import click

from gateway import VERSION
from gateway.cli import plain_spelling
from gateway.cli.command_line.given_path import refuse_senseless_words
from gateway.cli.errors import translate_error
from gateway.cli.subcommands import SubcommandGroup
from gateway.processes import exit_codes

SECTIONS: Final = {
    "operation": ("Run it and command a force", ("run", "monitor", "hold", "read", "write", "sim")),
    "setup": ("Set up a cell", ("init", "ports", "check", "wiring", "registers", "certs", "schema")),
    "calibration": ("Calibrate and test", ("calibrate", "self-test", "fit", "upload", "calibration")),
    "diagnosis": (
        "Record, and say why the force is off",
        ("record", "recordings", "replay", "diagnose", "effects", "plant", "simulate", "fleet"),
    ),
    "history": ("See what happened", ("explain", "events", "audit", "metrics", "report")),
    "maintenance": ("Keep it running", ("service", "backup", "restore", "completion", "version")),
}
"""Folder of gateway.cli.verbs -> its title in the help, and its verbs, in the order in which a newcomer meets them. Each verb
is a module of that folder with its `command`."""
_FOLDERS: Final = {verb: folder for folder, (_, verbs) in SECTIONS.items() for verb in verbs}
VERBS: Final = tuple(_FOLDERS)
ALIASES: Final = {"install-service": ("service", "install")}
"""Other names of subcommands, on which programs rely; the help does not list them."""
_WHOLE: Final = 1000
"""More characters than the first sentence of any verb: a list of verbs folds it, and cuts nothing."""
_MISSING_TEXTS: Final = (
    "What it does is missing here, for Python was told to drop such texts (PYTHONOPTIMIZE=2, -OO): with 1 it stands here."
    if sys.flags.optimize > 1
    else None
)
HELP: Final = """Modbus gateway that holds a constant contact force, and says why the force is off.

Begin with: force-gateway run demo --sim"""


def import_verb(verb: str) -> ModuleType:
    """Return a verb's module, and import it only now."""
    return import_module(f"gateway.cli.verbs.{_FOLDERS[verb]}.{verb.replace('-', '_')}")


def format_examples(examples: Iterable[str]) -> str | None:
    """Return the end of a verb's help; every example runs as it stands. None where there are none."""
    lines = [f"  force-gateway {words}" for words in examples]
    return "\n".join(["\b", "Examples:", *lines]) if lines else None


class VerbGroup(SubcommandGroup):
    """Finds verbs by name, and turns whatever they raise into one message. is_interrupted: Ctrl-C has ended the verb."""

    is_interrupted = False
    noun = "verb"

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order of the help."""
        return list(VERBS)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the verbs by what they are for; all sections have one column of names."""
        width = max(map(len, VERBS))
        for title, verbs in SECTIONS.values():
            commands = [(verb, self.get_command(ctx, verb)) for verb in verbs]
            with formatter.section(title):
                formatter.write_dl(
                    [(verb.ljust(width), one.get_short_help_str(_WHOLE)) for verb, one in commands if one]
                )

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a verb's module only when it is called."""
        if alias := ALIASES.get(cmd_name):
            group = self.get_command(ctx, alias[0])
            return group.get_command(ctx, alias[1]) if isinstance(group, click.Group) else None
        if cmd_name not in VERBS:
            return None
        module = import_verb(cmd_name)
        command: click.Command = module.command
        ends = (_MISSING_TEXTS, format_examples(getattr(module, "EXAMPLES", ())))
        command.epilog = "\n\n".join(filter(None, ends)) or None
        for one in command.commands.values() if isinstance(command, click.Group) else ():
            one.epilog = _MISSING_TEXTS
            one.short_help = one.get_short_help_str(_WHOLE)  # click itself cuts it at the width of the terminal
        return command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse a command line with an empty word in it, or an endless one, whichever argument or option it is."""
        if not ctx.resilient_parsing:
            refuse_senseless_words(args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the verb; turn what it raises into one message."""
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, click.Abort) as error:  # a question that is answered with Ctrl-C is an Abort
            self.is_interrupted = isinstance(error, KeyboardInterrupt) or isinstance(
                error.__context__, KeyboardInterrupt
            )
            raise
        except click.BadOptionUsage as error:
            verb = self.get_command(ctx, ctx.invoked_subcommand or "")
            told = _tell_argument(verb, error.option_name, ctx)
            raise click.BadOptionUsage(error.option_name, error.message + told, error.ctx) from None
        except (click.ClickException, click.exceptions.Exit, BrokenPipeError):
            raise
        except Exception as error:
            command_line = " ".join(word for word in sys.argv[1:] if word != "--debug")
            raise translate_error(error, command_line, debug=bool(ctx.params.get("debug"))) from error


def _tell_argument(verb: click.Command | None, option_name: str, ctx: click.Context) -> str:
    """Return what belongs behind an option that came without its argument; empty where nothing does. click tells of no
    subcommand, so it counts where all of them mean the same."""
    commands = [verb, *(verb.commands.values() if isinstance(verb, click.Group) else ())]
    options = [option for one in commands if one for option in one.params if isinstance(option, click.Option)]
    told = {
        f" {option_name} {option.make_metavar(ctx)}{': ' + option.help if option.help else ''}"
        for option in options
        if option_name in option.opts and not option.is_flag
    }
    return told.pop() if len(told) == 1 else ""


@click.group(cls=VerbGroup, help=HELP, epilog=_MISSING_TEXTS, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION, prog_name="force-gateway", message="%(prog)s %(version)s")
@click.option("--debug", is_flag=True, help="Show the traceback of a defect.")
def command(debug: bool) -> None:
    """Run one verb."""


def _open_standard_streams() -> None:
    """Open on nothing what we were started without (`>&-`). A lock, a port or the line to control would take that descriptor,
    and what is printed, or a child's own stdout, would end up in it."""
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest that is free
            os.set_inheritable(descriptor, True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(descriptor, "w" if descriptor else "r", closefd=False))  # noqa: SIM115


def _keep_files_for_their_owner() -> None:
    """Take out of the umask what it takes from the owner (0277, 0777): a state directory, a socket or a recording was made that
    the gateway itself could not open again, with this umask or any other."""
    os.umask(os.umask(0o077) & 0o077)


def _print_what_the_terminal_can() -> None:
    """Print what is like it, or `?`, for a character that the terminal's encoding does not have, or that a file's name has made
    of a stray byte: a verb that has done its work ended on it."""
    plain_spelling.register()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and _refuses_characters(stream):
            stream.reconfigure(errors=plain_spelling.ERRORS)


def _refuses_characters(stream: io.TextIOWrapper) -> bool:
    """Decide whether a character may end a verb; of a C locale's stream Python lets stray bytes through, and no character."""
    is_utf_8 = codecs.lookup(stream.encoding).name == "utf-8"
    return stream.errors == "strict" or (stream.errors == "surrogateescape" and not is_utf_8)


def main() -> None:
    """Run `force-gateway` or `python -m gateway`."""
    _open_standard_streams()
    _keep_files_for_their_owner()
    _print_what_the_terminal_can()
    if "_FORCE_GATEWAY_COMPLETE" in os.environ:
        from gateway.cli.command_line.bash_completion import use_our_bash

        use_our_bash()
    try:
        command(prog_name="force-gateway")
    except SystemExit as ended:
        if ended.code != exit_codes.INTERRUPTED and not getattr(command, "is_interrupted", False):
            raise
        sys.excepthook = lambda *_: None  # all is said, such as Aborted!
        raise KeyboardInterrupt from None  # Python ends by the signal: a shell sees 130, and its loop over files ends, too
    except OSError as error:  # of the help itself, for which no verb runs: what it is printed to takes nothing
        refused = translate_error(error, "--help", debug=False)
        refused.show()
        sys.exit(refused.exit_code)
