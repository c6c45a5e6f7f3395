//! From text to words and signs.

use super::Fault;
use super::tree::{At, SignalName};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::measure::decode::Wanted;

/// A word or a sign.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// `9.95`: finite and not negative.
    Number(f64),
    /// A signal that cannot be anything else: `5.pressure`, `pressure.status`, `0x6130:1`.
    Signal(SignalName),
    /// A name, a unit, a function or a keyword.
    Word(String),
    /// `<`, `<=`, `..`, `(` …
    Sign(&'static str),
}

/// The signs, the longer ones first.
const SIGNS: [&str; 16] =
    ["..", "<=", ">=", "==", "!=", "<", ">", "+", "-", "*", "/", "(", ")", "|", "\u{2264}", "\u{2265}"];

/// Signs of other languages, and what they are here.
const FOREIGN: [(&str, &str); 4] = [("&&", "and"), ("=", "=="), ("!", "not"), ("%", "a number of the signal's unit")];

/// All the tokens of a text with their places.
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, At)>, Fault> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let blank = rest.len() - rest.trim_start().len();
        if blank > 0 {
            at += blank;
            continue;
        }
        let (token, length) = token(rest, At(at))?;
        tokens.push((token, At(at)));
        at += length;
    }
    Ok(tokens)
}

/// The token that a text begins with, and its length in bytes.
fn token(text: &str, at: At) -> Result<(Token, usize), Fault> {
    let first = text.chars().next().unwrap_or_default();
    if first.is_ascii_digit() {
        return number_or_signal(text, at);
    }
    if is_letter(first) {
        let word = name(text);
        let status = text[word.len()..].starts_with(".status") && name(&text[word.len() + 1..]) == "status";
        return Ok(if status {
            let what = Wanted::Status(word.to_owned());
            (Token::Signal(SignalName { node: None, what, at }), word.len() + ".status".len())
        } else {
            (Token::Word(word.to_owned()), word.len())
        });
    }
    if let Some(sign) = SIGNS.into_iter().find(|sign| text.starts_with(sign)) {
        let meant = match sign {
            "\u{2264}" => "<=",
            "\u{2265}" => ">=",
            sign => sign,
        };
        return Ok((Token::Sign(meant), sign.len()));
    }
    if let Some((sign, meant)) = FOREIGN.into_iter().find(|(sign, _)| text.starts_with(sign)) {
        return Err(Fault::new(at, format!("\"{sign}\" means nothing here; write {meant}")));
    }
    Err(Fault::new(at, format!("\"{first}\" means nothing here")))
}

fn is_letter(character: char) -> bool {
    character.is_ascii_alphabetic() || matches!(character, '\u{b0}' | '\u{b5}' | '\u{3bc}')
}

/// The name that a text begins with. A hyphen belongs to it where letters stand on both sides without a blank:
/// `oil-pressure` is a name, `a - b` and `a-1` are not.
fn name(text: &str) -> &str {
    let mut end = 0;
    let mut letters = text.char_indices().peekable();
    let mut before = false;
    while let Some((at, letter)) = letters.next() {
        let hyphen = letter == '-' && before && letters.peek().is_some_and(|&(_, next)| next.is_ascii_alphabetic());
        if !(is_letter(letter) || letter.is_ascii_digit() || letter == '_' || hyphen) {
            break;
        }
        before = letter != '-';
        end = at + letter.len_utf8();
    }
    &text[..end]
}

/// What begins with a digit: a number, an object, or a node with its signal.
fn number_or_signal(text: &str, at: At) -> Result<(Token, usize), Fault> {
    let hexadecimal = text.starts_with("0x") || text.starts_with("0X");
    let word = text.find(|character: char| !character.is_ascii_alphanumeric()).map_or(text, |end| &text[..end]);
    let behind = &text[word.len()..];
    if behind.starts_with(':') {
        let (object, length) = object(text, at)?;
        return Ok((Token::Signal(SignalName { node: None, what: Wanted::Object(object), at }), length));
    }
    if let Some(signal) = behind.strip_prefix('.')
        && is_signal(signal)
    {
        let node: NodeId =
            word.parse().map_err(|_| Fault::new(at, format!("\"{word}\" is not a node-ID: they go from 1 to 127")))?;
        let inner = At(at.0 + word.len() + 1);
        let (what, length) = match token(signal, inner)? {
            (Token::Signal(named), length) if named.node.is_none() => (named.what, length),
            (Token::Word(name), length) => (Wanted::Signal(name), length),
            _ => return Err(Fault::new(inner, "behind a node and a point stands a signal: 5.pressure")),
        };
        return Ok((Token::Signal(SignalName { node: Some(node), what, at }), word.len() + 1 + length));
    }
    if hexadecimal {
        let number =
            word.get(2..).filter(|digits| digits.len() <= 8).and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let number = number.ok_or_else(|| Fault::new(at, format!("\"{word}\" is not a number")))?;
        return Ok((Token::Number(f64::from(number)), word.len()));
    }
    let length = decimal(text);
    let number = text[..length].parse().ok().filter(|number: &f64| number.is_finite());
    let number = number.ok_or_else(|| Fault::new(at, format!("{} is too large", &text[..length])))?;
    Ok((Token::Number(number), length))
}

/// Whether a signal stands behind a node and its point: a name, or an object with `0x` or a colon.
fn is_signal(text: &str) -> bool {
    let word = text.find(|character: char| !character.is_ascii_alphanumeric()).map_or(text, |end| &text[..end]);
    match word.chars().next() {
        Some(first) if first.is_ascii_digit() => text[word.len()..].starts_with(':'),
        Some(first) => first.is_ascii_alphabetic() && !is_exponent(word),
        None => false,
    }
}

/// `5.e3` is no node with a signal, whatever else it is.
fn is_exponent(word: &str) -> bool {
    let digits = word.trim_start_matches(['e', 'E']);
    word.len() == digits.len() + 1 && !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit())
}

/// The length of the decimal number that a text begins with: `9`, `9.95`, `1.25e-3`; `9..10` begins with 9.
fn decimal(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut length = digits(0);
    if text[length..].starts_with('.') && digits(length + 1) > 0 {
        length += 1 + digits(length + 1);
    }
    if text[length..].starts_with(['e', 'E']) {
        let sign = usize::from(text[length + 1..].starts_with(['+', '-']));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}

/// `0x6130:1` at the beginning of a text.
fn object(text: &str, at: At) -> Result<(ObjectId, usize), Fault> {
    let end = text.find(|character: char| !(character.is_ascii_alphanumeric() || character == ':'));
    let word = end.map_or(text, |end| &text[..end]);
    let object = word.parse().map_err(|error| Fault::new(at, format!("{error}")))?;
    Ok((object, word.len()))
}
