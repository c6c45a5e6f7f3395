//! LSS services with slaves that answer late, twice, wrongly or not at all.

mod fastscan;
mod services;
mod simulated;
mod slave;

use cangauge::bus::Mono;
use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::canopen::lss::LssAddress;
use slave::Slave;
use std::time::Duration;

fn ms(milliseconds: u64) -> Mono {
    Mono::at(Duration::from_millis(milliseconds))
}

fn address(identity: [u32; 4]) -> LssAddress {
    LssAddress::new(identity)
}

fn bus_of(slaves: impl IntoIterator<Item = Slave>) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual);
    slaves.into_iter().for_each(|slave| bus.attach(slave));
    bus
}

/// The identities of the slaves in configuration state.
fn configuring(bus: &MemoryBus) -> Vec<[u32; 4]> {
    bus.stations::<Slave>().filter(|slave| slave.is_configuring).map(|slave| slave.identity).collect()
}
