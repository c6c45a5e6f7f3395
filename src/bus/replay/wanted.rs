//! Which frames a replay delivers: the filters as a table.

use crate::bus::Filters;
use crate::canopen::id::CanId;
use std::collections::BTreeSet;

/// The number of 11-bit identifiers.
const STANDARD_IDS: usize = 0x800;

/// The filters of a bus, for a fast look-up.
pub(super) enum Wanted {
    All,
    Only {
        /// For each 11-bit identifier, whether it is delivered.
        standard: Box<[bool; STANDARD_IDS]>,
        extended: BTreeSet<CanId>,
    },
}

impl Wanted {
    pub(super) fn new(filters: &Filters) -> Wanted {
        let Filters::Only(ids) = filters else { return Wanted::All };
        let mut standard = Box::new([false; STANDARD_IDS]);
        let mut extended = BTreeSet::new();
        for &id in ids {
            match id {
                CanId::Standard(number) => standard[usize::from(number) % STANDARD_IDS] = true,
                CanId::Extended(_) => drop(extended.insert(id)),
            }
        }
        Wanted::Only { standard, extended }
    }

    pub(super) fn has(&self, id: CanId) -> bool {
        match (self, id) {
            (Wanted::All, _) => true,
            (Wanted::Only { standard, .. }, CanId::Standard(number)) => standard[usize::from(number) % STANDARD_IDS],
            (Wanted::Only { extended, .. }, id) => extended.contains(&id),
        }
    }
}
