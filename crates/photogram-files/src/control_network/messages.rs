//! Conversion of messages to columns.
//!
//! Conversion of columns to messages.
//!
//! Protobuf wire format: a message is a sequence of fields, each a key (number and wire type) and a value.
//!
//! Interruption by the caller.

use std::ops::Range;

use super::columns::{Cell, Column, Points, Table, Value};
use super::fault::{Fault, Reason};
use super::fields::{Field, Kind, MEASURE, number_or_absent};
use photocore::{Context, Event, Phase};

/// Encoding of the message lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Framing<'a> {
    /// Version 5: four bytes in front of each message, lowest first.
    Lengths,
    /// Version 2: list of lengths in the header.
    Listed(&'a [u64]),
}

/// Reads the messages in a part of a file.
///
/// # Errors
/// An error with its point and byte, an interruption, or lack of memory.
pub fn decoded(
    file: &[u8],
    part: Range<usize>,
    framing: Framing<'_>,
    context: &mut Context<'_>,
) -> Result<Points<'static>, Fault> {
    let mut all = Points::default();
    let mut at = part.start;
    let end = part.end.min(file.len());
    while let Some(message) = next_message(file, at..end, framing, all.points.rows)? {
        let number = all.points.rows;
        report(context, number).map_err(|stopped| stopped.at_byte(at))?;
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

/// Returns the range of the next message.
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

/// Stores a field in its column, or in the rest if the column is missing or would treat the value as absent.
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

/// Returns the value of a field.
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

/// Encodes points as messages of version 5, each after its length.
///
/// Fields are in the order of their numbers, including stored fields without a column.
///
/// # Errors
/// Inconsistent columns, content that only text can store, or a message longer than its length field allows.
pub fn encoded(all: &Points<'_>, context: &mut Context<'_>) -> Result<Vec<u8>, Fault> {
    all.check().map_err(Reason::of_columns)?;
    let (orders, mut to, mut own) = ((order(&all.points), order(&all.measures)), vec![], vec![]);
    for point in 0..all.points.rows {
        let fault = |reason: Reason| reason.of_columns().in_point(point);
        report(context, point).map_err(fault)?;
        let start = to.len();
        to.extend([0; 4]);
        let mut measures = |to: &mut Vec<u8>| {
            all.measures_of(point).try_for_each(|measure| {
                own.clear();
                write_row(&all.measures, measure, &orders.1, &mut own, &mut |_| Ok(()))?;
                put_bytes(MEASURE.into(), &own, to);
                Ok(())
            })
        };
        write_row(&all.points, point, &orders.0, &mut to, &mut measures).map_err(fault)?;
        let length = u32::try_from(to.len() - start - 4).map_err(|_| {
            fault(Reason::NoPlace("more than four gigabytes".to_owned(), "a point of a binary network"))
        })?;
        to[start..start + 4].copy_from_slice(&length.to_le_bytes());
    }
    Ok(to)
}

/// Returns the columns in the order of their field numbers.
fn order(table: &Table<'_>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..table.fields.len()).collect();
    order.sort_by_key(|&column| table.fields[column].number);
    order
}

type Inside<'a> = &'a mut dyn FnMut(&mut Vec<u8>) -> Result<(), Reason>;

/// Writes the fields of a row; `measures` writes the measures at their field number.
fn write_row(
    table: &Table<'_>,
    row: usize,
    order: &[usize],
    to: &mut Vec<u8>,
    measures: Inside<'_>,
) -> Result<(), Reason> {
    let mut slots = order.iter().copied().peekable();
    let mut inside = Some(measures);
    for packet in Message::new(table.rest.row(row), 0) {
        let packet = packet.map_err(|fault| fault.reason)?;
        if packet.number > LARGEST {
            return Err(Reason::NoPlace(shown(packet.value), "a binary network"));
        }
        while let Some(slot) = slots.next_if(|&slot| u64::from(table.fields[slot].number) < packet.number) {
            write_field(table, slot, row, to);
        }
        if packet.number > u64::from(MEASURE)
            && let Some(write) = inside.take()
        {
            write(to)?;
        }
        // A stored absent value is omitted if the column now has a value.
        let slot = table.slot_of_number(packet.number);
        if !slot.is_some_and(|slot| table.columns[slot].has(row)) {
            to.extend_from_slice(packet.raw);
        }
    }
    slots.for_each(|slot| write_field(table, slot, row, to));
    inside.take().map_or(Ok(()), |write| write(to))
}

/// Returns the first line of a stored text.
fn shown(kept: Packed<'_>) -> String {
    let Packed::Bytes(bytes) = kept else { return "what is no text".to_owned() };
    String::from_utf8_lossy(bytes).lines().next().unwrap_or_default().trim().to_owned()
}

fn write_field(table: &Table<'_>, slot: usize, row: usize, to: &mut Vec<u8>) {
    let number = table.fields[slot].number;
    if !table.columns[slot].has(row) {
        return;
    }
    match &table.columns[slot] {
        Column::Texts(own) => put_bytes(number.into(), own.get(row).as_bytes(), to),
        Column::Names(own) => {
            put_bytes(number.into(), own.names[own.indices.get(row) as usize].as_bytes(), to);
        }
        Column::Codes(own) => put_whole(number, own.get(row) as u64, to),
        Column::Truths(own) => put_whole(number, own.get(row).into(), to),
        Column::Numbers(own) => put_number(number, own.get(row), to),
        Column::Covariances(own) => {
            let bytes: [[u8; 8]; 6] = own.get(row).map(f64::to_le_bytes);
            put_bytes(number.into(), bytes.as_flattened(), to);
        }
        Column::Indices(own) => put_whole(number, own.get(row) as u64, to),
        Column::Kept => {}
    }
}

/// Encoded value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Packed<'a> {
    /// Wire type 0: integer of variable length.
    Varint(u64),
    /// Wire type 1: eight bytes.
    Eight([u8; 8]),
    /// Wire type 2: text, message, or packed numbers.
    Bytes(&'a [u8]),
    /// Wire type 5: four bytes.
    Four,
}

impl Packed<'_> {
    /// Returns the wire type.
    pub fn wire(&self) -> u8 {
        match self {
            Self::Varint(_) => 0,
            Self::Eight(_) => 1,
            Self::Bytes(_) => 2,
            Self::Four => 5,
        }
    }
}

