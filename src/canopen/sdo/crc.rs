//! The CRC of block transfers: x¹⁶ + x¹² + x⁵ + 1, initial value 0, highest bit first (CiA 301, 7.2.4.3.16).

const POLYNOMIAL: u16 = 0x1021;

/// The CRC contribution of each value of the highest byte.
const TABLE: [u16; 256] = table();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut index = 0;
    let mut byte: u16 = 0;
    while index < table.len() {
        let mut crc = byte << 8;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ POLYNOMIAL };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
        byte += 1;
    }
    table
}

/// Computes the CRC of `bytes`.
pub fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc: u16, byte| {
        let [high, _] = crc.to_be_bytes();
        crc << 8 ^ TABLE[usize::from(high ^ byte)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crc_of_the_standards_example_matches() {
        assert_eq!(crc16(b"123456789"), 0x31c3);
        assert_eq!(crc16(b""), 0);
        assert_eq!(crc16(&[0; 889]), 0);
        assert_eq!(crc16(&[0xff]), 0x1ef0);
    }
}
