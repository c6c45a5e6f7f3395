//! The mapping of a TPDO as a transaction: the settings asked for, read back, or the old ones.

use super::device::{Device, Trouble, Write};
use super::nmt::Switched;
use super::settings::Settings;
use super::show::{Shown, may_inhibit, unread};
use super::wish::Wish;
use super::{identifiers, mend, plan};
use crate::canopen::pdo::{MappingEntry, TpdoNumber};
use crate::canopen::sdo::AbortCode;
use crate::device::catalog::Model;
use crate::device::description::{Access, Remap};
use crate::master::{Error, Master, SdoError, SdoFailure};
use crate::measure::instrument::Instrument;
use crate::measure::survey::{Overrides, instruments};
use crate::tasks::store::{self, Done, Group};
use crate::tasks::{Failure, Kind};
use std::time::Duration;

/// The longest wait for a device that has restarted.
const BOOT_TIME: Duration = Duration::from_secs(3);

/// How often Ctrl-C is not listened to while the old settings are put back. Each costs one exchange.
const DEAF: u32 = 5;

/// A TPDO that is set as was asked for.
#[derive(Clone, Debug)]
pub struct Mapped {
    /// What it is set to.
    pub shown: Shown,
    /// How many writes that took.
    pub writes: u32,
    /// What the device acknowledged to have stored, where that was asked for.
    pub stored: Option<Done>,
    /// What is worth knowing.
    pub remarks: Vec<String>,
    /// What is not as one would expect.
    pub warnings: Vec<String>,
}

/// Sets a TPDO as `wish` wants it. With `keep` the device is then told to store it; whether it can, and whether it
/// keeps such settings, is found out before anything is changed.
///
/// # Errors
/// With the old settings in place again, if any were touched; a device that cannot be reached any more is
/// reported with the step that it was left at and the command that mends it.
pub fn map(master: &mut Master<'_>, wish: &Wish, keep: bool, overrides: &Overrides) -> Result<Mapped, Failure> {
    wish.check()?;
    let node = wish.node;
    master.listen_to(&[node])?;
    let found = instruments(master, &[node], overrides)?.pop();
    let instrument = found.ok_or_else(|| Failure::of_node(Kind::NoAnswer, node, "it is not there"))?;
    let model = instrument.model.as_deref();
    let storing = if keep { Some(storing(master, &instrument, wish.number)?) } else { None };
    let mut device = Device::new(master, node, model);
    let (mapping, remarks) = wish.mapping(&mut device, &instrument)?;
    let inhibit = wish.inhibit_100us.is_some() || may_inhibit(&instrument, wish.number);
    let old = Settings::read(&mut device, wish.number, inhibit).map_err(|trouble| unread(&instrument, trouble))?;
    if old.multiplexed && mapping.is_some() {
        let message = format!("{} is a multiplexed PDO, whose mapping is no list", old.number);
        return Err(Failure::of_node(Kind::Unexpected, node, message));
    }
    let wanted = wish.settings(&old, mapping, &instrument)?;
    check(&mut device, &instrument, &old, &wanted)?;
    let known = model.is_some_and(|model| !model.description.objects.is_empty());
    let remap = model.map(|model| model.description.pdo.remap).unwrap_or_default();
    let mut change = Change {
        device,
        instrument: &instrument,
        old,
        wanted,
        remap,
        known,
        never_off: false,
        state: Switched::default(),
        at: None,
        failed_at: None,
        done: None,
        remarks,
        warnings: Vec::new(),
    };
    change.run()?;
    let Change { device, wanted, remarks, warnings, .. } = change;
    let (writes, master) = (device.writes, device.master);
    let stored = storing.map(|plan| store::carry_out(master, &instrument, plan, false)).transpose();
    let stored = stored.map_err(|failure| {
        failure.knowing(node, format!("{} is set as wanted, and keeps it until power off at the least", wish.number))
    })?;
    Ok(Mapped { shown: Shown::new(&instrument, wanted), writes, stored, remarks, warnings })
}

/// What has to be stored to keep the settings of a TPDO. The communication settings alone where they are a group
/// of their own: a store of everything puts custom COB-IDs back on some devices.
fn storing(master: &mut Master<'_>, instrument: &Instrument, number: TpdoNumber) -> Result<store::Plan, Failure> {
    let model = instrument.model.as_deref();
    if model.is_some_and(|model| !keeps(model, number)) {
        let message = format!("it does not keep the settings of {number} when it stores: nothing was changed");
        let failure = Failure::of_node(Kind::CheckFailed, instrument.node, message);
        return Err(failure.hint("leave --store out, and set it after every power on"));
    }
    match store::plan(master, instrument, Group::Communication) {
        Err(failure) if failure.kind == Kind::Refused => store::plan(master, instrument, Group::All),
        plan => plan,
    }
}

