//! Conversion of text to columns.
//!
//! Conversion of columns to text.

use std::borrow::Cow;
use std::fmt::Write;

use super::columns::{Cell, Column, Points, Table, Value};
use super::fault::{Fault, Reason};
use super::fields::{Field, Kind, LOGS, number_or_absent};
use super::messages::{LARGEST, Message, Packed, Packet, put_bytes, put_number, put_whole, report};
use super::scan::{Act, Kind as Part, Read, Statement, Statements};
use photocore::Context;

/// Field number of unknown text, outside of the range of files.
pub(super) const UNKNOWN: u64 = LARGEST + 1;
/// Key of the reference measure of a point.
pub(super) const REFERENCE: &str = "Reference";

/// Optional unit of values without a declared unit.
const PIXELS: &str = "pixels";

/// Reads the points of a network in text. Also returns the text without its points, with unchanged line numbers.
///
/// # Errors
/// An error with its point and line, an interruption, or lack of memory.
pub fn read_text(file: &[u8], context: &mut Context<'_>) -> Result<(Points<'static>, String), Fault> {
    let text = str::from_utf8(file).map_err(|error| {
        let line = file[..error.valid_up_to()].split(|&byte| byte == b'\n').count();
        Reason::Utf8("a line").on_line(line)
    })?;
    let (mut all, mut around, mut lines) = (Points::default(), String::new(), 1);
    let mut statements = Statements::new(text);
    while let Some(statement) = statements.next() {
        let statement = statement?;
        let number = all.points.rows;
        if statement.begins(Part::Object, "ControlPoint") {
            report(context, number).map_err(|stopped| stopped.on_line(statement.line))?;
            let read = read_point(&mut statements, statement.line, &mut all);
            read.map_err(|fault| fault.in_point(number))?;
            continue;
        }
        around.extend((lines..statement.line).map(|_| '\n'));
        around.push_str(statement.text);
        lines = statement.line + statement.text.matches('\n').count();
        if statement.act() == Act::Stop {
            break;
        }
    }
    Ok((all, around))
}

fn read_point(statements: &mut Statements<'_>, begun: usize, all: &mut Points<'_>) -> Result<(), Fault> {
    let (first, mut reference) = (all.measures.rows, None);
    loop {
        let statement = next(statements, begun)?;
        match statement.act() {
            Act::End(Part::Object) => break,
            Act::End(_) | Act::Stop => return Err(statement.fault()),
            Act::Restart(_) if statement.begins(Part::Group, "ControlMeasure") => {
                if read_measure(statements, statement.line, &mut all.measures)? {
                    let index = (all.measures.rows - first - 1) as i32;
                    if reference.replace(index).is_some() {
                        return Err(Reason::Twice(REFERENCE).on_line(statement.line));
                    }
                }
            }
            Act::Restart(kind) => keep_group(statements, &statement, kind, &mut all.points)?,
            Act::Give => give(&statement, &mut all.points)?,
        }
    }
    if let Some(index) = reference {
        set(&mut all.points, "ReferenceIndex", Cell::Index(index)).map_err(|reason| reason.on_line(begun))?;
    }
    all.end_point().map_err(|reason| reason.on_line(begun))
}

/// Reads a measure; returns whether it is the reference measure of its point.
fn read_measure(statements: &mut Statements<'_>, begun: usize, table: &mut Table<'_>) -> Result<bool, Fault> {
    let mut is_reference = false;
    loop {
        let statement = next(statements, begun)?;
        match statement.act() {
            Act::End(Part::Group) => break,
            Act::End(_) | Act::Stop => return Err(statement.fault()),
            Act::Restart(kind) => keep_group(statements, &statement, kind, table)?,
            Act::Give if statement.key.eq_ignore_ascii_case(REFERENCE) => {
                let read = statement.read()?;
                is_reference =
                    truth(REFERENCE, &read.text).map_err(|reason| reason.on_line(statement.line))?;
            }
            Act::Give => give(&statement, table)?,
        }
    }
    table.end_row().map_err(|reason| reason.on_line(begun))?;
    Ok(is_reference)
}

fn next<'a>(statements: &mut Statements<'a>, begun: usize) -> Result<Statement<'a>, Fault> {
    statements.next().ok_or_else(|| Reason::Ends("a point").on_line(begun))?
}

