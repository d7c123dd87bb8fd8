"""Exit codes of every process and verb, those of sysexits.h where it has one."""

import signal
from typing import Final

OK: Final = 0
FAILED: Final = 1  # asked for and not done: a refusal, a full disk, an internal error
USAGE: Final = 2  # the command line itself
DATA: Final = 65  # an input file that is not what it should be
DEVICE: Final = 69  # a port, a device, a gateway or an extra that is not there
PERMISSION: Final = 77
CONFIGURATION: Final = 78  # a profile with a fault
BY_SIGNAL: Final = 128  # and the signal's number, as shells count: it has ended what was asked for
INTERRUPTED: Final = BY_SIGNAL + signal.SIGINT  # Ctrl-C