/// Whether a device stores the settings of a TPDO, as far as its description tells.
fn keeps(model: &Model, number: TpdoNumber) -> bool {
    let objects = &model.description.objects;
    let tells = objects.iter().any(|entry| entry.stored.is_some());
    let (communication, mapping) = (number.communication(1), number.mapping(1));
    let mut own = objects.iter().filter(|entry| {
        let mut at = entry.objects().into_iter().flatten();
        at.any(|object| object == communication || object == mapping)
    });
    !tells || own.all(|entry| entry.stored.is_some() || !entry.access.is_writable())
}

/// What can be known to be wrong before anything is written.
fn check(
    device: &mut Device<'_, '_>,
    instrument: &Instrument,
    old: &Settings,
    wanted: &Settings,
) -> Result<(), Failure> {
    let number = old.number;
    if old.mapping != wanted.mapping && is_fixed(instrument, number) {
        let entries: Vec<String> = old.mapping.iter().map(|&entry| mend::entry_text(entry)).collect();
        let message = format!("the mapping of {number} is fixed ({}): nothing was changed", entries.join(" "));
        return Err(Failure::of_node(Kind::Refused, instrument.node, message));
    }
    let (before, after) = (old.cob_id, wanted.cob_id);
    let moves = before.can_id() != after.can_id();
    if after.is_valid() && (moves || !before.is_valid()) {
        identifiers::free_of_own(instrument, number, after.can_id())?;
    }
    if after.is_valid() && moves {
        identifiers::free_of_others(device, after.can_id())?;
    }
    Ok(())
}

/// Whether the description says that the mapping cannot be written. An EDS file is not believed that much.
fn is_fixed(instrument: &Instrument, number: TpdoNumber) -> bool {
    let described = instrument.model.as_ref().filter(|model| !model.description.objects.is_empty());
    described.is_some_and(|model| {
        let access = |sub| model.dictionary.get(number.mapping(sub)).map(|entry| entry.access);
        let fixed = |access: Access| !access.is_writable();
        access(0).is_some_and(fixed) || access(1).is_some_and(fixed)
    })
}

/// A change under way.
struct Change<'a, 'm, 'bus> {
    device: Device<'m, 'bus>,
    instrument: &'a Instrument,
    old: Settings,
    wanted: Settings,
    remap: Remap,
    /// A description lists the device's objects.
    known: bool,
    /// The device takes no bit 31.
    never_off: bool,
    state: Switched,
    /// The write under way.
    at: Option<Write>,
    /// The write at which the change failed.
    failed_at: Option<Write>,
    /// The last write that was confirmed.
    done: Option<Write>,
    remarks: Vec<String>,
    warnings: Vec<String>,
}

/// Where an attempt to put things back has led.
enum Left {
    Old,
    New,
}

