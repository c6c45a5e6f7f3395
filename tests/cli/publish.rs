//! `cangauge publish` with small servers on loopback, most of them hostile.

use super::{Bench, Done};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread;

/// A request: its first line and headers, and its body.
#[derive(Clone, Debug, Default)]
pub(super) struct Request {
    pub(super) head: String,
    pub(super) body: String,
}

/// What a server does with a connection.
type Behaviour = dyn Fn(&Request) -> Vec<u8> + Send + Sync;

/// A server on loopback.
struct Server {
    address: SocketAddr,
    requests: Arc<Mutex<Vec<Request>>>,
    news: mpsc::Receiver<()>,
}

pub(super) const OK: &[u8] = b"HTTP/1.1 204 No Content\r\n\r\n";

fn answer(status: &str, headers: &str, body: &str) -> Vec<u8> {
    format!("HTTP/1.1 {status}\r\n{headers}Content-Length: {}\r\n\r\n{body}", body.len()).into_bytes()
}

pub(super) fn read_request(reader: &mut impl BufRead) -> Option<Request> {
    let (mut head, mut length) = (String::new(), 0);
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line).ok()? == 0 {
            return None;
        }
        if line == "\r\n" {
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse().ok()?;
        }
        head.push_str(&line);
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    Some(Request { head, body: String::from_utf8(body).ok()? })
}

impl Server {
    /// A server that answers each request with the result of `behaviour`. An empty answer closes the connection.
    fn new(behaviour: impl Fn(&Request) -> Vec<u8> + Send + Sync + 'static) -> Server {
        Server::at(TcpListener::bind("127.0.0.1:0").expect("a port"), Arc::new(behaviour))
    }

    fn at(listener: TcpListener, behaviour: Arc<Behaviour>) -> Server {
        let address = listener.local_addr().expect("an address");
        let requests = Arc::new(Mutex::new(Vec::new()));
        let (news_to, news) = mpsc::channel();
        let all = Arc::clone(&requests);
        thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let (all, behaviour, news_to) = (Arc::clone(&all), Arc::clone(&behaviour), news_to.clone());
                thread::spawn(move || {
                    let mut reader = BufReader::new(stream.try_clone().expect("a stream"));
                    let mut stream = stream;
                    while let Some(request) = read_request(&mut reader) {
                        let bytes = behaviour(&request);
                        all.lock().expect("not poisoned").push(request);
                        let _ = news_to.send(());
                        if bytes.is_empty() || stream.write_all(&bytes).is_err() {
                            return;
                        }
                    }
                });
            }
        });
        Server { address, requests, news }
    }

    fn url(&self) -> String {
        format!("influx://{}/lab", self.address)
    }

    fn requests(&self) -> Vec<Request> {
        self.requests.lock().expect("not poisoned").clone()
    }

    /// The distinct lines that the server received.
    fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> =
            self.requests().iter().flat_map(|request| request.body.lines()).map(str::to_owned).collect();
        lines.sort();
        lines.dedup();
        lines
    }

    /// Waits until the server has received this many distinct lines.
    fn wait_for_lines(&self, count: usize) {
        while self.lines().len() < count {
            self.news.recv_timeout(super::COMMAND_TIMEOUT).expect("a request");
        }
    }
}

/// A bench with a recording of `rows` rows.
pub(super) fn recorded(rows: usize) -> Bench {
    let bench = Bench::of("dps@127");
    bench.run(&format!("log 127 --count {rows} -o run.csv --tag part=P107")).exit(0);
    bench
}

/// Runs `publish` with short times. Secrets are in the environment.
pub(super) fn publish(bench: &Bench, line: &str) -> Done {
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut command = bench.command(&["publish", "--timeout", "1s", "--wait", "1s"]);
    let done = bench.finish(command.args(words).env("CANGAUGE_TOKEN", "s3cret"));
    let files = bench.files().iter().map(|file| bench.text(file)).collect::<String>();
    assert!(!format!("{}{}{files}", done.stdout, done.stderr).contains("s3cret"), "{done:?}");
    done
}

