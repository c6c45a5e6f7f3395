//! Decodes the bytes of a file into text.

/// The characters of Windows-1252 at 80h to 9Fh; Latin-1 has control characters there. Five codes are unused.
const CP1252_80: [char; 32] = [
    '€', '\u{fffd}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{fffd}', 'Ž', '\u{fffd}', '\u{fffd}',
    '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{fffd}', 'ž', 'Ÿ',
];

/// Decodes a file to text with `\n` as line end.
///
/// CiA 306 allows ISO 646 only. Real files are UTF-8 or UTF-16, with or without byte order mark, or Windows-1252. A
/// file that is not valid UTF-8 is read as Windows-1252. Control characters become U+FFFD, so that a name cannot move
/// the cursor of a terminal. ^Z and zeros at the end of a file (DOS, a full disk) are removed.
pub(super) fn decode(bytes: &[u8]) -> String {
    let text = match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        // UTF-16 without byte order mark: the first two characters are ASCII.
        [first, 0, second, 0, ..] if *first > 0 && *second > 0 => utf16(bytes, u16::from_le_bytes),
        [0, first, 0, second, ..] if *first > 0 && *second > 0 => utf16(bytes, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => utf8_or_cp1252(rest),
        _ => utf8_or_cp1252(bytes),
    };
    text.trim_end_matches(['\0', '\u{1a}'])
        .replace("\r\n", "\n")
        .chars()
        .map(|character| match character {
            '\r' => '\n',
            '\n' | '\t' => character,
            _ if character.is_control() => char::REPLACEMENT_CHARACTER,
            _ => character,
        })
        .collect()
}

fn utf8_or_cp1252(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| cp1252(byte)).collect(),
    }
}

fn cp1252(byte: u8) -> char {
    let high = byte.checked_sub(0x80).and_then(|place| CP1252_80.get(usize::from(place)));
    high.copied().unwrap_or(char::from(byte))
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// Shortens text of a file for a message, and escapes control characters.
pub(super) fn shown(text: &str) -> String {
    const MAX_CHARS: usize = 40;
    let mut short: String = text.chars().take(MAX_CHARS).collect();
    if text.chars().nth(MAX_CHARS).is_some() {
        short.push('…');
    }
    short.escape_debug().to_string()
}

/// Like [`shown`], in quotation marks.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", shown(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_reads_the_same() {
        let text = "[Gerät]\nDruck=5 µm\n";
        let utf16: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = [0xfeff].iter().chain(&utf16).flat_map(|unit: &u16| unit.to_le_bytes()).collect();
        let big: Vec<u8> = [0xfeff].iter().chain(&utf16).flat_map(|unit: &u16| unit.to_be_bytes()).collect();
        assert_eq!(decode(text.as_bytes()), text);
        assert_eq!(decode(format!("\u{feff}{text}").as_bytes()), text);
        assert_eq!(decode(b"[Ger\xe4t]\nDruck=5 \xb5m\n"), text);
        assert_eq!(decode(&little), text);
        assert_eq!(decode(&big), text);
        assert_eq!((decode(&little[2..]), decode(&big[2..])), (text.to_owned(), text.to_owned()));
    }

    #[test]
    fn cp1252_is_not_latin1() {
        assert_eq!(decode(b"\x80\x84\x96\x9f\xa0\xff\x81"), "€„–Ÿ\u{a0}ÿ\u{fffd}");
    }

    #[test]
    fn line_ends_and_garbage_at_the_end() {
        assert_eq!(decode(b"a\r\nb\rc\nd\x1a"), "a\nb\nc\nd");
        assert_eq!(decode(b"a\n\0\0\0"), "a\n");
        assert_eq!(decode(b"a\x1b[2Jb\t"), "a\u{fffd}[2Jb\t");
        assert_eq!(decode(b""), "");
        assert_eq!(decode(&[0xff, 0xfe, 0x41]), "");
    }

    #[test]
    fn quotations_are_short_and_safe() {
        assert_eq!(quoted("0.0"), "\"0.0\"");
        assert_eq!(quoted("a\"b\u{202e}"), "\"a\\\"b\\u{202e}\"");
        assert_eq!(quoted(&"x".repeat(1000)).chars().count(), 43);
    }
}
