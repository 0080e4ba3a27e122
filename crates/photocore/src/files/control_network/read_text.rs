//! Text as columns.

use super::columns::{Cell, Points, Table, Value};
use super::fault::{Fault, Reason};
use super::fields::{Field, Kind, LOGS};
use super::scan::{Act, Kind as Part, Read, Statement, Statements};
use super::watch::{Watch, go_on};
use super::wire::{LARGEST, put_bytes, put_number, put_whole};

/// The number of a field, which no file can have, that keeps text that nobody knows.
pub(super) const UNKNOWN: u64 = LARGEST + 1;
/// The key of the measure that a point refers to.
pub(super) const REFERENCE: &str = "Reference";

/// The unit of what text gives no unit.
const PIXELS: &str = "pixels";

/// Reads the points of a network in text, and what stands around them: the same text without its points, on the same lines.
///
/// # Errors
/// What is wrong, in which point, on which line; `watch` has said so, or there is no memory.
pub fn read_text(file: &[u8], watch: Watch<'_>) -> Result<(Points<'static>, String), Fault> {
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
            go_on(watch, number).map_err(|stopped| stopped.on_line(statement.line))?;
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
            Act::Begin(_) if statement.begins(Part::Group, "ControlMeasure") => {
                if read_measure(statements, statement.line, &mut all.measures)? {
                    let index = (all.measures.rows - first - 1) as i32;
                    if reference.replace(index).is_some() {
                        return Err(Reason::Twice(REFERENCE).on_line(statement.line));
                    }
                }
            }
            Act::Begin(kind) => keep_group(statements, &statement, kind, &mut all.points)?,
            Act::Give => give(&statement, &mut all.points)?,
        }
    }
    if let Some(index) = reference {
        set(&mut all.points, "ReferenceIndex", Cell::Index(index)).map_err(|reason| reason.on_line(begun))?;
    }
    all.end_point().map_err(|reason| reason.on_line(begun))
}

/// Reads a measure, and says whether it is the one that its point refers to.
fn read_measure(statements: &mut Statements<'_>, begun: usize, table: &mut Table<'_>) -> Result<bool, Fault> {
    let mut is_reference = false;
    loop {
        let statement = next(statements, begun)?;
        match statement.act() {
            Act::End(Part::Group) => break,
            Act::End(_) | Act::Stop => return Err(statement.fault()),
            Act::Begin(kind) => keep_group(statements, &statement, kind, table)?,
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

/// Keeps a group that nobody knows, up to its end.
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
            Act::Begin(kind) => open.push(kind),
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

/// Gives a key its value.
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

/// Puts a value into its column, or keeps it where it has none.
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
    // What is said to be absent is no value, but was said.
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

/// A number; NaN where there is said to be none.
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
