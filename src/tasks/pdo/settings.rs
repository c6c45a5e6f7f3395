//! Everything that a TPDO is set to.

use super::device::{Device, Trouble};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber, Transmission};
use crate::canopen::sdo::AbortCode;
use crate::master::{SdoError, SdoFailure};

/// The most entries of a mapping; FEh and FFh stand for multiplexed PDOs (CiA 301, 7.5.2.38).
const MOST_ENTRIES: u8 = 64;

/// What a TPDO is set to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Which one.
    pub number: TpdoNumber,
    /// 180xh:1.
    pub cob_id: CobId,
    /// 180xh:2.
    pub transmission: u8,
    /// 180xh:3 in 100 µs; `None` where the device has none.
    pub inhibit_100us: Option<u16>,
    /// 180xh:5 in ms; `None` where the device has none.
    pub event_timer_ms: Option<u16>,
    /// What is mapped.
    pub mapping: Vec<MappingEntry>,
    /// Whether 1Axxh:0 says that it is a multiplexed PDO, whose mapping is no list.
    pub multiplexed: bool,
}

impl Settings {
    /// Reads all of it. The inhibit time is read where `inhibit` says so.
    ///
    /// # Errors
    /// Anything but a device without event timer or inhibit time: what is not known completely cannot be put
    /// back.
    pub(super) fn read(device: &mut Device<'_, '_>, number: TpdoNumber, inhibit: bool) -> Result<Settings, Trouble> {
        let cob_id = device.read(number.communication(1), 4)?;
        let transmission = device.read(number.communication(2), 1)?;
        let inhibit_100us = if inhibit { optional(device.read(number.communication(3), 2))? } else { None };
        let event_timer_ms = optional(device.read(number.communication(5), 2))?;
        let count = u8::try_from(device.read(number.mapping(0), 1)?).unwrap_or(u8::MAX);
        let multiplexed = count > MOST_ENTRIES;
        let entries = if multiplexed { 0 } else { count };
        let entry = |sub| device.read(number.mapping(sub), 4).map(MappingEntry::from_word);
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

    /// When it is sent.
    pub fn transmission(&self) -> Transmission {
        Transmission::from_code(self.transmission)
    }

    /// The first object in which these settings differ from others, with the two numbers. Whether remote
    /// requests are answered (bit 30) is the device's own affair.
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
        let entries = (1..=u8::MAX).zip(self.mapping.iter().zip(&other.mapping)).map(|(sub, (mine, theirs))| {
            let words = (u64::from(mine.word()), u64::from(theirs.word()));
            (number.mapping(sub), words.0, words.1)
        });
        fixed.into_iter().chain(entries).find(|(_, mine, theirs)| mine != theirs)
    }
}

/// `None` for an object that the device does not have.
fn optional(result: Result<u32, Trouble>) -> Result<Option<u16>, Trouble> {
    match result {
        Ok(number) => Ok(u16::try_from(number).ok()),
        Err(Trouble::Refused(SdoError {
            failure: SdoFailure::Refused(AbortCode::NO_OBJECT | AbortCode::NO_SUB_INDEX),
            ..
        })) => Ok(None),
        Err(trouble) => Err(trouble),
    }
}
