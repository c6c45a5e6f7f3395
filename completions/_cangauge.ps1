
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
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('scan', 'scan', [CompletionResultType]::ParameterValue, 'List every node that answers, with its state, identity and recognised device')
            [CompletionResult]::new('ls', 'ls', [CompletionResultType]::ParameterValue, 'List every node that answers, with its state, identity and recognised device')
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read measured values now, scaled, with unit and status')
            [CompletionResult]::new('nmt', 'nmt', [CompletionResultType]::ParameterValue, 'Send NMT commands and show NMT states')
            [CompletionResult]::new('sdo', 'sdo', [CompletionResultType]::ParameterValue, 'Read and write objects of the object dictionary')
            [CompletionResult]::new('log', 'log', [CompletionResultType]::ParameterValue, 'Record measurements as CSV or JSON Lines')
            [CompletionResult]::new('check', 'check', [CompletionResultType]::ParameterValue, 'Check measurements against limits (exit code 0: all satisfied, 1: not, 3: no data)')
            [CompletionResult]::new('lss', 'lss', [CompletionResultType]::ParameterValue, 'Set the node-ID and bit rate of devices (LSS, CiA 305, or objects of the device)')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Show everything about a device on one page')
            [CompletionResult]::new('status', 'status', [CompletionResultType]::ParameterValue, 'Show everything about a device on one page')
            [CompletionResult]::new('unit', 'unit', [CompletionResultType]::ParameterValue, 'Show or set the physical unit of a signal (6131h)')
            [CompletionResult]::new('filter', 'filter', [CompletionResultType]::ParameterValue, 'Show or set the filter of a signal: type (61A0h) and constant (61A1h)')
            [CompletionResult]::new('limits', 'limits', [CompletionResultType]::ParameterValue, 'Show or set what triggers a TPDO: delta, limits, hysteresis (x133h to x136h)')
            [CompletionResult]::new('minmax', 'minmax', [CompletionResultType]::ParameterValue, 'Show the lowest and highest value that the device has measured, or reset them')
            [CompletionResult]::new('errors', 'errors', [CompletionResultType]::ParameterValue, 'Show the errors of a device: register (1001h) and history (1003h) in words, or clear the history')
            [CompletionResult]::new('bus', 'bus', [CompletionResultType]::ParameterValue, 'List CAN interfaces, bring them up and down, find the bit rate of a bus')
            [CompletionResult]::new('pdo', 'pdo', [CompletionResultType]::ParameterValue, 'Show, change and watch the transmit PDOs of nodes')
            [CompletionResult]::new('autozero', 'autozero', [CompletionResultType]::ParameterValue, 'Set the zero of a channel (6125h), with checks before and after')
            [CompletionResult]::new('zero', 'zero', [CompletionResultType]::ParameterValue, 'Set the zero of a channel (6125h), with checks before and after')
            [CompletionResult]::new('store', 'store', [CompletionResultType]::ParameterValue, 'Save settings to non-volatile memory (1010h)')
            [CompletionResult]::new('restore', 'restore', [CompletionResultType]::ParameterValue, 'Restore factory defaults (1011h); node-ID and bit rate stay')
            [CompletionResult]::new('sim', 'sim', [CompletionResultType]::ParameterValue, 'Simulate devices on a bus until Ctrl-C')
            [CompletionResult]::new('objects', 'objects', [CompletionResultType]::ParameterValue, 'Show what a description or an EDS states about a device''s objects')
            [CompletionResult]::new('devices', 'devices', [CompletionResultType]::ParameterValue, 'List device descriptions; show one as TOML, check a file, or describe a new device')
            [CompletionResult]::new('completions', 'completions', [CompletionResultType]::ParameterValue, 'Print the completion script for a shell')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;scan' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--passive', '--passive', [CompletionResultType]::ParameterName, 'Send nothing: list the nodes that send something within 3 s')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;ls' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--passive', '--passive', [CompletionResultType]::ParameterName, 'Send nothing: list the nodes that send something within 3 s')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;read' {
            [CompletionResult]::new('--in', '--in', [CompletionResultType]::ParameterName, 'Convert to this unit: bar, mbar, kPa, MPa, psi, degC, degF, K')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('start', 'start', [CompletionResultType]::ParameterValue, 'Set nodes to OPERATIONAL: they send their TPDOs')
            [CompletionResult]::new('stop', 'stop', [CompletionResultType]::ParameterValue, 'Set nodes to STOPPED: only NMT, heartbeat and LSS work')
            [CompletionResult]::new('preop', 'preop', [CompletionResultType]::ParameterValue, 'Set nodes to PRE-OPERATIONAL: everything except PDOs works')
            [CompletionResult]::new('reset', 'reset', [CompletionResultType]::ParameterValue, 'Restart the application (reset node)')
            [CompletionResult]::new('reset-comm', 'reset-comm', [CompletionResultType]::ParameterValue, 'Restart the communication')
            [CompletionResult]::new('state', 'state', [CompletionResultType]::ParameterValue, 'Show states, from the heartbeat or by node guarding if it is harmless; "-" if unknown')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Follow heartbeats, boot-ups and losses until Ctrl-C')
            [CompletionResult]::new('startup', 'startup', [CompletionResultType]::ParameterValue, 'Show or set how a device starts after power on: wait for the master, or auto (by itself)')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;nmt;start' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit with 3 if nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Send the command without confirmation')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;stop' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit with 3 if nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Send the command without confirmation')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;preop' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit with 3 if nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Send the command without confirmation')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;reset' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit with 3 if nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Send the command without confirmation')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;reset-comm' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--confirm', '--confirm', [CompletionResultType]::ParameterName, 'Exit with 3 if nothing confirms the state')
            [CompletionResult]::new('--no-wait', '--no-wait', [CompletionResultType]::ParameterName, 'Send the command without confirmation')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;state' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--probe', '--probe', [CompletionResultType]::ParameterName, 'If the state is unknown: set the heartbeat time (1017h) briefly and restore it')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;watch' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('-d', '-d', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('--duration', '--duration', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;startup' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;nmt;help' {
            [CompletionResult]::new('start', 'start', [CompletionResultType]::ParameterValue, 'Set nodes to OPERATIONAL: they send their TPDOs')
            [CompletionResult]::new('stop', 'stop', [CompletionResultType]::ParameterValue, 'Set nodes to STOPPED: only NMT, heartbeat and LSS work')
            [CompletionResult]::new('preop', 'preop', [CompletionResultType]::ParameterValue, 'Set nodes to PRE-OPERATIONAL: everything except PDOs works')
            [CompletionResult]::new('reset', 'reset', [CompletionResultType]::ParameterValue, 'Restart the application (reset node)')
            [CompletionResult]::new('reset-comm', 'reset-comm', [CompletionResultType]::ParameterValue, 'Restart the communication')
            [CompletionResult]::new('state', 'state', [CompletionResultType]::ParameterValue, 'Show states, from the heartbeat or by node guarding if it is harmless; "-" if unknown')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Follow heartbeats, boot-ups and losses until Ctrl-C')
            [CompletionResult]::new('startup', 'startup', [CompletionResultType]::ParameterValue, 'Show or set how a device starts after power on: wait for the master, or auto (by itself)')
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
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read objects: the value is never scaled; several objects print "OBJECT VALUE" lines')
            [CompletionResult]::new('write', 'write', [CompletionResultType]::ParameterValue, 'Write an object, or several OBJECT=VALUE')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;sdo;read' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--type', '--type', [CompletionResultType]::ParameterName, 'Decode the bytes as this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Write the bytes to a file; - for stdout')
            [CompletionResult]::new('--block', '--block', [CompletionResultType]::ParameterName, 'When to use block transfer: auto for long objects if the device supports it')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--hex', '--hex', [CompletionResultType]::ParameterName, 'Print a hexadecimal number')
            [CompletionResult]::new('--bytes', '--bytes', [CompletionResultType]::ParameterName, 'Print the bytes in wire order: 47 00 00 00')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Overwrite the file')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;sdo;write' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--type', '--type', [CompletionResultType]::ParameterName, 'Encode the value as this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex')
            [CompletionResult]::new('--sdo-size', '--sdo-size', [CompletionResultType]::ParameterName, 'Whether the request contains the size: auto follows the description, and retries with the other form if the device rejects it')
            [CompletionResult]::new('--input', '--input', [CompletionResultType]::ParameterName, 'Write the bytes of a file; - for stdin')
            [CompletionResult]::new('--block', '--block', [CompletionResultType]::ParameterName, 'When to use block transfer: auto for long objects if the device supports it')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verify', '--verify', [CompletionResultType]::ParameterName, 'Read back and compare')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;sdo;help' {
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read objects: the value is never scaled; several objects print "OBJECT VALUE" lines')
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
            [CompletionResult]::new('-d', '-d', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('--duration', '--duration', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('-n', '-n', [CompletionResultType]::ParameterName, 'End after this many rows')
            [CompletionResult]::new('--count', '--count', [CompletionResultType]::ParameterName, 'End after this many rows')
            [CompletionResult]::new('--sync', '--sync', [CompletionResultType]::ParameterName, 'Send SYNC at this interval')
            [CompletionResult]::new('--poll', '--poll', [CompletionResultType]::ParameterName, 'Read by SDO at this interval')
            [CompletionResult]::new('--max-gap', '--max-gap', [CompletionResultType]::ParameterName, 'Report longer intervals as gaps [default: 3 times the usual interval]')
            [CompletionResult]::new('--expect', '--expect', [CompletionResultType]::ParameterName, 'Exit with 1 at the end unless this was true: ''pressure in 9..11 bar'', see cangauge check --help')
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'Write to a file instead of stdout')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Write to a file instead of stdout')
            [CompletionResult]::new('--layout', '--layout', [CompletionResultType]::ParameterName, 'One row per value, or one per cycle of --sync or --poll')
            [CompletionResult]::new('--rotate', '--rotate', [CompletionResultType]::ParameterName, 'Start a new file after this time or at this size: 10m, 1h, 100MB, 1GiB. The files for run.csv are run-0001.csv and so on')
            [CompletionResult]::new('--events', '--events', [CompletionResultType]::ParameterName, 'Write events as CSV: emergencies, gaps, node losses, reboots')
            [CompletionResult]::new('--summary', '--summary', [CompletionResultType]::ParameterName, 'Write the summary as JSON to a file, which is replaced unless --append; - for stdout')
            [CompletionResult]::new('--delimiter', '--delimiter', [CompletionResultType]::ParameterName, 'Delimiter of CSV: , ; | or tab [default: ,]')
            [CompletionResult]::new('--decimal', '--decimal', [CompletionResultType]::ParameterName, 'Decimal sign of CSV: . or , [default: .]')
            [CompletionResult]::new('--time', '--time', [CompletionResultType]::ParameterName, 'Format of times: text (RFC 3339), seconds since 1970, or days as in spreadsheets; all UTC')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--passive', '--passive', [CompletionResultType]::ParameterName, 'Send nothing at all')
            [CompletionResult]::new('--no-nmt', '--no-nmt', [CompletionResultType]::ParameterName, 'Do not change the NMT state of the nodes')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Overwrite existing files')
            [CompletionResult]::new('--append', '--append', [CompletionResultType]::ParameterName, 'Continue existing files with the same columns. A last line that was cut off is removed')
            [CompletionResult]::new('--bom', '--bom', [CompletionResultType]::ParameterName, 'Start CSV with a byte order mark, which some spreadsheets need')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;check' {
            [CompletionResult]::new('--for', '--for', [CompletionResultType]::ParameterName, 'Check all samples of this time')
            [CompletionResult]::new('--sync', '--sync', [CompletionResultType]::ParameterName, 'Send SYNC at this interval')
            [CompletionResult]::new('--poll', '--poll', [CompletionResultType]::ParameterName, 'Read by SDO at this interval')
            [CompletionResult]::new('--junit', '--junit', [CompletionResultType]::ParameterName, 'Write the verdicts as JUnit XML for CI servers, one test case per expression and node. An existing file is replaced')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('scan', 'scan', [CompletionResultType]::ParameterValue, 'List devices with a node-ID (found by SDO) and without one (found by fastscan)')
            [CompletionResult]::new('inquire', 'inquire', [CompletionResultType]::ParameterValue, 'Read the identity and node-ID of a device by LSS')
            [CompletionResult]::new('set-id', 'set-id', [CompletionResultType]::ParameterValue, 'Set the node-ID of a device: check that it is free, configure, store, reset, confirm')
            [CompletionResult]::new('set-bitrate', 'set-bitrate', [CompletionResultType]::ParameterValue, 'Set the bit rate of a device, by its own bit rate table')
            [CompletionResult]::new('set', 'set', [CompletionResultType]::ParameterValue, 'Set the node-ID and bit rate of a device, with one store and one reset')
            [CompletionResult]::new('activate', 'activate', [CompletionResultType]::ParameterValue, 'Activate a configured bit rate. The device is silent for the delay, changes, and is silent for it again')
            [CompletionResult]::new('store', 'store', [CompletionResultType]::ParameterValue, 'Store node-ID and bit rate in non-volatile memory')
            [CompletionResult]::new('identify', 'identify', [CompletionResultType]::ParameterValue, 'Check whether devices have an identity in a range. Exit code 3 if none answers')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;lss;scan' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;inquire' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;set-id' {
            [CompletionResult]::new('--via', '--via', [CompletionResultType]::ParameterName, 'Method: LSS, objects of the device (sdo), or what its description prefers (auto)')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--no-store', '--no-store', [CompletionResultType]::ParameterName, 'Do not store: a power cycle restores the old values')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Accept more than one device for "only": all of them change')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;set-bitrate' {
            [CompletionResult]::new('--table-index', '--table-index', [CompletionResultType]::ParameterName, 'Index in the bit rate table of the device, if its table is unknown')
            [CompletionResult]::new('--via', '--via', [CompletionResultType]::ParameterName, 'Method: LSS, objects of the device (sdo), or what its description prefers (auto)')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--retime', '--retime', [CompletionResultType]::ParameterName, 'Switch the host interface as well; store after the device responds at the new bit rate. Requires that the device is the only one on the bus')
            [CompletionResult]::new('--no-store', '--no-store', [CompletionResultType]::ParameterName, 'Do not store: a power cycle restores the old values')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Accept more than one device for "only": all of them change')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;set' {
            [CompletionResult]::new('--id', '--id', [CompletionResultType]::ParameterName, 'New node-ID')
            [CompletionResult]::new('--bitrate', '--bitrate', [CompletionResultType]::ParameterName, '250k, 1M, 125000; auto if the device supports it')
            [CompletionResult]::new('--table-index', '--table-index', [CompletionResultType]::ParameterName, 'Index in the bit rate table of the device, if its table is unknown')
            [CompletionResult]::new('--via', '--via', [CompletionResultType]::ParameterName, 'Method: LSS, objects of the device (sdo), or what its description prefers (auto)')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--retime', '--retime', [CompletionResultType]::ParameterName, 'Switch the host interface as well; store after the device responds at the new bit rate. Requires that the device is the only one on the bus')
            [CompletionResult]::new('--no-store', '--no-store', [CompletionResultType]::ParameterName, 'Do not store: a power cycle restores the old values')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Accept more than one device for "only": all of them change')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;activate' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Accept more than one device for "only"')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;store' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Accept more than one device for "only"')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;identify' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;lss;help' {
            [CompletionResult]::new('scan', 'scan', [CompletionResultType]::ParameterValue, 'List devices with a node-ID (found by SDO) and without one (found by fastscan)')
            [CompletionResult]::new('inquire', 'inquire', [CompletionResultType]::ParameterValue, 'Read the identity and node-ID of a device by LSS')
            [CompletionResult]::new('set-id', 'set-id', [CompletionResultType]::ParameterValue, 'Set the node-ID of a device: check that it is free, configure, store, reset, confirm')
            [CompletionResult]::new('set-bitrate', 'set-bitrate', [CompletionResultType]::ParameterValue, 'Set the bit rate of a device, by its own bit rate table')
            [CompletionResult]::new('set', 'set', [CompletionResultType]::ParameterValue, 'Set the node-ID and bit rate of a device, with one store and one reset')
            [CompletionResult]::new('activate', 'activate', [CompletionResultType]::ParameterValue, 'Activate a configured bit rate. The device is silent for the delay, changes, and is silent for it again')
            [CompletionResult]::new('store', 'store', [CompletionResultType]::ParameterValue, 'Store node-ID and bit rate in non-volatile memory')
            [CompletionResult]::new('identify', 'identify', [CompletionResultType]::ParameterValue, 'Check whether devices have an identity in a range. Exit code 3 if none answers')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;lss;help;scan' {
            break
        }
        'cangauge;lss;help;inquire' {
            break
        }
        'cangauge;lss;help;set-id' {
            break
        }
        'cangauge;lss;help;set-bitrate' {
            break
        }
        'cangauge;lss;help;set' {
            break
        }
        'cangauge;lss;help;activate' {
            break
        }
        'cangauge;lss;help;store' {
            break
        }
        'cangauge;lss;help;identify' {
            break
        }
        'cangauge;lss;help;help' {
            break
        }
        'cangauge;info' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;status' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;unit' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;filter' {
            [CompletionResult]::new('--type', '--type', [CompletionResultType]::ParameterName, 'Filter type')
            [CompletionResult]::new('--constant', '--constant', [CompletionResultType]::ParameterName, 'Filter constant: number of values')
            [CompletionResult]::new('--damping', '--damping', [CompletionResultType]::ParameterName, 'Time in which the value follows a step; the device calculates the constant')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;limits' {
            [CompletionResult]::new('--delta', '--delta', [CompletionResultType]::ParameterName, 'Send if the value changes by at least this; 0: off')
            [CompletionResult]::new('--lower', '--lower', [CompletionResultType]::ParameterName, 'Lower limit: send if the value falls below it')
            [CompletionResult]::new('--upper', '--upper', [CompletionResultType]::ParameterName, 'Upper limit: send if the value rises above it')
            [CompletionResult]::new('--hysteresis', '--hysteresis', [CompletionResultType]::ParameterName, 'Hysteresis before a limit triggers again')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;minmax' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--reset', '--reset', [CompletionResultType]::ParameterName, 'Reset, and print the previous values')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;errors' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--clear', '--clear', [CompletionResultType]::ParameterName, 'Delete the history; a pending error stays in the register')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('list', 'list', [CompletionResultType]::ParameterValue, 'List the CAN interfaces of this computer with bit rate, state and error counters')
            [CompletionResult]::new('up', 'up', [CompletionResultType]::ParameterValue, 'Bring an interface up at a bit rate')
            [CompletionResult]::new('down', 'down', [CompletionResultType]::ParameterValue, 'Bring an interface down')
            [CompletionResult]::new('detect', 'detect', [CompletionResultType]::ParameterValue, 'Find the bit rate of a running bus by listening; print it in bit/s')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;bus;list' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;up' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--listen-only', '--listen-only', [CompletionResultType]::ParameterName, 'Listen only: send no frame, no acknowledge and no error flag')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;down' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;detect' {
            [CompletionResult]::new('--for', '--for', [CompletionResultType]::ParameterName, 'Time per bit rate; the default is longer than a heartbeat interval of 1 s')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--active', '--active', [CompletionResultType]::ParameterName, 'If nothing is received, ask each node-ID for its device type at each bit rate. Only for a bench with one device: at a wrong bit rate this disturbs every frame on the bus')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;bus;help' {
            [CompletionResult]::new('list', 'list', [CompletionResultType]::ParameterValue, 'List the CAN interfaces of this computer with bit rate, state and error counters')
            [CompletionResult]::new('up', 'up', [CompletionResultType]::ParameterValue, 'Bring an interface up at a bit rate')
            [CompletionResult]::new('down', 'down', [CompletionResultType]::ParameterValue, 'Bring an interface down')
            [CompletionResult]::new('detect', 'detect', [CompletionResultType]::ParameterValue, 'Find the bit rate of a running bus by listening; print it in bit/s')
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
        'cangauge;pdo' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('show', 'show', [CompletionResultType]::ParameterValue, 'Show the settings of TPDOs')
            [CompletionResult]::new('map', 'map', [CompletionResultType]::ParameterValue, 'Set the mapping of a TPDO, and when it is sent')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Show received TPDOs, decoded, until Ctrl-C')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;pdo;show' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;pdo;map' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--transmission', '--transmission', [CompletionResultType]::ParameterName, 'Transmission type: acyclic (on SYNC after a change), sync:N (on every N-th SYNC), event (255), timer (event timer), or a number')
            [CompletionResult]::new('--event-timer', '--event-timer', [CompletionResultType]::ParameterName, 'Event timer, in whole milliseconds; 0: off')
            [CompletionResult]::new('--inhibit', '--inhibit', [CompletionResultType]::ParameterName, 'Inhibit time: shortest time between two transmissions, in steps of 100us; 0: none')
            [CompletionResult]::new('--cob-id', '--cob-id', [CompletionResultType]::ParameterName, 'CAN identifier, 11 bits: 0x1A5')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--store', '--store', [CompletionResultType]::ParameterName, 'Store the change (1010h; only the communication settings if the device can store them separately)')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;pdo;watch' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('-d', '-d', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('--duration', '--duration', [CompletionResultType]::ParameterName, 'End after this time')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;pdo;help' {
            [CompletionResult]::new('show', 'show', [CompletionResultType]::ParameterValue, 'Show the settings of TPDOs')
            [CompletionResult]::new('map', 'map', [CompletionResultType]::ParameterValue, 'Set the mapping of a TPDO, and when it is sent')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Show received TPDOs, decoded, until Ctrl-C')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;pdo;help;show' {
            break
        }
        'cangauge;pdo;help;map' {
            break
        }
        'cangauge;pdo;help;watch' {
            break
        }
        'cangauge;pdo;help;help' {
            break
        }
        'cangauge;autozero' {
            [CompletionResult]::new('--channel', '--channel', [CompletionResultType]::ParameterName, 'Channel [default: the only one with a zero]')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Largest accepted reading: 0.1 (in the present unit), 100mbar, 2% (of the measuring range) [default: 1%]')
            [CompletionResult]::new('--samples', '--samples', [CompletionResultType]::ParameterName, 'Number of readings before and after, 100 ms apart')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Skip the safety checks')
            [CompletionResult]::new('--store', '--store', [CompletionResultType]::ParameterName, 'Store the offset, with the other application settings')
            [CompletionResult]::new('--dry-run', '--dry-run', [CompletionResultType]::ParameterName, 'Measure and check only; change nothing')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;zero' {
            [CompletionResult]::new('--channel', '--channel', [CompletionResultType]::ParameterName, 'Channel [default: the only one with a zero]')
            [CompletionResult]::new('--limit', '--limit', [CompletionResultType]::ParameterName, 'Largest accepted reading: 0.1 (in the present unit), 100mbar, 2% (of the measuring range) [default: 1%]')
            [CompletionResult]::new('--samples', '--samples', [CompletionResultType]::ParameterName, 'Number of readings before and after, 100 ms apart')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--force', '--force', [CompletionResultType]::ParameterName, 'Skip the safety checks')
            [CompletionResult]::new('--store', '--store', [CompletionResultType]::ParameterName, 'Store the offset, with the other application settings')
            [CompletionResult]::new('--dry-run', '--dry-run', [CompletionResultType]::ParameterName, 'Measure and check only; change nothing')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;store' {
            [CompletionResult]::new('--group', '--group', [CompletionResultType]::ParameterName, 'Which settings: everything, communication (1000h to 1FFFh), or application (6000h to 9FFFh)')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--verify', '--verify', [CompletionResultType]::ParameterName, 'Reset the node, read the stored settings again, and compare')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;restore' {
            [CompletionResult]::new('--group', '--group', [CompletionResultType]::ParameterName, 'Which settings: everything, communication (1000h to 1FFFh), or application (6000h to 9FFFh)')
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--reset', '--reset', [CompletionResultType]::ParameterName, 'Reset the node, and compare with its description')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;sim' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;objects' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;devices' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('show', 'show', [CompletionResultType]::ParameterValue, 'Print a description as TOML: a start for one of your own')
            [CompletionResult]::new('new', 'new', [CompletionResultType]::ParameterValue, 'Print a first description of a device, from the device and its EDS (--eds), with comments for what to fill in')
            [CompletionResult]::new('check', 'check', [CompletionResultType]::ParameterValue, 'Report every mistake in a description with its line')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;devices;show' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;devices;new' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;devices;check' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;devices;help' {
            [CompletionResult]::new('show', 'show', [CompletionResultType]::ParameterValue, 'Print a description as TOML: a start for one of your own')
            [CompletionResult]::new('new', 'new', [CompletionResultType]::ParameterValue, 'Print a first description of a device, from the device and its EDS (--eds), with comments for what to fill in')
            [CompletionResult]::new('check', 'check', [CompletionResultType]::ParameterValue, 'Report every mistake in a description with its line')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'cangauge;devices;help;show' {
            break
        }
        'cangauge;devices;help;new' {
            break
        }
        'cangauge;devices;help;check' {
            break
        }
        'cangauge;devices;help;help' {
            break
        }
        'cangauge;completions' {
            [CompletionResult]::new('-b', '-b', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('--bus', '--bus', [CompletionResultType]::ParameterName, 'Bus: can0 (SocketCAN), sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE (candump -L log, receive only) [default: the only CAN interface that is up]')
            [CompletionResult]::new('-t', '-t', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--timeout', '--timeout', [CompletionResultType]::ParameterName, 'Longest wait for one answer [default: 500ms; scan: 200ms]')
            [CompletionResult]::new('--retries', '--retries', [CompletionResultType]::ParameterName, 'Number of times to repeat a request without an answer [default: 1]')
            [CompletionResult]::new('--device', '--device', [CompletionResultType]::ParameterName, 'Use this device description instead of the recognised one: a name or a TOML file; NODE=NAME for one of several nodes')
            [CompletionResult]::new('--eds', '--eds', [CompletionResultType]::ParameterName, 'Use objects, names and types from an EDS or DCF file; NODE=FILE for one of several nodes')
            [CompletionResult]::new('-f', '-f', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'Output format: text, JSON Lines or CSV; for log, text means csv')
            [CompletionResult]::new('--trace', '--trace', [CompletionResultType]::ParameterName, 'Write every frame sent and received to FILE in candump -L format; - for stderr')
            [CompletionResult]::new('--progress', '--progress', [CompletionResultType]::ParameterName, 'Show live values and progress on stderr; auto: only on a terminal')
            [CompletionResult]::new('--color', '--color', [CompletionResultType]::ParameterName, 'Use colour on stderr; auto: only on a terminal without NO_COLOR')
            [CompletionResult]::new('--accept-mismatch', '--accept-mismatch', [CompletionResultType]::ParameterName, 'Use a description or EDS of another device (its vendor or product differs)')
            [CompletionResult]::new('--ignore-lock', '--ignore-lock', [CompletionResultType]::ParameterName, 'Continue although another program uses the same nodes')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print less on stderr')
            [CompletionResult]::new('-v', '-v', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('--verbose', '--verbose', [CompletionResultType]::ParameterName, 'Print more on stderr')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            break
        }
        'cangauge;help' {
            [CompletionResult]::new('scan', 'scan', [CompletionResultType]::ParameterValue, 'List every node that answers, with its state, identity and recognised device')
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read measured values now, scaled, with unit and status')
            [CompletionResult]::new('nmt', 'nmt', [CompletionResultType]::ParameterValue, 'Send NMT commands and show NMT states')
            [CompletionResult]::new('sdo', 'sdo', [CompletionResultType]::ParameterValue, 'Read and write objects of the object dictionary')
            [CompletionResult]::new('log', 'log', [CompletionResultType]::ParameterValue, 'Record measurements as CSV or JSON Lines')
            [CompletionResult]::new('check', 'check', [CompletionResultType]::ParameterValue, 'Check measurements against limits (exit code 0: all satisfied, 1: not, 3: no data)')
            [CompletionResult]::new('lss', 'lss', [CompletionResultType]::ParameterValue, 'Set the node-ID and bit rate of devices (LSS, CiA 305, or objects of the device)')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Show everything about a device on one page')
            [CompletionResult]::new('unit', 'unit', [CompletionResultType]::ParameterValue, 'Show or set the physical unit of a signal (6131h)')
            [CompletionResult]::new('filter', 'filter', [CompletionResultType]::ParameterValue, 'Show or set the filter of a signal: type (61A0h) and constant (61A1h)')
            [CompletionResult]::new('limits', 'limits', [CompletionResultType]::ParameterValue, 'Show or set what triggers a TPDO: delta, limits, hysteresis (x133h to x136h)')
            [CompletionResult]::new('minmax', 'minmax', [CompletionResultType]::ParameterValue, 'Show the lowest and highest value that the device has measured, or reset them')
            [CompletionResult]::new('errors', 'errors', [CompletionResultType]::ParameterValue, 'Show the errors of a device: register (1001h) and history (1003h) in words, or clear the history')
            [CompletionResult]::new('bus', 'bus', [CompletionResultType]::ParameterValue, 'List CAN interfaces, bring them up and down, find the bit rate of a bus')
            [CompletionResult]::new('pdo', 'pdo', [CompletionResultType]::ParameterValue, 'Show, change and watch the transmit PDOs of nodes')
            [CompletionResult]::new('autozero', 'autozero', [CompletionResultType]::ParameterValue, 'Set the zero of a channel (6125h), with checks before and after')
            [CompletionResult]::new('store', 'store', [CompletionResultType]::ParameterValue, 'Save settings to non-volatile memory (1010h)')
            [CompletionResult]::new('restore', 'restore', [CompletionResultType]::ParameterValue, 'Restore factory defaults (1011h); node-ID and bit rate stay')
            [CompletionResult]::new('sim', 'sim', [CompletionResultType]::ParameterValue, 'Simulate devices on a bus until Ctrl-C')
            [CompletionResult]::new('objects', 'objects', [CompletionResultType]::ParameterValue, 'Show what a description or an EDS states about a device''s objects')
            [CompletionResult]::new('devices', 'devices', [CompletionResultType]::ParameterValue, 'List device descriptions; show one as TOML, check a file, or describe a new device')
            [CompletionResult]::new('completions', 'completions', [CompletionResultType]::ParameterValue, 'Print the completion script for a shell')
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
            [CompletionResult]::new('start', 'start', [CompletionResultType]::ParameterValue, 'Set nodes to OPERATIONAL: they send their TPDOs')
            [CompletionResult]::new('stop', 'stop', [CompletionResultType]::ParameterValue, 'Set nodes to STOPPED: only NMT, heartbeat and LSS work')
            [CompletionResult]::new('preop', 'preop', [CompletionResultType]::ParameterValue, 'Set nodes to PRE-OPERATIONAL: everything except PDOs works')
            [CompletionResult]::new('reset', 'reset', [CompletionResultType]::ParameterValue, 'Restart the application (reset node)')
            [CompletionResult]::new('reset-comm', 'reset-comm', [CompletionResultType]::ParameterValue, 'Restart the communication')
            [CompletionResult]::new('state', 'state', [CompletionResultType]::ParameterValue, 'Show states, from the heartbeat or by node guarding if it is harmless; "-" if unknown')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Follow heartbeats, boot-ups and losses until Ctrl-C')
            [CompletionResult]::new('startup', 'startup', [CompletionResultType]::ParameterValue, 'Show or set how a device starts after power on: wait for the master, or auto (by itself)')
            break
        }
        'cangauge;help;nmt;start' {
            break
        }
        'cangauge;help;nmt;stop' {
            break
        }
        'cangauge;help;nmt;preop' {
            break
        }
        'cangauge;help;nmt;reset' {
            break
        }
        'cangauge;help;nmt;reset-comm' {
            break
        }
        'cangauge;help;nmt;state' {
            break
        }
        'cangauge;help;nmt;watch' {
            break
        }
        'cangauge;help;nmt;startup' {
            break
        }
        'cangauge;help;sdo' {
            [CompletionResult]::new('read', 'read', [CompletionResultType]::ParameterValue, 'Read objects: the value is never scaled; several objects print "OBJECT VALUE" lines')
            [CompletionResult]::new('write', 'write', [CompletionResultType]::ParameterValue, 'Write an object, or several OBJECT=VALUE')
            break
        }
        'cangauge;help;sdo;read' {
            break
        }
        'cangauge;help;sdo;write' {
            break
        }
        'cangauge;help;log' {
            break
        }
        'cangauge;help;check' {
            break
        }
        'cangauge;help;lss' {
            [CompletionResult]::new('scan', 'scan', [CompletionResultType]::ParameterValue, 'List devices with a node-ID (found by SDO) and without one (found by fastscan)')
            [CompletionResult]::new('inquire', 'inquire', [CompletionResultType]::ParameterValue, 'Read the identity and node-ID of a device by LSS')
            [CompletionResult]::new('set-id', 'set-id', [CompletionResultType]::ParameterValue, 'Set the node-ID of a device: check that it is free, configure, store, reset, confirm')
            [CompletionResult]::new('set-bitrate', 'set-bitrate', [CompletionResultType]::ParameterValue, 'Set the bit rate of a device, by its own bit rate table')
            [CompletionResult]::new('set', 'set', [CompletionResultType]::ParameterValue, 'Set the node-ID and bit rate of a device, with one store and one reset')
            [CompletionResult]::new('activate', 'activate', [CompletionResultType]::ParameterValue, 'Activate a configured bit rate. The device is silent for the delay, changes, and is silent for it again')
            [CompletionResult]::new('store', 'store', [CompletionResultType]::ParameterValue, 'Store node-ID and bit rate in non-volatile memory')
            [CompletionResult]::new('identify', 'identify', [CompletionResultType]::ParameterValue, 'Check whether devices have an identity in a range. Exit code 3 if none answers')
            break
        }
        'cangauge;help;lss;scan' {
            break
        }
        'cangauge;help;lss;inquire' {
            break
        }
        'cangauge;help;lss;set-id' {
            break
        }
        'cangauge;help;lss;set-bitrate' {
            break
        }
        'cangauge;help;lss;set' {
            break
        }
        'cangauge;help;lss;activate' {
            break
        }
        'cangauge;help;lss;store' {
            break
        }
        'cangauge;help;lss;identify' {
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
            [CompletionResult]::new('list', 'list', [CompletionResultType]::ParameterValue, 'List the CAN interfaces of this computer with bit rate, state and error counters')
            [CompletionResult]::new('up', 'up', [CompletionResultType]::ParameterValue, 'Bring an interface up at a bit rate')
            [CompletionResult]::new('down', 'down', [CompletionResultType]::ParameterValue, 'Bring an interface down')
            [CompletionResult]::new('detect', 'detect', [CompletionResultType]::ParameterValue, 'Find the bit rate of a running bus by listening; print it in bit/s')
            break
        }
        'cangauge;help;bus;list' {
            break
        }
        'cangauge;help;bus;up' {
            break
        }
        'cangauge;help;bus;down' {
            break
        }
        'cangauge;help;bus;detect' {
            break
        }
        'cangauge;help;pdo' {
            [CompletionResult]::new('show', 'show', [CompletionResultType]::ParameterValue, 'Show the settings of TPDOs')
            [CompletionResult]::new('map', 'map', [CompletionResultType]::ParameterValue, 'Set the mapping of a TPDO, and when it is sent')
            [CompletionResult]::new('watch', 'watch', [CompletionResultType]::ParameterValue, 'Show received TPDOs, decoded, until Ctrl-C')
            break
        }
        'cangauge;help;pdo;show' {
            break
        }
        'cangauge;help;pdo;map' {
            break
        }
        'cangauge;help;pdo;watch' {
            break
        }
        'cangauge;help;autozero' {
            break
        }
        'cangauge;help;store' {
            break
        }
        'cangauge;help;restore' {
            break
        }
        'cangauge;help;sim' {
            break
        }
        'cangauge;help;objects' {
            break
        }
        'cangauge;help;devices' {
            [CompletionResult]::new('show', 'show', [CompletionResultType]::ParameterValue, 'Print a description as TOML: a start for one of your own')
            [CompletionResult]::new('new', 'new', [CompletionResultType]::ParameterValue, 'Print a first description of a device, from the device and its EDS (--eds), with comments for what to fill in')
            [CompletionResult]::new('check', 'check', [CompletionResultType]::ParameterValue, 'Report every mistake in a description with its line')
            break
        }
        'cangauge;help;devices;show' {
            break
        }
        'cangauge;help;devices;new' {
            break
        }
        'cangauge;help;devices;check' {
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
