//! The corpus of the fuzz targets: what was found with them, and small inputs that reach most of each reader.

use crate::entry::{ENTRIES, Entry};
use crate::{file, held};
use std::time::{Duration, Instant};

/// Most that is held while an input of `length` bytes is read: what it may unpack to, 64 MiB and 256 times its size, in numbers
/// of eight bytes for each byte, twice while they are sorted.
pub fn most_bytes(length: usize) -> usize {
    2 * 8 * ((64 << 20) + 256 * length)
}

/// Longest time that an input may take, on a machine that does much else. Most take a thousandth of it.
const LONGEST: Duration = Duration::from_secs(120);

/// Runs an entry on what is called `name`, and checks that it ends, in time and within its memory.
pub fn run(entry: Entry, bytes: &[u8], name: &str) -> usize {
    let begin = Instant::now();
    let (done, most) = held::most(|| std::panic::catch_unwind(|| entry(bytes)));
    assert!(done.is_ok(), "{name}: a panic");
    assert!(most <= most_bytes(bytes.len()), "{name}: {most} bytes were held for {}", bytes.len());
    assert!(begin.elapsed() < LONGEST, "{name}: {:?}", begin.elapsed());
    most
}

#[test]
fn every_input_of_the_corpus_is_read_or_refused() {
    for (name, entry) in ENTRIES {
        let folder = file("corpus").join(name);
        let mut inputs = 0;
        for input in std::fs::read_dir(&folder).unwrap().flatten() {
            run(entry, &std::fs::read(input.path()).unwrap(), &input.path().display().to_string());
            inputs += 1;
        }
        assert!(inputs > 0, "{name}");
    }
}