/// Stores an unknown group up to its end.
fn keep_group(
    statements: &mut Statements<'_>,
    begin: &Statement<'_>,
    kind: Part,
    table: &mut Table<'_>,
) -> Result<(), Fault> {
    let (mut kept, mut open) = (begin.text.to_owned(), vec![kind]);
    while let Some(&innermost) = open.last() {
        let statement = next(statements, begin.line)?;
        match statement.act() {
            Act::Restart(kind) => open.push(kind),
            Act::End(kind) if kind == innermost => drop(open.pop()),
            Act::End(_) | Act::Stop => return Err(statement.fault()),
            Act::Give => {}
        }
        kept.push('\n');
        kept.push_str(statement.text);
    }
    keep(table, |to| put_bytes(UNKNOWN, kept.as_bytes(), to)).map_err(|reason| reason.on_line(begin.line))
}

fn keep(table: &mut Table<'_>, write: impl FnOnce(&mut Vec<u8>)) -> Result<(), Reason> {
    let mut raw = vec![];
    write(&mut raw);
    Ok(table.rest.keep(&raw)?)
}

/// Assigns a value to its key.
fn give(statement: &Statement<'_>, table: &mut Table<'_>) -> Result<(), Fault> {
    let fault = |reason: Reason| reason.on_line(statement.line);
    let slot = table.fields.iter().position(|field| statement.key.eq_ignore_ascii_case(field.key));
    if let Some(slot) = slot {
        return take(&table.fields[slot], slot, &statement.read()?, table).map_err(fault);
    }
    if statement.key.is_empty() || statement.value.is_empty() {
        return Err(statement.fault());
    }
    let has_logs = table.fields.iter().any(|field| field.kind == Kind::Log);
    let log = LOGS.iter().position(|key| has_logs && statement.key.eq_ignore_ascii_case(key));
    let Some(index) = log else {
        return keep(table, |to| put_bytes(UNKNOWN, statement.text.as_bytes(), to)).map_err(fault);
    };
    let value = number(LOGS[index], &statement.read()?.text).map_err(fault)?;
    let mut message = vec![];
    put_whole(1, index as u64 + 1, &mut message);
    put_number(2, value, &mut message);
    let field = table.fields.iter().find(|field| field.kind == Kind::Log).map_or(0, |field| field.number);
    keep(table, |to| put_bytes(field.into(), &message, to)).map_err(fault)
}

/// Stores a value in its column, or in the rest for fields without a column.
fn take(field: &Field, slot: usize, read: &Read<'_>, table: &mut Table<'_>) -> Result<(), Reason> {
    let row = table.rows;
    let cell = match field.kind {
        Kind::Kept | Kind::Log => {
            return keep(table, |to| put_bytes(field.number.into(), read.text.as_bytes(), to));
        }
        Kind::Text | Kind::Name => Cell::Text(&read.text),
        Kind::Code(words) => Cell::Code(code(field.key, &read.text, words)?),
        Kind::Truth => Cell::Truth(truth(field.key, &read.text)?),
        Kind::Number(unit) => {
            check_unit(field.key, read, unit)?;
            Cell::Number(number(field.key, &read.text)?)
        }
        Kind::Covariance => Cell::Covariance(covariance(field.key, &read.text)?),
        Kind::Index => Cell::Index(index(field.key, &read.text)?),
    };
    set(table, table.fields[slot].key, cell)?;
    // An explicitly absent value is stored separately, because the column treats it as missing.
    match cell {
        _ if table.columns[slot].has(row) => Ok(()),
        Cell::Number(absent) => keep(table, |to| put_number(field.number, absent, to)),
        Cell::Index(negative) => keep(table, |to| put_whole(field.number, i64::from(negative) as u64, to)),
        _ => keep(table, |to| put_whole(field.number, 0, to)),
    }
}

fn set(table: &mut Table<'_>, key: &'static str, cell: Cell<'_>) -> Result<(), Reason> {
    let row = table.rows;
    let slot = table.fields.iter().position(|field| field.key == key);
    match slot.map(|slot| table.columns[slot].set(row, cell)) {
        Some(Ok(true)) => Err(Reason::Twice(key)),
        Some(Err(stopped)) => Err(stopped.into()),
        _ => Ok(()),
    }
}

