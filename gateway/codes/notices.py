"""W, without a number in the registers: a connection that was closed, or a request that was taken otherwise than meant."""

from typing import Final

from gateway.codes.explanation import Explanation

NOTICES: Final = (
    Explanation(
        "W230",
        "connection refused",
        "A client was turned away when it connected; the log line says by which rule. It reads as a connection "
        "that closes.",
        "Its address is in none of the rig's allowed networks, or too many connections are open.",
        "Add its network to network.allow in the rig file, or close connections that are not needed.",
    ),
    Explanation(
        "W231",
        "answers not read",
        "A client sent requests and did not read the answers; its connection was closed at the bound.",
        "Its program stands still, or writes without ever reading.",
        "Let the client read each answer before the next request.",
    ),
    Explanation(
        "W232",
        "not Modbus TCP",
        "Bytes with another protocol id than 0, or an impossible length; the connection was closed.",
        "Another protocol on this port (HTTP, RTU over TCP), or a client that lost count of its bytes.",
        "Choose Modbus TCP in the client, not RTU over TCP.",
    ),
    Explanation(
        "W233",
        "half a request",
        "A request stayed incomplete for seconds; the connection was closed.",
        "A length field that promises more than the client sends, or a broken network.",
        "Look at the client's frames: the length counts unit id and everything after it.",
    ),
    Explanation(
        "W234",
        "a frozen load cell would be found late",
        "While the force stands still only its noise shows that a cell lives; at this rate there is too little of it for 2 s.",
        "A coarse count (few digits on the amplifier), few samples per second, or a strong filter.",
        "Set a finer resolution, a faster rate or a weaker filter on the amplifier; or frozen_equal_samples in the rig file.",
    ),
    Explanation(
        "W304",
        "force at the safe voltage",
        "The output is at the safe voltage and the load cell still measures a force.",
        "The tool is stuck in contact, a valve is open, or the zero has moved.",
        "Free the tool; if nothing touches it, tare.",
    ),
    Explanation(
        "W314",
        "setpoint lowered",
        "A calibration came into use that allows less force than is commanded; the force goes down along the ramp.",
        "Its force_high is below the setpoint; force_requested still shows what the master wrote.",
        "Command a force that the calibration allows, or take the one before: calibration rollback.",
    ),
    Explanation(
        "W330",
        "a set without slip stops",
        "A commit had the length 140: the form of map version 1, which carries a linear blend and no measured "
        "response.",
        "A master's program that was written for map version 1. The set is in use as it was sent.",
        "Send the whole set, length 190: force-gateway upload FILE --print-frames shows how.",
    ),
    Explanation(
        "W336",
        "disabled by somebody else",
        "While `hold` kept a force, enable was cleared by another client; any master may do that.",
        "A robot program's stop, a colleague, or another terminal on this machine.",
        "force-gateway monitor --state DIR shows the last writer of control_word; hold again when it is agreed.",
    ),
    Explanation(
        "W360",
        "trim stands still",
        "The trim's corrections at one setpoint changed their sign again and again, so it stopped correcting there.",
        "The slide sticks and slips (dirt, dry seals, side load), or the workpiece moves under the tool.",
        "Nothing if the force is good enough: the next setpoint starts afresh. Else free and clean the slide, and "
        "calibrate.",
    ),
)
