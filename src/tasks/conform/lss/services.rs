//! Switch state global, and inquiries.

use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::{IDENTITY, NO_LSS, enter_configuration, expect_silence, prepare, wrong_form};
use crate::node::Error;

pub(super) fn global(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    let answer = session.lss(&[0x04, 1])?;
    Ok(expect_silence(answer))
}

pub(super) fn address(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(address) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.switch(1)?;
    let mut findings = Vec::new();
    for ((service, sub), number) in (0x5a..).zip(1..).zip(address) {
        let Some(answer) = session.lss(&[service])? else {
            return Ok(Verdict::NotApplicable(WhyNot::NoService(service)));
        };
        let [a, b, c, d] = number.to_le_bytes();
        if !answer.data().starts_with(&[service, a, b, c, d]) {
            let expected = Expected::Number(number.into());
            findings.push(Finding::at(IDENTITY.with_sub(sub), expected, Seen::Frame(answer)));
        }
    }
    Ok(Verdict::of(findings))
}

pub(super) fn node_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.switch(1)?;
    let Some(answer) = session.lss(&[0x5e])? else { return Ok(Verdict::NotApplicable(WhyNot::NoService(0x5e))) };
    let own = session.node.id.get();
    let finding = || Finding::new(Expected::Number(own.into()), Seen::Frame(answer));
    Ok(Verdict::of((!answer.data().starts_with(&[0x5e, own])).then(finding)))
}

pub(super) fn waiting(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    for service in 0x5a..=0x5e {
        if let Some(answer) = session.lss(&[service])? {
            return Ok(expect_silence(Some(answer)));
        }
    }
    Ok(Verdict::Pass)
}

pub(super) fn unknown(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.switch(1)?;
    let answer = session.lss(&[0x7f])?;
    Ok(expect_silence(answer))
}

pub(super) fn form(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !enter_configuration(session)? {
        return Ok(NO_LSS);
    }
    let mut is_any = false;
    for (service, used) in [(0x5a, 5), (0x5e, 2)] {
        let Some(answer) = session.lss(&[service])? else { continue };
        is_any = true;
        if let Some(finding) = wrong_form(answer, used) {
            return Ok(Verdict::of([finding]));
        }
    }
    Ok(if is_any { Verdict::Pass } else { Verdict::NotApplicable(WhyNot::NoService(0x5a)) })
}
