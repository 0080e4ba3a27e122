//! Protobuf's wire format: a message is fields one after the other, each a key (number and wire type) and a value.

use super::fault::{Fault, Reason};

/// A value as it is packed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Packed<'a> {
    /// Wire type 0: a whole number of any length.
    Varint(u64),
    /// Wire type 1: eight bytes.
    Eight([u8; 8]),
    /// Wire type 2: a text, a message, numbers in a row.
    Bytes(&'a [u8]),
    /// Wire type 5: four bytes.
    Four,
}

impl Packed<'_> {
    /// The number of its wire type.
    pub fn wire(&self) -> u8 {
        match self {
            Self::Varint(_) => 0,
            Self::Eight(_) => 1,
            Self::Bytes(_) => 2,
            Self::Four => 5,
        }
    }
}

/// A field of a message.
#[derive(Debug, Clone, Copy)]
pub struct Packet<'a> {
    /// Its number.
    pub number: u64,
    /// Its value.
    pub value: Packed<'a>,
    /// The whole of it, byte for byte.
    pub raw: &'a [u8],
    /// Where it begins in the file.
    pub start: usize,
    /// Where its value ends in the file.
    pub end: usize,
}

/// The fields of a message, one after the other.
#[derive(Debug, Clone)]
pub struct Message<'a> {
    bytes: &'a [u8],
    at: usize,
    base: usize,
}

/// The largest number that a field can have.
pub const LARGEST: u64 = (1 << 29) - 1;

impl<'a> Message<'a> {
    /// A message whose first byte is the one of number `base` in its file.
    pub fn new(bytes: &'a [u8], base: usize) -> Self {
        Self { bytes, at: 0, base }
    }

    /// The next number that is packed as a varint; None at the end.
    pub fn varint(&mut self) -> Option<Result<u64, Fault>> {
        (self.at < self.bytes.len()).then(|| self.whole())
    }

    fn whole(&mut self) -> Result<u64, Fault> {
        let start = self.at;
        let mut value = 0;
        for shift in (0..70).step_by(7) {
            let byte = *self.bytes.get(self.at).ok_or_else(|| self.fault(Reason::Ends("a number"), start))?;
            self.at += 1;
            if shift == 63 && byte > 1 {
                break;
            }
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(self.fault(Reason::Endless, start))
    }

    /// The next bytes of a field that begins at `start`.
    fn take(&mut self, count: usize, start: usize) -> Result<&'a [u8], Fault> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        self.at += taken.map_or(0, <[u8]>::len);
        taken.ok_or_else(|| self.fault(Reason::Ends("a field"), start))
    }

    fn fault(&self, reason: Reason, at: usize) -> Fault {
        reason.at_byte(self.base + at)
    }

    fn packet(&mut self) -> Result<Packet<'a>, Fault> {
        let start = self.at;
        let key = self.whole()?;
        let (number, wire) = (key >> 3, (key & 7) as u8);
        if number == 0 {
            return Err(self.fault(Reason::Number(number), start));
        }
        let value = match wire {
            0 => Packed::Varint(self.whole()?),
            1 => {
                let mut eight = [0; 8];
                eight.copy_from_slice(self.take(8, start)?);
                Packed::Eight(eight)
            }
            2 => {
                let length = usize::try_from(self.whole()?).unwrap_or(usize::MAX);
                Packed::Bytes(self.take(length, start)?)
            }
            5 => self.take(4, start).map(|_| Packed::Four)?,
            _ => return Err(self.fault(Reason::Wire(number, wire), start)),
        };
        let (raw, end) = (&self.bytes[start..self.at], self.base + self.at);
        Ok(Packet { number, value, raw, start: self.base + start, end })
    }
}

impl<'a> Iterator for Message<'a> {
    type Item = Result<Packet<'a>, Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        (self.at < self.bytes.len()).then(|| self.packet())
    }
}

/// Writes a varint.
pub fn put_varint(mut value: u64, to: &mut Vec<u8>) {
    while value >= 0x80 {
        to.push(value as u8 | 0x80);
        value >>= 7;
    }
    to.push(value as u8);
}

fn put_key(number: u64, wire: u64, to: &mut Vec<u8>) {
    put_varint(number << 3 | wire, to);
}

/// Writes a field that is a whole number.
pub fn put_whole(number: u32, value: u64, to: &mut Vec<u8>) {
    put_key(number.into(), 0, to);
    put_varint(value, to);
}

/// Writes a field that is a number.
pub fn put_number(number: u32, value: f64, to: &mut Vec<u8>) {
    put_key(number.into(), 1, to);
    to.extend(value.to_le_bytes());
}

/// Writes a field that is a text or a message.
pub fn put_bytes(number: u64, bytes: &[u8], to: &mut Vec<u8>) {
    put_key(number, 2, to);
    put_varint(bytes.len() as u64, to);
    to.extend_from_slice(bytes);
}
