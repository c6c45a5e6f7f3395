#!/usr/bin/env python3
"""Publishes many recordings at once to real servers, while servers and publishers are killed.

    tests/publish/servers.py PROGRAM [--recordings 40] [--seconds 60] [--seed N]

Each recording has 100 rows/s. InfluxDB and VictoriaMetrics must have each row exactly once, and an MQTT subscriber at
least once. Rows that mosquitto loses after its acknowledgement, because it is killed before it saves them, are counted.

The servers are the packages influxdb, victoria-metrics, mosquitto and mosquitto-clients of Debian. They need not run.
"""

import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request

INFLUX, METRICS, BROKER = 28086, 28428, 28883
SERVERS = ("influxd", "victoria-metrics", "mosquitto", "mosquitto_sub")


def find(name):
    path = shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin")
    if path is None:
        print(f"SKIPPED: {name} is not installed", file=sys.stderr)
        sys.exit(1 if os.environ.get("CI") else 0)
    return path


def http(port, path, data=None, **query):
    url = f"http://127.0.0.1:{port}{path}?{urllib.parse.urlencode(query)}"
    with urllib.request.urlopen(url, data, 120) as answer:
        return answer.read().decode()


class Server:
    """A server that can be killed and started again with its data."""

    def __init__(self, folder, name, words, ready):
        self.words, self.ready, self.process = words, ready, None
        self.log = open(folder / f"{name}.log", "ab")
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.words, stdout=self.log, stderr=self.log, stdin=subprocess.DEVNULL)
        end = time.monotonic() + 60
        while time.monotonic() < end:
            try:
                self.ready()
                return
            except OSError:
                time.sleep(0.1)
        sys.exit(f"{self.words[0]} does not start: see {self.log.name}")

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


def connects(port):
    import socket

    socket.create_connection(("127.0.0.1", port), 2).close()


def servers(folder, words):
    influx = folder / "influx.conf"
    influx.write_text(
        f'reporting-disabled = true\nbind-address = "127.0.0.1:{INFLUX + 1}"\n'
        f'[meta]\ndir = "{folder}/influx/meta"\n'
        f'[data]\ndir = "{folder}/influx/data"\nwal-dir = "{folder}/influx/wal"\n'
        f'[http]\nbind-address = "127.0.0.1:{INFLUX}"\nlog-enabled = false\n[monitor]\nstore-enabled = false\n'
    )
    broker = folder / "mosquitto.conf"
    broker.write_text(
        f"listener {BROKER} 127.0.0.1\nallow_anonymous true\npersistence true\npersistence_location {folder}/\n"
        "autosave_interval 1\nmax_queued_messages 0\nuser root\n"
    )
    metrics = [
        words["victoria-metrics"], f"-storageDataPath={folder}/metrics", f"-httpListenAddr=127.0.0.1:{METRICS}",
        "-dedup.minScrapeInterval=1ms", "-retentionPeriod=100y", "-inmemoryDataFlushInterval=1s",
    ]
    if "inmemoryDataFlushInterval" not in subprocess.run([metrics[0], "-help"], capture_output=True, text=True).stdout:
        metrics.pop()
    return {
        "influx": Server(folder, "influx", [words["influxd"], "-config", influx], lambda: http(INFLUX, "/ping")),
        "metrics": Server(folder, "metrics", metrics, lambda: http(METRICS, "/health")),
        "broker": Server(folder, "broker", [words["mosquitto"], "-c", broker], lambda: connects(BROKER)),
    }


def publisher(program, file, url):
    log = open(f"{file}.{url.split(':')[0]}.log", "ab")
    return subprocess.Popen([program, "publish", file, "--to", url, "--follow"], stdout=log, stderr=log)


def rows_of(folder, number):
    """The rows of a recording: (file, line) and the value."""
    rows = {}
    for file in sorted(folder.glob(f"bench{number}-*.csv")):
        for line, text in enumerate(file.read_text().splitlines(), 1):
            if line > 1:
                rows[(file.name, line)] = text.split(",")
    return rows


def wait_for_end(program, files):
    """Waits until every position is at the end of its recording."""
    end = time.monotonic() + 600
    while time.monotonic() < end:
        done = subprocess.run([program, "publish", *files, "--status", "-f", "json"], capture_output=True, text=True)
        states = [json.loads(line) for line in done.stdout.splitlines()]
        behind = [state for state in states if state["behind_bytes"] > 0]
        if len(states) == 3 * len(files) and not behind:
            return
        time.sleep(1)
    sys.exit(f"FAILED: rows are not published after 600 s: {behind}")


def wait_for_quiet(file):
    """Waits until the subscriber has received nothing for 5 s: it is slower than the publishers."""
    size, quiet = -1, 0
    while quiet < 5:
        time.sleep(1)
        now = file.stat().st_size
        size, quiet = now, quiet + 1 if now == size else 0


