//! TPDOs as a DBC file for CANalyzer, SavvyCAN, asammdf and others.

use crate::canopen::id::CanId;
use crate::canopen::value::DataType;
use crate::tasks::export::{Message, MessageSignal};
use std::collections::BTreeSet;
use std::io::{self, Write};

/// The maximum length of a name in a DBC file.
const MAX_NAME: usize = 32;

/// Bit 31 of an identifier in a DBC file: set for a 29-bit identifier.
const EXTENDED: u32 = 0x8000_0000;

/// Writes a DBC file.
///
/// # Errors
/// The output cannot be written.
pub fn write(messages: &[Message], out: &mut dyn Write) -> io::Result<()> {
    let mut nodes: Vec<String> = messages.iter().map(node_name).collect();
    nodes.dedup();
    write!(out, "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_:")?;
    nodes.iter().try_for_each(|node| write!(out, " {node}"))?;
    writeln!(out)?;
    let usable = || messages.iter().filter(|message| !message.is_shared);
    for message in usable() {
        let (id, node) = (identifier(message), node_name(message));
        writeln!(out, "\nBO_ {id} {node}_TPDO{}: {} {node}", message.number.get(), message.length)?;
        for (name, signal) in named(message) {
            writeln!(out, " SG_ {name} : {} Vector__XXX", fields(signal))?;
        }
    }
    writeln!(out)?;
    let mut commented = BTreeSet::new();
    for message in messages {
        let node = node_name(message);
        if let Some(device) = message.device.as_ref().filter(|_| commented.insert(message.node)) {
            writeln!(out, "CM_ BU_ {node} \"{}\";", text(device))?;
        }
    }
    for message in usable() {
        for (name, signal) in named(message) {
            let real = match signal.data_type {
                DataType::Real32 => 1,
                DataType::Real64 => 2,
                _ => continue,
            };
            writeln!(out, "SIG_VALTYPE_ {} {name} : {real};", identifier(message))?;
        }
    }
    Ok(())
}

/// `0|32@1- (0.001,0) [0|0] "bar"`: Intel byte order, signed or not, without a range.
fn fields(signal: &MessageSignal) -> String {
    let is_signed = matches!(signal.data_type, DataType::Integer(_) | DataType::Real32 | DataType::Real64);
    let unit = signal.unit.map(|unit| unit.to_string()).unwrap_or_default();
    format!(
        "{}|{}@1{} ({},{}) [0|0] \"{}\"",
        signal.start,
        signal.bits,
        if is_signed { '-' } else { '+' },
        signal.scale.factor.as_f64(),
        signal.scale.offset.as_f64(),
        text(&unit)
    )
}

fn identifier(message: &Message) -> u32 {
    match message.id {
        CanId::Standard(id) => id.into(),
        CanId::Extended(id) => id | EXTENDED,
    }
}

fn node_name(message: &Message) -> String {
    format!("Node{}", message.node)
}

/// Returns the signals with unique names of letters, digits and underscores.
fn named(message: &Message) -> Vec<(String, &MessageSignal)> {
    let mut taken = BTreeSet::new();
    let name = |signal: &MessageSignal| {
        let word: String =
            signal.name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect();
        let word = if word.starts_with(|first: char| first.is_ascii_digit()) { format!("_{word}") } else { word };
        let word = &word[..word.len().min(MAX_NAME)];
        let numbered = |number: usize| {
            let end = format!("_{number}");
            format!("{}{end}", &word[..word.len().min(MAX_NAME - end.len())])
        };
        let name = std::iter::once(word.to_owned()).chain((2..).map(numbered)).find(|name| !taken.contains(name));
        let name = name.unwrap_or_default();
        taken.insert(name.clone());
        name
    };
    message.signals.iter().map(name).collect::<Vec<_>>().into_iter().zip(&message.signals).collect()
}

/// Converts a text so that it can stand between quotation marks.
fn text(text: &str) -> String {
    text.chars().filter(|letter| !letter.is_control()).map(|letter| if letter == '"' { '\'' } else { letter }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::id::NodeId;
    use crate::canopen::pdo::TpdoNumber;
    use crate::device::scale::{Decimal, Scale};
    use crate::device::unit::Unit;

    #[test]
    fn integers_reals_and_names() -> Result<(), Box<dyn std::error::Error>> {
        let signal = |name: &str, start, bits, data_type, digits| MessageSignal {
            name: name.to_owned(),
            start,
            bits,
            data_type,
            scale: Scale { factor: Decimal::new(1, digits), offset: Decimal::ZERO },
            unit: Unit::from_symbol("bar"),
        };
        let message = Message {
            node: NodeId::new(5)?,
            device: Some("a \"b\"".to_owned()),
            number: TpdoNumber::new(2).ok_or("a TPDO")?,
            id: CanId::Extended(0x281),
            length: 8,
            signals: vec![
                signal("ai-input-pv:1", 0, 24, DataType::Integer(3), 3),
                signal("ai-input.pv:1", 24, 8, DataType::Unsigned(1), 0),
                signal("0x6130:1", 32, 32, DataType::Real32, 0),
            ],
            unknown: Vec::new(),
            is_shared: false,
        };
        let mut text = Vec::new();
        write(&[message.clone(), Message { is_shared: true, ..message }], &mut text)?;
        assert_eq!(
            String::from_utf8(text)?,
            "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Node5\n\nBO_ 2147484289 Node5_TPDO2: 8 Node5\n \
             SG_ ai_input_pv_1 : 0|24@1- (0.001,0) [0|0] \"bar\" Vector__XXX\n \
             SG_ ai_input_pv_1_2 : 24|8@1+ (1,0) [0|0] \"bar\" Vector__XXX\n \
             SG_ _0x6130_1 : 32|32@1- (1,0) [0|0] \"bar\" Vector__XXX\n\nCM_ BU_ Node5 \"a 'b'\";\n\
             SIG_VALTYPE_ 2147484289 _0x6130_1 : 1;\n"
        );
        Ok(())
    }
}
