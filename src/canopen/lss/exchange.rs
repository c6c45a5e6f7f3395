//! One LSS service: its request frames and all answers.

use super::{Answer, ErrorCode, LssAddress, LssRange, Request, Service, Violation};
use crate::canopen::frame::Frame;

/// The largest number of different answers that are stored.
const MAX_ANSWERS: usize = 128;

/// A service in progress. All slaves in configuration state answer, so the exchange collects answers until the caller
/// ends it.
#[derive(Clone, Debug)]
pub struct Exchange {
    requests: Vec<Request>,
    service: Service,
    /// The different answers in the order of arrival.
    received: Vec<(Frame, Result<Answer, Violation>)>,
    /// The number of answers, including repeated ones.
    answer_count: usize,
    /// How often the requests were sent.
    request_count: usize,
}

/// Why a service with one slave failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExchangeError {
    /// No slave answered.
    NoAnswer,
    /// More than one slave answered: the different answers.
    Several(Vec<Frame>),
    /// The slave rejected the request.
    Refused(ErrorCode),
    /// The answer violates the protocol.
    Violation(Violation, Frame),
}

impl Exchange {
    /// Creates an exchange for a service of one frame.
    pub fn new(request: Request) -> Exchange {
        Exchange {
            requests: vec![request],
            service: request.service(),
            received: Vec::new(),
            answer_count: 0,
            request_count: 0,
        }
    }

    /// Creates the exchange that switches the slave with this address to configuration state.
    pub fn select(address: &LssAddress) -> Exchange {
        Exchange { requests: address.selection().to_vec(), ..Exchange::new(Request::Select(super::Part::Vendor, 0)) }
    }

    /// Creates the exchange that asks whether there are slaves in a range.
    pub fn identify(range: &LssRange) -> Exchange {
        let requests = range.identification().to_vec();
        Exchange { requests, ..Exchange::new(Request::Identify(super::Limit::Vendor, 0)) }
    }

    /// The service.
    pub fn service(&self) -> Service {
        self.service
    }

    /// Whether slaves answer this service (all except 04h and 15h).
    pub fn is_answered(&self) -> bool {
        self.service.answer_specifier().is_some()
    }

    /// Starts a request and returns all its frames. A retry also sends the whole address.
    pub fn ask(&mut self) -> Vec<Frame> {
        self.request_count += 1;
        self.requests.iter().map(|request| request.frame()).collect()
    }

    /// Handles a received frame; `true` if it answers this service.
    pub fn on_frame(&mut self, frame: &Frame) -> bool {
        let Some(answer) = Answer::parse(frame, self.service) else { return false };
        self.answer_count += 1;
        if self.received.len() < MAX_ANSWERS && !self.received.iter().any(|(received, _)| received == frame) {
            self.received.push((*frame, answer));
        }
        true
    }

    /// Whether a slave has answered.
    pub fn has_answer(&self) -> bool {
        self.answer_count > 0
    }

    /// Whether more than one slave answered: the answers differ, or there were more answers than requests.
    pub fn has_several_slaves(&self) -> bool {
        self.received.len() > 1 || self.answer_count > self.request_count
    }

    /// The different answers, with their frames.
    pub fn answers(&self) -> &[(Frame, Result<Answer, Violation>)] {
        &self.received
    }

    /// The result of a service for one slave. If all slaves send the same frame ([`Service::has_common_answer`]),
    /// several answers count as one.
    ///
    /// # Errors
    /// No answer, several slaves, a rejection, or a protocol violation.
    pub fn one(&self) -> Result<Answer, ExchangeError> {
        let Some(&(frame, answer)) = self.received.first() else { return Err(ExchangeError::NoAnswer) };
        if self.has_several_slaves() && !self.service.has_common_answer() {
            return Err(ExchangeError::Several(self.received.iter().map(|(frame, _)| *frame).collect()));
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

    /// Returns the result after `request_count` requests and these frames.
    fn outcome(request: Request, request_count: usize, received: &[&str]) -> Result<Answer, ExchangeError> {
        let mut exchange = Exchange::new(request);
        for _ in 0..request_count {
            assert_eq!(exchange.ask(), [request.frame()]);
        }
        for text in received {
            exchange.on_frame(&text.parse().expect("a frame"));
        }
        exchange.one()
    }

    #[test]
    fn several_answers_are_detected() {
        let serial = Request::Inquire(Part::Serial);
        let (a, b) = ("7E4#5D01000000000000", "7E4#5D02000000000000");
        let several = |frames: &[&str]| {
            Err(ExchangeError::Several(frames.iter().map(|text| text.parse().expect("a frame")).collect()))
        };
        assert_eq!(outcome(serial, 1, &[a]), Ok(Answer::Number(1)));
        assert_eq!(outcome(serial, 1, &[a, b]), several(&[a, b]));
        assert_eq!(outcome(serial, 1, &[a, a]), several(&[a]));
        // After two requests, one slave may answer twice.
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
        assert_eq!((exchange.answers().len(), exchange.has_several_slaves()), (MAX_ANSWERS, true));
    }
}
