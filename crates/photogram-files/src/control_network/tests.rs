use std::ops::ControlFlow;

use proptest::collection::vec;
use proptest::prelude::*;

use super::messages::{Message, put_bytes, put_number, put_varint, put_whole};
use super::{Fault, Framing, Header, Place, Points, Reason, decoded, encoded, read_text, text};
use photocore::{Context, Stopped, Threads};

fn on_a_thread<T>(work: impl FnOnce(&mut Context<'_>) -> T) -> T {
    work(&mut Context::new(&Threads::new(1).unwrap()))
}

fn read(file: &[u8]) -> Result<Points<'static>, Fault> {
    on_a_thread(|context| decoded(file, 0..file.len(), Framing::Lengths, context))
}

/// Returns a length-prefixed point: two measures, a false flag, an unknown field.
fn point(name: &str) -> Vec<u8> {
    let mut own = vec![];
    put_bytes(1, name.as_bytes(), &mut own);
    put_whole(2, 3, &mut own);
    put_whole(6, 0, &mut own);
    put_whole(8, 1, &mut own);
    put_number(16, 1.5, &mut own);
    put_bytes(19, &[0; 48], &mut own);
    for serial in ["A", "B"] {
        let mut measure = vec![];
        put_bytes(1, serial.as_bytes(), &mut measure);
        put_whole(2, 2, &mut measure);
        put_number(3, 2.5, &mut measure);
        put_bytes(7, b"chooser", &mut measure);
        put_whole(300, 1 << 40, &mut measure);
        put_bytes(25, &measure, &mut own);
    }
    put_bytes(90, b"unknown", &mut own);
    [&(own.len() as u32).to_le_bytes()[..], &own].concat()
}

#[test]
fn messages_come_back_byte_for_byte() {
    let file = [point("P"), point("Q")].concat();
    let all = read(&file).unwrap();
    assert_eq!((all.points.rows, all.measures.rows, &*all.firsts), (2, 4, &[0, 2, 4][..]));
    assert_eq!(on_a_thread(|context| encoded(&all, context)).unwrap(), file);
}

#[test]
fn a_fault_names_its_point_and_byte() {
    let (mut file, start) = ([point("P"), point("Q")].concat(), point("P").len() + 4);
    file[start + 3] = 2 << 3 | 2;
    let fault = read(&file).unwrap_err();
    assert_eq!((fault.point, fault.place), (Some(2), Place::Byte(start + 3)));
}

#[test]
fn whoever_watches_may_end_the_work() {
    let stopped = |fault: Fault| assert_eq!(fault.reason, Reason::Stopped(Stopped::Interrupted));
    let (threads, mut end) = (Threads::new(1).unwrap(), |_| ControlFlow::Break(()));
    let mut context = Context::with_progress(&threads, &mut end);
    let (file, all) = (point("P"), read(&point("P")).unwrap());
    stopped(decoded(&file, 0..file.len(), Framing::Lengths, &mut context).unwrap_err());
    stopped(encoded(&all, &mut context).unwrap_err());
    stopped(read_text(b"Object = ControlPoint", &mut context).unwrap_err());
    stopped(text(&all, &mut context).unwrap_err());
}

proptest! {
    #[test]
    fn whole_numbers_come_back(value: u64) {
        let mut bytes = vec![];
        put_varint(value, &mut bytes);
        let mut message = Message::new(&bytes, 0);
        prop_assert_eq!(message.varint(), Some(Ok(value)));
        prop_assert_eq!(message.varint(), None);
    }

    #[test]
    fn damaged_messages_are_read_or_refused(changes in vec((any::<usize>(), any::<u8>()), 1..5), cut: usize) {
        let mut file = [point("P"), point("Q")].concat();
        for (at, byte) in changes {
            let at = at % file.len();
            file[at] = byte;
        }
        file.truncate(file.len() - cut % 3 * (cut % file.len()) / 2);
        if let Ok(all) = read(&file) {
            let again = on_a_thread(|context| encoded(&all, context)).map(|written| read(&written));
            prop_assert!(again.is_ok_and(|again| again.is_ok_and(|again| again.measures.rows == all.measures.rows)));
            let _ = on_a_thread(|context| text(&all, context));
        }
        let _ = Header::decoded(&file, 4..file.len());
    }

    #[test]
    fn damaged_text_is_read_or_refused(changes in vec((any::<usize>(), 9_u8..126), 0..5)) {
        let mut file = b"Object = ControlPoint\nPointId = P\nPointType = Free\nColour = (a,\n'b') # c\n\
            Group = ControlMeasure\nSerialNumber = \"S\"\nMeasureType = Manual\nSample = 1.5 <pixels>\n\
            End_Group\nGroup = More\nA = -\nB\nEnd_Group\nEnd_Object\n".to_vec();
        for (at, byte) in changes {
            let at = at % file.len();
            file[at] = byte;
        }
        if let Ok((all, _)) = on_a_thread(|context| read_text(&file, context)) {
            let written = on_a_thread(|context| text(&all, context));
            let again = |text: String| on_a_thread(|context| read_text(text.as_bytes(), context).is_ok());
            prop_assert!(written.map_or(true, again));
        }
    }
}
