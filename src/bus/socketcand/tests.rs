use super::*;
use crate::bus::remote::{Remote, Use};
use crate::bus::server::Server;
use crate::bus::{Bus, Wall};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::thread;

const OPENED: Duration = Duration::from_secs(1_436_509_052);

fn at(mono: Duration) -> Stamp {
    Stamp { mono: Mono::at(mono), wall: Wall::at(OPENED + mono) }
}

/// A client that has opened its bus.
fn open_client() -> Client {
    let (mut client, mut out) = (Client::new("can0"), Output::default());
    client.start(at(Duration::ZERO), &mut out);
    client.receive(b"< hi >< ok >< ok >", at(Duration::ZERO), &mut out).expect("opened");
    assert_eq!(String::from_utf8_lossy(&out.bytes), "< open can0 >< rawmode >");
    assert!(client.is_open());
    client
}

/// Returns the events for text that arrives in these pieces.
fn events<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> Vec<String> {
    let (mut client, mut out) = (open_client(), Output::default());
    for piece in pieces {
        client.receive(piece, at(Duration::from_secs(1)), &mut out).expect("received");
    }
    let text = |event| match event {
        Event::Frame(received) => received.frame.to_string(),
        Event::Fault(fault, _) => fault.to_string(),
        other => format!("{other:?}"),
    };
    out.events.into_iter().map(text).collect()
}

#[test]
fn text_may_be_cut_anywhere() {
    let text = b"< frame 185 1436509052.249713 0011AAff >< frame 080 7.5  >\n< frame 18FF0001 7.000001 1 2 a0 >< error 040 7.6 >";
    let whole = ["185#0011AAFF", "080#", "18FF0001#0102A0", "bus-off"];
    for cut in 0..=text.len() {
        assert_eq!(events([&text[..cut], &text[cut..]]), whole, "{cut}");
    }
    assert_eq!(events(text.chunks(1)), whole);
}

#[test]
fn damaged_text_is_no_frame() {
    for text in [
        "< frame 185 1.5 0 0 1122334455667788 >",
        "< frame 185 1.5 112 >",
        "< frame 185 1.5 112233445566778899 >",
        "< frame 1850 1.5 11 >",
        "< frame 800 1.5 11 >",
        "< frame 20000000 1.5 11 >",
        "< frame 185 1.5 +1 >",
        "< frame 185 15 11 >",
        "< frame 185 1.5x 11 >",
        "< frame 185 1.5 11 \u{e9} >",
        "< frame 185 >",
        "< frame >",
        "< frame 185 1.5 11< frame 185 1.5 1",
        "frame 185 1.5 11 >",
    ] {
        let found = events([text.as_bytes()]);
        assert_eq!(found, [Fault::Garbled.to_string()], "{text}");
    }
    assert_eq!(events(["\r\n < stat 5 6 > \n".as_bytes()]), [""; 0]);
}

#[test]
fn a_line_without_end_takes_no_memory() {
    let (mut client, mut out) = (open_client(), Output::default());
    let piece = vec![b'a'; 1 << 20];
    client.receive(b"< frame 185 1.5 ", at(Duration::ZERO), &mut out).expect("received");
    for _ in 0..64 {
        client.receive(&piece, at(Duration::ZERO), &mut out).expect("received");
    }
    assert!(client.messages.text.is_none() && client.messages.noise.len() <= MAX_GREETING && out.events.len() <= 2);
    out.events.clear();
    client.receive(b"< frame 185 1.5 11 >", at(Duration::ZERO), &mut out).expect("received");
    assert!(matches!(out.events.pop_front(), Some(Event::Frame(_))));
}

#[test]
fn time_of_the_server_is_an_offset() {
    let (mut client, mut out) = (open_client(), Output::default());
    // The clock of the server is 20 years behind. Transmission takes 1 ms, for the second frame 9 ms.
    for (arrived, sent) in [(1001, "800000001.000000"), (2009, "800000002.000000"), (3001, "800000003.000000")] {
        let text = format!("< frame 185 {sent} 11 >");
        client.receive(text.as_bytes(), at(Duration::from_millis(arrived)), &mut out).expect("received");
    }
    let times = out.events.iter().map(|event| match event {
        Event::Frame(received) => (received.at.mono.since_start(), received.at.wall.since_epoch() - OPENED),
        other => panic!("{other:?}"),
    });
    for ((mono, wall), expected) in times.zip([1001, 2001, 3001]) {
        assert_eq!(mono, wall);
        assert!(mono.abs_diff(Duration::from_millis(expected)) < Duration::from_millis(2), "{mono:?}");
    }
}

