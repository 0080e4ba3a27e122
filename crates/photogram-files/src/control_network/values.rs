//! Special numbers of ISIS.

/// Bit pattern of a missing number in ISIS.
const NULL: u64 = 0xFFEF_FFFF_FFFF_FFFB;

/// Decodes eight bytes, lowest first; NaN for a missing or infinite number.
pub fn number_or_absent(bytes: [u8; 8]) -> f64 {
    let value = f64::from_le_bytes(bytes);
    if value.is_finite() && value.to_bits() != NULL { value } else { f64::NAN }
}
