"""E10x: what the machine that the gateway runs on does not give: ports, rights, directories, systemd. The verb has ended."""

from typing import Final

from gateway.codes.explanation import Explanation

MACHINE_ERRORS: Final = (
    Explanation(
        "E101",
        "no permission for a serial port",
        "The port is there, but this user may not open it.",
        "Serial ports belong to a group (dialout on Debian and Ubuntu, uucp on Arch) and you are not in it.",
        "sudo usermod -aG GROUP USER with the names from the message, then log out and in again.",
    ),
    Explanation(
        "E102",
        "serial port missing or renamed",
        "The port that the rig file names does not exist.",
        "The adapter is unplugged, or has another by-id name than the one in the file (another adapter of the same "
        "make).",
        "Compare with `force-gateway ports` and put the by-id path of your adapter into the rig file.",
    ),
    Explanation(
        "E103",
        "serial port in use",
        "Another process holds the port, and two talkers on one line garble each other.",
        "A terminal program, a second gateway or ModemManager; the message names the process.",
        "End that process; for ModemManager: sudo systemctl mask --now ModemManager.",
    ),
    Explanation(
        "E104",
        "another gateway runs on this state directory",
        "The state directory's lock is held.",
        "A gateway for this rig already runs, as a service or in another terminal; or, for a moment, a command such as "
        "`calibration use` or `restore` holds it.",
        "Use the one that runs, stop it, or give this one its own --state DIR.",
    ),
    Explanation(
        "E105",
        "no permission",
        "The operating system refused access to a file or directory.",
        "It belongs to another user, often because an earlier run was made with sudo.",
        "ls -l the path in the message; chown it, or choose another with --state or -o.",
    ),
    Explanation(
        "E106",
        "the operating system refused",
        "A file operation failed; the message has the system's own words and the path.",
        "A full disk, a missing directory, or a directory where a file was expected.",
        "df -h and ls -ld of the path in the message show which: make room, make the directory, or name another path.",
    ),
    Explanation(
        "E107",
        "the service cannot be installed",
        "A systemd unit for this rig could not be written, or would not work.",
        "Only root may write /etc, program or rig lie below /home, which the service does not see, its user may not read "
        "a file, or there is no such unit.",
        "Do what the message says; force-gateway service install RIG --dry-run shows everything without changing anything.",
    ),
    Explanation(
        "E108",
        "systemd has refused",
        "A command of systemd failed or is not there; its last words stand in the message.",
        "No systemd on this machine (a container), no root, or a unit that does not start.",
        "journalctl -u UNIT shows why a unit does not start; without systemd run `force-gateway run` under any supervisor.",
    ),
)
