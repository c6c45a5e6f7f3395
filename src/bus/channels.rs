//! A wrapper around a bus for nodes whose SDO channel does not use the COB-IDs 600h and 580h + node-ID.
//!
//! The wrapper exchanges the COB-IDs in both directions, so all other code uses the usual COB-IDs. A trace inside the
//! wrapper shows the COB-IDs on the bus.

use super::{BitRateControl, Bus, BusError, Event, Filters, Mono, delegate_bus};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};

/// The SDO channel of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SdoChannel {
    /// The node.
    pub node: NodeId,
    /// The COB-ID of requests to the node.
    pub request: CanId,
    /// The COB-ID of answers from the node.
    pub response: CanId,
}

/// A bus that exchanges the COB-IDs of some SDO channels.
pub struct SdoChannels<B> {
    bus: B,
    /// Pairs of exchanged COB-IDs: the usual COB-ID, and the COB-ID on the bus.
    pairs: Vec<(CanId, CanId)>,
}

impl<B: Bus> SdoChannels<B> {
    /// Exchanges the COB-IDs of these channels on `bus`.
    pub fn new(bus: B, channels: &[SdoChannel]) -> SdoChannels<B> {
        let pairs = channels.iter().flat_map(|channel| {
            [(CanId::sdo_request(channel.node), channel.request), (CanId::sdo_response(channel.node), channel.response)]
        });
        SdoChannels { bus, pairs: pairs.collect() }
    }

    fn exchange_id(&self, id: CanId) -> CanId {
        let pair = self.pairs.iter().find(|(usual, actual)| *usual == id || *actual == id);
        pair.map_or(id, |&(usual, actual)| if id == usual { actual } else { usual })
    }

    fn exchange_frame(&self, frame: &Frame) -> Frame {
        let id = self.exchange_id(frame.id());
        if frame.is_remote() { *frame } else { Frame::new(id, frame.data()).unwrap_or(*frame) }
    }
}

impl<B: Bus> Bus for SdoChannels<B> {
    delegate_bus!(self, self.bus => name timestamps is_live sends_remote_frames waits now mono receive_buffer unreported_drops finish);

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        match filters {
            Filters::All => self.bus.listen(filters),
            Filters::Only(ids) => self.bus.listen(&Filters::Only(ids.iter().map(|&id| self.exchange_id(id)).collect())),
        }
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(&self.exchange_frame(frame))
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        Ok(match self.bus.receive(deadline)? {
            Event::Frame(mut received) => {
                received.frame = self.exchange_frame(&received.frame);
                Event::Frame(received)
            }
            event => event,
        })
    }
}

impl<B: Bus> BitRateControl for SdoChannels<B> {
    delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cob_ids_are_exchanged_in_both_directions() {
        let id = |number| CanId::standard(number).expect("an identifier");
        let channel = SdoChannel { node: NodeId::new(5).expect("a node-ID"), request: id(0x645), response: id(0x5c5) };
        let bus = SdoChannels::new(crate::bus::memory::MemoryBus::new(crate::bus::memory::Clock::Virtual), &[channel]);
        for (from, to) in [(0x605, 0x645), (0x645, 0x605), (0x585, 0x5c5), (0x5c5, 0x585), (0x705, 0x705)] {
            assert_eq!(bus.exchange_id(id(from)), id(to));
        }
        let frame: Frame = "605#4000100000000000".parse().expect("a frame");
        assert_eq!(bus.exchange_frame(&frame).to_string(), "645#4000100000000000");
    }
}
