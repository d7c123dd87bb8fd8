"""W, without a number in the registers: a connection that was closed, or a request that was taken otherwise than meant."""

from typing import Final

from gateway.codes.explanation import Explanation

NOTICES: Final = (
    Explanation(
        "W230",
        "connection refused",
        "A client was turned away when it connected; the log line says by which rule. It reads as a connection "
        "that closes.",
        "Its address is in none of the rig's allowed networks, or too many connections are open, none of them silent for 10 s.",
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
        "Another protocol id than 0, an impossible length, TLS that is damaged or has hardly any Modbus in it; the connection "
        "was closed.",
        "Another protocol on this port (HTTP, RTU over TCP), a client that lost count of its bytes, or two of its threads that "
        "write at once.",
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
        "W235",
        "noise on a master's serial line",
        "Bytes on a Modbus RTU face were no request: damaged ones, or what a line picks up. They were left out, at most once a "
        "minute a line tells how many.",
        "No termination or bias resistors on the RS-485 line, A and B swapped, its cable beside motors, two masters at once.",
        "120 ohm at both ends of the line, bias at one, a twisted pair with ground; requests that came whole were answered.",
    ),
    Explanation(
        "W236",
        "no request can be read on a serial line",
        "Bytes come in on a Modbus RTU face, and none of them make a request.",
        "The master's baud, parity or stop bits are not the face's, A and B are swapped, or it speaks another protocol.",
        "Set baud, parity and stop_bits of the face (fieldbus in the rig file) as they are in the master, such as 19200 8E1.",
    ),
    Explanation(
        "W237",
        "a client asks faster than it is answered",
        "More of a client's requests wait than are carried out in a second: a stop comes late, no heartbeat renews a lease, "
        "and nothing begins.",
        "It sends without waiting for its answers, more than network.requests_per_s (200 unless the rig file says otherwise).",
        "Let it wait for each answer, ask less often or for more registers at once; or raise network.requests_per_s.",
    ),
    Explanation(
        "W240",
        "certificate of a client not accepted",
        "A client connected by TLS without a certificate, with one of another CA, or did not accept the gateway's.",
        "The CA in the rig file is not the one that signed it, or the client does not know the gateway's CA.",
        "Make the client's certificate with the same CA: force-gateway certs DIR --client NAME:ROLE. New files of the "
        "gateway's own count from its next start.",
    ),
    Explanation(
        "W241",
        "certificate of a client outside its days",
        "A client's certificate, or that of the CA, has expired or is not yet valid; its connection was closed.",
        "It is old, or a clock is wrong: this machine's, or that of the machine which made it.",
        "date shows the clock; make the client a new one. Where force-gateway check says that the CA has expired: all anew.",
    ),
    Explanation(
        "W242",
        "certificate without a known role",
        "A client's certificate has no role, or one that there is not, or no usable name; its connection was closed.",
        "It was made without the extension 1.3.6.1.4.1.50316.802.1 (UTF8String: monitor, setpoint, calibration or admin).",
        "Make it with force-gateway certs --client NAME:ROLE, or add the extension in your own CA.",
    ),
    Explanation(
        "W243",
        "TLS handshake not finished",
        "A client did not finish its handshake in 5 s or in 12 KiB, or too many began at a time; it was cut.",
        "A port scanner, a plain Modbus client that waits for an answer, a very slow network, a chain of many certificates.",
        "Look at what runs at the address in the line; `allow` of the face keeps others out.",
    ),
    Explanation(
        "W244",
        "no TLS 1.2 or 1.3",
        "A client spoke something else than TLS on the TLS port, or a version that is not accepted any more.",
        "Plain Modbus TCP or a browser on the wrong port, or a client that knows TLS 1.0 and 1.1 only, or no P-256.",
        "Choose Modbus/TCP Security in the client and allow it P-256 (secp256r1), or connect it to the plain port.",
    ),
    Explanation(
        "W245",
        "revoked certificate",
        "A client showed a certificate whose serial number the rig file lists under `revoked`.",
        "A device that was to be shut out is still connected somewhere, or somebody uses its files.",
        "Find the machine at the address in the line; give it another certificate if it may connect after all.",
    ),
    Explanation(
        "W246",
        "server certificate is about to expire",
        "The gateway's own certificate, its CA's or one between ends within 30 days; after that no client connects by TLS.",
        "Certificates are made for a limited time, and certs makes a CA for the same as what it signs first.",
        "Make a new one with the same CA, put it into the rig file and start anew; clients keep theirs. Of a CA: all anew.",
    ),
    Explanation(
        "W247",
        "the rig's files have changed",
        "Control goes on with the rig as the gateway was started with it. What begins anew and needs the files waits.",
        "Somebody has edited or removed them while the gateway ran.",
        "force-gateway check RIG; end the gateway and start it again when the change is meant.",
    ),
    Explanation(
        "W248",
        "no room for new connections",
        "The system had no descriptor or memory for a Modbus TCP connection: it waits. The force and who is connected do not "
        "feel it.",
        "Another program has opened all files that this machine or user may have, or this process's limit is small.",
        "ulimit -n and /proc/sys/fs/file-nr show limit and use; end the program that opens so many, or raise LimitNOFILE.",
    ),
    Explanation(
        "W249",
        "the device's watchdog was off",
        "The output device, looked at once a second, said that its watchdog is off or has another time than it was told. It "
        "was armed again; the force was not touched.",
        "Its power was away for a moment (a loose plug, a weak supply), or another program on its line has set it.",
        "Look at the device's plug and supply; let nobody else talk to it. Where it cannot be armed again, A334 says so.",
    ),
    Explanation(
        "W250",
        "another calibration, plant or zero since the restart",
        "Control was started again and has another calibration or plant in use than before it, or no tare any more: forces may "
        "be off by the difference.",
        "A restart forgets the tare. The state directory, or the document's file in it, is gone or damaged; or another was "
        "chosen meanwhile.",
        "Tare again, with nothing pressed. calibration list shows what there is: choose with calibration use N, upload it "
        "anew, or restore a backup.",
    ),
    Explanation(
        "W251",
        "the device's watchdog does not arm",
        "The output device did not arm its watchdog. The rig says accept_no_device_watchdog, so the output is used: "
        "the guardian alone watches it.",
        "A switch or a setting in the device keeps the watchdog off, or the profile's words are another model's.",
        "See to the device's manual; force-gateway check --probe names what answered. With this machine off, nothing ends the "
        "force.",
    ),
    Explanation(
        "W252",
        "the clock cannot tell how old recordings are",
        "The clock was not set, or does not go with the ends of the recordings: `days` takes none, for a day where it seems "
        "to be ahead, or has leapt ahead.",
        "The machine has no battery for its clock and no time server, or stood still for longer than recordings are retained.",
        "date shows the clock; sudo timedatectl set-ntp true has it set by a time server. recordings keep N keeps one.",
    ),
    Explanation(
        "W304",
        "force with the output disabled",
        "The output is disabled, told the safe voltage, and the load cell still measures a force.",
        "The tool is stuck in contact, a valve is open, or the zero has moved; or the output does not obey (then ready is 0, "
        "and W214 says why).",
        "Free the tool; if nothing touches it, tare. Where the output does not obey, see to its plug first.",
    ),
    Explanation(
        "W314",
        "setpoint lowered",
        "A calibration came into use that allows less force than is commanded; the force goes down along the ramp.",
        "Its force_high is below the setpoint; force_requested still shows what the master wrote.",
        "Command a force that the calibration allows, or take the one before: calibration rollback.",
    ),
    Explanation(
        "W316",
        "self-test item warned",
        "An item of a self-test is off its usual value, though not so far that the machine should not press; the line has "
        "the numbers.",
        "Wear, a drift since the calibration, a noisy cable, or other work on the machine while it was tested.",
        "Look at the item the line names before it fails; calibrate again where the machine was changed.",
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
        "W332",
        "slow USB adapter",
        "The adapter of a serial port waits up to 16 ms before it hands over what it received, and may not be set here.",
        "An FTDI adapter as it comes; its latency timer may be written by root alone.",
        "The message has the line that sets it to 1 ms; a udev rule makes it last.",
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
        "trim has backed off",
        "Force or corrections changed their sign at one setpoint again and again, so the trim stands still there, or goes "
        "slower where its gain is the rig file's.",
        "The slide sticks and slips (dirt, dry seals, side load), the workpiece moves under the tool, or trim.gain_v_per_n_s "
        "or lead is too large for this rig.",
        "Nothing if the force is good enough. Else free and clean the slide, and calibrate, which measures the trim's pace.",
    ),
)