/// Field of a message.
#[derive(Debug, Clone, Copy)]
pub struct Packet<'a> {
    /// Field number.
    pub number: u64,
    /// Value.
    pub value: Packed<'a>,
    /// Complete field as bytes.
    pub raw: &'a [u8],
    /// Start of the field in the file.
    pub start: usize,
    /// End of the value in the file.
    pub end: usize,
}

/// Iterator over the fields of a message.
#[derive(Debug, Clone)]
pub struct Message<'a> {
    bytes: &'a [u8],
    at: usize,
    base: usize,
}

/// Largest valid field number.
pub const LARGEST: u64 = (1 << 29) - 1;

impl<'a> Message<'a> {
    /// Creates a message whose first byte has the position `base` in its file.
    pub fn new(bytes: &'a [u8], base: usize) -> Self {
        Self { bytes, at: 0, base }
    }

    /// Returns the next packed varint; None at the end.
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

    /// Returns the next bytes of a field that begins at `start`.
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

/// Writes an integer field.
pub fn put_whole(number: u32, value: u64, to: &mut Vec<u8>) {
    put_key(number.into(), 0, to);
    put_varint(value, to);
}

/// Writes a field with a floating-point number.
pub fn put_number(number: u32, value: f64, to: &mut Vec<u8>) {
    put_key(number.into(), 1, to);
    to.extend(value.to_le_bytes());
}

/// Writes a field with a text or a message.
pub fn put_bytes(number: u64, bytes: &[u8], to: &mut Vec<u8>) {
    put_key(number, 2, to);
    put_varint(bytes.len() as u64, to);
    to.extend_from_slice(bytes);
}

/// Number of points between two reports of progress.
const PATIENCE: usize = 1024;

/// Reports progress once per `PATIENCE` points; fails if this stops the work.
pub fn report(context: &mut Context<'_>, point: usize) -> Result<(), Reason> {
    if point.is_multiple_of(PATIENCE) {
        context.report(Event::Progress { phase: Phase::Form, done: point, total: 0 })?;
    }
    Ok(())
}