impl Change<'_, '_, '_> {
    fn run(&mut self) -> Result<(), Failure> {
        match self.attempt() {
            Ok(()) => {}
            Err(trouble) => self.undo(trouble)?,
        }
        let said = self.put_state_back();
        self.warnings.extend(said);
        self.advise();
        Ok(())
    }

    fn writes(&self, now: &Settings, wanted: &Settings) -> Vec<Write> {
        plan::writes(now, wanted, self.remap, self.never_off)
    }

    /// From the old settings to those asked for, and reads them back.
    fn attempt(&mut self) -> Result<(), Trouble> {
        let (old, wanted) = (self.old.clone(), self.wanted.clone());
        if self.writes(&old, &wanted).is_empty() {
            return Ok(());
        }
        if self.remap == Remap::CountOnly && old.mapping != wanted.mapping {
            self.state.enter(&mut self.device)?;
        }
        let mut writes = self.writes(&old, &wanted);
        let off = writes.first().filter(|write| **write == self.off()).cloned();
        if let Some(off) = off {
            writes.remove(0);
            match self.step(&off) {
                Err(Trouble::Refused(error)) if self.goes_without_off(&error) => {
                    self.warnings.push(format!(
                        "node {}: {error}: {} is changed while it stays on",
                        self.device.node, old.number
                    ));
                    self.never_off = true;
                    self.remap = Remap::CountOnly;
                    if old.mapping != wanted.mapping {
                        self.state.enter(&mut self.device)?;
                    }
                    writes = self.writes(&old, &wanted);
                }
                result => result?,
            }
        }
        for write in &writes {
            self.step(write)?;
        }
        self.read_back(&wanted)
    }

    /// The write that switches the PDO off.
    fn off(&self) -> Write {
        Write::new(self.old.number.communication(1), self.old.cob_id.switched_off().0, 4)
    }

    /// Whether a refusal of bit 31 may be passed over: some devices do not know it and change their mapping
    /// without it. Of a device that is described it is known.
    fn goes_without_off(&self, error: &SdoError) -> bool {
        let unknown = matches!(
            error.failure,
            SdoFailure::Refused(AbortCode::VALUE | AbortCode::READ_ONLY | AbortCode::DEVICE_STATE)
        );
        unknown && (!self.known || self.remap == Remap::CountOnly)
    }

    /// One write. A device that is not in the state for it is put in PRE-OPERATIONAL, once.
    fn step(&mut self, write: &Write) -> Result<(), Trouble> {
        self.at = Some(write.clone());
        match self.device.write(write) {
            Err(Trouble::Refused(SdoError { failure: SdoFailure::Refused(AbortCode::DEVICE_STATE), .. }))
                if !self.state.is_switched() && *write != self.off() =>
            {
                self.state.enter(&mut self.device)?;
                self.device.write(write)?;
            }
            result => result?,
        }
        self.done = Some(write.clone());
        Ok(())
    }

    /// That the device holds these settings.
    fn read_back(&mut self, wanted: &Settings) -> Result<(), Trouble> {
        let found = Settings::read(&mut self.device, wanted.number, wanted.inhibit_100us.is_some())?;
        match found.difference(wanted) {
            Some((object, reads, wrote)) => Err(Trouble::NotKept(object, reads, wrote)),
            None if self.device.restarted => Err(Trouble::Restarted),
            None => Ok(()),
        }
    }

    /// Something went wrong: the old settings are put back. Success where the device turns out to have the new
    /// ones, completely.
    fn undo(&mut self, trouble: Trouble) -> Result<(), Failure> {
        self.failed_at = self.at.take();
        let (mut deaf, mut waited) = (DEAF, false);
        let last = loop {
            match self.put_back(&trouble) {
                Ok(Left::New) => return Ok(()),
                Ok(Left::Old) => {
                    let said = self.put_state_back().map(|said| format!("; {said}")).unwrap_or_default();
                    let end = format!("{} has its old mapping and parameters{said}", self.old.number);
                    return Err(self.failure(&trouble, &end));
                }
                Err(Trouble::Stopped(Error::Interrupted)) if deaf > 0 => deaf -= 1,
                Err(last @ (Trouble::Lost(_) | Trouble::Restarted)) if !waited => {
                    waited = true;
                    // Seen or not, it is tried once more: most devices without heartbeat boot for so long.
                    if !self.device.restarted && self.device.wait_for_life(BOOT_TIME).is_err() {
                        break last;
                    }
                }
                Err(last) => break last,
            }
        };
        Err(self.left(&trouble, &last))
    }

    fn put_back(&mut self, trouble: &Trouble) -> Result<Left, Trouble> {
        self.device.restarted = false;
        self.device.clear_the_air()?;
        let (old, wanted) = (self.old.clone(), self.wanted.clone());
        let now = Settings::read(&mut self.device, old.number, old.inhibit_100us.is_some())?;
        let may_stand = !matches!(trouble, Trouble::Refused(_) | Trouble::NotKept(..));
        if may_stand && now.difference(&wanted).is_none() {
            return Ok(Left::New);
        }
        let restarted = matches!(trouble, Trouble::Restarted);
        if restarted && self.remap == Remap::CountOnly && now.mapping != old.mapping {
            self.state.enter(&mut self.device)?;
        }
        for write in self.writes(&now, &old) {
            self.step(&write)?;
        }
        self.read_back(&old)?;
        Ok(Left::Old)
    }

    /// The NMT state before, where it was known; what is to be said about it.
    fn put_state_back(&mut self) -> Option<String> {
        let before = self.state.clone();
        for _ in 0..=DEAF {
            match self.state.put_back(&mut self.device) {
                Err(Trouble::Stopped(Error::Interrupted)) => self.state = before.clone(),
                Ok(remark) => return remark,
                Err(_) => break,
            }
        }
        Some(format!("the state of node {} was not put back", self.device.node))
    }

    /// What was being done, at a write, as a part of a message.
    fn what(trouble: &Trouble, at: Option<&Write>) -> String {
        let step = |object| {
            let write = at.filter(|write| write.object == object);
            write.map(|write| format!(" ({})", described(write))).unwrap_or_default()
        };
        match trouble {
            Trouble::Refused(error) | Trouble::Lost(error) => {
                format!("{} {}{}: {}", error.operation, error.object, step(error.object), error.failure)
            }
            Trouble::Restarted => "it restarted in the middle".to_owned(),
            Trouble::Stopped(error) => {
                let at = at.map(|write| format!(" at {} ({})", write.object, described(write)));
                format!("{error}{}", at.unwrap_or_default())
            }
            Trouble::NotKept(object, reads, wrote) => {
                format!("{object} was acknowledged and reads {reads:#X} instead of {wrote:#X}")
            }
        }
    }

    fn failure(&self, trouble: &Trouble, end: &str) -> Failure {
        let node = self.device.node;
        let message = format!("{}: {end}", Self::what(trouble, self.failed_at.as_ref()));
        let failure = |kind| Failure::of_node(kind, node, &message);
        match trouble {
            Trouble::Refused(error) => {
                let Failure { object, abort, .. } = Failure::from(error.clone());
                let hint = match abort {
                    Some(AbortCode::NOT_MAPPABLE) => self.mappable(),
                    _ => None,
                };
                Failure { object, abort, hint, ..failure(Kind::Refused) }
            }
            Trouble::Lost(error) => {
                let Failure { kind, object, .. } = Failure::from(error.clone());
                Failure { object, ..failure(kind) }
            }
            Trouble::Restarted => failure(Kind::Unexpected),
            Trouble::Stopped(Error::Interrupted) => failure(Kind::Interrupted),
            Trouble::Stopped(_) => failure(Kind::Bus),
            Trouble::NotKept(object, ..) => Failure { object: Some(*object), ..failure(Kind::Unexpected) },
        }
    }

    /// What the description says can be mapped.
    fn mappable(&self) -> Option<String> {
        let model = self.instrument.model.as_ref()?;
        let entries = model.dictionary.iter().filter(|entry| entry.pdo);
        let entry = |object, bits| mend::entry_text(MappingEntry { object, bits });
        let names: Vec<String> = entries
            .filter_map(|known| Some(entry(known.object, u8::try_from(8 * known.data_type.width()?).ok()?)))
            .take(8)
            .collect();
        (!names.is_empty()).then(|| format!("it can map: {}", names.join(" ")))
    }

    /// The device cannot be put back: where it was left, and the command that mends it.
    fn left(&self, trouble: &Trouble, last: &Trouble) -> Failure {
        let (node, number) = (self.device.node, self.old.number);
        let end = match &self.done {
            Some(write) => format!("{number} was left half changed, after {} ({})", write.object, described(write)),
            None => format!("whether {number} was changed is not known: no step was confirmed"),
        };
        let why = match (trouble, last) {
            (Trouble::Lost(_), Trouble::Lost(_)) => String::new(),
            _ => format!("; putting it back failed: {}", Self::what(last, self.at.as_ref())),
        };
        let mend = mend::command(node, &self.old, self.remap == Remap::CountOnly);
        let start = if self.state.was_operational() { format!(" && cangauge nmt start {node}") } else { String::new() };
        self.failure(trouble, &format!("{end}{why}")).hint(format!("when it answers again: {mend}{start}"))
    }

    /// What the new settings mean for who waits for the PDO.
    fn advise(&mut self) {
        let Settings { number, event_timer_ms, .. } = self.wanted;
        let (node, kind) = (self.device.node, self.wanted.transmission());
        if !self.wanted.cob_id.is_valid() {
            self.remarks.push(format!("node {node}: {number} is off: name signals, or --cob-id, to switch it on"));
        } else if kind.needs_sync() {
            self.remarks.push(format!("node {node}: {number} waits for SYNC"));
        } else if event_timer_ms == Some(0) {
            self.remarks.push(format!(
                "node {node}: the event timer of {number} is 0: it is sent only when a value changes by its delta \
                 (x133h) or passes a limit, if ever"
            ));
        }
        if kind.needs_sync() && event_timer_ms != self.old.event_timer_ms {
            self.remarks.push(format!("node {node}: with {kind} the event timer does nothing"));
        }
    }
}

/// What a write does, in words.
fn described(write: &Write) -> String {
    match (write.object.index, write.object.sub) {
        (0x1a00..=0x1bff, 0) => format!("{} entries", write.value),
        (0x1a00..=0x1bff, _) => mend::entry_text(MappingEntry::from_word(write.value)),
        (_, 1) => format!("0x{:08X}", write.value),
        _ => write.value.to_string(),
    }
}
