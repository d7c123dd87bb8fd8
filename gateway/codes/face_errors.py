"""E: what keeps a face from being served, or a master (a client verb, too) from being answered. The verb has ended."""

from typing import Final

from gateway import defaults
from gateway.codes.explanation import Explanation

FACE_ERRORS: Final = (
    Explanation(
        "E120",
        "the Modbus port needs a right",
        "Listening on a port below 1024 (Modbus' own is 502) was refused.",
        "Linux gives these ports to programs with the capability net_bind_service only.",
        f"Use --bind HOST:{defaults.MODBUS_PORT}, or run it as a service with AmbientCapabilities=CAP_NET_BIND_SERVICE.",
    ),
    Explanation(
        "E121",
        "the Modbus port cannot be opened",
        "Listening on the wanted address failed. After a restart of control it goes on without this face and tries again.",
        "Another program (an earlier gateway?) listens there, or the address is not one of this machine, or not any more.",
        "ss -ltnp shows who listens; --bind 127.0.0.1:0 takes any free port.",
    ),
    Explanation(
        "E122",
        "an open address without an allow-list",
        "The gateway is to listen on an address that others can reach, and nobody said who may connect.",
        "`bind:` was changed and `allow:` was not; plain Modbus has no password, so the list is the only door.",
        "Put the robot's network under network.allow in the rig file, e.g. 192.168.125.0/24.",
    ),
    Explanation(
        "E123",
        "no answer on the serial line",
        "A request was written to the port, and no whole answer came in time.",
        "Baud, parity or unit id differ, A and B are swapped, no Modbus RTU face is there, two masters speak at once; where it "
        "answered before, noise or a loose wire.",
        "Compare --baud, --parity and --unit with the gateway's line `modbus rtu`; where it answered before, look at shield "
        "and termination.",
    ),
    Explanation(
        "E124",
        "a port for masters that the rig uses",
        "`run --rtu PORT` names the port of one of the rig's devices, or of one of its faces.",
        "The wrong adapter, or two names of one: by-id names and /dev/ttyUSB0 lead to the same port.",
        "Give masters an adapter of their own; force-gateway ports lists what is plugged in.",
    ),
    Explanation(
        "E125",
        "an address without plain Modbus TCP",
        "`run --bind` was given, and the rig's file switches plain Modbus TCP off.",
        "network.plain is false: masters come in by the faces of `fieldbus` only.",
        "Leave --bind out, or write network.plain: true.",
    ),
    Explanation(
        "E127",
        "the port of the page or the metrics cannot be opened",
        "Listening on the address of `web` or `metrics` failed.",
        "Another program (another gateway's page?) listens there, or the address is not one of this machine.",
        "ss -ltnp shows who listens; --web 127.0.0.1:0 takes any free port.",
    ),
    Explanation(
        "E181",
        "the MQTT broker is away",
        "No connection to the broker of the rig's section `mqtt`, or it broke. Control goes on; data is kept and sent later.",
        "The broker is down, mqtt.host or mqtt.port is another, it refuses user, password or the topic of commands, or a "
        "second gateway takes our name there.",
        "mosquitto_sub -h HOST -p PORT -u USER -P PASSWORD -t '#' from this machine shows which. Give each cell a rig name of "
        "its own.",
    ),
    Explanation(
        "E128",
        "an open page without a token",
        "The page is to listen on an address that others can reach, and whoever opens it could command the force.",
        "`web.listen` or --web names another address than 127.0.0.1, and the rig file has no `web: {token: ...}`.",
        "Write a token of at least 16 characters there; openssl rand -hex 16 makes one. Browsers ask for it once.",
    ),
    Explanation(
        "E137",
        "somebody holds a force already",
        "`hold` was asked for while the output is enabled and its heartbeat goes on changing.",
        "A `hold` in another terminal, or a program. From one host both would share one setpoint, and the end of the first "
        "that lets go.",
        "End that one first (force-gateway monitor shows the owner); force-gateway write control_word=0 ends it at once.",
    ),
    Explanation(
        "E130",
        "no gateway there",
        "Nothing accepted the connection.",
        "The gateway is not running, listens on another address or port, or a firewall is between.",
        "Compare --gateway with the `modbus tcp` line of the gateway's banner.",
    ),
    Explanation(
        "E131",
        "connected, but no Modbus answer",
        "The connection was accepted, and no answer came within a second, or one that is not Modbus.",
        "Another program listens there, its allow-list closes your connection, its unit id is another; where it answered "
        "before, it has stopped.",
        "Check port and --unit; the rig's network.allow must contain this machine's address. Where it answered before, "
        "look at `force-gateway events` on its machine.",
    ),
    Explanation(
        "E171",
        "certificate or key cannot be read",
        "A file of a TLS connection is missing, or this user may not read it.",
        "A path that counts from another place (a rig file's count from that file), or files that belong to root.",
        "ls -l the path in the message; force-gateway certs DIR makes files to begin with.",
    ),
    Explanation(
        "E172",
        "private key of another certificate, or open to others",
        "The key does not belong to the certificate, or everybody can use it, or its group change it (read it may).",
        "Files of two runs were mixed, or copied without their mode.",
        "Take the .crt and .key that were made together; chmod 600 the key.",
    ),
    Explanation(
        "E173",
        "server certificate outside its days",
        "The gateway's own certificate has expired, or it or its CA's is not yet valid: no client accepts it; all else works.",
        "It was made long ago, or this machine's clock is wrong.",
        "date shows the clock; make a new one (force-gateway certs) and give it to the rig file.",
    ),
    Explanation(
        "E174",
        "no certificate or key in a file",
        "A file of a TLS connection is not what it should be: PEM text with BEGIN CERTIFICATE or BEGIN PRIVATE KEY.",
        "Two paths were swapped, the file is DER or PKCS #12, or its key has a password.",
        "openssl x509 -in FILE -noout -text, or openssl pkey -in FILE -noout, says what it is.",
    ),
    Explanation(
        "E175",
        "server certificate that no client would accept",
        "The gateway's own certificate is not signed by the CA that the face names, or is a client's, or its CA has expired.",
        "Files of two runs of certs were mixed, a client's .crt and .key stand where the gateway's belong, or the CA is old.",
        "Take gateway.crt and gateway.key that were made with this ca.crt; of two CAs, put both into one file as `ca`.",
    ),
    Explanation(
        "E176",
        "no TLS connection to the gateway",
        "The handshake failed, or the gateway closed the connection right after it.",
        "The port is the plain one; the gateway's certificate is of another CA or for another name; or it refuses yours.",
        "force-gateway events on the gateway's machine says why it refuses (W240 to W245).",
    ),
)