#[test]
fn rows_are_sent_once_with_their_tags() {
    let bench = recorded(5);
    let server = Server::new(|_| OK.to_vec());
    let to = format!("run.csv --to {} --tag bench=3 --identity", server.url());
    let done = publish(&bench, &to).exit(0);
    assert_eq!(done.stderr, "run.csv: 5 rows sent, up to date\n");
    let requests = server.requests();
    assert!(requests[0].head.starts_with("POST /write?db=lab&precision=ns HTTP/1.1\r\n"), "{requests:?}");
    assert!(requests[0].head.to_lowercase().contains("authorization: token s3cret\r\n"), "{requests:?}");
    let lines = server.lines();
    assert_eq!(lines.len(), 5);
    for line in &lines {
        let (tags, rest) = line.split_once(" value=").expect("a value");
        assert!(tags.starts_with("cangauge,bench=3,run="), "{line}");
        assert!(tags.ends_with(",part=P107,name=DPS,serial=20002,node=127,signal=pressure,unit=psi"), "{line}");
        let time: u64 = rest.split(' ').nth(1).and_then(|time| time.parse().ok()).expect("a time");
        assert!((2..7).contains(&(time % 1000)), "the line number: {line}");
    }
    let status = bench.run("publish run.csv --status -f json").exit(0).json().remove(0);
    assert_eq!((&status["sent"], &status["behind_bytes"], &status["state"]), (&5.into(), &0.into(), &"ok".into()));

    let again = publish(&bench, &(to.clone() + " -f json")).exit(0).json().remove(0);
    assert_eq!((&again["sent"], server.requests().len()), (&5.into(), 1));
    bench.run("log 127 --count 2 -o run.csv --append --tag part=P108").exit(0);
    publish(&bench, &to).exit(0);
    assert_eq!(server.lines().len(), 7);
}

#[test]
fn rejected_rows_are_saved_and_the_others_are_sent() {
    let bench = recorded(30);
    let bad = bench.text("run.csv").lines().nth(7).expect("a row").to_owned();
    let value = format!("value={} ", bad.split(',').nth(4).expect("a value"));
    let server = Server::new(move |request| match request.body.contains(&value) {
        true => answer("400 Bad Request", "", "{\"error\":\"unable to parse\\u001b a line\"}"),
        false => OK.to_vec(),
    });
    let done = publish(&bench, &format!("run.csv --to {}", server.url())).exit(7);
    let rejects = bench.files().into_iter().find(|file| file.ends_with(".rejected")).expect("a file");
    assert!(done.stderr.contains("never accepted, first line 8: unable to parse a line; saved in run.csv.influx-"));
    assert!(done.stderr.contains("cangauge: run.csv: 1 line was rejected: see run.csv.influx-"), "{}", done.stderr);
    let rejected: serde_json::Value = serde_json::from_str(&bench.text(&rejects)).expect("one line");
    assert_eq!((&rejected["line"], &rejected["row"]), (&8.into(), &bad.into()));
    assert!(done.stderr.contains("run.csv: 29 rows sent, 1 rejected, up to date\n"), "{}", done.stderr);
}

#[test]
fn hostile_servers_get_no_row_taken_away() {
    let redirect = "HTTP/1.1 307 Temporary Redirect\r\nLocation: http://127.0.0.1:1/\r\nContent-Length: 0\r\n\r\n";
    let endless_body = || [b"HTTP/1.1 500 Oops\r\n\r\n".to_vec(), vec![b'x'; 3_000_000]].concat();
    let endless_head = || [b"HTTP/1.1 204 No\r\nX: ".to_vec(), vec![b'x'; 3_000_000]].concat();
    let cases: Vec<(&str, Vec<u8>, i32, &str)> = vec![
        ("garbage", b"\x16\x03\x01\x02garbage\r\n\r\n".to_vec(), 6, "the answer is not in the protocol of the server"),
        ("endless head", endless_head(), 6, "the answer is not in the protocol of the server"),
        ("endless body", endless_body(), 4, "(HTTP status 500)"),
        ("cut off", b"HTTP/1.1 204 No".to_vec(), 3, "no answer in time"),
        ("closed", Vec::new(), 3, "the server closed the connection without an answer"),
        ("redirect", redirect.as_bytes().to_vec(), 4, "the server redirects to another address (HTTP status 307)"),
        ("web page", answer("200 OK", "", "<html>"), 6, "the answer is not that of a database (HTTP status 200)"),
        ("token", answer("401 Unauthorized", "", "{}"), 4, "the server rejects the credentials (status 401)"),
        ("no database", answer("404 Not Found", "", "{\"error\":\"database not found\"}"), 4, "database not found"),
        ("full", answer("503 Full", "Retry-After: 1\r\n", "{\"error\":\"timeout\"}"), 4, "timeout (HTTP status 503)"),
        ("https", answer("400 Bad Request", "", "HTTP request to an HTTPS server"), 4, "the server rejects every row"),
    ];
    let check = |(name, bytes, exit, message): (&str, Vec<u8>, i32, &str)| {
        let bench = recorded(3);
        let server = Server::new(move |_| bytes.clone());
        let done = publish(&bench, &format!("run.csv --to {}", server.url())).exit(exit);
        assert!(done.stderr.contains(message), "{name}: {}", done.stderr);
        assert!(bench.files().iter().all(|file| !file.ends_with(".rejected")), "{name}");
        // The position did not move: a good server gets all rows.
        let good = Server::new(|_| OK.to_vec());
        let position = bench.files().into_iter().find(|file| file.ends_with(".pos")).expect("a position");
        let text = bench.text(&position).replace(&server.address.to_string(), &good.address.to_string());
        let renamed = position.replace(&server.address.port().to_string(), &good.address.port().to_string());
        fs::write(bench.path(&renamed), text).expect("written");
        publish(&bench, &format!("run.csv --to {}", good.url())).exit(0);
        assert_eq!(good.lines().len(), 3, "{name}");
    };
    // In parallel, because some of them wait for an answer until a time-out.
    thread::scope(|scope| cases.into_iter().for_each(|case| drop(scope.spawn(|| check(case)))));
}

