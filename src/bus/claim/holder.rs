//! Finds the process that holds a name in the abstract namespace.
//!
//! The kernel reports the peer of a connection. The connection is non-blocking, so a holder that does not accept, or
//! whose queue is full, cannot block this process. In that case `/proc` is searched, which shows the sockets of other
//! users only to root.

use super::Holder;
use socket2::{Domain, SockAddr, Socket, Type};
use std::fs;
use std::io;
use std::os::fd::AsRawFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::SocketAddr;
use std::path::PathBuf;

/// The longest name of a user or program that is printed, in characters.
const MAX_NAME: usize = 32;

/// Identifies the holder of `address` as far as possible, without waiting.
pub(super) fn identify(address: &SocketAddr) -> Holder {
    let Some(name) = address.as_abstract_name() else { return Holder::default() };
    let (process, user) = match peer(name) {
        Ok(peer) => (u32::try_from(peer.pid).ok().filter(|&process| process > 0), Some(peer.uid)),
        Err(_) => {
            let process = owner(name);
            let folder = process.and_then(|process| fs::metadata(format!("/proc/{process}")).ok());
            (process, folder.map(|folder| folder.uid()))
        }
    };
    let program = process.and_then(|process| fs::read_to_string(format!("/proc/{process}/comm")).ok());
    Holder {
        process,
        user: user.map(|user| printable(&user_name(user).unwrap_or_else(|| user.to_string()))),
        program: program.map(|program| printable(program.trim_end())).filter(|program| !program.is_empty()),
    }
}

/// Reads the credentials of the process that listens at this name, over a non-blocking connection.
#[expect(unsafe_code, reason = "the standard library does not give the credentials of a peer")]
fn peer(name: &[u8]) -> io::Result<libc::ucred> {
    let socket = Socket::new(Domain::UNIX, Type::STREAM.nonblocking().cloexec(), None)?;
    let path = [b"\0", name].concat();
    let path = std::str::from_utf8(&path).map_err(io::Error::other)?;
    socket.connect(&SockAddr::unix(path)?)?;
    let mut peer = libc::ucred { pid: 0, uid: 0, gid: 0 };
    let mut length = libc::socklen_t::try_from(size_of::<libc::ucred>()).map_err(io::Error::other)?;
    // SAFETY: `peer` is plain numbers, `length` is its length, and both outlive the call.
    let result = unsafe {
        let (level, option) = (libc::SOL_SOCKET, libc::SO_PEERCRED);
        libc::getsockopt(socket.as_raw_fd(), level, option, (&raw mut peer).cast(), &raw mut length)
    };
    if result == 0 { Ok(peer) } else { Err(io::Error::last_os_error()) }
}

/// Searches `/proc` for the process that has the socket of this name open.
fn owner(name: &[u8]) -> Option<u32> {
    let sockets = fs::read("/proc/self/net/unix").ok()?;
    let ending = [b" @", name].concat();
    let lines = sockets.split(|&byte| byte == b'\n').filter(|line| line.ends_with(&ending));
    // Num: RefCount Protocol Flags Type St Inode Path
    let inodes = lines.filter_map(|line| std::str::from_utf8(line).ok()?.split_ascii_whitespace().nth(6));
    // Connections in the queue have the same name and inode 0. They do not belong to a process.
    let inodes = inodes.filter(|&inode| inode != "0");
    let targets: Vec<PathBuf> = inodes.map(|inode| PathBuf::from(format!("socket:[{inode}]"))).collect();
    let processes = fs::read_dir("/proc").ok()?.flatten();
    processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).find(|process: &u32| {
        let files = fs::read_dir(format!("/proc/{process}/fd"));
        files.is_ok_and(|files| {
            files.flatten().any(|file| fs::read_link(file.path()).is_ok_and(|link| targets.contains(&link)))
        })
    })
}

/// Looks up the name of a user ID in `/etc/passwd`.
fn user_name(user: u32) -> Option<String> {
    let users = fs::read_to_string("/etc/passwd").ok()?;
    users.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(user)).then(|| name.to_owned())
    })
}

/// Replaces all but printable ASCII characters, so that the name of a process cannot control the terminal.
fn printable(text: &str) -> String {
    let safe = |character: char| if character.is_ascii_graphic() || character == ' ' { character } else { '?' };
    text.chars().take(MAX_NAME).map(safe).collect()
}
