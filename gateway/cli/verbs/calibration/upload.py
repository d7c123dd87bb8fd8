"""`upload`: a calibration from the master's side, exactly as a robot or a PLC would bring it.

Decisions: --dry-run lets the gateway check everything and store nothing (its own dry run, commit word 2). With
--print-frames every request is printed before it is sent; both together print the requests of a real commit and send
nothing, so that no gateway is needed. The gateway says `committed` when the set is on its disk and in use; then the
active block is read back and compared word by word.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from gateway.cli.command_line.completion_words import complete_calibration_files
from gateway.cli.command_line.numbers import Whole
from gateway.cli.errors import CliError
from gateway.cli.options import gateway_options, json_option
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.bsfm import Calibration
    from gateway.cli.master.upload import UploadClient
    from gateway.cli.master.upload_frames import UploadFrames
    from gateway.registers import RegisterMap


EXAMPLES = ("upload demo --dry-run", "upload demo --print-frames --dry-run")


@click.command()
@click.argument("file", metavar="FILE", shell_complete=complete_calibration_files)
@click.option("--slot", type=Whole(0, 7), default=0, show_default=True, help="Recipe slot that it fills.")
@click.option("--print-frames", is_flag=True, help="Print every Modbus request, for those who program a PLC.")
@click.option("--dry-run", is_flag=True, help="Check only, store nothing. With --print-frames: send nothing.")
@click.option("--fc06", is_flag=True, help="Write single words, as masters do that have FC06 only.")
@gateway_options
@json_option
def command(*, file: str, map_name: str, as_json: bool, **options: Any) -> None:
    """Upload a calibration over Modbus and put it to use.

    FILE is a calibration file or a shipped name. A set that fails a check changes nothing.
    """
    from gateway.cli.master.upload_frames import facts, listing
    from gateway.cli.master.wires import RtuWire
    from gateway.profiles import load_register_map

    calibration, register_map = _load(file), load_register_map(map_name)
    upload, unit = _upload(calibration, register_map, options), options["unit"]
    is_serial = isinstance(options["wire"], RtuWire)
    only_print = options["print_frames"] and options["dry_run"]
    if options["print_frames"] and not as_json:
        click.echo("\n".join(listing(upload, register_map, unit, is_serial=is_serial)))
    sentence = {} if only_print else _send(upload, register_map, options)
    if as_json:
        frames = {"frames": facts(upload, unit, is_serial=is_serial)} if options["print_frames"] else {}
        click.echo(json.dumps({"sent": not only_print, **sentence, **frames}))
    elif not only_print:
        click.echo(_sentence(calibration, sentence))


def _load(file: str) -> "Calibration":
    """Return the calibration to upload, checked: what can be said here need not go to the gateway."""
    from gateway.profiles import ProfileError, load_calibration

    try:
        return load_calibration(file)
    except ProfileError as error:
        cure = f"; `force-gateway calibration export {file} --yaml FILE` makes a file of the stored calibration {file}"
        raise CliError(f"{error}{cure if file.isdecimal() else ''}", exit_codes.DATA) from None


def _upload(calibration: "Calibration", register_map: "RegisterMap", options: dict[str, Any]) -> "UploadFrames":
    from gateway.cli.master.upload_frames import upload_of
    from gateway.registers.words import CommitAction

    check_only = options["dry_run"] and not options["print_frames"]
    action = CommitAction.DRY_RUN if check_only else CommitAction.COMMIT
    try:
        return upload_of(calibration, register_map, slot=options["slot"], action=action, fc06=options["fc06"])
    except ValueError as error:
        text = f"E406 {error}: name the file as the rig's calibration, or fit it with fewer"
        raise CliError(text, exit_codes.DATA) from None


def _send(upload: "UploadFrames", register_map: "RegisterMap", options: dict[str, Any]) -> dict[str, Any]:
    """Stage, commit, wait, read back; what to tell. CliError when it did not come to that."""
    from gateway.cli.master.refusal_text import explain_refusals
    from gateway.cli.master.upload import UploadClient

    master = UploadClient(options["wire"], options["unit"], register_map)
    with _commit_told(master, is_dry=options["dry_run"]), master:
        with explain_refusals(master):
            master.check_map()
        master.send(upload, options["slot"])
        master.outcome(upload)
        committed, is_known = not options["dry_run"], False
        if committed:
            master.check_active(upload, options["slot"])
            is_known = master.is_known_set()
        active = master.calibration_id()
        return {"committed": committed, "active": active, "slot": options["slot"], "known": is_known}


@contextmanager
def _commit_told(master: "UploadClient", *, is_dry: bool) -> Iterator[None]:
    """Add to what is told of a gateway that is lost behind the commit that it may have been taken."""
    try:
        yield
    except CliError as error:
        if is_dry or not master.is_commit_sent or error.exit_code != exit_codes.DEVICE:
            raise
        cure = "the commit was sent, and the set may be in use: `force-gateway read calibration_id commit_status` of it tells"
        raise CliError(f"{error.format_message()}\n  {cure}", error.exit_code) from None


def _sentence(calibration: "Calibration", sentence: dict[str, Any]) -> str:
    if not sentence["committed"]:
        return f"{calibration.name} passes every check; nothing was stored, active set {sentence['active']} unchanged"
    is_known = "; the gateway knew it, and keeps its number and name" if sentence["known"] else ""
    return (
        f"{calibration.name} is in use as calibration {sentence['active']}, slot {sentence['slot']}: "
        f"{calibration.reversal_kind}, durable, and read back word by word{is_known}"
    )
