//! Scanner of text: statements of a key and a value, which may extend over several lines.

use std::borrow::Cow;
use std::ops::Range;

use super::fault::{Fault, Reason};

/// Number of characters of a line in an error.
const SHOWN: usize = 60;

/// Statement: one line, or several lines of a continued value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Statement<'a> {
    /// Number of the first line, from 1.
    pub line: usize,
    /// Text of the statement.
    pub text: &'a str,
    /// Key, or the word that ends a group.
    pub key: &'a str,
    /// Text after the equals sign.
    pub value: &'a str,
}

/// Iterator over the statements of a text, without comments.
#[derive(Debug, Clone)]
pub struct Statements<'a> {
    text: &'a str,
    at: usize,
    line: usize,
}

/// Open quotes and lists at the end of a line.
#[derive(Debug, Default)]
struct OpenMessage {
    quote: Option<u8>,
    lists: usize,
    hyphen: bool,
}

impl OpenMessage {
    /// Scans a line; returns whether the statement ends with it.
    fn ends_with(&mut self, line: &[u8]) -> bool {
        let mut before = b' ';
        for &byte in line {
            match (self.quote, byte) {
                (Some(quote), _) if byte == quote => self.quote = None,
                (Some(_), _) => {}
                (None, b'#') if before.is_ascii_whitespace() => break,
                (None, b'"' | b'\'') if before.is_ascii_whitespace() || b"=(,{".contains(&before) => {
                    self.quote = Some(byte);
                }
                (None, b'(' | b'{') => self.lists += 1,
                (None, b')' | b'}') => self.lists = self.lists.saturating_sub(1),
                _ => {}
            }
            before = byte;
        }
        self.hyphen = self.quote.is_none() && before == b'-';
        self.quote.is_none() && self.lists == 0 && !self.hyphen
    }
}

impl<'a> Statements<'a> {
    /// Creates an iterator over a text.
    pub fn new(text: &'a str) -> Self {
        Self { text, at: 0, line: 0 }
    }

    /// Returns the range of the next line.
    fn next_line(&mut self) -> Option<Range<usize>> {
        let start = self.at;
        let rest = self.text.get(start..).filter(|rest| !rest.is_empty())?;
        let length = rest.find('\n').unwrap_or(rest.len());
        self.at = (start + length + 1).min(self.text.len());
        self.line += 1;
        Some(start..start + length)
    }

    fn skip_comment(&mut self, mut line: Range<usize>) -> Result<(), Fault> {
        let start = self.line;
        while !self.text[line].trim_end().ends_with("*/") {
            line = self.next_line().ok_or_else(|| Reason::Ends("a comment").on_line(start))?;
        }
        Ok(())
    }

    fn statement(&mut self, first: Range<usize>) -> Result<Statement<'a>, Fault> {
        let (line, start) = (self.line, first.start);
        let (mut open, mut last) = (OpenMessage::default(), first);
        while !open.ends_with(self.text[last.clone()].trim_end().as_bytes()) {
            last = self.next_line().ok_or_else(|| Reason::Ends("a value").on_line(line))?;
        }
        let text = self.text[start..last.end].trim();
        let (key, value) = text.split_once('=').map_or((text, ""), |(key, value)| (key.trim(), value.trim()));
        Ok(Statement { line, text, key, value })
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Result<Statement<'a>, Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let line = self.next_line()?;
            let trimmed = self.text[line.clone()].trim();
            if trimmed.starts_with("/*") {
                if let Err(fault) = self.skip_comment(line) {
                    return Some(Err(fault));
                }
            } else if !trimmed.is_empty() && !trimmed.starts_with('#') {
                return Some(self.statement(line));
            }
        }
    }
}

/// Type of a block with an end statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Block `Object` .. `End_Object`.
    Object,
    /// Block `Group` .. `End_Group`.
    Group,
}

/// Effect of a statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// Begin of a group or object.
    Restart(Kind),
    /// End of a group or object.
    End(Kind),
    /// End of the text.
    Stop,
    /// Assignment of a value to a key.
    Give,
}

