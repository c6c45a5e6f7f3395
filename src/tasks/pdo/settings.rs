//! The settings of a TPDO.

use super::failure::StepError;
use super::session::Session;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber, Transmission};
use crate::canopen::sdo::AbortCode;
use crate::master::{SdoError, SdoFailure};

/// The largest number of entries. FEh and FFh mean multiplexed PDOs (CiA 301, 7.5.2.38).
const MAX_ENTRIES: u8 = 64;

/// The settings of a TPDO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The TPDO.
    pub number: TpdoNumber,
    /// The COB-ID (180xh:1).
    pub cob_id: CobId,
    /// The transmission type (180xh:2).
    pub transmission: u8,
    /// The inhibit time (180xh:3) in 100 µs; `None` if the device has none.
    pub inhibit_100us: Option<u16>,
    /// The event timer (180xh:5) in ms; `None` if the device has none.
    pub event_timer_ms: Option<u16>,
    /// The mapping (1Axxh), in order.
    pub mapping: Vec<MappingEntry>,
    /// Whether the PDO is multiplexed (1Axxh:0), so that its mapping is not a list.
    pub multiplexed: bool,
}

impl Settings {
    /// Reads all settings; the inhibit time only if `inhibit` is true.
    ///
    /// # Errors
    /// Any error except a missing event timer or inhibit time. The settings can be restored only if all of them are
    /// known.
    pub(super) fn read(
        session: &mut Session<'_, '_>,
        number: TpdoNumber,
        inhibit: bool,
    ) -> Result<Settings, StepError> {
        let cob_id = session.read(number.communication(1), 4)?;
        let transmission = session.read(number.communication(2), 1)?;
        let inhibit_100us = if inhibit { read_optional(session, number.communication(3))? } else { None };
        let event_timer_ms = read_optional(session, number.communication(5))?;
        let count = u8::try_from(session.read(number.mapping(0), 1)?).unwrap_or(u8::MAX);
        let multiplexed = count > MAX_ENTRIES;
        let entries = if multiplexed { 0 } else { count };
        let entry = |sub| session.read(number.mapping(sub), 4).map(MappingEntry::from_word);
        let mapping = (1..=entries).map(entry).collect::<Result<_, _>>()?;
        Ok(Settings {
            number,
            cob_id: CobId(cob_id),
            transmission: u8::try_from(transmission).unwrap_or(u8::MAX),
            inhibit_100us,
            event_timer_ms,
            mapping,
            multiplexed,
        })
    }

    /// The transmission type.
    pub fn transmission(&self) -> Transmission {
        Transmission::from_code(self.transmission)
    }

    /// Returns the first object in which these settings differ from other settings, with both numbers. Bit 30 of the
    /// COB-ID (no remote requests) is ignored, because some devices set it themselves.
    pub(super) fn difference(&self, other: &Settings) -> Option<(ObjectId, u64, u64)> {
        let number = self.number;
        let wide = |number: Option<u16>| number.map_or(0, u64::from);
        let count = |settings: &Settings| u64::try_from(settings.mapping.len()).unwrap_or(u64::MAX);
        let fixed = [
            (number.communication(1), u64::from(self.cob_id.without_rtr()), u64::from(other.cob_id.without_rtr())),
            (number.communication(2), self.transmission.into(), other.transmission.into()),
            (number.communication(3), wide(self.inhibit_100us), wide(other.inhibit_100us)),
            (number.communication(5), wide(self.event_timer_ms), wide(other.event_timer_ms)),
            (number.mapping(0), count(self), count(other)),
        ];
        let entries = (1..=u8::MAX)
            .zip(self.mapping.iter().zip(&other.mapping))
            .map(|(sub, (own, others))| (number.mapping(sub), u64::from(own.word()), u64::from(others.word())));
        fixed.into_iter().chain(entries).find(|(_, own, others)| own != others)
    }
}

/// Reads a number; `None` if the device does not have the object.
fn read_optional(session: &mut Session<'_, '_>, object: ObjectId) -> Result<Option<u16>, StepError> {
    match session.read(object, 2) {
        Ok(number) => Ok(u16::try_from(number).ok()),
        Err(StepError::Rejected(SdoError {
            failure: SdoFailure::Refused(AbortCode::NO_OBJECT | AbortCode::NO_SUB_INDEX),
            ..
        })) => Ok(None),
        Err(StepError::Lost(SdoError { node, failure: SdoFailure::NoAnswer { .. }, .. }))
            if session.accepts_silence =>
        {
            session.master.add_unknown(node, object);
            Ok(None)
        }
        Err(error) => Err(error),
    }
}
