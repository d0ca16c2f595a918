//! Plain lines are read on all cores, anything with a quotation mark by the `csv` crate: both read the same.

use super::*;
use crate::ingest::formats::table::{Table, collect};
use crate::math::random::Stream;
use std::fmt::Write as _;

fn read(text: &str) -> Result<Table> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    let Opened::Table(source) = (FORMAT.open)(Input::open(file.path())?)? else { panic!("text is one table") };
    let wanted = vec![true; source.heads().len()];
    collect(source, &wanted)
}

/// The same rows read as plain lines, and by the `csv` crate from the comment with the quotation mark on.
fn both(header: &str, rows: &str) -> [Result<Table>; 2] {
    ["# plain", "# \"quoted\""].map(|comment| {
        read(&format!("{header}\n{comment}\n{rows}")).map_err(|mut e| {
            // each has a file of its own
            e.input = String::new();
            e
        })
    })
}

#[track_caller]
fn assert_same(plain: &Table, quoted: &Table) {
    assert_eq!((plain.rows, plain.first_line, &plain.notes), (quoted.rows, quoted.first_line, &quoted.notes));
    for (name, (a, b)) in plain.heads.iter().map(|h| &h.name).zip(plain.cells.iter().zip(&quoted.cells)) {
        assert_eq!((a.origin, a.resolution), (b.origin, b.resolution), "{name}");
        let bad =
            |c: &crate::ingest::formats::table::Cells| c.bad.as_ref().map(|(b, count)| (b.row, b.text.clone(), *count));
        assert_eq!(bad(a), bad(b), "{name}");
        assert_eq!(a.values.len(), b.values.len(), "{name}");
        let differ = (0..a.values.len()).find(|&i| a.values[i].to_bits() != b.values[i].to_bits());
        assert_eq!(differ, None, "{name}");
    }
}

/// Two blocks and a half of what recorders write: Unix times, rates, counts, a column with gaps and words.
fn long(line_end: &str) -> String {
    let mut draw = Stream::new(5, 0);
    let mut out = String::new();
    let mut row = 0;
    while out.len() < 10 << 20 {
        let odd = draw.uniform();
        if odd < 1e-4 {
            let _ = write!(out, "# restarted{line_end}");
        } else if odd < 2e-4 {
            out += line_end;
        }
        let rate = 1e-3 * draw.normal();
        let gap = match draw.uniform() {
            u if u < 0.3 => "nan".into(),
            u if u < 0.4 => String::new(),
            u if u < 0.4001 => "ERR".into(),
            u => format!(" {u:.3} "),
        };
        let _ = write!(out, "{}.{:06},{rate},{rate:e},{row},{gap}", 1_700_000_000 + row / 100, row % 100 * 10_000);
        out += if odd > 0.9 && row > 300 { "," } else { "" };
        out += line_end;
        row += 1;
    }
    out
}

#[test]
fn long_logs_are_read_alike_on_all_cores_and_by_one() {
    for line_end in ["\n", "\r\n"] {
        let [plain, quoted] = both("t_s,gz_rad_s,gy,n,extra", &long(line_end));
        let (plain, quoted) = (plain.unwrap(), quoted.unwrap());
        assert!(plain.rows > 80_000 && plain.cells[0].origin == 1_700_000_000);
        assert_same(&plain, &quoted);
    }
}

#[test]
fn a_column_that_begins_late_and_large_counts_from_its_first_value() {
    let mut rows = "0.5,\n".repeat(80_000);
    (0..80_000).for_each(|i| rows += &format!("0.5,{}\n", 1_700_000_000_000_000_001_i64 + 7 * i));
    let [plain, quoted] = both("gz,stamp_ns", &rows);
    let (plain, quoted) = (plain.unwrap(), quoted.unwrap());
    assert_eq!(plain.cells[1].values[159_999], 7.0 * 79_999.0);
    assert_same(&plain, &quoted);
}

#[test]
fn rows_that_differ_and_ends_that_are_cut_off_are_told_alike() {
    let long = "1.5,2\n".repeat(120_000);
    for end in
        ["", "3", "3,", "3,4", "3,4,", "3\n", "3,4,5\n", "3,4,5", "\n\n", "  \n", "\n3,4\n", "x,4\n", "3,4\r\n", "-"]
    {
        for rows in [format!("1,2\n{end}"), format!("{long}{end}")] {
            match both("a,b", &rows) {
                [Ok(plain), Ok(quoted)] => assert_same(&plain, &quoted),
                [Err(plain), Err(quoted)] => assert_eq!(plain, quoted),
                [plain, quoted] => panic!("{end:?}: {:?} and {:?}", plain.map(|t| t.rows), quoted.map(|t| t.rows)),
            }
        }
    }
}

#[test]
fn a_last_row_that_may_lack_the_end_of_its_last_value_is_told() {
    for (rows, told) in [
        ("0,0.25\n1,0.25\n2,0.25", false),
        ("0,0.25\n1,0.25\n2,0.2", true),
        ("0,0.25\r\n1,0.25\r\n2,0.25", false),
        ("0,0.25\r\n1,0.25\r\n2,0.2", true),
        ("0,0.25\n1,0.25\n2,0.2\n", false),
        // shorter than the header alone
        ("0,0.25", false),
    ] {
        let [plain, quoted] = both("t_s,gyro_z_rad_s", rows).map(Result::unwrap);
        assert_eq!(plain.notes.iter().any(|n| n.contains("may be cut off")), told, "{rows:?}: {:?}", plain.notes);
        assert_same(&plain, &quoted);
    }
}

#[test]
fn quotation_marks_and_lone_returns_may_come_at_any_row() {
    let many = "1.5,2\n".repeat(900_000);
    let table = read(&format!("a,b\n{many}\"3\",\"4\"\n5,6\n")).unwrap();
    assert_eq!(table.rows, 900_002);
    assert_eq!(table.cells[1].values[900_000..], [4.0, 6.0]);
    assert_eq!(read("a,b\n1,2\r3,4\n5,6\n").unwrap().cells[0].values, [1.0, 3.0, 5.0]);
}
