//! Columns of large tables with regular lines. Irregular tables are left to the line reader, which also reports errors.

use std::hash::{BuildHasher, RandomState};
use std::ops::Range;

use hashbrown::HashTable;
use rayon::prelude::*;

/// Maximum length of a line in bytes.
const LONGEST_LINE: usize = 100_000;
/// Maximum length of a number in bytes.
const LONGEST_NUMBER: usize = 1_000;

/// Size in bytes of the parts of a piece, which are read in parallel.
const PART: usize = 1 << 18;

/// Table of text, read piece by piece.
#[derive(Debug)]
pub struct Table {
    delimiter: u8,
    columns: Vec<Column>,
    state: ParserState,
}

/// Column of a table.
#[derive(Debug)]
pub enum Column {
    /// Numbers; NaN for an empty cell.
    Numbers(Vec<f64>),
    /// Names.
    Names(Names),
}

/// Conditions that previous lines impose on the next ones.
#[derive(Debug, Default)]
struct ParserState {
    /// Decimal mark of all numbers, set by the first number with a mark.
    mark: Option<u8>,
    /// Whether a blank line was read: no line may follow.
    ended: bool,
}

/// Cells of some lines.
struct TextPart {
    columns: Vec<Cells>,
    state: ParserState,
    /// Number of lines that are not blank.
    lines: usize,
}

enum Cells {
    Numbers(Vec<f64>),
    /// Byte ranges of the names in the piece, and their hashes.
    Names(Vec<(Range<usize>, u64)>),
}

impl Table {
    /// Creates an empty table; `numeric` is true for columns of numbers.
    pub fn new(delimiter: u8, numeric: &[bool]) -> Self {
        let column = |&numeric: &bool| {
            if numeric { Column::Numbers(vec![]) } else { Column::Names(Names::default()) }
        };
        Self { delimiter, columns: numeric.iter().map(column).collect(), state: ParserState::default() }
    }

    /// Returns the columns.
    pub fn columns(self) -> Vec<Column> {
        self.columns
    }

    /// Appends whole lines, on the threads of the current pool. Returns `None` for an irregular line; the table is then unusable.
    pub fn add(&mut self, piece: &[u8]) -> Option<()> {
        let parts: Vec<TextPart> =
            parts_of(piece).into_par_iter().map(|lines| self.part(piece, lines)).collect::<Option<_>>()?;
        for part in &parts {
            self.state.follow(part)?;
        }
        self.columns.par_iter_mut().enumerate().try_for_each(|(k, column)| {
            let mut cells = parts.iter().map(|part| &part.columns[k]);
            cells.try_for_each(|cells| column.extend(piece, cells))
        })
    }

    /// Reads whole lines of a piece.
    fn part(&self, piece: &[u8], lines: Range<usize>) -> Option<TextPart> {
        let columns = self.columns.iter().map(Column::cells).collect();
        let mut part = TextPart { columns, state: ParserState::default(), lines: 0 };
        let (mut at, text) = (lines.start, &piece[..lines.end]);
        while at < text.len() {
            let first = after_blanks(text, at, b'\n');
            if let Some(next) = after_line_end(text, first) {
                (part.state.ended, at) = (true, next);
                continue;
            }
            if part.state.ended || text[first] == b'#' {
                return None;
            }
            let next = self.line(text, at, &mut part)?;
            if next - at > LONGEST_LINE {
                return None;
            }
            (part.lines, at) = (part.lines + 1, next);
        }
        Some(part)
    }

    /// Appends a line to a part; returns the start of the next line.
    fn line(&self, piece: &[u8], mut at: usize, part: &mut TextPart) -> Option<usize> {
        for (k, (column, cells)) in self.columns.iter().zip(&mut part.columns).enumerate() {
            if k > 0 {
                if piece.get(at) != Some(&self.delimiter) {
                    return None;
                }
                at += 1;
            }
            let (cell, end) = self.cell(piece, at)?;
            at = end;
            match (column, cells) {
                (Column::Names(names), Cells::Names(cells)) => {
                    let hash = names.hashes.hash_one(&piece[cell.clone()]);
                    cells.push((cell, hash));
                }
                (_, Cells::Numbers(numbers)) => {
                    numbers.push(number(&piece[cell], self.delimiter, &mut part.state.mark)?)
                }
                (Column::Numbers(_), Cells::Names(_)) => return None,
            }
        }
        if piece.get(at) == Some(&self.delimiter) {
            // A delimiter at the end of the line.
            at = after_blanks(piece, at + 1, self.delimiter);
        }
        after_line_end(piece, at)
    }

    /// Returns the content of a cell without quotation marks and outer blanks, and the position of the delimiter or line end after it.
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

impl Column {
    fn cells(&self) -> Cells {
        match self {
            Self::Numbers(_) => Cells::Numbers(vec![]),
            Self::Names(_) => Cells::Names(vec![]),
        }
    }

