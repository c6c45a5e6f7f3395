# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_cangauge_global_optspecs
    string join \n b/bus= t/timeout= retries= device= eds= sdo= accept-mismatch f/format= wait= pace trace= ignore-lock q/quiet v/verbose progress= color= h/help V/version
end

function __fish_cangauge_needs_command
    # Figure out if the current invocation already has a command.
    set -l cmd (commandline -opc)
    set -e cmd[1]
    argparse -s (__fish_cangauge_global_optspecs) -- $cmd 2>/dev/null
    or return
    if set -q argv[1]
        # Also print the command, so this can be used to figure out what it is.
        echo $argv[1]
        return 1
    end
    return 0
end

function __fish_cangauge_using_subcommand
    set -l cmd (__fish_cangauge_needs_command)
    test -z "$cmd"
    and return 1
    contains -- $cmd[1] $argv
end

complete -c cangauge -n "__fish_cangauge_needs_command" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_needs_command" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_needs_command" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_needs_command" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_needs_command" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_needs_command" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_needs_command" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_needs_command" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_needs_command" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_needs_command" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_needs_command" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "scan" -d 'List every node that answers, with its state, identity and recognised device'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "ls" -d 'List every node that answers, with its state, identity and recognised device'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "read" -d 'Read measured values now, scaled, with unit and status'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "nmt" -d 'Send NMT commands and show NMT states'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "sdo" -d 'Read and write objects of the object dictionary'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "log" -d 'Record measurements as CSV or JSON Lines'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "check" -d 'Check measurements against limits (exit code 0: all satisfied, 1: not satisfied, 3: no data)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "lss" -d 'Set the node-ID and bit rate of devices (LSS, CiA 305, or objects of the device)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "info" -d 'Show everything about a device on one page'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "status" -d 'Show everything about a device on one page'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "unit" -d 'Show or set the physical unit of a signal (6131h)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "filter" -d 'Show or set the filter of a signal: type (61A0h) and constant (61A1h)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "limits" -d 'Show or set what triggers a TPDO: delta, limits, hysteresis (x133h to x136h)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "minmax" -d 'Show the lowest and highest value that the device has measured, or reset them'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "errors" -d 'Show the errors of a device, register (1001h) and history (1003h), or clear the history'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "bus" -d 'List CAN interfaces, bring them up and down, and find the bit rate of a bus'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "pdo" -d 'Show, change and watch the transmit PDOs of nodes'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "config" -d 'Show all settings of a device as a file, compare them with a file, and set them from a file'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "autozero" -d 'Set the zero of a channel (6125h), with checks before and after'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "zero" -d 'Set the zero of a channel (6125h), with checks before and after'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "tare" -d 'Set the net value of a channel to zero (6139h), or restore it (--undo)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "store" -d 'Save settings to non-volatile memory (1010h)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "restore" -d 'Restore factory defaults (1011h), except node-ID and bit rate'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "sim" -d 'Simulate devices on a bus until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "doctor" -d 'Find out why a node or the whole bus is silent'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "monitor" -d 'Show all traffic on the bus in words, until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "health" -d 'Measure the load of the bus, heartbeat intervals and SDO answer times'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "objects" -d 'Show the objects of a device from its description or EDS'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "export" -d 'Describe the TPDOs of nodes for other programs'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "plot" -d 'Plot recordings of log, in the terminal or as SVG or PNG'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "devices" -d 'List device descriptions; show one as TOML, check a file, or describe a new device'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "completions" -d 'Print or install the completion script for a shell'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l passive -d 'Send nothing: list the nodes that send something within 3 s (or --timeout)'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l passive -d 'Send nothing: list the nodes that send something within 3 s (or --timeout)'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand ls" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l in -d 'Convert to this unit: bar, mbar, kPa, MPa, psi, degC, degF, K. Without SIGNAL, other quantities keep their unit' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "start" -d 'Set nodes to OPERATIONAL: nodes send TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "stop" -d 'Set nodes to STOPPED: only NMT, heartbeat and LSS work'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "preop" -d 'Set nodes to PRE-OPERATIONAL: everything except PDOs works'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "reset" -d 'Restart the application (reset node)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "reset-comm" -d 'Restart the communication'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "state" -d 'Show states, from the heartbeat or node guarding; "-" if unknown'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "watch" -d 'Follow heartbeats, boot-ups and losses until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "startup" -d 'Show or set the start after power-on: wait (for the master) or auto (the device starts by itself)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l confirm -d 'Exit with 3 if the state cannot be confirmed'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l no-wait -d 'Send the command without confirmation'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l confirm -d 'Exit with 3 if the state cannot be confirmed'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l no-wait -d 'Send the command without confirmation'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l confirm -d 'Exit with 3 if the state cannot be confirmed'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l no-wait -d 'Send the command without confirmation'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l confirm -d 'Exit with 3 if the state cannot be confirmed'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l no-wait -d 'Send the command without confirmation'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l confirm -d 'Exit with 3 if the state cannot be confirmed'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l no-wait -d 'Send the command without confirmation'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l probe -d 'If the state is unknown, switch on the heartbeat (1017h) for a moment'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s d -l duration -d 'End after this time' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "start" -d 'Set nodes to OPERATIONAL: nodes send TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "stop" -d 'Set nodes to STOPPED: only NMT, heartbeat and LSS work'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "preop" -d 'Set nodes to PRE-OPERATIONAL: everything except PDOs works'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "reset" -d 'Restart the application (reset node)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "reset-comm" -d 'Restart the communication'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "state" -d 'Show states, from the heartbeat or node guarding; "-" if unknown'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "watch" -d 'Follow heartbeats, boot-ups and losses until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "startup" -d 'Show or set the start after power-on: wait (for the master) or auto (the device starts by itself)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -f -a "read" -d 'Read objects and print their unscaled values'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -f -a "write" -d 'Write an object, or several OBJECT=VALUE'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l type -d 'Decode the bytes as this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l output -d 'Write the bytes to a file; - for stdout' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l block -d 'When to use block transfer: auto for long objects if the device supports it' -r -f -a "always\t'For every object'
never\t'Never'
auto\t'For long objects'"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l hex -d 'Print a hexadecimal number'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l bytes -d 'Print the bytes in wire order: 47 00 00 00'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l force -d 'Overwrite the file'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l type -d 'Encode the value as this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l sdo-size -d 'Include the size in the request. auto follows the description; if the device rejects this form, the other form is sent' -r -f -a "indicated\t'With the size: 2Fh, 2Bh, 27h, 23h'
omit\t'Without the size: 22h'
auto\t'As in the description of the device'"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l input -d 'Write the bytes of a file; - for stdin' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l block -d 'When to use block transfer: auto for long objects if the device supports it' -r -f -a "always\t'For every object'
never\t'Never'
auto\t'For long objects'"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l verify -d 'Read back and compare'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from help" -f -a "read" -d 'Read objects and print their unscaled values'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from help" -f -a "write" -d 'Write an object, or several OBJECT=VALUE'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s d -l duration -d 'End after this time' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s n -l count -d 'End after this many rows' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l sync -d 'Send SYNC at this interval' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l poll -d 'Read by SDO at this interval' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l request -d 'Request TPDOs by remote frames (RTR) at this interval. The values may be old; prefer --poll' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l max-gap -d 'Report longer intervals as gaps [default: 3 times the usual interval]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l expect -d 'Exit with 1 at the end if this expression failed: \'pressure in 9..11 bar\' (see cangauge check --help)' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s o -l output -d 'Write to a file instead of stdout' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l layout -d 'One row per value, or one per cycle of --sync or --poll' -r -f -a "long\t''
wide\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l rotate -d 'Start a new file after this time or at this size: 10m, 1h, 100MB, 1GiB. The files for run.csv are run-0001.csv and so on' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l events -d 'Write events as CSV: emergencies, gaps, node losses, reboots' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l summary -d 'Write the summary as JSON to a file, which is replaced unless --append; - for stdout' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l delimiter -d 'Delimiter of CSV: , ; | or tab [default: ,]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l decimal -d 'Decimal sign of CSV: . or , [default: .]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l time -d 'Format of times: text (RFC 3339), seconds since 1970, or days as in spreadsheets; all UTC' -r -f -a "rfc3339\t''
unix\t''
excel\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l passive -d 'Send nothing at all'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l start -d 'Start every node, also drives and inputs or outputs, and beside another NMT master [default: sensors]'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l no-nmt -d 'Do not change the NMT state of the nodes [default: if another NMT master is seen]'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l plot -d 'Plot the values at the end, on stderr (see cangauge plot)'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l force -d 'Overwrite existing files'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l append -d 'Append to existing files with the same columns. An incomplete last line is removed'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l bom -d 'Start CSV with a byte order mark, which some spreadsheets need'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l for -d 'Check all samples during this time' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l sync -d 'Send SYNC at this interval' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l poll -d 'Read by SDO at this interval' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l junit -d 'Write the verdicts as JUnit XML for CI servers, one test case per expression and node. An existing file is replaced' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l annotate -d 'Print an annotation per expression and node to stderr, and append a table to the file in GITHUB_STEP_SUMMARY [default: github if GITHUB_ACTIONS is true]' -r -f -a "github\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand check" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "scan" -d 'List devices with a node-ID (found by SDO) and without one (found by fastscan)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "inquire" -d 'Read the identity and node-ID of a device by LSS'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "set-id" -d 'Set the node-ID of a device: check that the node-ID is free, configure, store, reset, confirm'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "set-bitrate" -d 'Set the bit rate of a device'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "set" -d 'Set the node-ID and bit rate of a device, with one store and one reset'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "activate" -d 'Activate the configured bit rate. The device is silent for DELAY before the change, and for DELAY after it'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "store" -d 'Store node-ID and bit rate in non-volatile memory'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "identify" -d 'Check whether devices have an identity in a range. Exit code 3 if no device answers'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and not __fish_seen_subcommand_from scan inquire set-id set-bitrate set activate store identify help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from scan" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from inquire" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l via -d 'Method: lss, sdo (objects of the device), or auto (the preferred method in its description)' -r -f -a "auto\t''
lss\t''
sdo\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l no-store -d 'Do not store: a power cycle restores the old values'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l force -d 'Accept more than one device for "only": all of them change'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-id" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l table-index -d 'Index of the bit rate in the table of the device; --retime also needs RATE' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l via -d 'Method: lss, sdo (objects of the device), or auto (the preferred method in its description)' -r -f -a "auto\t''
lss\t''
sdo\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l retime -d 'Also switch the host interface; store after the device responds at the new bit rate. The device must be the only one on the bus'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l no-store -d 'Do not store: a power cycle restores the old values'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l force -d 'Accept more than one device for "only": all of them change'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set-bitrate" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l id -d 'New node-ID' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l bitrate -d '250k, 1M, 125000; auto if the device supports it' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l table-index -d 'Index of the bit rate in the table of the device; --retime also needs RATE' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l via -d 'Method: lss, sdo (objects of the device), or auto (the preferred method in its description)' -r -f -a "auto\t''
lss\t''
sdo\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l retime -d 'Also switch the host interface; store after the device responds at the new bit rate. The device must be the only one on the bus'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l no-store -d 'Do not store: a power cycle restores the old values'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l force -d 'Accept more than one device for "only": all of them change'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from set" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l force -d 'Accept more than one device for "only"'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from activate" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l force -d 'Accept more than one device for "only"'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from store" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from identify" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "scan" -d 'List devices with a node-ID (found by SDO) and without one (found by fastscan)'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "inquire" -d 'Read the identity and node-ID of a device by LSS'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "set-id" -d 'Set the node-ID of a device: check that the node-ID is free, configure, store, reset, confirm'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "set-bitrate" -d 'Set the bit rate of a device'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "set" -d 'Set the node-ID and bit rate of a device, with one store and one reset'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "activate" -d 'Activate the configured bit rate. The device is silent for DELAY before the change, and for DELAY after it'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "store" -d 'Store node-ID and bit rate in non-volatile memory'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "identify" -d 'Check whether devices have an identity in a range. Exit code 3 if no device answers'
complete -c cangauge -n "__fish_cangauge_using_subcommand lss; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l passive -d 'Listen without sending anything; show state and identity, as far as other masters have read it'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l passive -d 'Listen without sending anything; show state and identity, as far as other masters have read it'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand status" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l type -d 'Filter type' -r -f -a "none\t''
moving\t''
repeating\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l constant -d 'Filter constant: number of samples' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l damping -d 'Settling time after a step; the device calculates the constant from it' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l delta -d 'Delta: send if the value changes by at least this much; 0: off' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l lower -d 'Lower limit: send if the value falls below this limit' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l upper -d 'Upper limit: send if the value rises above this limit' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l hysteresis -d 'Hysteresis before a limit triggers again' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l reset -d 'Reset, and print the previous values'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l clear -d 'Delete the history; a pending error stays in the register'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "list" -d 'List the CAN interfaces of this computer with bit rate, state and error counters, and the serial adapters'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "up" -d 'Bring an interface up at a bit rate'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "down" -d 'Bring an interface down'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "detect" -d 'Find the bit rate of a running bus by listening; print it in bit/s'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l listen-only -d 'Listen only: send no frame, no acknowledgement and no error flag'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l for -d 'Time per bit rate; the default is longer than a heartbeat interval of 1 s' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l active -d 'If nothing is received, ask each node-ID for its device type at each bit rate. Only for a bench with one device: at a wrong bit rate this disturbs every frame on the bus'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "list" -d 'List the CAN interfaces of this computer with bit rate, state and error counters, and the serial adapters'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "up" -d 'Bring an interface up at a bit rate'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "down" -d 'Bring an interface down'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "detect" -d 'Find the bit rate of a running bus by listening; print it in bit/s'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -f -a "show" -d 'Show the settings of TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -f -a "map" -d 'Set the mapping and the transmission of a TPDO'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -f -a "watch" -d 'Show received TPDOs, decoded, until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and not __fish_seen_subcommand_from show map watch help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from show" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l transmission -d 'Transmission type: acyclic (on SYNC after a change), sync:N (on every N-th SYNC), event (255), timer (event timer), or a number' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l event-timer -d 'Event timer, in whole milliseconds; 0: off' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l inhibit -d 'Inhibit time: shortest time between two transmissions, in steps of 100us; 0: none' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l cob-id -d 'CAN identifier, 11 bits: 0x1A5' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -l store -d 'Store the change (1010h; only the communication settings if the device can store them separately)'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from map" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s d -l duration -d 'End after this time' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from watch" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from help" -f -a "show" -d 'Show the settings of TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from help" -f -a "map" -d 'Set the mapping and the transmission of a TPDO'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from help" -f -a "watch" -d 'Show received TPDOs, decoded, until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand pdo; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -f -a "dump" -d 'Print all settings of a device as a file for config apply'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -f -a "diff" -d 'Compare a device with a file, two devices, or two files; exit 1 if anything differs'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -f -a "apply" -d 'Configure a device from a file: check the file, write the differences, read everything back'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -f -a "schema" -d 'Print the JSON Schema of the file, for editors'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and not __fish_seen_subcommand_from dump diff apply schema help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l changed -d 'Omit settings that are factory defaults'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -l dcf -d 'Print a DCF (CiA 306) for other tools; without [calibration]'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from dump" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l address -d 'Compare [address], too'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -l with-calibration -d 'Compare [calibration], too'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from diff" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l table -d 'Configure many devices, one per row. Columns: vendor, product, serial, node (with --address), and one for each {NAME} in the file. A device that is not in the table is not changed' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l record -d 'Write a record: time, devices, old and new values, verification. HTML if the name ends with .html, else JSON' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l store -d 'Save to non-volatile memory (1010h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l reset -d 'Reset the node after the store, and read everything again'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l dry-run -d 'Show the writes; change nothing'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l exact -d 'Set settings that are not in the file to their factory defaults'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l address -d 'Set [address], too: node-ID, bit rate, explicit COB-IDs, SYNC producer. For one node only'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l with-calibration -d 'Set [calibration], too. The serial number must be equal'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l rollback -d 'Restore the settings saved before the last failed or interrupted apply'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -l prompt -d 'Set devices that are plugged in one after the other, each with the values of its row. Includes --address and --store. The result is written to the column "result" of the table. To compare the serial number with the label, type it before the device is plugged in'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from apply" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from schema" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from help" -f -a "dump" -d 'Print all settings of a device as a file for config apply'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from help" -f -a "diff" -d 'Compare a device with a file, two devices, or two files; exit 1 if anything differs'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from help" -f -a "apply" -d 'Configure a device from a file: check the file, write the differences, read everything back'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from help" -f -a "schema" -d 'Print the JSON Schema of the file, for editors'
complete -c cangauge -n "__fish_cangauge_using_subcommand config; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l channel -d 'Channel [default: the only channel that can be set to zero]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l limit -d 'Largest accepted reading: 0.1 (in the present unit), 100mbar, 2% (of the measuring range) [default: 1%]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l samples -d 'Number of readings before and after, 100 ms apart' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l force -d 'Skip the safety checks'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l store -d 'Store the offset, with the other application settings'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l dry-run -d 'Measure and check only; change nothing'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand autozero" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l channel -d 'Channel [default: the only channel that can be set to zero]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l limit -d 'Largest accepted reading: 0.1 (in the present unit), 100mbar, 2% (of the measuring range) [default: 1%]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l samples -d 'Number of readings before and after, 100 ms apart' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l force -d 'Skip the safety checks'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l store -d 'Store the offset, with the other application settings'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l dry-run -d 'Measure and check only; change nothing'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand zero" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l channel -d 'Channel [default: the only channel with a tare]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l undo -d 'Set the tare zero to 0, so that the net value is the process value again'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand tare" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l group -d 'Settings: all, communication (1000h to 1FFFh), or application (6000h to 9FFFh)' -r -f -a "all\t''
comm\t''
app\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l verify -d 'Reset the node, read the stored settings again, and compare'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand store" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l group -d 'Settings: all, communication (1000h to 1FFFh), or application (6000h to 9FFFh)' -r -f -a "all\t''
comm\t''
app\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l reset -d 'Reset the node, and compare with its description'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand restore" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l listen -d 'Serve the devices at this TCP port to other programs, as a socketcand server, in place of a bus. Without an address, only programs on this computer can connect' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l state -d 'Keep what the devices store, and their node-IDs, in this file for the next run' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l passive -d 'Send nothing'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand doctor" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s k -l kind -d 'Only these kinds of messages [default: all]' -r -f -a "nmt\t''
heartbeat\t''
boot-up\t''
guarding\t''
emcy\t''
sdo\t''
lss\t''
sync\t''
time\t''
pdo\t''
error\t''
other\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s d -l duration -l for -d 'End after this time' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s n -l count -d 'End after this many messages' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s a -l all -d 'Show repetitions too: heartbeats without a change of the state, repeated error frames'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand monitor" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s d -l for -l duration -d 'Measure for this time; a recording to its end' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l bitrate -d 'Bit rate of the bus, if the interface does not report it: 250k' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l passive -d 'Send nothing: SDO answer times come from the reads of other masters'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand health" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand objects" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -f -a "dbc" -d 'Print a DBC file with the present mapping of the TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and not __fish_seen_subcommand_from dbc help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from dbc" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from help" -f -a "dbc" -d 'Print a DBC file with the present mapping of the TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand export; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s o -l output -d 'Write the plot to a file: .svg or .png. An existing file is replaced' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s s -l signal -d 'Plot only this signal: pressure, or 5.pressure for one node [default: all]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l events -d 'Show the events in this file (log --events)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l from -d 'Start here: 14:30, 2026-11-29T14:30:00Z, or a time since the first value: 10m' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l to -d 'End here' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l elapsed -d 'Show the time since the start of the run. Several runs are compared'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand plot" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -f -a "show" -d 'Print a description as TOML'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -f -a "new" -d 'Print a first description of a device from the device and its EDS (--eds); comments mark missing parts'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -f -a "check" -d 'Report each mistake in a description file with its line'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and not __fish_seen_subcommand_from show new check help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from show" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from new" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from check" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from help" -f -a "show" -d 'Print a description as TOML'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from help" -f -a "new" -d 'Print a first description of a device from the device and its EDS (--eds); comments mark missing parts'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from help" -f -a "check" -d 'Report each mistake in a description file with its line'
complete -c cangauge -n "__fish_cangauge_using_subcommand devices; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s b -l bus -d 'Bus: can0 (SocketCAN), socketcand://HOST/can0 (a remote one), slcan:/dev/ttyACM0@250k or slcan:tcp://HOST:PORT@250k (a serial adapter; @ and the bit rate of the bus), sim, sim:mh4@5:pressure=0bar,dps@127, sim:FILE.toml, replay:FILE (a recording of candump, Vector ASC, PEAK TRC or python-can CSV; receive only), replay:FILE:can1 (one of its channels) [default: the only CAN interface that is up]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l retries -d 'Number of times to repeat a request without an answer [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l device -d 'Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes: NODE=NAME' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l eds -d 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l sdo -d 'COB-IDs of requests and answers, if the SDO channel of a node is not the usual one: 0x645:0x5C5; NODE=TX:RX for one of several nodes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s f -l format -d 'Output format: text, JSON Lines or CSV; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l wait -d 'Wait up to DUR if the CAN interface is missing or down' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l trace -d 'Write every frame to FILE (candump -L; for Wireshark if the name ends in .pcapng; - for stderr)' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l progress -d 'Show live values and progress on stderr; auto: only on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l color -d 'Use colour on stderr; auto: only on a terminal without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l accept-mismatch -d 'Use a description or EDS of another device (its vendor or product differs)'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l pace -d 'Replay a recording (replay:) in real time'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l ignore-lock -d 'Continue although another program uses the same nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s q -l quiet -d 'Print less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s v -l verbose -d 'Print more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "scan" -d 'List every node that answers, with its state, identity and recognised device'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "read" -d 'Read measured values now, scaled, with unit and status'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "nmt" -d 'Send NMT commands and show NMT states'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "sdo" -d 'Read and write objects of the object dictionary'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "log" -d 'Record measurements as CSV or JSON Lines'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "check" -d 'Check measurements against limits (exit code 0: all satisfied, 1: not satisfied, 3: no data)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "lss" -d 'Set the node-ID and bit rate of devices (LSS, CiA 305, or objects of the device)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "info" -d 'Show everything about a device on one page'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "unit" -d 'Show or set the physical unit of a signal (6131h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "filter" -d 'Show or set the filter of a signal: type (61A0h) and constant (61A1h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "limits" -d 'Show or set what triggers a TPDO: delta, limits, hysteresis (x133h to x136h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "minmax" -d 'Show the lowest and highest value that the device has measured, or reset them'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "errors" -d 'Show the errors of a device, register (1001h) and history (1003h), or clear the history'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "bus" -d 'List CAN interfaces, bring them up and down, and find the bit rate of a bus'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "pdo" -d 'Show, change and watch the transmit PDOs of nodes'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "config" -d 'Show all settings of a device as a file, compare them with a file, and set them from a file'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "autozero" -d 'Set the zero of a channel (6125h), with checks before and after'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "tare" -d 'Set the net value of a channel to zero (6139h), or restore it (--undo)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "store" -d 'Save settings to non-volatile memory (1010h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "restore" -d 'Restore factory defaults (1011h), except node-ID and bit rate'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "sim" -d 'Simulate devices on a bus until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "doctor" -d 'Find out why a node or the whole bus is silent'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "monitor" -d 'Show all traffic on the bus in words, until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "health" -d 'Measure the load of the bus, heartbeat intervals and SDO answer times'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "objects" -d 'Show the objects of a device from its description or EDS'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "export" -d 'Describe the TPDOs of nodes for other programs'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "plot" -d 'Plot recordings of log, in the terminal or as SVG or PNG'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "devices" -d 'List device descriptions; show one as TOML, check a file, or describe a new device'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "completions" -d 'Print or install the completion script for a shell'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log check lss info unit filter limits minmax errors bus pdo config autozero tare store restore sim doctor monitor health objects export plot devices completions help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "start" -d 'Set nodes to OPERATIONAL: nodes send TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "stop" -d 'Set nodes to STOPPED: only NMT, heartbeat and LSS work'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "preop" -d 'Set nodes to PRE-OPERATIONAL: everything except PDOs works'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "reset" -d 'Restart the application (reset node)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "reset-comm" -d 'Restart the communication'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "state" -d 'Show states, from the heartbeat or node guarding; "-" if unknown'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "watch" -d 'Follow heartbeats, boot-ups and losses until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from nmt" -f -a "startup" -d 'Show or set the start after power-on: wait (for the master) or auto (the device starts by itself)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from sdo" -f -a "read" -d 'Read objects and print their unscaled values'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from sdo" -f -a "write" -d 'Write an object, or several OBJECT=VALUE'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "scan" -d 'List devices with a node-ID (found by SDO) and without one (found by fastscan)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "inquire" -d 'Read the identity and node-ID of a device by LSS'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "set-id" -d 'Set the node-ID of a device: check that the node-ID is free, configure, store, reset, confirm'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "set-bitrate" -d 'Set the bit rate of a device'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "set" -d 'Set the node-ID and bit rate of a device, with one store and one reset'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "activate" -d 'Activate the configured bit rate. The device is silent for DELAY before the change, and for DELAY after it'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "store" -d 'Store node-ID and bit rate in non-volatile memory'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from lss" -f -a "identify" -d 'Check whether devices have an identity in a range. Exit code 3 if no device answers'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "list" -d 'List the CAN interfaces of this computer with bit rate, state and error counters, and the serial adapters'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "up" -d 'Bring an interface up at a bit rate'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "down" -d 'Bring an interface down'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from bus" -f -a "detect" -d 'Find the bit rate of a running bus by listening; print it in bit/s'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from pdo" -f -a "show" -d 'Show the settings of TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from pdo" -f -a "map" -d 'Set the mapping and the transmission of a TPDO'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from pdo" -f -a "watch" -d 'Show received TPDOs, decoded, until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from config" -f -a "dump" -d 'Print all settings of a device as a file for config apply'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from config" -f -a "diff" -d 'Compare a device with a file, two devices, or two files; exit 1 if anything differs'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from config" -f -a "apply" -d 'Configure a device from a file: check the file, write the differences, read everything back'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from config" -f -a "schema" -d 'Print the JSON Schema of the file, for editors'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from export" -f -a "dbc" -d 'Print a DBC file with the present mapping of the TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from devices" -f -a "show" -d 'Print a description as TOML'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from devices" -f -a "new" -d 'Print a first description of a device from the device and its EDS (--eds); comments mark missing parts'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and __fish_seen_subcommand_from devices" -f -a "check" -d 'Report each mistake in a description file with its line'

# Names of signals, objects, devices and units come from the program.
complete -c cangauge -a '(cangauge completions -- (commandline -opc)[2..-1] (commandline -ct) 2>/dev/null)'
