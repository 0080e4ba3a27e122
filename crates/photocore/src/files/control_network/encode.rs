//! Columns as messages.

use super::columns::{Column, Points, Table};
use super::fault::{Fault, Reason};
use super::fields::MEASURE;
use super::watch::{Watch, go_on};
use super::wire::{LARGEST, Message, Packed, put_bytes, put_number, put_whole};
use crate::sorting;

/// Writes points as messages of version 5, each behind its length.
///
/// Fields stand in the order of their numbers, those that were kept between them.
///
/// # Errors
/// Columns do not agree, something was kept that only text can hold, a message is longer than its length can say.
pub fn encoded(all: &Points<'_>, watch: Watch<'_>) -> Result<Vec<u8>, Fault> {
    all.check().map_err(Reason::of_columns)?;
    let (orders, mut to, mut own) = ((order(&all.points), order(&all.measures)), vec![], vec![]);
    for point in 0..all.points.rows {
        let fault = |reason: Reason| reason.of_columns().in_point(point);
        go_on(watch, point).map_err(fault)?;
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

/// The columns in the order of their fields' numbers.
fn order(table: &Table<'_>) -> Vec<usize> {
    sorting::order(table.fields.len(), &|a, b| table.fields[a].number.cmp(&table.fields[b].number))
}

type Inside<'a> = &'a mut dyn FnMut(&mut Vec<u8>) -> Result<(), Reason>;

/// Writes the fields of a row: `measures` are those between the ones of lower and of higher numbers.
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
        // What was kept because it said that there is none goes where there now is one.
        let slot = table.slot_of_number(packet.number);
        if !slot.is_some_and(|slot| table.columns[slot].has(row)) {
            to.extend_from_slice(packet.raw);
        }
    }
    slots.for_each(|slot| write_field(table, slot, row, to));
    inside.take().map_or(Ok(()), |write| write(to))
}

/// The first line of what was kept of text.
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
