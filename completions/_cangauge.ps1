
using namespace System.Management.Automation
using namespace System.Management.Automation.Language

Register-ArgumentCompleter -Native -CommandName 'cangauge' -ScriptBlock {
    param($wordToComplete, $commandAst, $cursorPosition)

    $commandElements = $commandAst.CommandElements
    $command = @(
        'cangauge'
        for ($i = 1; $i -lt $commandElements.Count; $i++) {
            $element = $commandElements[$i]
            if ($element -isnot [StringConstantExpressionAst] -or
                $element.StringConstantType -ne [StringConstantType]::BareWord -or
                $element.Value.StartsWith('-') -or
                $element.Value -eq $wordToComplete) {
                break
        }
        $element.Value
    }) -join ';'

    $completions = @(switch ($command) {
        'cangauge' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('scan', 'scan', [CompletionResultType]::ParameterValue, 'List every node that answers, with its state, identity and recognised device')
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read measured values now, scaled, with unit and status')
            [CompletionResult]::new('nmt', 'nmt', [CompletionResultType]::ParameterValue, 'Send NMT commands and tell states')
            [CompletionResult]::new('sdo', 'sdo', [CompletionResultType]::ParameterValue, 'Read and write objects of the object dictionary')
            [CompletionResult]::new('log', 'log', [CompletionResultType]::ParameterValue, 'Record measurements as CSV or JSON Lines')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Tell everything about one device on one page')
            [CompletionResult]::new('unit', 'unit', [CompletionResultType]::ParameterValue, 'Tell or set the physical unit of a signal (6131h)')
            [CompletionResult]::new('filter', 'filter', [CompletionResultType]::ParameterValue, 'Tell or set the filter of a signal: type (61A0h) and constant (61A1h)')
            [CompletionResult]::new('limits', 'limits', [CompletionResultType]::ParameterValue, 'Tell or set what makes a TPDO of a signal go out by itself: delta, limits, hysteresis (x133h to x136h)')
            [CompletionResult]::new('minmax', 'minmax', [CompletionResultType]::ParameterValue, 'Tell the lowest and highest value that the device has measured, or reset them')
            [CompletionResult]::new('errors', 'errors', [CompletionResultType]::ParameterValue, 'Tell the errors of a device: register (1001h) and history (1003h) in words, or clear the history')
            [CompletionResult]::new('bus', 'bus', [CompletionResultType]::ParameterValue, 'List CAN interfaces, switch them on and off, find the bit rate of a bus')
            [CompletionResult]::new('sim', 'sim', [CompletionResultType]::ParameterValue, 'Simulate devices on a bus until Ctrl-C')
            [CompletionResult]::new('completions', 'completions', [CompletionResultType]::ParameterValue, 'Print the completions for a shell')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;scan' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--passive', '--passive', [CompletionResultType]::ParameterName, 'Send nothing: list who shows itself within 3 s')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;read' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--in', '--in', [CompletionResultType]::ParameterName, 'Convert to this unit: bar, mbar, kPa, MPa, psi, degC, degF, K')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('start', 'start', [CompletionResultType]::ParameterValue, 'To OPERATIONAL: the nodes send their TPDOs')
            [CompletionResult]::new('stop', 'stop', [CompletionResultType]::ParameterValue, 'To STOPPED: only NMT, heartbeat and LSS')
            [CompletionResult]::new('preop', 'preop', [CompletionResultType]::ParameterValue, 'To PRE-OPERATIONAL: everything but PDOs')
            [CompletionResult]::new('reset', 'reset', [CompletionResultType]::ParameterValue, 'Restart the application (reset node)')
            [CompletionResult]::new('reset-comm', 'reset-comm', [CompletionResultType]::ParameterValue, 'Restart the communication')
            [CompletionResult]::new('state', 'state', [CompletionResultType]::ParameterValue, 'Tell the states: by heartbeat, or node guarding where that is harmless; "-" where nothing tells it')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Follow heartbeats, boot-ups and losses until Ctrl-C')
            [CompletionResult]::new('startup', 'startup', [CompletionResultType]::ParameterValue, 'Tell or set who starts a device after power on: wait for the master, or auto (by itself)')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;nmt;start' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit 3 where nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Only send')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;stop' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit 3 where nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Only send')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;preop' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit 3 where nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Only send')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;reset' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit 3 where nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Only send')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;reset-comm' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit 3 where nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Only send')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;state' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--probe', '--probe', [CompletionResultType]::ParameterName, 'Where nothing tells the state: set the heartbeat (1017h) for a moment and put it back')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;watch' {
            [CompletionResult]::new('-d', '-d', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('--duration', '--duration', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;startup' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;help' {
            [CompletionResult]::new('start', 'start', [CompletionResultType]::ParameterValue, 'To OPERATIONAL: the nodes send their TPDOs')
            [CompletionResult]::new('stop', 'stop', [CompletionResultType]::ParameterValue, 'To STOPPED: only NMT, heartbeat and LSS')
            [CompletionResult]::new('preop', 'preop', [CompletionResultType]::ParameterValue, 'To PRE-OPERATIONAL: everything but PDOs')
            [CompletionResult]::new('reset', 'reset', [CompletionResultType]::ParameterValue, 'Restart the application (reset node)')
            [CompletionResult]::new('reset-comm', 'reset-comm', [CompletionResultType]::ParameterValue, 'Restart the communication')
            [CompletionResult]::new('state', 'state', [CompletionResultType]::ParameterValue, 'Tell the states: by heartbeat, or node guarding where that is harmless; "-" where nothing tells it')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Follow heartbeats, boot-ups and losses until Ctrl-C')
            [CompletionResult]::new('startup', 'startup', [CompletionResultType]::ParameterValue, 'Tell or set who starts a device after power on: wait for the master, or auto (by itself)')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;nmt;help;start' {
            break
        }
        'cangauge;nmt;help;stop' {
            break
        }
        'cangauge;nmt;help;preop' {
            break
        }
        'cangauge;nmt;help;reset' {
            break
        }
        'cangauge;nmt;help;reset-comm' {
            break
        }
        'cangauge;nmt;help;state' {
            break
        }
        'cangauge;nmt;help;watch' {
            break
        }
        'cangauge;nmt;help;startup' {
            break
        }
        'cangauge;nmt;help;help' {
            break
        }
        'cangauge;sdo' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read objects: the value as it is, never scaled; several print "OBJECT VALUE" lines')
            [CompletionResult]::new('write', 'write', [CompletionResultType]::ParameterValue, 'Write an object, or several OBJECT=VALUE')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;sdo;read' {
            [CompletionResult]::new('--type', '--type', [CompletionResultType]::ParameterName, 'Take the bytes for this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Write the bytes to a file; - for stdout')
            [CompletionResult]::new('--block', '--block', [CompletionResultType]::ParameterName, 'Whether to use block transfer: auto where it pays and the device offers it')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--hex', '--hex', [CompletionResultType]::ParameterName, 'Print the bytes in wire order')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Overwrite the file')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;sdo;write' {
            [CompletionResult]::new('--type', '--type', [CompletionResultType]::ParameterName, 'Take the value for this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex')
            [CompletionResult]::new('--sdo-size', '--sdo-size', [CompletionResultType]::ParameterName, 'Whether the write says how many bytes it carries: auto asks the description, and tries the other way where the device takes it amiss')
            [CompletionResult]::new('--input', '--input', [CompletionResultType]::ParameterName, 'Take the bytes from a file; - for stdin')
            [CompletionResult]::new('--block', '--block', [CompletionResultType]::ParameterName, 'Whether to use block transfer: auto where it pays and the device offers it')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--verify', '--verify', [CompletionResultType]::ParameterName, 'Read back and compare')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;sdo;help' {
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read objects: the value as it is, never scaled; several print "OBJECT VALUE" lines')
            [CompletionResult]::new('write', 'write', [CompletionResultType]::ParameterValue, 'Write an object, or several OBJECT=VALUE')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;sdo;help;read' {
            break
        }
        'cangauge;sdo;help;write' {
            break
        }
        'cangauge;sdo;help;help' {
            break
        }
        'cangauge;log' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-d', '-d', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('--duration', '--duration', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('-n', '-n', [CompletionResultType]::ParameterName, 'End after this many rows')
            [CompletionResult]::new('--count', '--count', [CompletionResultType]::ParameterName, 'End after this many rows')
            [CompletionResult]::new('--sync', '--sync', [CompletionResultType]::ParameterName, 'Send SYNC at this interval')
            [CompletionResult]::new('--poll', '--poll', [CompletionResultType]::ParameterName, 'Read by SDO at this interval')
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'Write to a file instead of stdout')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Write to a file instead of stdout')
            [CompletionResult]::new('--summary', '--summary', [CompletionResultType]::ParameterName, 'Write the summary as JSON to a file; - for stdout')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--passive', '--passive', [CompletionResultType]::ParameterName, 'Send nothing at all')
            [CompletionResult]::new('--no-nmt', '--no-nmt', [CompletionResultType]::ParameterName, 'Leave the nodes'' NMT states alone')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Overwrite files that exist')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;info' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;unit' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;filter' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--type', '--type', [CompletionResultType]::ParameterName, 'What the filter does')
            [CompletionResult]::new('--constant', '--constant', [CompletionResultType]::ParameterName, 'How many steps it takes')
            [CompletionResult]::new('--damping', '--damping', [CompletionResultType]::ParameterName, 'Within which time the value follows a step; the device works out the constant')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;limits' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--delta', '--delta', [CompletionResultType]::ParameterName, 'A change of at least this sends; 0 is off')
            [CompletionResult]::new('--lower', '--lower', [CompletionResultType]::ParameterName, 'Below it, it sends')
            [CompletionResult]::new('--upper', '--upper', [CompletionResultType]::ParameterName, 'Above it, it sends')
            [CompletionResult]::new('--hysteresis', '--hysteresis', [CompletionResultType]::ParameterName, 'How far back behind a limit before it counts again')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;minmax' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--reset', '--reset', [CompletionResultType]::ParameterName, 'Begin anew; printed is what was there before')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;errors' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--clear', '--clear', [CompletionResultType]::ParameterName, 'Delete the history; an error that is pending stays in the register')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('list', 'list', [CompletionResultType]::ParameterValue, 'List the CAN interfaces of this machine with bit rate, state and error counters')
            [CompletionResult]::new('up', 'up', [CompletionResultType]::ParameterValue, 'Switch an interface on, at a bit rate')
            [CompletionResult]::new('down', 'down', [CompletionResultType]::ParameterValue, 'Switch an interface off')
            [CompletionResult]::new('detect', 'detect', [CompletionResultType]::ParameterValue, 'Find the bit rate of a running bus by listening only; prints it in bit/s')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;bus;list' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;up' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--listen-only', '--listen-only', [CompletionResultType]::ParameterName, 'Only listen: no frame, no acknowledge, no error flag')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;down' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;detect' {
            [CompletionResult]::new('--for', '--for', [CompletionResultType]::ParameterName, 'How long each bit rate is tried; the default hears a heartbeat of once a second')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('--active', '--active', [CompletionResultType]::ParameterName, 'Where nothing is heard, ask: every node-ID for its device type, at one rate after the other. Only for a bench with one device: at a wrong rate this disturbs every frame on the bus')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;help' {
            [CompletionResult]::new('list', 'list', [CompletionResultType]::ParameterValue, 'List the CAN interfaces of this machine with bit rate, state and error counters')
            [CompletionResult]::new('up', 'up', [CompletionResultType]::ParameterValue, 'Switch an interface on, at a bit rate')
            [CompletionResult]::new('down', 'down', [CompletionResultType]::ParameterValue, 'Switch an interface off')
            [CompletionResult]::new('detect', 'detect', [CompletionResultType]::ParameterValue, 'Find the bit rate of a running bus by listening only; prints it in bit/s')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;bus;help;list' {
            break
        }
        'cangauge;bus;help;up' {
            break
        }
        'cangauge;bus;help;down' {
            break
        }
        'cangauge;bus;help;detect' {
            break
        }
        'cangauge;bus;help;help' {
            break
        }
        'cangauge;sim' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;completions' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (a candump -L log; receives only). Not given: the only CAN interface that is up')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'How often a request that got no answer is repeated [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in TOML; NODE=NAME for one node of several')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Form of the output: for people, one object a line, or comma-separated; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE, as candump -L does; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Colour on stderr; auto: on a terminal, and without NO_COLOR')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Say less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Say more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;help' {
            [CompletionResult]::new('scan', 'scan', [CompletionResultType]::ParameterValue, 'List every node that answers, with its state, identity and recognised device')
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read measured values now, scaled, with unit and status')
            [CompletionResult]::new('nmt', 'nmt', [CompletionResultType]::ParameterValue, 'Send NMT commands and tell states')
            [CompletionResult]::new('sdo', 'sdo', [CompletionResultType]::ParameterValue, 'Read and write objects of the object dictionary')
            [CompletionResult]::new('log', 'log', [CompletionResultType]::ParameterValue, 'Record measurements as CSV or JSON Lines')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Tell everything about one device on one page')
            [CompletionResult]::new('unit', 'unit', [CompletionResultType]::ParameterValue, 'Tell or set the physical unit of a signal (6131h)')
            [CompletionResult]::new('filter', 'filter', [CompletionResultType]::ParameterValue, 'Tell or set the filter of a signal: type (61A0h) and constant (61A1h)')
            [CompletionResult]::new('limits', 'limits', [CompletionResultType]::ParameterValue, 'Tell or set what makes a TPDO of a signal go out by itself: delta, limits, hysteresis (x133h to x136h)')
            [CompletionResult]::new('minmax', 'minmax', [CompletionResultType]::ParameterValue, 'Tell the lowest and highest value that the device has measured, or reset them')
            [CompletionResult]::new('errors', 'errors', [CompletionResultType]::ParameterValue, 'Tell the errors of a device: register (1001h) and history (1003h) in words, or clear the history')
            [CompletionResult]::new('bus', 'bus', [CompletionResultType]::ParameterValue, 'List CAN interfaces, switch them on and off, find the bit rate of a bus')
            [CompletionResult]::new('sim', 'sim', [CompletionResultType]::ParameterValue, 'Simulate devices on a bus until Ctrl-C')
            [CompletionResult]::new('completions', 'completions', [CompletionResultType]::ParameterValue, 'Print the completions for a shell')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;help;scan' {
            break
        }
        'cangauge;help;read' {
            break
        }
        'cangauge;help;nmt' {
            break
        }
        'cangauge;help;sdo' {
            break
        }
        'cangauge;help;log' {
            break
        }
        'cangauge;help;info' {
            break
        }
        'cangauge;help;unit' {
            break
        }
        'cangauge;help;filter' {
            break
        }
        'cangauge;help;limits' {
            break
        }
        'cangauge;help;minmax' {
            break
        }
        'cangauge;help;errors' {
            break
        }
        'cangauge;help;bus' {
            break
        }
        'cangauge;help;sim' {
            break
        }
        'cangauge;help;completions' {
            break
        }
        'cangauge;help;help' {
            break
        }
    })

    $completions.Where{ $_.CompletionText -like "$wordToComplete*" } |
        Sort-Object -Property ListItemText
}
