//! Columns of a large table whose lines are all regular. The reader of single lines reads all other tables and names their faults.

use std::hash::{BuildHasher, RandomState};
use std::ops::Range;

/// Bytes of a line at most.
const LONGEST_LINE: usize = 100_000;
/// Bytes of a number at most.
const LONGEST_NUMBER: usize = 1_000;

/// A table of text, which grows piece by piece.
#[derive(Debug)]
pub struct Table {
    delimiter: u8,
    /// The decimal mark of all numbers, from the first number that has one.
    mark: Option<u8>,
    columns: Vec<Column>,
    /// Cells in the last piece of the columns of names.
    cells: Vec<Vec<Range<usize>>>,
    /// A blank line was read: no other line may follow.
    ended: bool,
}

/// A column of a table.
#[derive(Debug)]
pub enum Column {
    /// Numbers; NaN for an empty cell.
    Numbers(Vec<f64>),
    /// Names.
    Names(Names),
}

impl Table {
    /// An empty table; `numeric` of a column is whether its cells are numbers.
    pub fn new(delimiter: u8, numeric: &[bool]) -> Self {
        let column = |&numeric: &bool| {
            if numeric { Column::Numbers(vec![]) } else { Column::Names(Names::default()) }
        };
        let columns = numeric.iter().map(column).collect();
        Self { delimiter, mark: None, columns, cells: vec![vec![]; numeric.len()], ended: false }
    }

    /// The columns.
    pub fn columns(self) -> Vec<Column> {
        self.columns
    }

    /// Appends whole lines. The result is `None`, and the table is useless, if a line is irregular.
    pub fn add(&mut self, piece: &[u8]) -> Option<()> {
        self.cells.iter_mut().for_each(Vec::clear);
        let mut at = 0;
        while at < piece.len() {
            let first = after_blanks(piece, at, b'\n');
            if let Some(next) = after_line_end(piece, first) {
                (self.ended, at) = (true, next);
                continue;
            }
            if self.ended || piece[first] == b'#' {
                return None;
            }
            let next = self.line(piece, at)?;
            if next - at > LONGEST_LINE {
                return None;
            }
            at = next;
        }
        for (column, cells) in self.columns.iter_mut().zip(&self.cells) {
            if let Column::Names(names) = column {
                names.extend(piece, cells)?;
            }
        }
        Some(())
    }

    /// Appends a line, and returns where the next one begins.
    fn line(&mut self, piece: &[u8], mut at: usize) -> Option<usize> {
        for k in 0..self.columns.len() {
            if k > 0 {
                if piece.get(at) != Some(&self.delimiter) {
                    return None;
                }
                at += 1;
            }
            let (cell, end) = self.cell(piece, at)?;
            at = end;
            match &mut self.columns[k] {
                Column::Numbers(numbers) => {
                    numbers.push(number(&piece[cell], self.delimiter, &mut self.mark)?)
                }
                Column::Names(_) => self.cells[k].push(cell),
            }
        }
        if piece.get(at) == Some(&self.delimiter) {
            // A delimiter at the end of the line.
            at = after_blanks(piece, at + 1, self.delimiter);
        }
        after_line_end(piece, at)
    }

    /// The content of a cell without quotation marks and outer blanks, and the place of the delimiter or line end behind the cell.
    fn cell(&self, piece: &[u8], at: usize) -> Option<(Range<usize>, usize)> {
        let start = after_blanks(piece, at, self.delimiter);
        if piece.get(start) != Some(&b'"') {
            let ends = |byte: &u8| *byte == self.delimiter || *byte == b'\n' || *byte == b'"';
            let end = piece[start..].iter().position(ends).map_or(piece.len(), |length| start + length);
            let end = match piece.get(end) {
                Some(b'"') => return None,
                Some(b'\n') | None if end > start && piece[end - 1] == b'\r' => end - 1,
                _ => end,
            };
            return Some((without_blanks(piece, start..end), end));
        }
        let inside = &piece[start + 1..];
        let length = inside.iter().position(|byte| matches!(byte, b'"' | b'\n'))?;
        let closing = start + 1 + length;
        let content = after_blanks(piece, start + 1, b'\n').min(closing)..closing;
        (piece[closing] == b'"')
            .then(|| (without_blanks(piece, content), after_blanks(piece, closing + 1, self.delimiter)))
    }
}

fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}

/// The place of the first byte from `at` on that is the delimiter or no blank.
fn after_blanks(piece: &[u8], at: usize, delimiter: u8) -> usize {
    let blanks = piece[at..].iter().take_while(|&&byte| is_blank(byte) && byte != delimiter);
    at + blanks.count()
}

/// The range without blanks at its end.
fn without_blanks(piece: &[u8], range: Range<usize>) -> Range<usize> {
    let blanks = piece[range.clone()].iter().rev().take_while(|&&byte| is_blank(byte));
    range.start..range.end - blanks.count()
}

