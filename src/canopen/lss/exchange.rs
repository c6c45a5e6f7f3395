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
