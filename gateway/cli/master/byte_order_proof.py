"""Some rigs want 1234.5 in byte_order_echo before they begin anything: proof of a client's word order. Our own is right, so
nobody need write it by hand."""

from gateway.cli.master.client import Assignment, Frame, GatewayClient, RefusedError
from gateway.codes.refusals import RefusalReason
from gateway.registers.writes.byte_order_echo import PROOF


def write_with_proof(client: GatewayClient, frame: Frame) -> None:
    """Write a frame, and the proof before it where that is what it is refused for. RefusedError as `GatewayClient.write`."""
    try:
        client.write(frame)
    except RefusedError:
        if not prove_byte_order(client):
            raise
        client.write(frame)


def prove_byte_order(client: GatewayClient) -> bool:
    """Write the proof where the last refusal wants it; return whether it was missing and has been written now."""
    (reason,) = client.read_values([client.register_map.find("refusal_reason")])
    if int(reason.value) != RefusalReason.BYTE_ORDER_UNPROVEN:
        return False
    echo = client.register_map.find("byte_order_echo")
    client.write_values([Assignment(echo, echo.encode(PROOF))])
    return True