/// The place after the line end at a place; `None` if there is no line end.
fn after_line_end(piece: &[u8], at: usize) -> Option<usize> {
    match &piece[at..] {
        [] | [b'\r'] => Some(piece.len()),
        [b'\n', ..] => Some(at + 1),
        [b'\r', b'\n', ..] => Some(at + 2),
        _ => None,
    }
}

/// The number in a cell, NaN if the cell is empty.
fn number(cell: &[u8], delimiter: u8, mark: &mut Option<u8>) -> Option<f64> {
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    for &byte in cell {
        match byte {
            b'0'..=b'9' | b'+' | b'-' | b'e' | b'E' => {}
            b'.' | b',' if byte != delimiter && *mark.get_or_insert(byte) == byte => {}
            _ => return None,
        }
    }
    let text = str::from_utf8(cell).ok().filter(|text| text.len() <= LONGEST_NUMBER)?;
    let value: f64 =
        if *mark == Some(b',') { text.replace(',', ".").parse().ok()? } else { text.parse().ok()? };
    value.is_finite().then_some(value)
}

/// A column of names: each name once, in the order of the rows, and the number of the name of each row.
#[derive(Debug, Default)]
pub struct Names {
    /// The number of the name of each row.
    pub rows: Vec<i64>,
    /// The names, each with a line feed behind it.
    pub text: Vec<u8>,
    starts: Vec<usize>,
    /// Places by hash: a power of two of them, of which at most half are filled.
    slots: Vec<Slot>,
    hashes: RandomState,
    /// The names have letters of either case.
    lower: bool,
    upper: bool,
    /// A name is empty, "nan", not ASCII or with a blank inside.
    doubtful: bool,
}

#[derive(Debug, Clone, Copy)]
struct Slot {
    hash: u32,
    /// The number of a name, from 1; 0 if the slot is free.
    number: u32,
}

impl Names {
    /// Whether all names are proper names, no two of which are equal but for blanks and case.
    pub fn are_distinct(&self) -> bool {
        let mixed = self.lower && self.upper;
        !self.doubtful && !mixed
    }

    fn extend(&mut self, piece: &[u8], cells: &[Range<usize>]) -> Option<()> {
        // All hashes first: then the processor waits for the memory of several slots at a time.
        let hashes: Vec<u64> = cells.iter().map(|cell| self.hashes.hash_one(&piece[cell.clone()])).collect();
        self.rows.reserve(cells.len());
        for (cell, hash) in cells.iter().zip(hashes) {
            let row = self.number(&piece[cell.clone()], hash)?;
            self.rows.push(row);
        }
        Some(())
    }

    fn number(&mut self, name: &[u8], hash: u64) -> Option<i64> {
        if 2 * self.starts.len() >= self.slots.len() {
            self.grow();
        }
        let slot = self.slot(name, hash);
        if self.slots[slot].number == 0 {
            self.check(name)?;
            self.starts.push(self.text.len());
            self.text.extend_from_slice(name);
            self.text.push(b'\n');
            self.slots[slot] =
                Slot { hash: (hash >> 32) as u32, number: u32::try_from(self.starts.len()).ok()? };
        }
        Some(i64::from(self.slots[slot].number) - 1)
    }

    /// The slot of a name, or a free one for it.
    fn slot(&self, name: &[u8], hash: u64) -> usize {
        let last = self.slots.len() - 1;
        let mut at = hash as usize & last;
        loop {
            let slot = self.slots[at];
            if slot.number == 0 || (slot.hash == (hash >> 32) as u32 && self.is_name(slot.number, name)) {
                return at;
            }
            at = (at + 1) & last;
        }
    }

    fn is_name(&self, number: u32, name: &[u8]) -> bool {
        let text = &self.text[self.starts[number as usize - 1]..];
        text.get(name.len()) == Some(&b'\n') && text.starts_with(name)
    }

    fn grow(&mut self) {
        let count = (2 * self.slots.len()).max(64);
        self.slots = vec![Slot { hash: 0, number: 0 }; count];
        for (number, name) in (1..).zip(self.text.split(|&byte| byte == b'\n').take(self.starts.len())) {
            let hash = self.hashes.hash_one(name);
            let mut at = hash as usize & (count - 1);
            while self.slots[at].number > 0 {
                at = (at + 1) & (count - 1);
            }
            self.slots[at] = Slot { hash: (hash >> 32) as u32, number };
        }
    }

    /// Notes what a new name has; `None` if it has a control character.
    fn check(&mut self, name: &[u8]) -> Option<()> {
        self.doubtful |= name.is_empty() || name.eq_ignore_ascii_case(b"nan");
        for &byte in name {
            match byte {
                0..b' ' => return None,
                b'a'..=b'z' => self.lower = true,
                b'A'..=b'Z' => self.upper = true,
                b' ' | 128.. => self.doubtful = true,
                _ => {}
            }
        }
        Some(())
    }
}