def check_influx(folder, recordings):
    total = 0
    for number in range(recordings):
        rows = rows_of(folder, number)
        answer = http(INFLUX, "/query", db="lab", epoch="ns", q=f"SELECT value FROM cangauge WHERE bench='{number}'")
        values = json.loads(answer)["results"][0].get("series", [{"values": []}])[0]["values"]
        # The last three digits are those of the line.
        found = sorted((stamp // 1000, stamp % 1000, value) for stamp, value in values)
        expected = sorted((micros(row[0]), line % 1000, float(row[4])) for (_, line), row in rows.items())
        if found != expected:
            sys.exit(f"FAILED: InfluxDB has {len(found)} of {len(expected)} rows of recording {number}, or other values")
        total += len(found)
    print(f"InfluxDB: {total} rows, each exactly once")


def check_metrics(folder, recordings):
    total = 0
    # New rows are visible after some seconds.
    time.sleep(3)
    for number in range(recordings):
        rows = rows_of(folder, number)
        match = f'cangauge_value{{bench="{number}"}}'
        lines = http(METRICS, "/api/v1/export", **{"match[]": match, "reduce_mem_usage": 0}).splitlines()
        stamps = sorted(stamp for line in lines for stamp in json.loads(line)["timestamps"])
        expected = sorted({micros(row[0]) // 1000 for row in rows.values()})
        if stamps != expected:
            missing, unknown = set(expected) - set(stamps), set(stamps) - set(expected)
            sys.exit(
                f"FAILED: VictoriaMetrics has {len(stamps)} rows of recording {number} instead of {len(expected)}: "
                f"{len(missing)} are missing, {len(unknown)} are unknown"
            )
        total += len(stamps)
    print(f"VictoriaMetrics: {total} rows, each exactly once (milliseconds)")


def check_broker(folder, recordings, log):
    arrived, messages = {}, 0
    for line in log.read_text(errors="replace").splitlines():
        topic, _, text = line.partition(" ")
        if topic.endswith("/status"):
            continue
        payload = json.loads(text)
        messages += 1
        key = (payload["run"], payload["file"], payload["line"])
        arrived[key] = arrived.get(key, 0) + 1
    files = {(file, line) for number in range(recordings) for file, line in rows_of(folder, number)}
    missing = files - {key[1:] for key in arrived}
    foreign = {key[1:] for key in arrived} - files
    if foreign or len(missing) > len(files) * 0.05:
        sys.exit(f"FAILED: MQTT: {len(missing)} of {len(files)} rows are missing, {len(foreign)} are unknown")
    print(
        f"MQTT: {len(files)} rows, {messages} messages; without repeats by run, file and line each once; "
        f"{len(missing)} lost by the killed broker after its acknowledgement"
    )


def micros(text):
    import datetime

    at = datetime.datetime.fromisoformat(text.replace("Z", "+00:00"))
    return round((at - datetime.datetime.fromtimestamp(0, datetime.timezone.utc)) / datetime.timedelta(microseconds=1))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--recordings", type=int, default=40)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=random.randrange(1 << 30))
    options = parser.parse_args()
    print(f"seed {options.seed}")
    dice = random.Random(options.seed)
    words = {name: find(name) for name in SERVERS}
    program = os.path.abspath(options.program)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        processes = []
        try:
            run(options, dice, words, program, pathlib.Path(name), processes)
        finally:
            for process in processes:
                process.kill()
                if isinstance(process, subprocess.Popen):
                    process.wait()


def run(options, dice, words, program, folder, processes):
    running = servers(folder, words)
    processes.extend(running.values())
    http(INFLUX, "/query", b"", q="CREATE DATABASE lab")
    received = folder / "received.txt"
    subscribe = [words["mosquitto_sub"], "-p", str(BROKER), "-h", "127.0.0.1", "-t", "cangauge/#", "-q", "1", "-c",
                 "-i", "subscriber", "-F", "%t %p"]
    # It connects again by itself.
    subscriber = subprocess.Popen(subscribe, stdout=open(received, "wb"), stderr=subprocess.DEVNULL)
    urls = [f"influx://127.0.0.1:{INFLUX}/lab", f"influx://127.0.0.1:{METRICS}/lab", f"mqtt://127.0.0.1:{BROKER}"]
    files = [str(folder / f"bench{number}.csv") for number in range(options.recordings)]
    publishers = {(file, url): publisher(program, file, url) for file in files for url in urls}
    processes.extend([subscriber, *publishers.values()])
    logs = []
    for number, file in enumerate(files):
        log = [program, "-q", "-b", "sim:dps@1", "log", "1", "--poll", "10ms", "--duration", f"{options.seconds}s",
               "-o", file, "--rotate", "20s", "--tag", f"bench={number}"]
        logs.append(subprocess.Popen(log, stdout=subprocess.DEVNULL))
    processes.extend(logs)
    start, kills = time.monotonic(), 0
    plan = sorted((dice.uniform(0.1, 0.9) * options.seconds, name) for name in running for _ in range(2))
    while any(log.poll() is None for log in logs):
        if plan and time.monotonic() - start > plan[0][0]:
            server = running[plan.pop(0)[1]]
            server.kill()
            time.sleep(dice.uniform(0, 2))
            server.start()
        key = dice.choice(list(publishers))
        publishers[key].send_signal(signal.SIGKILL)
        publishers[key].wait()
        publishers[key] = publisher(program, *key)
        processes.append(publishers[key])
        kills += 1
        time.sleep(dice.uniform(0, 0.4))
    if any(log.wait() != 0 for log in logs):
        sys.exit("FAILED: a recording failed")
    print(f"{len(files)} recordings of {options.seconds} s; {kills} publishers and 6 servers killed")
    before = time.monotonic()
    wait_for_end(program, files)
    print(f"all rows acknowledged {time.monotonic() - before:.0f} s after the last row")
    for process in publishers.values():
        process.terminate()
    codes = [process.wait(20) for process in publishers.values()]
    if any(codes):
        sys.exit(f"FAILED: exit codes of publishers after SIGTERM: {codes}")
    wait_for_quiet(received)
    subscriber.terminate()
    subscriber.wait()
    check_influx(folder, options.recordings)
    check_metrics(folder, options.recordings)
    check_broker(folder, options.recordings, received)


if __name__ == "__main__":
    main()