fn wrong(key: &'static str, value: &str, expected: &'static str) -> Reason {
    Reason::Value { key, value: value.chars().take(40).collect(), expected }
}

fn check_unit(key: &'static str, read: &Read<'_>, unit: Option<&'static str>) -> Result<(), Reason> {
    let unit = unit.unwrap_or(PIXELS);
    match &read.unit {
        Some(found) if !found.eq_ignore_ascii_case(unit) => Err(wrong(key, &format!("<{found}>"), unit)),
        _ => Ok(()),
    }
}

fn code(key: &'static str, text: &str, words: &[&str]) -> Result<i8, Reason> {
    let found = words.iter().position(|word| text.eq_ignore_ascii_case(word));
    found.map(|code| code as i8).ok_or_else(|| wrong(key, text, "one of a few words, none of which this is"))
}

fn truth(key: &'static str, text: &str) -> Result<bool, Reason> {
    let is = |words: [&str; 4]| words.iter().any(|word| text.eq_ignore_ascii_case(word));
    match (is(["true", "yes", "on", "1"]), is(["false", "no", "off", "0"])) {
        (true, _) => Ok(true),
        (_, true) => Ok(false),
        _ => Err(wrong(key, text, "True or False")),
    }
}

/// Parses a number; NaN for `null`.
fn number(key: &'static str, text: &str) -> Result<f64, Reason> {
    if text.eq_ignore_ascii_case("null") {
        return Ok(f64::NAN);
    }
    let value = text.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| wrong(key, text, "a number"))
}

fn index(key: &'static str, text: &str) -> Result<i32, Reason> {
    text.parse().map_err(|_| wrong(key, text, "a whole number"))
}

fn covariance(key: &'static str, text: &str) -> Result<[f64; 6], Reason> {
    let six = || wrong(key, text, "a list of six numbers");
    let values: Result<Vec<f64>, Reason> = text.split(',').map(|each| number(key, each.trim())).collect();
    let values: [f64; 6] = values?.try_into().map_err(|_| six())?;
    values.iter().all(|value| !value.is_absent()).then_some(values).ok_or_else(six)
}

/// Name of the text format in errors.
const TEXT: &str = "a network in text";

/// Writes points as text, as part of the object of their network: keys in the order of ISIS, one per line.
///
/// # Errors
/// Inconsistent columns, or content that only messages can store.
pub fn text(all: &Points<'_>, context: &mut Context<'_>) -> Result<String, Fault> {
    all.check().map_err(Reason::of_columns)?;
    let mut to = String::new();
    for point in 0..all.points.rows {
        let fault = |reason: Reason| reason.of_columns().in_point(point);
        report(context, point).map_err(fault)?;
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

/// Item of a point or a measure.
enum Item<'a> {
    /// Key with its value.
    Key(Cow<'a, str>, String),
    /// Unknown group, unchanged.
    Group(&'a str),
}

fn put_items(items: &[Item<'_>], indent: usize, to: &mut String) {
    let width = items.iter().map(|item| if let Item::Key(key, _) = item { key.len() } else { 0 }).max();
    let width = width.unwrap_or(0);
    for item in items {
        // Writing to memory cannot fail.
        let _ = match item {
            Item::Key(key, value) => writeln!(to, "{:indent$}{key:width$} = {value}", ""),
            Item::Group(text) => {
                text.lines().try_for_each(|line| writeln!(to, "{:indent$}{}", "", line.trim()))
            }
        };
    }
}

/// Returns the items of a row, in the order of its fields, followed by unknown ones.
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

/// Returns the value of a column as text.
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

/// Returns the item of a known field without a column value.
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

/// Returns the item of a logged number: its name and value.
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

/// Returns the item of unknown text.
fn unknown(bytes: &[u8]) -> Result<Item<'_>, Reason> {
    let text = str::from_utf8(bytes).map_err(|_| Reason::Utf8("what is kept"))?;
    Ok(match text.split_once('=') {
        Some((key, value)) if !text.contains('\n') => Item::Key(key.trim().into(), value.trim().to_owned()),
        _ => Item::Group(text),
    })
}

/// Returns a text as a value, quoted unless it is a single word.
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
