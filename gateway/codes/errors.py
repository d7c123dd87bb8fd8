"""E: something around the gateway is not as it should be: ports, files. The verb that met it has ended.

Those between masters and a gateway are in face_errors.
"""

from typing import Final

from gateway.codes.explanation import Explanation

ERRORS: Final = (
    Explanation(
        "E110",
        "bytes arrive, no valid line",
        "The line carries bytes, none of which form a message of this device at this baud rate.",
        "The wrong baud rate, the wrong device profile, or another unit or format; seldom inverted or missing ground.",
        "Set `baud:` in the rig file to what the device's menu says (mostly 9600 or 115200); where it is quoted, set it to "
        "speak as its profile reads.",
    ),
    Explanation(
        "E111",
        "silence on a serial line",
        "Not one byte came from the device, or it does not answer.",
        "No power, RX and TX crossed, the wrong port, or an amplifier that is not in stream mode.",
        "Check its power light, then swap RX and TX (pins 2 and 3); then look for `stream` in its menu.",
    ),
    Explanation(
        "E112",
        "nothing that is known answered the probe",
        "Each profile's harmless questions were put at each usual speed, and no answer made sense.",
        "No power, crossed wires, another address or parity than in the profile, or a device that no profile describes.",
        "Read what was heard, if anything; set address and parity as the device has them; your own device: profiles/README.md.",
    ),
    Explanation(
        "E113",
        "another device answered than the rig names",
        "The probe was answered, at another speed or in the words of another profile than the rig file says.",
        "Two adapters exchanged, a device that is set to another speed, or a copied rig file.",
        "Put what answered into the rig file, or exchange the two ports; then probe again.",
    ),
    Explanation(
        "E114",
        "nothing to probe",
        "check --probe asks the devices of a rig at its own ports, or with --port PORT the one of a device's own file.",
        "A simulated rig, a file of another kind, a device's file without --port, or a rig's with it.",
        "Name a real rig's file; force-gateway ports --listen PORT listens at any port.",
    ),
    Explanation(
        "E132",
        "no such thing can be set on a simulated rig",
        "`force-gateway sim` was given a name that is neither a fault, nor something around the tool, nor an effect.",
        "A slip of the pen, or a parameter that this effect does not have.",
        "force-gateway sim list --all shows every name with its unit and bounds.",
    ),
    Explanation(
        "E133",
        "a simulated rig does not take this value",
        "The name is known; the value is not of its kind, out of range, or of a part that this rig does not have.",
        "A word where a number is wanted, a number beyond the bounds in the message, or a valve fault on a rig without one.",
        "Give a value within the bounds that the message names; on and off for a fault.",
    ),
    Explanation(
        "E134",
        "not a simulated rig",
        "Faults and effects were to be set on a rig whose devices are real.",
        "The running gateway drives the real machine, or --state or --rig names another gateway than you meant.",
        "Rehearse beside it: force-gateway run RIG --sim --state DIR, and the same --state DIR for sim.",
    ),
    Explanation(
        "E135",
        "the simulated rig's process does not answer",
        "Control answered, but not rig.sock in the state directory; the audit holds what was asked, and it may not be set.",
        "The simulated rig's process has just died and is being started again, or it has ended for good (A409).",
        "Wait a second and repeat; force-gateway events shows whether it came back.",
    ),
    Explanation(
        "E136",
        "no machine has such a plant",
        "With the effects that were to be set the simulation does not come to a finite force; nothing was changed.",
        "Several effects at the ends of their ranges, which no machine has together.",
        "Set smaller values, or one effect after the other; sim clear begins anew.",
    ),
    Explanation(
        "E140",
        "no running gateway on this state directory",
        "Nobody listens on control.sock in the state directory.",
        "The gateway is not running, or runs with another --state or rig than you named here.",
        "Give the same --state DIR (or --rig) as to `force-gateway run`.",
    ),
    Explanation(
        "E141",
        "the running gateway said no",
        "The control socket answered, with a refusal; the message has its sentence.",
        "What was asked does not fit its present state, e.g. a second recording beside a running one.",
        "Do what the message ends with, or wait for what is under way: force-gateway monitor shows the state.",
    ),
    Explanation(
        "E150",
        "events are not kept",
        "The disk did not take a line of events.jsonl. Control goes on; the lines are still on the gateway's stderr.",
        "The disk is full, read-only or gone; a quota or a limit on files; or the state directory was removed.",
        "df -h on the state directory; once lines are taken again, the next one says how many are missing.",
    ),
    Explanation(
        "E151",
        "gateway did not start: the rig file has faults",
        "The rig file could not be used; every fault is in the event, with its line and column.",
        "It was edited since the last start, or belongs to another version.",
        "force-gateway check RIG shows the same; fix it and start again.",
    ),
    Explanation(
        "E152",
        "no local socket for the tools",
        "control.sock (or a simulated rig's rig.sock) could not be made. The tools, the page and MQTT reach control by it, "
        "and so do their stops; Modbus does not.",
        "A path of more than 107 bytes, a file system that has no sockets, somebody has put another file in its place, or has "
        "removed the state directory.",
        "Give a shorter --state DIR, on a local disk; remove the other file, or make the directory again: the socket comes "
        "back. Stop by Modbus until then.",
    ),
    Explanation(
        "E160",
        "a library is not installed, or broken",
        "A library that this verb, the page, MQTT or OPC UA needs is not there, or does not load; holding a force does not "
        "need it.",
        "The gateway was installed without the extra `analysis`: numba (diagnose, simulate, watch), pyarrow (Parquet). Or an "
        "installation was cut.",
        "pip install 'force-gateway[analysis]' into the gateway's environment (250 MB more). What is broken: install it anew; "
        "its process starts again by itself.",
    ),
    Explanation(
        "E170",
        "audit does not hold",
        "The chain of hashes over the record of writes breaks at the named line: it was altered, or one is missing.",
        "Somebody changed, removed or moved a line; a power cut leaves at most an incomplete last line, which is told apart.",
        "Compare the file with a backup (force-gateway backup packs it); what stands before that line still holds.",
    ),
    Explanation(
        "E180",
        "the gateway was lost while a force was held",
        "The connection to the gateway broke and could not be had again while a lease may run.",
        "The gateway was stopped, its machine went down, or the network between is broken.",
        "Look at the tool first: a rig with a lease has let go, one without may still press. Then read the "
        "gateway's log.",
    ),
    Explanation(
        "E185",
        "the map lacks registers that a client needs",
        "A client for a robot or PLC is made from the register map, and `hold`, `upload` and others go by it: they name "
        "registers that this one does not have.",
        "A map of your own in which registers were renamed or left out, or have names that the client's language cannot have.",
        "Take the missing ones over from profiles/registers/force-v1.yaml, and give those of your own a short name.",
    ),
    Explanation(
        "E186",
        "the gateway serves another register map",
        "Register map_hash is not that of the map of this program: its counts, or its places, mean something else there. "
        "Nothing was written.",
        "A rig with a register map of its own, or a gateway of another version.",
        "Name the rig's map: --map FILE (the banner of `run` has the whole line). A write of zeros alone, such as "
        "control_word=0, goes out all the same.",
    ),
    Explanation(
        "E190",
        "no recording matches",
        "The pattern of fleet fit or fleet diagnose finds no file.",
        "A pattern without quotes that the shell has expanded elsewhere, a misspelled folder, or another ending.",
        "Quote it: 'recordings/cell=*/date=*/*.parquet'; ls with the same pattern shows what is there.",
    ),
    Explanation(
        "E191",
        "no Dask scheduler answers",
        "The address given with --scheduler takes no connection of a Dask client.",
        "No scheduler runs there, a firewall, or other versions of dask on both sides.",
        "dask scheduler starts one and prints its address, dask worker ADDRESS joins it; without a cluster leave it out.",
    ),
    Explanation(
        "E192",
        "a recording ended its worker twice",
        "The process that computed this row was killed, and again when it was tried alone.",
        "Mostly memory: a recording of very many rows on a small machine. The kernel's log (dmesg) names who was killed.",
        "Diagnose it by itself on a larger machine, or shorten it; the other rows are not touched by it.",
    ),
    Explanation(
        "E402",
        "recording stopped",
        "The disk did not take a batch of the recording, or a sync of it. Control goes on, rows before that are whole.",
        "The disk is full, read-only, broken or gone; a quota; or a limit on the length of files.",
        "Free space (df -h on the state directory): it goes on by itself within an hour, by force-gateway record on at once.",
    ),
    Explanation(
        "E403",
        "not a readable recording",
        "The file is not a recording of force-gateway, or was cut inside its header, before the first row.",
        "The wrong file, a text-mode transfer, or a recorder that was killed in the moment it began.",
        "force-gateway recordings list shows which are readable.",
    ),
    Explanation(
        "E404",
        "not a usable backup",
        "The archive is damaged, was not made by `backup`, or contains paths that lead out of the directory.",
        "The wrong file, or a transfer that broke off. Nothing was changed.",
        "gzip -t FILE tells whether the transfer is whole: copy it again where not. force-gateway backup makes such a file.",
    ),
    Explanation(
        "E405",
        "something is already there",
        "The target exists and would be overwritten.",
        "You ran the same verb before, or chose a name that is taken.",
        "Take another name, or --force where the verb has it.",
    ),
    Explanation(
        "E406",
        "more slip stops than an upload carries",
        "The calibration has more slip stops than the registers have room for; nothing was sent.",
        "A calibration file made by other means than this program's fit, which gives no more than fit.",
        "Name the file as the rig's calibration (calibration: FILE), or fit it with fewer stops.",
    ),
    Explanation(
        "E407",
        "a recording that stays",
        "The recording is kept, is the rig's reference, or is being recorded; it was not deleted.",
        "recordings keep, recordings reference, or a recording under way.",
        "recordings keep N --no, recordings reference --none, or record off; then delete it.",
    ),
    Explanation(
        "E421",
        "not a ladder to fit",
        "The table can be read, but a calibration must not be made from it; the message says what was seen.",
        "One direction only, a saturated cell, kgf read as N, a wrong sign, swapped columns, or another rig's file.",
        "Do what the message ends with, and run the ladder again: force-gateway calibrate.",
    ),
    Explanation(
        "E422",
        "nothing to go on with",
        "calibrate --resume found no recorded calibration run in the state directory, or one that does not say its plan.",
        "Another --state or --rig than the one the run was started with.",
        "Compare with force-gateway recordings list, or begin a new run without --resume.",
    ),
    Explanation(
        "E431",
        "calibration not stored",
        "The disk refused a calibration or plant, or the note of which one is in use. What was in use stays in use.",
        "The disk is full (ENOSPC), read-only, or broken (EIO); or the machine has no thread left for it, no memory.",
        "Free space (df -h on the state directory) or memory, then repeat the upload or `calibration use`.",
    ),
    Explanation(
        "E432",
        "damaged file in the calibration store",
        "A calibration or plant, or the note of which one is in use, does not have the CRC-32 in its first line.",
        "The file was edited by hand, or the disk lost a part of it. The one before it is used, else the rig's own.",
        "force-gateway calibration list shows which are whole; `calibration use N` chooses; a backup has the rest.",
    ),
    Explanation(
        "E433",
        "no such calibration",
        "The number is not in the store, nothing was in use before, or this calibration or plant cannot be used for that.",
        "A number of another rig or state directory, or the first calibration that was ever used here.",
        "force-gateway calibration list, with the same --state (or --rig) as `run`.",
    ),
    Explanation(
        "E434",
        "another set is in use than the one that was uploaded",
        "The commit went through, but the active block reads back other numbers.",
        "Another master, or `calibration use` on the gateway's machine, changed the set in the same moment.",
        "force-gateway read active_slot calibration_id shows what is in use; agree on one master for uploads.",
    ),
    Explanation(
        "E435",
        "calibration stored as rejected",
        "The fit's RMS error on all measured points is more than in_band_tolerance_n, or clearly more than that of "
        "the calibration in use on the same data.",
        "Too few or too coarse stairs, no reversal part, a tool that slipped, or a zero that moved during the run.",
        "Look at its report, then run a finer ladder: force-gateway calibrate. `calibration use N --force` takes "
        "it anyway.",
    ),
    Explanation(
        "E436",
        "a rejected calibration is not used",
        "`calibration use` names a calibration whose fit was rejected when it was made; the message has the figures.",
        "It was made of data that do not describe the rig well enough; see E435.",
        "Use another of `force-gateway calibration list`, or give --force if you know better.",
    ),
    Explanation(
        "E437",
        "another ladder than the one that was stopped",
        "calibrate --resume was given other stairs than those of the run that it is to go on with.",
        "Groups of different stairs describe different ladders and are not fitted together.",
        "Leave --step and --v-max out to go on, or leave --resume out to begin anew.",
    ),
    Explanation(
        "E520",
        "a column in another unit",
        "The measured force, or a pressure, is by a unit's own factor larger or smaller than the plant gives for "
        "its drive.",
        "The table's numbers are in kgf, mN, bar, mV, ms ..., not in what the column's name ends with.",
        "Give the unit: diagnose FILE --columns force_n=force_n:kgf (the message spells it). Causes come after that.",
    ),
    Explanation(
        "E521",
        "two columns are swapped",
        "The plant agrees with the recording only when two of its columns are exchanged.",
        "A header that is one column off, or the numbers in --columns.",
        "Exchange them: diagnose FILE --columns command_v=force_n,force_n=command_v (the message spells it).",
    ),
    Explanation(
        "E522",
        "the force has the wrong sign",
        "The measured force falls where the plant's rises, by the same amount.",
        "The cell's wires are exchanged, the rig's `sign` is wrong, or a pull counts as positive.",
        "diagnose FILE --columns force_n=force_n:-n turns it; in the rig file, load_cell: sign.",
    ),
    Explanation(
        "E523",
        "not fit to be the reference",
        "recordings reference was given a recording that does not show the machine.",
        "It is short, its command hardly moves, or a fault stood in it.",
        "Record half a minute of work or more while all is well (record on, record off), and name that.",
    ),
    Explanation(
        "E500",
        "internal error",
        "A verb ended with an error that its author did not foresee.",
        "An internal error; nothing that you typed should do this.",
        "Report it with the traceback that `force-gateway --debug ...` prints; force-gateway report packs the rest.",
    ),
)
