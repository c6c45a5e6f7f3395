//! Values beyond the limits of the file.

use super::super::codes;
use super::super::finding::{Verdict, WhyNot};
use super::super::sdo::{expect_abort, has_pdo_rules, unchanged};
use super::super::session::Session;
use super::{NO_FILE, entries, file, is_setting};
use crate::canopen::id::NodeId;
use crate::canopen::value::DataType;
use crate::device::description::Access;
use crate::device::dictionary::Entry;
use crate::device::scalar::Scalar;
use crate::node::Error;

/// The bytes of the integer next to a limit, outside; `None` if there is no limit, or no such integer.
fn beyond(entry: &Entry, is_high: bool) -> Option<Vec<u8>> {
    let (DataType::Unsigned(1..=4) | DataType::Integer(1..=4)) = entry.data_type else { return None };
    let Scalar::Integer(limit) = *(if is_high { entry.high.as_ref()? } else { entry.low.as_ref()? }) else {
        return None;
    };
    let beyond = if is_high { limit.checked_add(1)? } else { limit.checked_sub(1)? };
    Scalar::Integer(beyond).encode(entry.data_type, NodeId::MIN).ok()
}

fn beyond_limits(session: &mut Session<'_, '_>, is_high: bool, codes: &'static [u32]) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let (mut findings, mut is_any) = (Vec::new(), false);
    for entry in entries(&eds).filter(|entry| entry.access == Access::Rw && !has_pdo_rules(entry.object)) {
        let object = entry.object;
        let Some(bytes) = beyond(entry, is_high).filter(|_| is_setting(session, entry)) else { continue };
        let Some(value) = session.read(object)? else { continue };
        is_any = true;
        let answer = session.download(object, &bytes)?;
        findings.extend(expect_abort(session, object, codes, answer));
        findings.extend(unchanged(session, object, &value)?);
    }
    if !is_any {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    }
    Ok(Verdict::of(findings))
}

pub(super) fn too_high(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    beyond_limits(session, true, codes::TOO_HIGH)
}

pub(super) fn too_low(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    beyond_limits(session, false, codes::TOO_LOW)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::object::ObjectId;

    #[test]
    fn integer_beyond_a_limit_fits_its_type() {
        let entry = |data_type, low, high| Entry {
            object: ObjectId::new(0x6132, 1),
            name: String::new(),
            numbered: false,
            data_type,
            access: Access::Rw,
            default: None,
            low: Some(Scalar::Integer(low)),
            high: Some(Scalar::Integer(high)),
            pdo: false,
        };
        let digits = entry(DataType::Unsigned(1), 0, 5);
        assert_eq!((beyond(&digits, true), beyond(&digits, false)), (Some(vec![6]), None));
        let signed = entry(DataType::Integer(2), -300, 0x7fff);
        assert_eq!((beyond(&signed, true), beyond(&signed, false)), (None, Some(vec![0xd3, 0xfe])));
        assert_eq!(beyond(&entry(DataType::Real32, 0, 1), true), None);
    }
}