/// Value in text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Read<'a> {
    /// Text, or the content of a parenthesized list.
    pub text: Cow<'a, str>,
    /// Unit.
    pub unit: Option<Cow<'a, str>>,
}

impl<'a> Statement<'a> {
    /// Returns the effect of the statement.
    pub fn act(&self) -> Act {
        let is = |words: &[&str]| words.iter().any(|word| self.key.eq_ignore_ascii_case(word));
        // Few keys begin with these letters.
        match self.key.as_bytes().first().map(u8::to_ascii_lowercase) {
            Some(b'o' | b'b') if is(&["Object", "Begin_Object"]) => Act::Restart(Kind::Object),
            Some(b'g' | b'b') if is(&["Group", "Begin_Group"]) => Act::Restart(Kind::Group),
            Some(b'e') if is(&["End_Object", "EndObject"]) => Act::End(Kind::Object),
            Some(b'e') if is(&["End_Group", "EndGroup"]) => Act::End(Kind::Group),
            Some(b'e') if self.value.is_empty() && is(&["End"]) => Act::Stop,
            _ => Act::Give,
        }
    }

    /// Returns whether the statement begins a block of this kind and name.
    pub fn begins(&self, kind: Kind, name: &str) -> bool {
        self.act() == Act::Restart(kind) && self.value.eq_ignore_ascii_case(name)
    }

    /// Returns the fault of a statement with a syntax error.
    pub fn fault(&self) -> Fault {
        Reason::Line(self.text.chars().take(SHOWN).collect()).on_line(self.line)
    }

    /// Returns the value without quotation marks, with continued lines joined.
    pub fn read(&self) -> Result<Read<'a>, Fault> {
        let is_word = !self.value.starts_with(['"', '\'', '(', '{']);
        let read = match self.value.contains('\n') && is_word {
            true => parts(&put_together(self.value, "-", "")).map(|(text, unit)| Read {
                text: text.to_owned().into(),
                unit: unit.map(|unit| unit.to_owned().into()),
            }),
            false => parts(self.value)
                .map(|(text, unit)| Read { text: unfolded(text), unit: unit.map(Cow::Borrowed) }),
        };
        read.filter(|_| !self.key.is_empty()).ok_or_else(|| self.fault())
    }
}

/// Returns a value without quotation marks or parentheses, and its unit; None if other text follows.
fn parts(value: &str) -> Option<(&str, Option<&str>)> {
    let (text, rest) = match value.as_bytes().first()? {
        quote @ (b'"' | b'\'') => value[1..].split_once(char::from(*quote))?,
        b'(' => value[1..].split_once(')')?,
        b'{' => value[1..].split_once('}')?,
        b'<' => return None,
        _ => value.split_at(value.find(|c: char| c.is_whitespace() || c == '<').unwrap_or(value.len())),
    };
    let rest = rest.trim();
    let (unit, behind) = match rest.strip_prefix('<') {
        Some(rest) => rest.split_once('>').map(|(unit, behind)| (Some(unit.trim()), behind.trim()))?,
        None => (None, rest),
    };
    (behind.is_empty() || behind.starts_with('#')).then_some((text, unit))
}

/// Joins the lines of a quoted text: without hyphen after a hyphen, with a space otherwise.
fn unfolded(text: &str) -> Cow<'_, str> {
    match text.contains('\n') {
        true => put_together(&put_together(text, "-", ""), "", " ").into(),
        false => text.into(),
    }
}

/// Joins lines that end with `mark`, which `between` replaces.
fn put_together(text: &str, mark: &str, between: &str) -> String {
    let mut lines = text.split('\n').map(|line| line.trim_end_matches('\r')).peekable();
    let (mut all, mut joined) = (String::new(), false);
    while let Some(line) = lines.next() {
        let line = if joined { line.trim_start() } else { line };
        let ended = lines.peek().and_then(|_| line.trim_end().strip_suffix(mark));
        all.push_str(ended.unwrap_or(line));
        joined = ended.is_some();
        all.push_str(match (joined, lines.peek()) {
            (true, _) => between,
            (false, Some(_)) => "\n",
            (false, None) => "",
        });
    }
    all
}
