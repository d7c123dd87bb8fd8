"""What the service's user may run and read. Root, who installs it, may do all of that: that its own check finds no fault says
nothing of the service, which ends at its start then, and systemctl says no more than that a job has failed.
"""

import os
import pwd
import shlex
import subprocess
from collections.abc import Sequence
from pathlib import Path

from gateway.cli.errors import CliError
from gateway.cli.system_service.unit_file import USER
from gateway.plain_file import exists, is_directory
from gateway.processes import exit_codes


def refuse_closed_program(program: Path) -> None:
    """Raise CliError E107 for a program that is not there, or that the service's user may not run."""
    if not exists(program):
        raise CliError(
            f"E107 {program}: there is no such program; --command names the right one, and nothing was started",
            exit_codes.CONFIGURATION,
        )
    if not _may(program, "-x"):
        place = shlex.quote(str(program.parent.parent))
        raise CliError(
            f"E107 {program}: the service's user, {USER}, may not run it: sudo chmod -R go+rX {place}, then install again; "
            "nothing was started",
            exit_codes.PERMISSION,
        )


def refuse_unreadable(paths: Sequence[str]) -> None:
    """Raise CliError E107 where the service's user may not read one of these files, with the commands that let it."""
    files = [Path(path) for path in paths]
    on_the_way = dict.fromkeys(part for file in files for part in (*reversed(file.parents), file))
    closed = [str(part) for part in on_the_way if not _may(part, "-x" if is_directory(part) else "-r")]
    if closed:
        these = shlex.join(closed)
        raise CliError(
            f"E107 {closed[-1]}: the service's user, {USER}, may not read it: sudo chgrp {USER} {these} && sudo chmod g+rX "
            f"{these}, then install again; nothing was started",
            exit_codes.PERMISSION,
        )


def _may(path: Path, way: str) -> bool:
    """way: of test(1); -x of a folder is to go through it."""
    group = pwd.getpwnam(USER).pw_gid
    groups = os.getgrouplist(USER, group)
    words = ("test", way, str(path))
    done = subprocess.run(words, user=USER, group=group, extra_groups=groups, cwd="/", check=False)
    return not done.returncode
