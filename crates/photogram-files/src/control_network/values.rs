//! Numbers as ISIS has them.

/// What ISIS has for a number that is not there.
const NULL: u64 = 0xFFEF_FFFF_FFFF_FFFB;

/// The number that eight bytes are, the lowest first; NaN where it is none.
pub fn number_or_absent(bytes: [u8; 8]) -> f64 {
    let value = f64::from_le_bytes(bytes);
    if value.is_finite() && value.to_bits() != NULL { value } else { f64::NAN }
}