#[test]
fn absent_server_is_exit_3() {
    let bench = recorded(3);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("influx://{}/lab", listener.local_addr().expect("an address"));
    drop(listener);
    let done = publish(&bench, &format!("run.csv --to {url}")).exit(3);
    assert!(done.stderr.contains(&format!("cangauge: {url}: no connection: ")), "{}", done.stderr);
    let error = publish(&bench, &format!("run.csv --to {url} -q -f json")).exit(3);
    let error: serde_json::Value = serde_json::from_str(error.stderr.trim()).expect("an object");
    assert_eq!(error["error"]["kind"], "no-answer");
}

#[test]
fn wrong_arguments_change_nothing() {
    let bench = recorded(1);
    let before = bench.files();
    for (url, message) in [
        ("influx://me:s3cret@lab1/db", "--to must not contain a user name or a password"),
        ("influx://lab1/db?token=s3cret", "--to must not contain ? or #"),
        ("http://lab1/db", "--to has an unknown kind of server"),
        ("influx://lab1", "--to names no database"),
        ("influx://lab1:0/db", "--to has no valid host and port"),
    ] {
        let done = publish(&bench, &format!("run.csv --to {url}")).exit(2);
        assert!(done.stderr.starts_with(&format!("cangauge: {message}")), "{url}: {}", done.stderr);
    }
    #[cfg(not(feature = "tls"))]
    for url in ["influx+https://lab1/db", "mqtts://lab1"] {
        let done = publish(&bench, &format!("run.csv --to {url} --ca none.pem")).exit(2);
        assert!(done.stderr.starts_with("cangauge: --to needs TLS, which this program does not contain\nhint: "));
    }
    let done = publish(&bench, "run.csv --to influx://lab1/db --ca none.pem").exit(2);
    assert!(done.stderr.starts_with("cangauge: --ca needs an address with TLS"), "{}", done.stderr);
    publish(&bench, "run.csv --to influx://127.0.0.1:1/db --tag a=1 --tag a=2").exit(2);
    publish(&bench, "run.csv").exit(2);
    publish(&bench, "none.csv --to influx://127.0.0.1:1/db").exit(8);
    bench.run("publish run.csv --status").exit(8);
    assert_eq!(bench.files(), before);
}

