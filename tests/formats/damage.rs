//! Files that are cut off or have flipped bits: an error that names the file, or what can be read with a note; never a
//! panic, never more memory than the file can account for.

use super::*;
use crate::cases::cases;
use crate::held;
use gyroid::ingest::{read_log, write_log};
use gyroid::math::random::Stream;

/// More than reading any of the files takes, much less than a length field can claim.
const MOST_BYTES: usize = 48 << 20;

/// Reads `bytes` as the case asks, and checks what must hold of any file.
fn read(case: &Case, bytes: &[u8], what: &str) -> gyroid::Result<GyroRecording> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(case.file);
    std::fs::write(&path, bytes).unwrap();
    let (done, most) = held::most(|| std::panic::catch_unwind(|| read_gyro(&path, &case.query())));
    let name = format!("{} {:?} {what}", case.file, case.topic);
    assert!(most < MOST_BYTES, "{name}: {most} bytes were held");
    let result = done.unwrap_or_else(|_| panic!("{name}: a panic"));
    if let Err(error) = &result {
        let text = error.to_string();
        assert!(text.contains(case.file) && text.lines().count() == 1, "{name}: {text}");
        assert!(error.hint.is_some(), "{name}: no hint: {text}");
    }
    result
}

/// Whether a note tells that something was lost.
fn told(recording: &GyroRecording) -> bool {
    let words = ["cut off", "killed", "no footer", "left out", "no index", "damaged"];
    recording.notes.iter().any(|n| words.iter().any(|w| n.contains(w)))
}

fn distinct() -> impl Iterator<Item = &'static Case> {
    CASES.iter().enumerate().filter(|(i, c)| CASES[..*i].iter().all(|d| d.file != c.file)).map(|(_, c)| c)
}

/// Whether a flight log of `length` bytes ends with a message: then it is a log like any other.
fn between_messages(name: &str, whole: &[u8], length: usize) -> bool {
    let mut at = if name.ends_with("ulg") { 16 } else { 0 };
    while at < length {
        at += match (name, whole[at + 2]) {
            ("px4.ulg", _) => 3 + usize::from(u16::from_le_bytes([whole[at], whole[at + 1]])),
            ("ardupilot.bin", 128) => 89,
            ("ardupilot.bin", 129) => 44,
            ("ardupilot.bin", 130) => 54,
            ("ardupilot.bin", 131) => 32,
            ("ardupilot.bin", 132) => 75,
            ("ardupilot.bin", 133) => 13,
            _ => return false,
        };
    }
    at == length
}

#[test]
fn files_that_are_cut_off_anywhere() {
    const PLACES: usize = 48;
    // a text that ends in the middle of a number cannot be told from one that is shorter
    for case in distinct().filter(|c| c.file != "euroc.csv") {
        let whole = std::fs::read(file(case.file)).unwrap();
        let expected = case.expected();
        let mut read_in_part = 0;
        let near = [1, 2, 7, 9, 13, 17, 31, 64, 100, 127, 128, 129, 200, 512];
        let spread = (1..PLACES).map(|i| i * whole.len() / PLACES);
        let last = [1, 2, 5, 8, 9, 20, 40].map(|n| whole.len() - n);
        for length in near.into_iter().chain(spread).chain(last) {
            let what = format!("cut off after {length} bytes");
            let Ok(recording) = read(case, &whole[..length], &what) else { continue };
            let rates = rates(&recording);
            // what is read is what was written
            assert_eq!(rates, &expected[..rates.len()], "{} {what}", case.file);
            let plain = rates.len() < SAMPLES && !told(&recording);
            assert!(
                !plain || between_messages(case.file, &whole, length),
                "{} {what}: {:?}",
                case.file,
                recording.notes
            );
            read_in_part += usize::from(rates.len() < SAMPLES);
        }
        // where the field's tools save what was recorded, so does this
        let saved = ["bag", "mcap", "ulg", "bin"].iter().any(|e| case.file.ends_with(e));
        assert_eq!(read_in_part > PLACES / 3, saved, "{}: {read_in_part}", case.file);
    }
}

#[test]
fn most_of_a_log_that_is_cut_off_is_read() {
    for (name, least) in [("ros1.bag", 0.85), ("ros2.mcap", 0.85), ("px4.ulg", 0.88), ("ardupilot.bin", 0.88)] {
        let case = distinct().find(|c| c.file == name).unwrap();
        let whole = std::fs::read(file(name)).unwrap();
        let recording = read(case, &whole[..whole.len() * 9 / 10], "cut off at nine tenths").unwrap();
        let share = rates(&recording).len() as f64 / SAMPLES as f64;
        assert!(share > least && told(&recording), "{name}: {share} {:?}", recording.notes);
    }
}

#[test]
fn a_bag_whose_recorder_was_killed_is_read() {
    // the header still says that there is no index
    let mut bag = std::fs::read(file("ros1_lz4.bag")).unwrap();
    let at = bag.windows(10).position(|w| w == b"index_pos=").unwrap() + 10;
    let index = u64::from_le_bytes(bag[at..at + 8].try_into().unwrap()) as usize;
    bag[at..at + 8].fill(0);
    bag.truncate(index - 100);
    let case = distinct().find(|c| c.file == "ros1_lz4.bag").unwrap();
    let recording = read(case, &bag, "killed").unwrap();
    assert_eq!(rates(&recording), case.expected());
    assert!(told(&recording), "{:?}", recording.notes);
}

