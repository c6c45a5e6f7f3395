//! The only wait loop. It ends at a deadline, when the caller has its result, or when the policy ends it.
//!
//! | | [`Policy::Command`] | [`Policy::Observe`] | [`Policy::Reconnect`] | [`Policy::Record`] |
//! |---|---|---|---|---|
//! | Ctrl-C | error, transfers aborted | normal end | error, transfers aborted | given to the caller |
//! | link down | error | error | given to the caller | given to the caller |
//! | link up again | given to the caller | given to the caller | given to the caller | given to the caller |
//! | end of a recording | normal end | normal end | normal end | normal end |
//! | dropped frames, faults | given to the caller | given to the caller | given to the caller | given to the caller |
//!
//! A dropped frame never ends a wait: a caller that needs the frame reaches its deadline. Frames, the ends of SDO
//! transfers, faults and drop counts are given to the caller in the order of reception.

use crate::bus::{BusError, Mono};
use crate::master::{Error, Master, MasterEvent};
use std::ops::ControlFlow;

/// Which events end a wait before its deadline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// A step of a command: Ctrl-C and an interface that goes down are errors.
    Command,
    /// An observation until Ctrl-C: Ctrl-C is its normal end. An interface that goes down is an error.
    Observe,
    /// A step of a command that changes the bit rate: the interface may go down. Ctrl-C is an error.
    Reconnect,
    /// A recording: the interface may go down, and Ctrl-C is handled by the caller.
    Record,
}

/// How a wait ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Waited<T> {
    /// The caller has its result.
    Done(T),
    /// The deadline passed.
    Deadline,
    /// The recording that is replayed ended.
    Ended,
    /// Ctrl-C ([`Policy::Observe`] and [`Policy::Record`] only).
    Interrupted,
}

impl<T> Waited<T> {
    /// The result, if the caller has it.
    pub fn done(self) -> Option<T> {
        match self {
            Waited::Done(result) => Some(result),
            Waited::Deadline | Waited::Ended | Waited::Interrupted => None,
        }
    }
}

/// How long to wait for the next event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// Wait for events until this moment.
    Deadline(Mono),
    /// Only deliver events that were received by this moment, without waiting for more.
    Drained(Mono),
}

/// A wait whose deadline depends on the received events.
pub trait Waiter {
    /// The result of the wait.
    type Output;
    /// The error if the wait fails.
    type Error: From<Error>;

    /// How long to wait for the next event. Called before each event.
    fn until(&self) -> Until;

    /// Handles an event: a frame, the end of an SDO transfer, a fault, a drop count, or [`MasterEvent::Ended`].
    ///
    /// [`MasterEvent::Deadline`] is the end of the time in [`Waiter::until`]. The policy decides whether
    /// [`MasterEvent::Interrupted`] and [`MasterEvent::Link`] are passed.
    ///
    /// # Errors
    /// An error ends the wait.
    fn on_event(
        &mut self,
        master: &mut Master<'_>,
        event: MasterEvent,
    ) -> Result<ControlFlow<Self::Output>, Self::Error>;
}

/// Waits until the waiter breaks or fails, or the policy ends the wait.
///
/// # Errors
/// Bus errors, events that the policy treats as errors, and errors of the waiter.
pub fn run<W: Waiter>(master: &mut Master<'_>, policy: Policy, waiter: &mut W) -> Result<W::Output, W::Error> {
    loop {
        let event = match waiter.until() {
            Until::Deadline(at) => master.next(at),
            Until::Drained(at) => master.drain(at),
        }?;
        let event = apply(master, policy, event)?;
        if let ControlFlow::Break(output) = waiter.on_event(master, event)? {
            return Ok(output);
        }
    }
}

/// Waits until `until`, or until `on_event` breaks.
///
/// `on_event` receives frames, ends of SDO transfers, faults and drop counts. The policy decides whether it receives
/// changes of the link.
///
/// # Errors
/// Bus errors, and events that the policy treats as errors.
pub fn wait<T>(
    master: &mut Master<'_>,
    until: Mono,
    policy: Policy,
    on_event: impl FnMut(&mut Master<'_>, MasterEvent) -> ControlFlow<T>,
) -> Result<Waited<T>, Error> {
    struct Simple<F>(Mono, F);

    impl<T, F: FnMut(&mut Master<'_>, MasterEvent) -> ControlFlow<T>> Waiter for Simple<F> {
        type Output = Waited<T>;
        type Error = Error;

        fn until(&self) -> Until {
            Until::Deadline(self.0)
        }

        fn on_event(&mut self, master: &mut Master<'_>, event: MasterEvent) -> Result<ControlFlow<Waited<T>>, Error> {
            Ok(match event {
                MasterEvent::Deadline => ControlFlow::Break(Waited::Deadline),
                MasterEvent::Ended => ControlFlow::Break(Waited::Ended),
                MasterEvent::Interrupted => ControlFlow::Break(Waited::Interrupted),
                event => match (self.1)(master, event) {
                    ControlFlow::Break(result) => ControlFlow::Break(Waited::Done(result)),
                    ControlFlow::Continue(()) => ControlFlow::Continue(()),
                },
            })
        }
    }

    run(master, policy, &mut Simple(until, on_event))
}

/// Waits until `until`, and ignores frames.
///
/// # Errors
/// Bus errors, and events that the policy treats as errors.
pub fn pause(master: &mut Master<'_>, until: Mono, policy: Policy) -> Result<(), Error> {
    wait(master, until, policy, |_, _| ControlFlow::<()>::Continue(())).map(|_| ())
}

/// Turns an event into an error if the policy requires it.
fn apply(master: &mut Master<'_>, policy: Policy, event: MasterEvent) -> Result<MasterEvent, Error> {
    match (event, policy) {
        (MasterEvent::Interrupted, Policy::Command | Policy::Reconnect) => {
            master.cancel();
            Err(Error::Interrupted)
        }
        (MasterEvent::Link(false), Policy::Command | Policy::Observe) => {
            master.cancel();
            Err(Error::Bus(BusError::Down(master.bus().name().to_owned())))
        }
        (event, _) => Ok(event),
    }
}
