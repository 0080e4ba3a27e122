//! Columns as text.

use std::borrow::Cow;
use std::fmt::Write;

use super::columns::{Column, Points, Table};
use super::fault::{Fault, Reason};
use super::fields::{Field, Kind, LOGS};
use super::read_text::{REFERENCE, UNKNOWN};
use super::values::number_or_absent;
use super::watch::{Watch, go_on};
use super::wire::{Message, Packed, Packet};

/// What text is called where something has no place in it.
const TEXT: &str = "a network in text";

/// Writes points as text, as they stand in the object of their network: keys in the order of ISIS, one below the other.
///
/// # Errors
/// Columns do not agree, something was kept that only messages can hold.
pub fn text(all: &Points<'_>, watch: Watch<'_>) -> Result<String, Fault> {
    all.check().map_err(Reason::of_columns)?;
    let mut to = String::new();
    for point in 0..all.points.rows {
        let fault = |reason: Reason| reason.of_columns().in_point(point);
        go_on(watch, point).map_err(fault)?;
        to.push_str("\n  Object = ControlPoint\n");
        put_items(&items(&all.points, point).map_err(fault)?, 4, &mut to);
        for (index, measure) in all.measures_of(point).enumerate() {
            let mut own = items(&all.measures, measure).map_err(fault)?;
            if all.reference(point) == Some(index as i32) {
                own.push(Item::Key(REFERENCE.into(), "True".to_owned()));
            }
            to.push_str("\n    Group = ControlMeasure\n");
            put_items(&own, 6, &mut to);
            to.push_str("    End_Group\n");
        }
        to.push_str("  End_Object\n");
    }
    Ok(to)
}

/// What stands in a point or a measure.
enum Item<'a> {
    /// A key with its value.
    Key(Cow<'a, str>, String),
    /// A group that nobody knows, as it was.
    Group(&'a str),
}

fn put_items(items: &[Item<'_>], indent: usize, to: &mut String) {
    let width = items.iter().map(|item| if let Item::Key(key, _) = item { key.len() } else { 0 }).max();
    let width = width.unwrap_or(0);
    for item in items {
        // Writing to memory does not fail.
        let _ = match item {
            Item::Key(key, value) => writeln!(to, "{:indent$}{key:width$} = {value}", ""),
            Item::Group(text) => {
                text.lines().try_for_each(|line| writeln!(to, "{:indent$}{}", "", line.trim()))
            }
        };
    }
}

/// What stands in a row, in the order of its fields, then what nobody knows.
fn items<'a>(table: &'a Table<'_>, row: usize) -> Result<Vec<Item<'a>>, Reason> {
    let packets: Vec<Packet<'a>> = Message::new(table.rest.row(row), 0)
        .collect::<Result<_, _>>()
        .map_err(|fault: Fault| fault.reason)?;
    let mut items = vec![];
    for (slot, field) in table.fields.iter().enumerate() {
        if table.columns[slot].has(row) {
            if field.kind != Kind::Index {
                items.push(Item::Key(field.key.into(), value(field, &table.columns[slot], row)?));
            }
            continue;
        }
        for packet in packets.iter().filter(|packet| packet.number == u64::from(field.number)) {
            items.push(kept(field, packet)?);
        }
    }
    for packet in &packets {
        match packet.value {
            Packed::Bytes(bytes) if packet.number == UNKNOWN => items.push(unknown(bytes)?),
            _ if table.slot_of_number(packet.number).is_some() => {}
            _ => return Err(Reason::NoPlace(format!("field {}", packet.number), TEXT)),
        }
    }
    Ok(items)
}

/// The value of a column.
fn value(field: &Field, column: &Column<'_>, row: usize) -> Result<String, Reason> {
    let number = |value: f64| format!("{value:?}");
    Ok(match (column, field.kind) {
        (Column::Texts(own), _) => quoted(own.get(row))?,
        (Column::Names(own), _) => quoted(&own.names[own.indices.get(row) as usize])?,
        (Column::Codes(own), Kind::Code(words)) => words[own.get(row) as usize].to_owned(),
        (Column::Truths(_), _) => "True".to_owned(),
        (Column::Numbers(own), Kind::Number(Some(unit))) => format!("{} <{unit}>", number(own.get(row))),
        (Column::Numbers(own), _) => number(own.get(row)),
        (Column::Covariances(own), _) => format!("({})", own.get(row).map(number).join(", ")),
        _ => String::new(),
    })
}

/// What was kept of a field that is known.
fn kept<'a>(field: &Field, packet: &Packet<'a>) -> Result<Item<'a>, Reason> {
    let key = |value: &str| Item::Key(field.key.into(), value.to_owned());
    match (field.kind, packet.value) {
        (Kind::Kept, Packed::Bytes(bytes)) => {
            let text = str::from_utf8(bytes).map_err(|_| Reason::Utf8(field.key))?;
            Ok(Item::Key(field.key.into(), quoted(text)?))
        }
        (Kind::Truth, Packed::Varint(0)) => Ok(key("False")),
        (Kind::Number(_), Packed::Eight(_)) => Ok(key("Null")),
        (Kind::Index, Packed::Varint(index)) => Ok(key(&(index as i64).to_string())),
        (Kind::Log, Packed::Bytes(bytes)) => log(bytes),
        _ => Err(Reason::NoPlace(format!("field {}", packet.number), TEXT)),
    }
}

/// A number of a log: what it is, and how large.
fn log<'a>(bytes: &[u8]) -> Result<Item<'a>, Reason> {
    let mut packets = Message::new(bytes, 0).flatten().map(|packet| (packet.number, packet.value));
    if let (Some((1, Packed::Varint(kind))), Some((2, Packed::Eight(value))), None) =
        (packets.next(), packets.next(), packets.next())
        && let Some(key) = usize::try_from(kind).ok().and_then(|kind| LOGS.get(kind.checked_sub(1)?))
    {
        let value = number_or_absent(value);
        let value = if value.is_nan() { "Null".to_owned() } else { format!("{value:?}") };
        return Ok(Item::Key((*key).into(), value));
    }
    Err(Reason::NoPlace("a log that is no number with a name".to_owned(), TEXT))
}

/// What stood in text and nobody knows.
fn unknown(bytes: &[u8]) -> Result<Item<'_>, Reason> {
    let text = str::from_utf8(bytes).map_err(|_| Reason::Utf8("what is kept"))?;
    Ok(match text.split_once('=') {
        Some((key, value)) if !text.contains('\n') => Item::Key(key.trim().into(), value.trim().to_owned()),
        _ => Item::Group(text),
    })
}

/// A text as a value: in marks of quotation where it is no single word.
fn quoted(text: &str) -> Result<String, Reason> {
    let special = |c: char| c.is_whitespace() || "\"'(){}<>,=#;".contains(c);
    if !text.is_empty() && !text.contains(special) && !text.contains("/*") && !text.ends_with('-') {
        return Ok(text.to_owned());
    }
    match (text.contains('\n'), text.contains('"'), text.contains('\'')) {
        (false, false, _) => Ok(format!("\"{text}\"")),
        (false, true, false) => Ok(format!("'{text}'")),
        _ => Err(Reason::NoPlace(format!("the text {text:?}"), TEXT)),
    }
}
