//! The abort codes that CiA 301 allows for a mistake (7.2.4.3.17), each with the general one.

pub(super) const COMMAND: &[u32] = &[0x0504_0001, 0x0800_0000];
pub(super) const TOGGLE: &[u32] = &[0x0503_0000, 0x0800_0000];
pub(super) const BLOCK_SIZE: &[u32] = &[0x0504_0002, 0x0504_0001, 0x0800_0000];
pub(super) const SEQUENCE: &[u32] = &[0x0504_0003, 0x0504_0001, 0x0800_0000];
pub(super) const CRC: &[u32] = &[0x0504_0004, 0x0800_0000];
pub(super) const READ_ONLY: &[u32] = &[0x0601_0002, 0x0601_0000, 0x0800_0000];
pub(super) const WRITE_ONLY: &[u32] = &[0x0601_0001, 0x0601_0000, 0x0800_0000];
pub(super) const NO_OBJECT: &[u32] = &[0x0602_0000, 0x0800_0000];
pub(super) const NO_SUB_INDEX: &[u32] = &[0x0609_0011, 0x0800_0000];
pub(super) const TOO_LONG: &[u32] = &[0x0607_0010, 0x0607_0012, 0x0800_0000];
pub(super) const TOO_SHORT: &[u32] = &[0x0607_0010, 0x0607_0013, 0x0800_0000];
pub(super) const TOO_HIGH: &[u32] = &[0x0609_0030, 0x0609_0031, 0x0800_0000];
pub(super) const TOO_LOW: &[u32] = &[0x0609_0030, 0x0609_0032, 0x0800_0000];
pub(super) const VALUE: &[u32] = &[0x0609_0030, 0x0609_0031, 0x0609_0032, 0x0800_0000];
