"""Whether somebody holds a force already. A setpoint is owned by a host: of two programs of one host the second one's force
would become the first one's too, and the first that lets go would let go for both."""

import time
from typing import Final

from gateway.cli.errors import CliError
from gateway.cli.master.client import GatewayClient
from gateway.processes import exit_codes
from gateway.registers.words import StatusBit

_WATCHED_S: Final = 0.5  # several beats of a hold, and one at least of most programs


def check_nobody_holds(client: GatewayClient) -> int:
    """Return the heartbeat that stands there. E137 where the output is enabled and it goes on changing; a force that was left,
    by a hold that was killed say, may be taken over."""
    names = ("heartbeat", "status_word", "force_requested")
    heartbeat, status, requested = client.read_values([client.register_map.find(name) for name in names])
    standing = int(heartbeat.value)
    if int(status.value) & StatusBit.ENABLED:
        time.sleep(_WATCHED_S)
        if int(client.read_values([heartbeat.register])[0].value) != standing:
            raise CliError(
                f"E137 {client.where}: somebody holds {requested.value:.2f} N there already, for the heartbeat changes; end "
                "that first, or `force-gateway write control_word=0` ends it at once",
                exit_codes.DATA,
            )
    return standing
