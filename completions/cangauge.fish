# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_cangauge_global_optspecs
    string join \n b/bus= t/timeout= retries= device= eds= f/format= trace= q/quiet v/verbose progress= color= h/help V/version
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

complete -c cangauge -n "__fish_cangauge_needs_command" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_needs_command" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_needs_command" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_needs_command" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_needs_command" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_needs_command" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_needs_command" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_needs_command" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_needs_command" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "scan" -d 'List every node that answers, with its state, identity and recognised device'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "read" -d 'Read measured values now, scaled, with unit and status'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "nmt" -d 'Send NMT commands and tell states'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "sdo" -d 'Read and write objects of the object dictionary'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "log" -d 'Record measurements as CSV or JSON Lines'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "info" -d 'Tell everything about one device on one page'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "unit" -d 'Tell or set the physical unit of a signal (6131h)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "filter" -d 'Tell or set the filter of a signal: type (61A0h) and constant (61A1h)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "limits" -d 'Tell or set what makes a TPDO of a signal go out by itself: delta, limits, hysteresis (x133h to x136h)'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "minmax" -d 'Tell the lowest and highest value that the device has measured, or reset them'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "errors" -d 'Tell the errors of a device: register (1001h) and history (1003h) in words, or clear the history'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "bus" -d 'List CAN interfaces, switch them on and off, find the bit rate of a bus'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "sim" -d 'Simulate devices on a bus until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "completions" -d 'Print the completions for a shell'
complete -c cangauge -n "__fish_cangauge_needs_command" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -l passive -d 'Send nothing: list who shows itself within 3 s'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand scan" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -l in -d 'Convert to this unit: bar, mbar, kPa, MPa, psi, degC, degF, K' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand read" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "start" -d 'To OPERATIONAL: the nodes send their TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "stop" -d 'To STOPPED: only NMT, heartbeat and LSS'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "preop" -d 'To PRE-OPERATIONAL: everything but PDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "reset" -d 'Restart the application (reset node)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "reset-comm" -d 'Restart the communication'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "state" -d 'Tell the states: by heartbeat, or node guarding where that is harmless; "-" where nothing tells it'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "watch" -d 'Follow heartbeats, boot-ups and losses until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "startup" -d 'Tell or set who starts a device after power on: wait for the master, or auto (by itself)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and not __fish_seen_subcommand_from start stop preop reset reset-comm state watch startup help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l confirm -d 'Exit 3 where nothing confirms the state'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -l no-wait -d 'Only send'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from start" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l confirm -d 'Exit 3 where nothing confirms the state'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -l no-wait -d 'Only send'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from stop" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l confirm -d 'Exit 3 where nothing confirms the state'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -l no-wait -d 'Only send'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from preop" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l confirm -d 'Exit 3 where nothing confirms the state'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -l no-wait -d 'Only send'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l confirm -d 'Exit 3 where nothing confirms the state'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -l no-wait -d 'Only send'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from reset-comm" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -l probe -d 'Where nothing tells the state: set the heartbeat (1017h) for a moment and put it back'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from state" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s d -l duration -d 'End after this time' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from watch" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from startup" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "start" -d 'To OPERATIONAL: the nodes send their TPDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "stop" -d 'To STOPPED: only NMT, heartbeat and LSS'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "preop" -d 'To PRE-OPERATIONAL: everything but PDOs'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "reset" -d 'Restart the application (reset node)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "reset-comm" -d 'Restart the communication'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "state" -d 'Tell the states: by heartbeat, or node guarding where that is harmless; "-" where nothing tells it'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "watch" -d 'Follow heartbeats, boot-ups and losses until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "startup" -d 'Tell or set who starts a device after power on: wait for the master, or auto (by itself)'
complete -c cangauge -n "__fish_cangauge_using_subcommand nmt; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -f -a "read" -d 'Read objects: the value as it is, never scaled; several print "OBJECT VALUE" lines'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -f -a "write" -d 'Write an object, or several OBJECT=VALUE'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and not __fish_seen_subcommand_from read write help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l type -d 'Take the bytes for this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l output -d 'Write the bytes to a file; - for stdout' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l block -d 'Whether to use block transfer: auto where it pays and the device offers it' -r -f -a "always\t'For everything'
never\t'For nothing'
auto\t'Where it pays'"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l hex -d 'Print the bytes in wire order'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -l force -d 'Overwrite the file'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from read" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l type -d 'Take the value for this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l sdo-size -d 'Whether the write says how many bytes it carries: auto asks the description, and tries the other way where the device takes it amiss' -r -f -a "indicated\t'2Fh, 2Bh, 27h, 23h'
omit\t'22h'
auto\t'As the device wants it'"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l input -d 'Take the bytes from a file; - for stdin' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l block -d 'Whether to use block transfer: auto where it pays and the device offers it' -r -f -a "always\t'For everything'
never\t'For nothing'
auto\t'Where it pays'"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -l verify -d 'Read back and compare'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from write" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from help" -f -a "read" -d 'Read objects: the value as it is, never scaled; several print "OBJECT VALUE" lines'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from help" -f -a "write" -d 'Write an object, or several OBJECT=VALUE'
complete -c cangauge -n "__fish_cangauge_using_subcommand sdo; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s d -l duration -d 'End after this time' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s n -l count -d 'End after this many rows' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l sync -d 'Send SYNC at this interval' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l poll -d 'Read by SDO at this interval' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s o -l output -d 'Write to a file instead of stdout' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l summary -d 'Write the summary as JSON to a file; - for stdout' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l passive -d 'Send nothing at all'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l no-nmt -d 'Leave the nodes\' NMT states alone'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -l force -d 'Overwrite files that exist'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand log" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand info" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand unit" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l type -d 'What the filter does' -r -f -a "none\t''
moving\t''
repeating\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l constant -d 'How many steps it takes' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -l damping -d 'Within which time the value follows a step; the device works out the constant' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand filter" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l delta -d 'A change of at least this sends; 0 is off' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l lower -d 'Below it, it sends' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l upper -d 'Above it, it sends' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -l hysteresis -d 'How far back behind a limit before it counts again' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand limits" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -l reset -d 'Begin anew; printed is what was there before'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand minmax" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -l clear -d 'Delete the history; an error that is pending stays in the register'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand errors" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "list" -d 'List the CAN interfaces of this machine with bit rate, state and error counters'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "up" -d 'Switch an interface on, at a bit rate'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "down" -d 'Switch an interface off'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "detect" -d 'Find the bit rate of a running bus by listening only; prints it in bit/s'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and not __fish_seen_subcommand_from list up down detect help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from list" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -l listen-only -d 'Only listen: no frame, no acknowledge, no error flag'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from up" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from down" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l for -d 'How long each bit rate is tried; the default hears a heartbeat of once a second' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -l active -d 'Where nothing is heard, ask: every node-ID for its device type, at one rate after the other. Only for a bench with one device: at a wrong rate this disturbs every frame on the bus'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from detect" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "list" -d 'List the CAN interfaces of this machine with bit rate, state and error counters'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "up" -d 'Switch an interface on, at a bit rate'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "down" -d 'Switch an interface off'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "detect" -d 'Find the bit rate of a running bus by listening only; prints it in bit/s'
complete -c cangauge -n "__fish_cangauge_using_subcommand bus; and __fish_seen_subcommand_from help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c cangauge -n "__fish_cangauge_using_subcommand sim" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s b -l bus -d 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s t -l timeout -d 'Longest wait for one answer [default: 500ms; scan: 200ms]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l retries -d 'How often a request that got no answer is repeated [default: 1]' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l device -d 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l eds -d 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several' -r
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s f -l format -d 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv' -r -f -a "text\t''
json\t''
csv\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l trace -d 'Write every frame sent and received to FILE, as candump -L does; - for stderr' -r -F
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l progress -d 'Show live values and progress on stderr; auto: on a terminal' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -l color -d 'Colour on stderr; auto: on a terminal, and without NO_COLOR' -r -f -a "auto\t''
always\t''
never\t''"
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s q -l quiet -d 'Say less on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s v -l verbose -d 'Say more on stderr'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s h -l help -d 'Print help'
complete -c cangauge -n "__fish_cangauge_using_subcommand completions" -s V -l version -d 'Print version'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "scan" -d 'List every node that answers, with its state, identity and recognised device'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "read" -d 'Read measured values now, scaled, with unit and status'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "nmt" -d 'Send NMT commands and tell states'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "sdo" -d 'Read and write objects of the object dictionary'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "log" -d 'Record measurements as CSV or JSON Lines'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "info" -d 'Tell everything about one device on one page'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "unit" -d 'Tell or set the physical unit of a signal (6131h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "filter" -d 'Tell or set the filter of a signal: type (61A0h) and constant (61A1h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "limits" -d 'Tell or set what makes a TPDO of a signal go out by itself: delta, limits, hysteresis (x133h to x136h)'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "minmax" -d 'Tell the lowest and highest value that the device has measured, or reset them'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "errors" -d 'Tell the errors of a device: register (1001h) and history (1003h) in words, or clear the history'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "bus" -d 'List CAN interfaces, switch them on and off, find the bit rate of a bus'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "sim" -d 'Simulate devices on a bus until Ctrl-C'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "completions" -d 'Print the completions for a shell'
complete -c cangauge -n "__fish_cangauge_using_subcommand help; and not __fish_seen_subcommand_from scan read nmt sdo log info unit filter limits minmax errors bus sim completions help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
