//! `cangauge publish` with TLS servers on loopback. Their certificates are those of `tests/data/tls/`.

use super::publish::{OK, publish, read_packet, read_request, recorded};
use super::{Bench, Done};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ServerConfig, ServerConnection, StreamOwned};
use std::fs;
use std::io::{BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::thread;

type Encrypted = StreamOwned<ServerConnection, TcpStream>;

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/tls").join(name)
}

fn ca() -> String {
    format!("--ca {}", file("ca.pem").display())
}

/// A server with this certificate. Sends each line or message that it received.
fn server(certificate: &str, serve: fn(&mut Encrypted, &mpsc::Sender<String>)) -> (SocketAddr, mpsc::Receiver<String>) {
    let chain = CertificateDer::pem_file_iter(file(certificate)).expect("a file").map(Result::unwrap).collect();
    let key = PrivateKeyDer::from_pem_file(file("key.pem")).expect("a key");
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ServerConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let config = config.expect("versions").with_no_client_auth().with_single_cert(chain, key).expect("a pair");
    let config = Arc::new(config);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let (to, received) = mpsc::channel();
    thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let connection = ServerConnection::new(Arc::clone(&config)).expect("a connection");
            serve(&mut StreamOwned::new(connection, stream), &to);
        }
    });
    (address, received)
}

fn database(stream: &mut Encrypted, to: &mpsc::Sender<String>) {
    let mut reader = BufReader::new(stream);
    while let Some(request) = read_request(&mut reader) {
        assert!(request.head.to_lowercase().contains("authorization: token s3cret\r\n"), "{request:?}");
        request.body.lines().for_each(|line| to.send(line.to_owned()).expect("a reader"));
        reader.get_mut().write_all(OK).expect("writable");
    }
}

fn broker(stream: &mut Encrypted, to: &mpsc::Sender<String>) {
    while let Some((first, body)) = read_packet(stream) {
        match first >> 4 {
            1 => stream.write_all(b"\x20\x02\0\0").expect("writable"),
            3 => {
                let end = 2 + usize::from(u16::from_be_bytes([body[0], body[1]]));
                to.send(String::from_utf8_lossy(&body[2..end]).into_owned()).expect("a reader");
                stream.write_all(&[0x40, 2, body[end], body[end + 1]]).expect("writable");
            }
            _ => break,
        }
    }
}

/// Checks that nothing was sent, and that nothing is lost: no row is saved as sent or rejected.
fn assert_nothing_sent(bench: &Bench, done: &Done, received: &mpsc::Receiver<String>) {
    assert_eq!(received.try_iter().collect::<Vec<_>>(), [""; 0]);
    assert!(bench.files().iter().all(|file| !file.ends_with(".rejected")), "{done:?}");
    let status = bench.run("publish run.csv --status -f json").exit(0).json().remove(0);
    assert_eq!(status["sent"], 0, "{status}");
    assert_ne!(status["behind_bytes"], 0, "{status}");
}

#[test]
fn rows_are_sent_to_a_trusted_database() {
    let bench = recorded(3);
    let (address, lines) = server("localhost.pem", database);
    for (host, options) in [("127.0.0.1", ca()), ("localhost", ca()), ("127.0.0.1", String::new())] {
        let url = format!("influx+https://{host}:{}/lab", address.port());
        let line = format!("publish run.csv --to {url} {options}");
        let mut command = bench.command(&line.split_whitespace().collect::<Vec<_>>());
        command.env("CANGAUGE_TOKEN", "s3cret");
        if options.is_empty() {
            // The same recording was sent to this address before.
            fs::remove_file(bench.path(&format!("run.csv.influx-https-127.0.0.1-{}-lab.pos", address.port()))).unwrap();
            command.env("SSL_CERT_FILE", file("ca.pem"));
        }
        bench.finish(&mut command).exit(0);
        assert_eq!(lines.try_iter().count(), 3, "{host} {options}");
    }
}

#[test]
fn self_signed_certificate_can_be_trusted() {
    let bench = recorded(3);
    let (address, lines) = server("self-signed.pem", database);
    let trusted = file("self-signed.pem");
    publish(&bench, &format!("run.csv --to influx+https://{address}/lab --ca {}", trusted.display())).exit(0);
    assert_eq!(lines.try_iter().count(), 3);
}

