//! One service: what is sent, and everything that is answered to it.

use super::{Answer, ErrorCode, LssAddress, LssRange, Request, Service, Violation};
use crate::canopen::frame::Frame;

/// More different answers than there can be slaves say nothing more.
const KEPT: usize = 128;

/// A service in progress. It collects the answers until whoever drives it says that the time is over: several
/// slaves that are in configuration state at once all answer.
#[derive(Clone, Debug)]
pub struct Exchange {
    requests: Vec<Request>,
    service: Service,
    /// Different answers in the order in which they came.
    heard: Vec<(Frame, Result<Answer, Violation>)>,
    /// How many answers came, the same ones too.
    count: usize,
    /// How often it was asked.
    asked: usize,
}

/// Why a service that one slave shall carry out has no result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExchangeError {
    /// Nobody answered.
    NoAnswer,
    /// More than one slave answered; the different answers.
    Several(Vec<Frame>),
    /// The slave said no.
    Refused(ErrorCode),
    /// The slave answered against the protocol.
    Violation(Violation, Frame),
}

impl Exchange {
    /// A service of one frame.
    pub fn new(request: Request) -> Exchange {
        Exchange { requests: vec![request], service: request.service(), heard: Vec::new(), count: 0, asked: 0 }
    }

    /// The switch to configuration state of the slave with this address.
    pub fn select(address: &LssAddress) -> Exchange {
        Exchange { requests: address.selection().to_vec(), ..Exchange::new(Request::Select(super::Part::Vendor, 0)) }
    }

    /// The question whether there are slaves within a range.
    pub fn identify(range: &LssRange) -> Exchange {
        let requests = range.identification().to_vec();
        Exchange { requests, ..Exchange::new(Request::Identify(super::Limit::Vendor, 0)) }
    }

    /// Which service it is.
    pub fn service(&self) -> Service {
        self.service
    }

    /// Whether there is an answer at all: not to 04h and 15h.
    pub fn is_answered(&self) -> bool {
        self.service.answer_specifier().is_some()
    }

    /// The frames to send, from the first one on, however often it is asked: half an address says nothing.
    pub fn ask(&mut self) -> Vec<Frame> {
        self.asked += 1;
        self.requests.iter().map(|request| request.frame()).collect()
    }

    /// Takes a frame of the bus; whether it was an answer to this service.
    pub fn on_frame(&mut self, frame: &Frame) -> bool {
        let Some(answer) = Answer::parse(frame, self.service) else { return false };
        self.count += 1;
        if self.heard.len() < KEPT && !self.heard.iter().any(|(heard, _)| heard == frame) {
            self.heard.push((*frame, answer));
        }
        true
    }

    /// Whether anybody has answered.
    pub fn has_answer(&self) -> bool {
        self.count > 0
    }

    /// Whether certainly more than one slave answered: answers differ, or more came than were asked for. Of a
    /// service that is answered in chorus the number says so too.
    pub fn is_crowded(&self) -> bool {
        self.heard.len() > 1 || self.count > self.asked
    }

    /// The different answers, with their frames.
    pub fn answers(&self) -> &[(Frame, Result<Answer, Violation>)] {
        &self.heard
    }

    /// The result, where one slave is meant. In chorus ([`Service::is_chorus`]) several are as good as one.
    ///
    /// # Errors
    /// Silence, several slaves, a refusal, a violation.
    pub fn one(&self) -> Result<Answer, ExchangeError> {
        let Some(&(frame, answer)) = self.heard.first() else { return Err(ExchangeError::NoAnswer) };
        if self.is_crowded() && !self.service.is_chorus() {
            return Err(ExchangeError::Several(self.heard.iter().map(|(frame, _)| *frame).collect()));
        }
        match answer.map_err(|violation| ExchangeError::Violation(violation, frame))? {
            Answer::Acknowledge(code) if !code.is_success() => Err(ExchangeError::Refused(code)),
            answer => Ok(answer),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::lss::Part;

    /// The outcome after being asked `asked` times and hearing these frames.
    fn outcome(request: Request, asked: usize, heard: &[&str]) -> Result<Answer, ExchangeError> {
        let mut exchange = Exchange::new(request);
        for _ in 0..asked {
            assert_eq!(exchange.ask(), [request.frame()]);
        }
        for text in heard {
            exchange.on_frame(&text.parse().expect("a frame"));
        }
        exchange.one()
    }

    #[test]
    fn several_are_told_from_one() {
        let serial = Request::Inquire(Part::Serial);
        let (a, b) = ("7E4#5D01000000000000", "7E4#5D02000000000000");
        let several = |frames: &[&str]| {
            Err(ExchangeError::Several(frames.iter().map(|text| text.parse().expect("a frame")).collect()))
        };
        assert_eq!(outcome(serial, 1, &[a]), Ok(Answer::Number(1)));
        assert_eq!(outcome(serial, 1, &[a, b]), several(&[a, b]));
        assert_eq!(outcome(serial, 1, &[a, a]), several(&[a]));
        // Asked twice, one slave may answer twice.
        assert_eq!(outcome(serial, 2, &[a, a]), Ok(Answer::Number(1)));
        assert_eq!(outcome(serial, 2, &[a, a, a]), several(&[a]));
        assert_eq!(outcome(serial, 1, &["7E4#1100000000000000", "701#00", a]), Ok(Answer::Number(1)));
        assert_eq!(outcome(serial, 1, &[]), Err(ExchangeError::NoAnswer));
        assert_eq!(outcome(Request::IdentifyUnconfigured, 1, &["7E4#50", "7E4#5000000000000000"]), Ok(Answer::Here));
    }

    #[test]
    fn half_an_acknowledge_is_none() {
        let half = "7E4#17".parse().expect("a frame");
        let violation = Err(ExchangeError::Violation(Violation::Short, half));
        assert_eq!(outcome(Request::Store, 1, &["7E4#17"]), violation);
        let refused = Err(ExchangeError::Refused(ErrorCode { code: 1, specific: 0 }));
        assert_eq!(outcome(Request::Store, 1, &["7E4#1701000000000000"]), refused);
    }

    #[test]
    fn a_babbler_is_not_kept_for_ever() {
        let mut exchange = Exchange::new(Request::Inquire(Part::Serial));
        exchange.ask();
        for number in 0..1000u32 {
            let [a, b, c, d] = number.to_le_bytes();
            exchange.on_frame(&Frame::full(crate::canopen::id::CanId::LSS_SLAVE, [0x5d, a, b, c, d, 0, 0, 0]));
        }
        assert_eq!((exchange.answers().len(), exchange.is_crowded()), (KEPT, true));
    }
}