/// Starts a server that runs `serve` for its first connection. Returns the bus and the thread.
fn server(serve: impl FnOnce(TcpStream, TcpListener) + Send + 'static) -> (Remote, thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("bound");
    let address = listener.local_addr().expect("an address");
    let thread = thread::spawn(move || serve(listener.accept().expect("a client").0, listener));
    (remote(address), thread)
}

fn remote(address: SocketAddr) -> Remote {
    Remote::parse(&format!("socketcand://{address}/can0")).expect("remote").expect("a name")
}

fn address(server: &Server) -> SocketAddr {
    server.address().expect("an address").to_string().parse().expect("an address")
}

/// Reads up to the end of a message.
fn read_message(stream: &mut TcpStream) -> String {
    let (mut text, mut byte) = (String::new(), [0]);
    while !text.ends_with('>') {
        stream.read_exact(&mut byte).expect("a message");
        text.push(char::from(byte[0]));
    }
    text
}

/// Greets and opens the bus.
fn greet(stream: &mut TcpStream) {
    stream.write_all(b"< hi >").expect("written");
    assert_eq!(read_message(stream), "< open can0 >");
    stream.write_all(b"< ok >").expect("written");
    assert_eq!(read_message(stream), "< rawmode >");
    stream.write_all(b"< ok >").expect("written");
}

fn error(remote: &Remote) -> String {
    remote.open(Use::Normal).err().expect("an error").to_string()
}

#[test]
fn refusals_are_reported_in_words() {
    let (bus, thread) = server(|mut stream, _| {
        stream.write_all(b"< hi >").expect("written");
        read_message(&mut stream);
        stream.write_all(b"< error could not \x1b open bus >").expect("written");
        let _ = stream.read(&mut [0; 9]);
    });
    assert_eq!(error(&bus), format!("{bus}: the server refuses the bus \"can0\": could not ? open bus"));
    thread.join().expect("the server");
    let (bus, thread) = server(|mut stream, _| {
        stream.write_all(b"SSH-2.0-OpenSSH_9.2\r\n").expect("written");
        let _ = stream.read(&mut [0; 9]);
    });
    assert_eq!(error(&bus), format!("{bus}: this is not a socketcand server: it sends \"SSH-2.0-OpenSSH_9.2\""));
    thread.join().expect("the server");
    let (bus, thread) = server(|_, _| {});
    thread::spawn(|| {});
    let why = error(&bus);
    assert!(why.ends_with("the connection was closed") || why.contains("reset"), "{why}");
    thread.join().expect("the server");
    assert_eq!(error(&bus), format!("{bus}: connection refused: no server listens there"));
}

#[test]
fn lost_connection_is_made_again() {
    let (bus, thread) = server(|mut stream, listener| {
        greet(&mut stream);
        assert_eq!(read_message(&mut stream), "< send 605 8 40 0 10 0 0 0 0 0 >");
        stream.write_all(b"< frame 585 5.000000 43001000940").expect("written");
        drop(stream);
        let mut stream = listener.accept().expect("a client again").0;
        greet(&mut stream);
        stream.write_all(b"< frame 705 5.1 05 >").expect("written");
        let _ = stream.read(&mut [0; 9]);
    });
    let mut bus = bus.open(Use::Normal).expect("opened");
    let frame: Frame = "605#4000100000000000".parse().expect("a frame");
    bus.send(&frame).expect("sent");
    let deadline = bus.mono() + Duration::from_secs(20);
    assert_eq!(bus.receive(deadline).expect("an event"), Event::Link(false));
    assert!(matches!(bus.send(&frame), Err(BusError::Down(_))));
    assert_eq!(bus.receive(deadline).expect("an event"), Event::Link(true));
    match bus.receive(deadline).expect("an event") {
        Event::Frame(received) => assert_eq!(received.frame.to_string(), "705#05"),
        other => panic!("{other:?}"),
    }
    drop(bus);
    thread.join().expect("the server");
}

