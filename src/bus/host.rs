//! The name of this computer, and random identifiers of runs.

use super::time::Wall;
use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};

/// The length of the longest POSIX host name, including the zero byte at its end.
#[cfg(unix)]
const MAX_NAME_LENGTH: usize = 256;

/// Returns the host name without the domain; `host` if it is unknown.
pub fn host_name() -> String {
    let name = full_name().unwrap_or_default();
    let first = name.split('.').next().unwrap_or_default();
    if first.is_empty() { "host".to_owned() } else { first.to_owned() }
}

#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library does not know the host name")]
fn full_name() -> Option<String> {
    let mut name = [0u8; MAX_NAME_LENGTH];
    // SAFETY: the pointer and the length describe `name`. The last byte stays 0, so the text has an end.
    let result = unsafe { libc::gethostname(name.as_mut_ptr().cast(), MAX_NAME_LENGTH - 1) };
    let text = name.split(|&byte| byte == 0).next()?;
    (result == 0).then(|| String::from_utf8_lossy(text).into_owned())
}

#[cfg(not(unix))]
fn full_name() -> Option<String> {
    None
}

/// Returns a new run ID: the start time and eight random hexadecimal digits, `20261129T150102-7f3a9c21`.
pub fn new_run_id(start: Wall) -> String {
    let time = humantime::format_rfc3339_seconds(start.system_time()).to_string();
    let time: String = time.chars().filter(char::is_ascii_alphanumeric).collect();
    format!("{}-{}", time.trim_end_matches('Z'), random_word())
}

/// Returns eight random hexadecimal digits. They are not suitable as a secret.
pub fn random_word() -> String {
    // The standard library seeds each hasher from the random numbers of the system.
    let mut hasher = RandomState::new().build_hasher();
    hasher.write_u32(std::process::id());
    format!("{:08x}", hasher.finish() >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn run_ids_differ_and_begin_with_the_time() {
        let start = Wall::at(Duration::from_secs(1_700_000_001));
        let [one, other] = [new_run_id(start), new_run_id(start)];
        assert_ne!(one, other);
        let (time, random) = one.split_once('-').expect("two parts");
        assert_eq!((time, random.len()), ("20231114T221321", 8));
        assert!(random.bytes().all(|byte| byte.is_ascii_hexdigit()), "{one}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn host_name_is_that_of_the_kernel() {
        let name = std::fs::read_to_string("/proc/sys/kernel/hostname").expect("a name");
        assert_eq!(Some(host_name().as_str()), name.trim().split('.').next());
    }
}