#[test]
fn rows_are_sent_to_a_trusted_broker() {
    let bench = recorded(3);
    let (address, topics) = server("localhost.pem", broker);
    publish(&bench, &format!("run.csv --to mqtts://{address}/lab --tag bench=3 {}", ca())).exit(0);
    let topics: Vec<String> = topics.try_iter().collect();
    assert_eq!(topics.iter().filter(|topic| *topic == "lab/3/127/pressure").count(), 3, "{topics:?}");
}

#[test]
fn certificates_that_are_not_accepted() {
    let cases = [
        ("other-name.pem", "ca.pem", "is for lab1.example, not for the name in the address\nhint: use a name of the"),
        ("localhost.pem", "other-name.pem", "is not signed by a trusted authority\nhint: name the file with the cert"),
        ("self-signed.pem", "ca.pem", "is not signed by a trusted authority\nhint: name the file with the certificate"),
        ("expired.pem", "ca.pem", "has expired (2021-01-01)\nhint: renew the certificate of the server, or set the"),
        ("future.pem", "ca.pem", "is not valid yet (2120-01-01)\nhint: renew the certificate of the server, or set"),
    ];
    for (own, trusted, message) in cases {
        for (scheme, serve) in [("influx+https", database as fn(&mut Encrypted, &_)), ("mqtts", broker)] {
            let bench = recorded(3);
            let (address, received) = server(own, serve);
            let trusted = file(trusted);
            let line = format!("run.csv --tag bench=3 --to {scheme}://{address}/lab --ca {}", trusted.display());
            let done = publish(&bench, &line).exit(6);
            let expected = format!("cangauge: {scheme}://{address}/lab: the certificate of the server {message}");
            assert!(done.stderr.contains(&expected), "{own}: {}", done.stderr);
            assert_nothing_sent(&bench, &done, &received);
        }
    }
}

#[test]
fn certificate_of_an_authority_is_none_of_a_server() {
    let bench = recorded(1);
    let (address, received) = server("ca.pem", database);
    let done = publish(&bench, &format!("run.csv --to influx+https://{address}/lab {}", ca())).exit(6);
    assert!(done.stderr.contains("presents the certificate of an authority (CA:TRUE) as its own"), "{}", done.stderr);
    assert_nothing_sent(&bench, &done, &received);
}

#[test]
fn servers_without_tls() {
    let cases: [(&'static [u8], i32, &str); 3] = [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", 6, "the server does not use TLS at this port\nhint: check the port"),
        (b"", 3, "the server closed the connection without an answer"),
        // A record of TLS that never ends.
        (b"\x16\x03\x03\x40\x00", 3, "no answer in time"),
    ];
    for (answer, exit, message) in cases {
        for scheme in ["influx+https", "mqtts"] {
            let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
            let address = listener.local_addr().expect("an address");
            thread::spawn(move || {
                let mut open = Vec::new();
                for mut stream in listener.incoming().map_while(Result::ok) {
                    let _ = stream.read(&mut [0; 4096]);
                    let _ = stream.write_all(answer);
                    if !answer.is_empty() {
                        open.push(stream);
                    }
                }
            });
            let bench = recorded(2);
            let line = format!("run.csv --tag bench=3 --to {scheme}://{address}/lab {}", ca());
            let done = publish(&bench, &line).exit(exit);
            assert!(done.stderr.contains(message), "{scheme}: {}", done.stderr);
        }
    }
}

#[test]
fn files_without_certificates() {
    let bench = recorded(1);
    let before = bench.files();
    let run = |options: &str| publish(&bench, &format!("run.csv --to influx+https://127.0.0.1:1/lab {options}"));
    let done = run("--ca run.csv").exit(2);
    assert!(done.stderr.contains("run.csv does not contain certificates"), "{}", done.stderr);
    run("--ca none.pem").exit(8);
    let mut command = bench.command(&["publish", "run.csv", "--to", "mqtts://127.0.0.1:1"]);
    let done = bench.finish(command.env("SSL_CERT_FILE", bench.path("none.pem"))).exit(8);
    assert!(done.stderr.starts_with("cangauge: this computer has no certificates of authorities: "), "{}", done.stderr);
    assert!(done.stderr.contains("hint: install ca-certificates, or name the file"), "{}", done.stderr);
    assert_eq!(bench.files(), before);
}
