//! Header of a binary network.

use std::ops::Range;

use super::fault::{Fault, Reason};
use super::messages::{LARGEST, Message, Packed, Packet, put_bytes, put_number, put_whole};

/// Header of a binary network, in front of the points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Header {
    /// Network, target, created, modified, description, user; None if missing.
    pub texts: [Option<String>; 6],
    /// Number of points; None if missing.
    pub points: Option<u64>,
    /// Length of each point's message (version 2).
    pub lengths: Vec<u64>,
    /// Radii of the target, m.
    pub radii: Vec<f64>,
    /// Unknown fields as bytes.
    pub rest: Vec<u8>,
}

/// Field number of the point count, or of the list of lengths.
const POINTS: u32 = 7;
/// Field number of the radii.
const RADII: u32 = 10;

impl Header {
    /// Reads a header from a part of a file.
    ///
    /// # Errors
    /// An error with its byte.
    pub fn decoded(file: &[u8], part: Range<usize>) -> Result<Self, Fault> {
        let bytes = file.get(part.clone()).ok_or_else(|| Reason::Ends("the header").at_byte(file.len()))?;
        let mut own = Self::default();
        for packet in Message::new(bytes, part.start) {
            let packet = packet?;
            own.take(&packet).map_err(|reason| reason.at_byte(packet.start))?;
        }
        Ok(own)
    }

    fn take(&mut self, packet: &Packet<'_>) -> Result<(), Reason> {
        match (packet.number, packet.value) {
            (number @ 1..=6, Packed::Bytes(bytes)) => {
                let text = str::from_utf8(bytes).map_err(|_| Reason::Utf8("the header"))?;
                self.texts[number as usize - 1] = Some(text.to_owned());
            }
            (7, Packed::Varint(count)) => self.points = Some(count),
            (7, Packed::Bytes(bytes)) => {
                let mut lengths = Message::new(bytes, packet.end - bytes.len());
                while let Some(length) = lengths.varint() {
                    self.lengths.push(length.map_err(|fault| fault.reason)?);
                }
            }
            (10, Packed::Eight(bytes)) => self.radii.push(f64::from_le_bytes(bytes)),
            (10, Packed::Bytes(bytes)) => match bytes.as_chunks() {
                (radii, []) => self.radii.extend(radii.iter().map(|&bytes| f64::from_le_bytes(bytes))),
                _ => return Err(Reason::Ends("the radii")),
            },
            (1..=7 | 10, other) => return Err(Reason::Wire(packet.number, other.wire())),
            (number, _) if number > LARGEST => return Err(Reason::Number(number)),
            _ => self.rest.extend_from_slice(packet.raw),
        }
        Ok(())
    }

    /// Encodes the header in version 5.
    pub fn encoded(&self) -> Vec<u8> {
        let mut to = vec![];
        for (number, text) in (1..).zip(&self.texts) {
            if let Some(text) = text {
                put_bytes(number, text.as_bytes(), &mut to);
            }
        }
        if let Some(points) = self.points {
            put_whole(POINTS, points, &mut to);
        }
        self.radii.iter().for_each(|&radius| put_number(RADII, radius, &mut to));
        to.extend_from_slice(&self.rest);
        to
    }
}
