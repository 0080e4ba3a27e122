//! Messages as columns.

use std::ops::Range;

use super::columns::{Cell, Column, Points, Table, Value};
use super::fault::{Fault, Reason};
use super::fields::{Field, Kind, MEASURE};
use super::values::number_or_absent;
use super::watch::{Watch, go_on};
use super::wire::{LARGEST, Message, Packed, Packet};

/// How long each message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Framing<'a> {
    /// Version 5: before each message stands its length, four bytes, the lowest first.
    Lengths,
    /// Version 2: the header has listed the lengths.
    Listed(&'a [u64]),
}

/// Reads the messages that stand in a part of a file.
///
/// # Errors
/// What is wrong with them, in which point, at which byte; `watch` has said so, or there is no memory.
pub fn decoded(
    file: &[u8],
    part: Range<usize>,
    framing: Framing<'_>,
    watch: Watch<'_>,
) -> Result<Points<'static>, Fault> {
    let mut all = Points::default();
    let mut at = part.start;
    let end = part.end.min(file.len());
    while let Some(message) = next_message(file, at..end, framing, all.points.rows)? {
        let number = all.points.rows;
        go_on(watch, number).map_err(|stopped| stopped.at_byte(at))?;
        read_point(&file[message.clone()], message.start, &mut all)
            .map_err(|fault| fault.in_point(number))?;
        at = message.end;
    }
    if part.end > file.len() {
        return Err(Reason::Ends("the points").at_byte(end));
    }
    if at < end {
        return Err(Reason::Columns("more bytes than the lengths of all points").at_byte(at));
    }
    Ok(all)
}

/// Where the next message stands.
fn next_message(
    file: &[u8],
    part: Range<usize>,
    framing: Framing<'_>,
    number: usize,
) -> Result<Option<Range<usize>>, Fault> {
    let ends = || Reason::Ends("a point").at_byte(part.start).in_point(number);
    let (start, length) = match framing {
        Framing::Lengths if part.is_empty() => return Ok(None),
        Framing::Lengths => {
            let four = file[part.clone()].first_chunk().ok_or_else(ends)?;
            (part.start + four.len(), u64::from(u32::from_le_bytes(*four)))
        }
        Framing::Listed(lengths) => match lengths.get(number) {
            Some(&length) => (part.start, length),
            None => return Ok(None),
        },
    };
    let stop = usize::try_from(length).ok().and_then(|length| start.checked_add(length));
    stop.filter(|&stop| stop <= part.end).map(|stop| Some(start..stop)).ok_or_else(ends)
}

fn read_point(bytes: &[u8], start: usize, all: &mut Points<'_>) -> Result<(), Fault> {
    for packet in Message::new(bytes, start) {
        let packet = packet?;
        match packet.value {
            Packed::Bytes(measure) if packet.number == u64::from(MEASURE) => {
                for own in Message::new(measure, packet.end - measure.len()) {
                    take(own?, &mut all.measures)?;
                }
                all.measures.end_row().map_err(|reason| reason.at_byte(packet.start))?;
            }
            other if packet.number == u64::from(MEASURE) => {
                return Err(Reason::Wire(packet.number, other.wire()).at_byte(packet.start));
            }
            _ => take(packet, &mut all.points)?,
        }
    }
    all.end_point().map_err(|reason| reason.at_byte(start))
}

/// Puts a field into its column, or keeps it: where it has none, and where it says what a column has for absent.
fn take(packet: Packet<'_>, table: &mut Table<'_>) -> Result<(), Fault> {
    let fault = |reason: Reason| reason.at_byte(packet.start);
    if packet.number > LARGEST {
        return Err(fault(Reason::Number(packet.number)));
    }
    let row = table.rows;
    let slot =
        table.slot_of_number(packet.number).filter(|&slot| !matches!(table.columns[slot], Column::Kept));
    if let Some(slot) = slot {
        let cell = cell(&table.fields[slot], &packet).map_err(fault)?;
        table.columns[slot].set(row, cell).map_err(|stopped| fault(stopped.into()))?;
        if table.columns[slot].has(row) {
            return Ok(());
        }
    }
    table.rest.keep(packet.raw).map_err(|stopped| fault(stopped.into()))
}

/// The value of a field.
fn cell<'a>(field: &Field, packet: &Packet<'a>) -> Result<Cell<'a>, Reason> {
    match (field.kind, packet.value) {
        (Kind::Text | Kind::Name, Packed::Bytes(bytes)) => {
            str::from_utf8(bytes).map(Cell::Text).map_err(|_| Reason::Utf8(field.key))
        }
        (Kind::Code(words), Packed::Varint(code)) if code < words.len() as u64 => Ok(Cell::Code(code as i8)),
        (Kind::Code(_), Packed::Varint(code)) => {
            Err(Reason::Value { key: field.key, value: code.to_string(), expected: "a type that is known" })
        }
        (Kind::Truth, Packed::Varint(truth)) => Ok(Cell::Truth(truth != 0)),
        (Kind::Index, Packed::Varint(index)) => i32::try_from(index as i64).map(Cell::Index).map_err(|_| {
            Reason::Value { key: field.key, value: index.to_string(), expected: "the index of a measure" }
        }),
        (Kind::Number(_), Packed::Eight(bytes)) => Ok(Cell::Number(number_or_absent(bytes))),
        (Kind::Covariance, Packed::Bytes([])) => Ok(Cell::Covariance(Value::ABSENT)),
        (Kind::Covariance, Packed::Bytes(bytes)) => {
            let (&[a, b, c, d, e, f], []) = bytes.as_chunks() else {
                let value = format!("{} bytes", bytes.len());
                return Err(Reason::Value { key: field.key, value, expected: "six numbers" });
            };
            let values = [a, b, c, d, e, f].map(number_or_absent);
            let whole = values.iter().all(|value| !value.is_absent());
            Ok(Cell::Covariance(if whole { values } else { Value::ABSENT }))
        }
        (_, other) => Err(Reason::Wire(field.number.into(), other.wire())),
    }
}