    fn extend(&mut self, piece: &[u8], cells: &Cells) -> Option<()> {
        match (self, cells) {
            (Self::Numbers(column), Cells::Numbers(numbers)) => column.extend_from_slice(numbers),
            (Self::Names(column), Cells::Names(names)) => column.extend(piece, names)?,
            _ => return None,
        }
        Some(())
    }
}

impl ParserState {
    /// Appends the state of a part; `None` if its lines may not follow.
    fn follow(&mut self, part: &TextPart) -> Option<()> {
        let marks = self.mark.is_none() || part.state.mark.is_none() || self.mark == part.state.mark;
        if !marks || (self.ended && part.lines > 0) {
            return None;
        }
        self.mark = self.mark.or(part.state.mark);
        self.ended |= part.state.ended;
        Some(())
    }
}

/// Divides a piece into parts of whole lines.
fn parts_of(piece: &[u8]) -> Vec<Range<usize>> {
    let (mut parts, mut start) = (vec![], 0);
    while start < piece.len() {
        let near = (start + PART).min(piece.len());
        let end =
            piece[near..].iter().position(|&byte| byte == b'\n').map_or(piece.len(), |at| near + at + 1);
        parts.push(start..end);
        start = end;
    }
    parts
}

fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}

/// Returns the position of the first byte at or after `at` that is the delimiter or not a blank.
fn after_blanks(piece: &[u8], at: usize, delimiter: u8) -> usize {
    let blanks = piece[at..].iter().take_while(|&&byte| is_blank(byte) && byte != delimiter);
    at + blanks.count()
}

/// Returns the range without trailing blanks.
fn without_blanks(piece: &[u8], range: Range<usize>) -> Range<usize> {
    let blanks = piece[range.clone()].iter().rev().take_while(|&&byte| is_blank(byte));
    range.start..range.end - blanks.count()
}

/// Returns the position after a line end; `None` if the position is not at a line end.
fn after_line_end(piece: &[u8], at: usize) -> Option<usize> {
    match &piece[at..] {
        [] | [b'\r'] => Some(piece.len()),
        [b'\n', ..] => Some(at + 1),
        [b'\r', b'\n', ..] => Some(at + 2),
        _ => None,
    }
}

/// Parses a number; NaN for an empty cell.
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

/// Column of names: distinct names in the order of first use, and the index of each row.
#[derive(Debug, Default)]
pub struct Names {
    /// Index of the name of each row.
    pub rows: Vec<i64>,
    /// Distinct names, each followed by a line feed.
    pub text: Vec<u8>,
    starts: Vec<usize>,
    /// Indices of the names, by hash.
    numbers: HashTable<u32>,
    hashes: RandomState,
    /// Whether names contain lower-case or upper-case letters.
    lower: bool,
    upper: bool,
    /// Whether a name is empty, "nan", not ASCII, or contains a blank.
    doubtful: bool,
}

impl Names {
    /// Returns whether all names are proper names that remain distinct without blanks and case.
    pub fn are_distinct(&self) -> bool {
        let mixed = self.lower && self.upper;
        !self.doubtful && !mixed
    }

    fn extend(&mut self, piece: &[u8], cells: &[(Range<usize>, u64)]) -> Option<()> {
        self.rows.reserve(cells.len());
        for (cell, hash) in cells {
            let row = self.number(&piece[cell.clone()], *hash)?;
            self.rows.push(row);
        }
        Some(())
    }

    fn number(&mut self, name: &[u8], hash: u64) -> Option<i64> {
        let found = self.numbers.find(hash, |&number| name_at(&self.text, &self.starts, number) == name);
        if let Some(&number) = found {
            return Some(i64::from(number));
        }
        self.check(name)?;
        let number = u32::try_from(self.starts.len()).ok()?;
        self.starts.push(self.text.len());
        self.text.extend_from_slice(name);
        self.text.push(b'\n');
        let (text, starts, hashes) = (&self.text, &self.starts, &self.hashes);
        self.numbers.insert_unique(hash, number, |&other| hashes.hash_one(name_at(text, starts, other)));
        Some(i64::from(number))
    }

