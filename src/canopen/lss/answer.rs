//! The answers of slaves on 7E4h (CiA 305).

use super::{ErrorCode, Service, UNCONFIGURED};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};

/// An answer of a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// 44h: the slave is in configuration state. The next byte is a mode in some manuals, 0 in others.
    Selected,
    /// 11h, 13h, 17h: accepted or rejected.
    Acknowledge(ErrorCode),
    /// 5Ah to 5Dh: the requested number.
    Number(u32),
    /// 5Eh: the node-ID; `None` if the slave has none.
    NodeId(Option<NodeId>),
    /// 4Fh or 50h: a matching slave exists.
    Here,
}

/// How an answer violates the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// The frame has too few bytes.
    #[error("frame too short")]
    Short,
    /// The node-ID is not valid.
    #[error("{0} is not a valid node-ID")]
    NodeId(u8),
}

impl Answer {
    /// Parses an answer to `service`; `None` if the frame does not answer it.
    ///
    /// # Errors
    /// Required bytes are missing or invalid. Unused bytes may be missing: some devices send two bytes instead of
    /// eight.
    pub fn parse(frame: &Frame, service: Service) -> Option<Result<Answer, Violation>> {
        let (&specifier, rest) = frame.data().split_first()?;
        if frame.id() != CanId::LSS_SLAVE || service.answer_specifier() != Some(specifier) {
            return None;
        }
        Some(match service {
            Service::SwitchSelective => Ok(Answer::Selected),
            Service::Identify | Service::IdentifyUnconfigured | Service::Fastscan => Ok(Answer::Here),
            Service::Inquire(_) => {
                rest.first_chunk().map(|bytes| Answer::Number(u32::from_le_bytes(*bytes))).ok_or(Violation::Short)
            }
            Service::InquireNodeId => match rest.first() {
                None => Err(Violation::Short),
                Some(&UNCONFIGURED) => Ok(Answer::NodeId(None)),
                Some(&node) => {
                    NodeId::new(node).map(|node| Answer::NodeId(Some(node))).map_err(|_| Violation::NodeId(node))
                }
            },
            Service::ConfigureNodeId | Service::ConfigureBitTiming | Service::Store => match *rest {
                [] | [ErrorCode::SPECIFIC] => Err(Violation::Short),
                [code] => Ok(Answer::Acknowledge(ErrorCode { code, specific: 0 })),
                [code, specific, ..] => Ok(Answer::Acknowledge(ErrorCode { code, specific })),
            },
            Service::SwitchGlobal | Service::ActivateBitTiming => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::lss::Part;
    use proptest::prelude::*;

    fn frame(text: &str) -> Frame {
        text.parse().expect("a frame")
    }

    #[test]
    fn answers_need_only_the_bytes_that_have_a_meaning() {
        let acknowledge = |code, specific| Ok(Answer::Acknowledge(ErrorCode { code, specific }));
        for (service, text, answer) in [
            (Service::SwitchSelective, "7E4#4400000000000000", Ok(Answer::Selected)),
            (Service::SwitchSelective, "7E4#4401000000000000", Ok(Answer::Selected)),
            (Service::ConfigureNodeId, "7E4#1100000000000000", acknowledge(0, 0)),
            (Service::ConfigureNodeId, "7E4#1100", acknowledge(0, 0)),
            (Service::ConfigureNodeId, "7E4#1101000000000000", acknowledge(1, 0)),
            (Service::ConfigureNodeId, "7E4#11FF030000000000", acknowledge(0xff, 3)),
            (Service::ConfigureNodeId, "7E4#11FF", Err(Violation::Short)),
            (Service::ConfigureNodeId, "7E4#11", Err(Violation::Short)),
            (Service::ConfigureBitTiming, "7E4#13", Err(Violation::Short)),
            (Service::Store, "7E4#17", Err(Violation::Short)),
            (Service::Inquire(Part::Serial), "7E4#5D224E0000000000", Ok(Answer::Number(20002))),
            (Service::Inquire(Part::Serial), "7E4#5D224E0000", Ok(Answer::Number(20002))),
            (Service::Inquire(Part::Serial), "7E4#5D224E00", Err(Violation::Short)),
            (Service::InquireNodeId, "7E4#5E7F", Ok(Answer::NodeId(Some(NodeId::MAX)))),
            (Service::InquireNodeId, "7E4#5EFF000000000000", Ok(Answer::NodeId(None))),
            (Service::InquireNodeId, "7E4#5E00000000000000", Err(Violation::NodeId(0))),
            (Service::InquireNodeId, "7E4#5E", Err(Violation::Short)),
            (Service::Identify, "7E4#4F00000000000000", Ok(Answer::Here)),
            (Service::IdentifyUnconfigured, "7E4#5000000000000000", Ok(Answer::Here)),
        ] {
            assert_eq!(Answer::parse(&frame(text), service), Some(answer), "{text}");
        }
    }

    #[test]
    fn frames_of_other_services_are_not_answers() {
        for (service, text) in [
            (Service::ConfigureNodeId, "7E4#1700000000000000"),
            (Service::ConfigureNodeId, "7E5#1100000000000000"),
            (Service::ConfigureNodeId, "000007E4#1100000000000000"),
            (Service::ConfigureNodeId, "7E4#"),
            (Service::ConfigureNodeId, "7E4#R8"),
            (Service::Inquire(Part::Vendor), "7E4#5B00000000000000"),
            (Service::IdentifyUnconfigured, "7E4#4F00000000000000"),
            (Service::SwitchGlobal, "7E4#0400000000000000"),
            (Service::ActivateBitTiming, "7E4#1500000000000000"),
        ] {
            assert_eq!(Answer::parse(&frame(text), service), None, "{text}");
        }
    }

    proptest! {
            #[test]
    fn parsing_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..=8), part in 0u8..4) {
                let part = Part::from_number(part).expect("a part");
                for id in [CanId::LSS_MASTER, CanId::LSS_SLAVE] {
                    let frame = Frame::new(id, &bytes).expect("a frame");
                    for service in [Service::Store, Service::InquireNodeId, Service::Inquire(part), Service::Fastscan] {
                        if let Some(Ok(answer)) = Answer::parse(&frame, service) {
                            prop_assert_eq!(id, CanId::LSS_SLAVE);
                            let success = Answer::Acknowledge(ErrorCode { code: 0, specific: 0 });
                            prop_assert!(answer != success || bytes.get(..2) == Some(&[0x17, 0]));
                        }
                    }
                }
            }
        }
}