#[test]
fn flipped_bits_are_errors_or_other_numbers() {
    const TIMES: usize = 150;
    for case in distinct() {
        let whole = std::fs::read(file(case.file)).unwrap();
        // what a checksum covers cannot come back changed
        let checked = ["mcap", "npz", "v5.mat"].iter().any(|e| case.file.ends_with(e));
        let expected = case.expected();
        let mut draw = Stream::new(7, 0);
        let mut errors = 0;
        for _ in 0..TIMES {
            let mut bytes = whole.clone();
            let mut places = Vec::new();
            for _ in 0..=(draw.uniform() * 3.0) as usize {
                let at = (draw.uniform() * bytes.len() as f64) as usize;
                bytes[at] ^= 1 << ((draw.uniform() * 8.0) as u32).min(7);
                places.push(at);
            }
            let what = format!("flipped at {places:?}");
            match read(case, &bytes, &what) {
                Err(_) => errors += 1,
                Ok(recording) if checked => {
                    assert!(rates(&recording) == expected || told(&recording), "{} {what}", case.file);
                }
                Ok(_) => {}
            }
        }
        if checked {
            assert!(errors > TIMES / 3, "{}: {errors}", case.file);
        }
    }
}

#[test]
fn damage_is_placed() {
    for (name, at, parts) in [
        ("ros1.bag", 40_000, &["byte", "damaged"][..]),
        ("ros1_bz2.bag", 15_000, &["byte", "chunk cannot be unpacked"]),
        ("ros2_zstd.mcap", 12_000, &["byte", "chunk cannot be unpacked"]),
        ("ros2.mcap", 30_000, &["byte", "checksum"]),
        ("v5.mat", 4000, &["byte", "unpacked"]),
        ("log.npz", 4000, &["array"]),
        ("log.h5", 15_500, &["dataset"]),
    ] {
        let case = distinct().find(|c| c.file == name).unwrap();
        let mut bytes = std::fs::read(file(name)).unwrap();
        bytes[at..at + 64].fill(0xa5);
        match read(case, &bytes, "overwritten") {
            Err(error) => {
                let text = error.to_string();
                assert!(parts.iter().all(|p| text.contains(p)), "{name}: {text}");
            }
            // numbers of an unpacked bag have no checksum
            Ok(_) => assert_eq!(name, "ros1.bag"),
        }
    }
    // flight logs go on behind the damage, and say where it is
    for name in ["px4.ulg", "ardupilot.bin"] {
        let case = distinct().find(|c| c.file == name).unwrap();
        let mut bytes = std::fs::read(file(name)).unwrap();
        let at = bytes.len() / 2;
        bytes[at..at + 300].fill(0xa5);
        let recording = read(case, &bytes, "overwritten").unwrap();
        assert!(rates(&recording).len() > SAMPLES / 2 && told(&recording), "{name}: {:?}", recording.notes);
        assert!(recording.notes.iter().any(|n| n.contains("byte")), "{:?}", recording.notes);
    }
}

/// Damage of four kinds by turns: cut off, flipped bits, a piece twice, pieces in each other's place.
fn damaged(whole: &[u8], turn: u64, draw: &mut Stream) -> (Vec<u8>, String) {
    let mut place = |below: usize| ((draw.uniform() * below as f64) as usize).min(below - 1);
    let (at, from, length) = (place(whole.len()), place(whole.len()), 1 + place(whole.len() / 4));
    let piece = &whole[from..whole.len().min(from + length)];
    let mut bytes = whole.to_vec();
    let what = match turn % 4 {
        0 => {
            bytes.truncate(at);
            format!("cut off after {at} bytes")
        }
        1 => {
            let places: Vec<usize> = (0..=place(3)).map(|_| place(whole.len())).collect();
            places.iter().for_each(|at| bytes[*at] ^= 1 << place(8));
            format!("flipped at {places:?}")
        }
        2 => {
            bytes.splice(from..from, piece.iter().copied());
            format!("{} bytes twice at {from}", piece.len())
        }
        _ => {
            let end = bytes.len().min(at + piece.len());
            bytes[at..end].copy_from_slice(&piece[..end - at]);
            format!("{} bytes at {at} from {from}", end - at)
        }
    };
    (bytes, what)
}

/// Reads this many damaged copies of each test file. Where checksums cover all of a file's numbers, what is read is what was
/// written, or a note says what was lost.
fn damaged_copies(times: u64) {
    let parquet = Case { unit: true, ..case("log.parquet", None, Held::Double) };
    let folder = tempfile::tempdir().unwrap();
    write_log(folder.path().join("log.parquet"), &read_log(file("euroc.csv")).unwrap()).unwrap();
    let parquet = (&parquet, std::fs::read(folder.path().join("log.parquet")).unwrap());
    let files = distinct().map(|case| (case, std::fs::read(file(case.file)).unwrap()));
    for (stream, (case, whole)) in files.chain([parquet]).enumerate() {
        let checked = ["mcap", "npz", "v5.mat", "parquet"].iter().any(|e| case.file.ends_with(e));
        let expected = case.expected();
        let mut draw = Stream::new(44, stream as u64);
        let (mut errors, mut unplaced, mut noted) = (0, 0, 0);
        for turn in 0..times {
            let (bytes, what) = damaged(&whole, turn, &mut draw);
            match read(case, &bytes, &what) {
                Err(error) => {
                    errors += 1;
                    unplaced += u64::from(error.place.is_none());
                }
                Ok(recording) => {
                    noted += u64::from(told(&recording));
                    let same = rates(&recording) == expected;
                    assert!(!checked || same || told(&recording), "{} {what}: {:?}", case.file, recording.notes);
                }
            }
        }
        println!("{}: {errors} of {times} refused, {unplaced} without a place; {noted} read with a note", case.file);
    }
}

#[test]
fn damaged_copies_are_told() {
    damaged_copies(12);
}

#[test]
#[ignore = "minutes; cargo test battery -- --ignored"]
fn battery_of_damaged_copies() {
    damaged_copies(cases(500));
}