    /// Records the character classes of a new name; `None` for a control character.
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

/// Returns the name with an index, without its line feed.
fn name_at<'a>(text: &'a [u8], starts: &[usize], number: u32) -> &'a [u8] {
    let next = starts.get(number as usize + 1).copied().unwrap_or(text.len());
    &text[starts[number as usize]..next - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers, or names by row, of a column.
    #[derive(Debug, PartialEq)]
    enum Read {
        Numbers(Vec<f64>),
        Names(Vec<String>, bool),
    }

    fn read(pieces: &[&str], numeric: &[bool]) -> Option<Vec<Read>> {
        let mut table = Table::new(b',', numeric);
        for piece in pieces {
            table.add(piece.as_bytes())?;
        }
        let columns = table.columns().into_iter().map(|column| match column {
            Column::Numbers(numbers) => Read::Numbers(numbers),
            Column::Names(names) => {
                let text = String::from_utf8_lossy(&names.text).into_owned();
                let all: Vec<&str> = text.lines().collect();
                let rows = names.rows.iter().map(|&row| all[row as usize].to_owned()).collect();
                Read::Names(rows, names.are_distinct())
            }
        });
        Some(columns.collect())
    }

    fn names(names: &[&str], distinct: bool) -> Read {
        Read::Names(names.iter().map(|&name| name.to_owned()).collect(), distinct)
    }

    #[test]
    fn cells_have_quotes_blanks_and_line_ends() {
        let expected = || Some(vec![names(&["a b", "2", "a b"], false), Read::Numbers(vec![1.5, -2e3, 7.0])]);
        let numeric = [false, true];
        assert_eq!(read(&["a b,1.5\n2,-2e3\na b,7\n"], &numeric), expected());
        assert_eq!(read(&["a b,1.5\r\n2,-2e3\r\na b,7"], &numeric), expected());
        assert_eq!(
            read(&["\"a b\" , 1.5,\n", " 2 ,\t\"-2e3\"\n a b, 7\r\n", "\n  \n"], &numeric),
            expected()
        );
    }

    #[test]
    fn an_empty_number_is_nan() {
        let columns = read(&["p,,2\n"], &[false, true, true]);
        assert!(matches!(&columns.unwrap()[1], Read::Numbers(x) if x.len() == 1 && x[0].is_nan()));
    }

    #[test]
    fn irregular_lines_are_rejected() {
        let lines = [
            "p\n",
            "p,1,2\n",
            "p,x\n",
            "p,inf\n",
            "p,1_0\n",
            "# p,1\n",
            "\n p,1\n",
            "\"p,1\n",
            "p\"q,1\n",
            "\"a\"b,1\n",
            "\x01,1\n",
        ];
        for line in lines {
            assert_eq!(read(&["a,1\n", line], &[false, true]), None, "{line:?}");
            assert_eq!(read(&[&format!("a,1\n{line}")], &[false, true]), None, "{line:?}");
        }
        let long = format!("{},1\n", "x".repeat(LONGEST_LINE));
        assert_eq!(read(&[&long], &[false, true]), None);
    }

    #[test]
    fn a_table_has_one_decimal_mark() {
        let read = |pieces: &[&str]| {
            let mut table = Table::new(b';', &[true, true]);
            pieces.iter().try_for_each(|piece| table.add(piece.as_bytes()))?;
            match &table.columns()[1] {
                Column::Numbers(numbers) => Some(numbers.clone()),
                Column::Names(_) => None,
            }
        };
        assert_eq!(read(&["1;2,5\n", "3;4,5\n"]), Some(vec![2.5, 4.5]));
        assert_eq!(read(&["1;2,5\n", "3;4.5\n"]), None);
        assert_eq!(read(&["1;2,5\n3;4.5\n"]), None);
    }

    #[test]
    fn names_of_one_spelling_are_distinct() {
        for (text, distinct) in [("a\nb\n", true), ("a\nB\n", false), ("7\nnan\n", false), ("ä\n", false)] {
            let columns = read(&[text], &[false]).unwrap();
            assert!(matches!(columns[0], Read::Names(_, same) if same == distinct), "{text:?}");
        }
    }

    /// Parallel parts give the columns and the errors of a single part.
    #[test]
    fn parts_are_joined_in_order() {
        let line = |k: usize| format!("DJI_{:05},{},{}.25,{}\n", k / 100, k % 7919, k, k as f64 / 3.0);
        let rows = 40_000;
        let text: String = (0..rows).map(line).collect();
        assert!(parts_of(text.as_bytes()).len() > 3);
        let numeric = [false, false, true, true];
        let columns = |threads: usize, pieces: &[&str]| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| read(pieces, &numeric))
        };
        let one = columns(1, &[&text]).unwrap();
        let half = text.len() / 2 + text[text.len() / 2..].find('\n').unwrap() + 1;
        assert_eq!(columns(3, &[&text]).unwrap(), one);
        assert_eq!(columns(2, &[&text[..half], &text[half..]]).unwrap(), one);
        assert!(matches!(&one[0], Read::Names(names, _) if names[rows - 1] == "DJI_00399"));
        assert!(matches!(&one[2], Read::Numbers(x) if x.len() == rows && x[123] == 123.25));
        assert_eq!(columns(2, &[&format!("{text}\n{text}")]), None);
        assert_eq!(columns(2, &[&format!("{text}1,2,\"3,5\",4\n")]), None);
    }
}