#[test]
fn a_server_that_does_not_read_fills_the_queue() {
    let (sender, receiver) = std::sync::mpsc::channel::<()>();
    let (bus, thread) = server(move |mut stream, _| {
        greet(&mut stream);
        let _ = receiver.recv();
    });
    let mut bus = bus.open(Use::Normal).expect("opened");
    let frame: Frame = "605#4000100000000000".parse().expect("a frame");
    let full = (0..2_000_000).map(|_| bus.send(&frame)).find_map(Result::err);
    assert!(matches!(full, Some(BusError::QueueFull)), "{full:?}");
    assert_eq!(bus.receive(bus.mono()).expect("no wait"), Event::Timeout);
    let remote = Frame::remote(frame.id(), 1).expect("a frame");
    assert!(!bus.sends_remote_frames());
    drop(sender);
    thread.join().expect("the server");
    assert!(matches!(
        open_client().send(&remote, Stamp::default(), &mut Output::default()),
        Err(BusError::NoRemoteFrames)
    ));
}

#[test]
fn clients_of_our_server_receive_each_other() {
    let mut server = Server::listen("127.0.0.1:0".parse().expect("an address")).expect("listening");
    let bus = remote(address(&server));
    let clients = thread::spawn(move || {
        let mut clients = [bus.open(Use::Normal).expect("opened"), bus.open(Use::Normal).expect("opened")];
        clients[0].send(&"18FF0001#0102".parse().expect("a frame")).expect("sent");
        clients[1].send(&"000#".parse().expect("a frame")).expect("sent");
        clients.map(|mut client| {
            let until = client.mono() + Duration::from_secs(20);
            let mut frames = Vec::new();
            while frames.len() < 2 {
                match client.receive(until).expect("an event") {
                    Event::Frame(received) => frames.push(received.frame.to_string()),
                    Event::Timeout => break,
                    _ => {}
                }
            }
            frames
        })
    });
    let (until, mut frames) = (server.mono() + Duration::from_secs(20), Vec::new());
    while frames.len() < 2 {
        match server.receive(until).expect("an event") {
            Event::Frame(received) => frames.push(received.frame.to_string()),
            other => panic!("{other:?}"),
        }
    }
    server.send(&"705#7F".parse().expect("a frame")).expect("sent");
    let _ = server.receive(server.mono() + Duration::from_millis(50));
    let [first, second] = clients.join().expect("the clients");
    assert_eq!(
        (first, second),
        (vec!["000#".to_owned(), "705#7F".to_owned()], vec!["18FF0001#0102".to_owned(), "705#7F".to_owned()])
    );
    frames.sort();
    assert_eq!(frames, ["000#", "18FF0001#0102"]);
}

#[test]
fn our_server_survives_odd_clients() {
    let mut server = Server::listen("127.0.0.1:0".parse().expect("an address")).expect("listening");
    let address = address(&server);
    let client = thread::spawn(move || {
        let mut stream = TcpStream::connect(address).expect("connected");
        assert_eq!(read_message(&mut stream), "< hi >");
        let mut answer = |text: &str| {
            stream.write_all(text.as_bytes()).expect("written");
            read_message(&mut stream)
        };
        assert_eq!(answer("< rawmode >"), "< error unknown command >");
        assert_eq!(answer("GET / HTTP/1.0\r\n\r\n< open vcan7 >"), "< ok >");
        assert_eq!(answer("< send 605 0 >< echo >"), "< error unknown command >");
        assert_eq!(answer(""), "< echo >");
        assert_eq!(answer("< rawmode >"), "< ok >");
        for wrong in ["605 9 0 0 0 0 0 0 0 0 0", "605 2 1", "1 0", "605 1 100", "605", "20000605 0"] {
            assert_eq!(answer(&format!("< send {wrong} >")), "< error invalid frame >", "{wrong}");
        }
        stream.write_all(b"< send 605 1 ff >").expect("written");
    });
    match server.receive(server.mono() + Duration::from_secs(20)).expect("an event") {
        Event::Frame(received) => assert_eq!(received.frame.to_string(), "605#FF"),
        other => panic!("{other:?}"),
    }
    client.join().expect("the client");
}