#[test]
fn service_follows_a_rotated_recording_and_waits_for_the_server() {
    let bench = Bench::of("dps@127");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    drop(listener);
    let url = format!("influx://{address}/lab");
    let start = |bench: &Bench| {
        let mut command = bench.command(&["publish", "run.csv", "--follow", "--to", &url]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary")
    };
    // Neither the recording nor the server exists yet.
    let child = start(&bench);
    bench.run("log 127 --duration 3s -o run.csv --rotate 1s").exit(0);
    let rows: usize = (1..=3).map(|number| bench.text(&format!("run-000{number}.csv")).lines().count() - 1).sum();
    let server = Server::at(TcpListener::bind(address).expect("the port"), Arc::new(|_: &Request| OK.to_vec()));
    server.wait_for_lines(rows);
    // A killed publisher continues.
    let mut child = child;
    child.kill().expect("killed");
    child.wait().expect("its end");
    let child = start(&bench);
    bench.run("log 127 --duration 1s -o run.csv --rotate 1s --append").exit(0);
    let rows = rows + bench.text("run-0004.csv").lines().count() - 1;
    server.wait_for_lines(rows);
    terminate(&child);
    let done = bench.end(child).exit(0);
    assert!(done.stderr.contains("rows sent"), "{}", done.stderr);
    assert_eq!(server.lines().len(), rows);
}

#[test]
fn rows_of_the_last_seconds_are_sent_again_after_a_restart_of_the_server() {
    let bench = recorded(5);
    let count = AtomicUsize::new(0);
    let server =
        Server::new(move |_| if count.fetch_add(1, Ordering::Relaxed) == 1 { Vec::new() } else { OK.to_vec() });
    let mut command = bench.command(&["publish", "run.csv", "--follow", "--to", &server.url()]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
    server.wait_for_lines(5);
    bench.run("log 127 --count 2 -o run.csv --append --tag part=P107").exit(0);
    while server.requests().len() < 3 {
        server.news.recv_timeout(super::COMMAND_TIMEOUT).expect("a request");
    }
    terminate(&child);
    bench.end(child).exit(0);
    let bodies: Vec<String> = server.requests().into_iter().map(|request| request.body).collect();
    assert_eq!(bodies[0].lines().count(), 5, "{bodies:?}");
    assert_eq!(bodies[2], format!("{}{}", bodies[0], bodies[1]));
}

fn terminate(child: &Child) {
    let killed = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill");
    assert!(killed.success());
}

/// Reads one MQTT packet: its first byte and its body.
pub(super) fn read_packet(stream: &mut impl Read) -> Option<(u8, Vec<u8>)> {
    let mut byte = [0];
    stream.read_exact(&mut byte).ok()?;
    let (first, mut length, mut shift) = (byte[0], 0, 0);
    loop {
        stream.read_exact(&mut byte).ok()?;
        length |= usize::from(byte[0] & 127) << shift;
        shift += 7;
        if byte[0] < 128 {
            break;
        }
    }
    let mut body = vec![0; length];
    stream.read_exact(&mut body).ok()?;
    Some((first, body))
}

/// A broker on loopback that acknowledges everything. The first connection is closed before the acknowledgement of its
/// third message. Sends each message as `TOPIC PAYLOAD`, a retained one with `!`.
fn broker() -> (SocketAddr, mpsc::Receiver<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let (to, messages) = mpsc::channel();
    thread::spawn(move || {
        for (number, mut stream) in listener.incoming().map_while(Result::ok).enumerate() {
            let mut count = 0;
            while let Some((first, body)) = read_packet(&mut stream) {
                let text = |from: usize, to: usize| String::from_utf8_lossy(&body[from..to]).into_owned();
                match first >> 4 {
                    1 => stream.write_all(b"\x20\x02\0\0").expect("writable"),
                    3 => {
                        count += 1;
                        if number == 0 && count == 3 {
                            break;
                        }
                        let end = 2 + usize::from(u16::from_be_bytes([body[0], body[1]]));
                        let mark = if first & 1 == 1 { "!" } else { "" };
                        let _ = to.send(format!("{mark}{} {}", text(2, end), text(end + 2, body.len())));
                        stream.write_all(&[0x40, 2, body[end], body[end + 1]]).expect("writable");
                    }
                    _ => break,
                }
            }
        }
    });
    (address, messages)
}

#[test]
fn rows_are_mqtt_messages() {
    let bench = recorded(4);
    let (address, messages) = broker();
    let done = publish(&bench, &format!("run.csv --to mqtt://{address}/lab --tag bench=3")).exit(0);
    assert!(done.stderr.contains("the server closed the connection without an answer; trying again"), "{done:?}");
    let all: Vec<String> = messages.try_iter().collect();
    assert_eq!(
        (all[0].as_str(), all.last().map(String::as_str)),
        ("!lab/3/status online", Some("!lab/3/status offline"))
    );
    let mut lines = Vec::new();
    for message in all.iter().filter(|message| !message.contains("/status ")) {
        // The recording is of the virtual clock, so no value is fresh.
        let payload = message.strip_prefix("lab/3/127/pressure ").expect(message);
        let row: serde_json::Value = serde_json::from_str(payload).expect(payload);
        assert_eq!((&row["file"], &row["tags"]["part"]), (&"run.csv".into(), &"P107".into()));
        lines.push(row["line"].as_u64().expect("a line"));
    }
    // The rows of the lost connection are repeated.
    assert!(lines.ends_with(&[2, 3, 4, 5]) && lines.len() > 4, "{lines:?}");
}
