//! part(log) = 1 + SHA-256(name) mod n:  logs of a folder dealt out to n runs that know nothing of each other
//!
//! The name is the log's path within the folder that was named, so that each machine finds the same part wherever it has the folder,
//! and a log that comes or goes moves no other.

use crate::error::{Error, ErrorKind, Result};
use crate::files::mark::sha256_hex;
use std::path::{Path, PathBuf};

/// One of so many parts of the logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shard {
    part: u64,
    parts: u64,
}

impl Shard {
    /// Reads `i/n`, i from 1 to n.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for anything else.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        let numbers = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
        match numbers {
            Some((part, parts)) if (1..=parts).contains(&part) => Ok(Self { part, parts }),
            _ => Err(Error::new(ErrorKind::Usage, "--shard", format!("{text:?} is no part"))
                .hint("give i/n with i from 1 to n: 2/8 is the second of eight parts")),
        }
    }

    /// Those of `logs` that belong to this part; `named`: the files and folders that they were found by.
    pub(crate) fn of<P: AsRef<Path>>(&self, logs: Vec<PathBuf>, named: &[P]) -> Vec<PathBuf> {
        let within = |log: &Path| {
            let inside = named.iter().filter_map(|p| log.strip_prefix(p).ok());
            let name = inside.filter(|rest| !rest.as_os_str().is_empty()).map(Path::to_path_buf).next();
            name.unwrap_or_else(|| log.file_name().map_or_else(|| log.to_path_buf(), PathBuf::from))
        };
        logs.into_iter().filter(|log| self.holds(&within(log))).collect()
    }

    fn holds(&self, name: &Path) -> bool {
        let parts: Vec<_> = name.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        let digest = sha256_hex(&parts.join("/"));
        // the first 64 of its bits
        let number = digest.get(..16).and_then(|digits| u64::from_str_radix(digits, 16).ok()).unwrap_or_default();
        number % self.parts == self.part - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_log_is_in_one_part_wherever_its_folder_lies() {
        let names: Vec<String> = (0..300).map(|k| format!("unit_{}/{k}.csv", k % 7)).collect();
        let part = |folder: &str, part: usize| -> Vec<PathBuf> {
            let logs = names.iter().map(|n| Path::new(folder).join(n)).collect();
            Shard::parse(&format!("{part}/3")).unwrap().of(logs, &[folder])
        };
        let mut all: Vec<PathBuf> = (1..=3).flat_map(|i| part("/data/fleet", i)).collect();
        all.sort();
        let mut wanted: Vec<PathBuf> = names.iter().map(|n| Path::new("/data/fleet").join(n)).collect();
        wanted.sort();
        assert_eq!(all, wanted);
        for i in 1..=3 {
            let there = part("elsewhere", i);
            assert_eq!(there.len(), part("/data/fleet", i).len());
            assert!(there.iter().zip(part("/data/fleet", i)).all(|(a, b)| a.file_name() == b.file_name()));
            // 300 logs at 1/3: four standard deviations of a binomial count
            assert!((there.len() as f64 - 100.0).abs() < 4.0 * (300.0_f64 * 2.0 / 9.0).sqrt(), "{}", there.len());
        }
    }

    #[test]
    fn other_texts_are_no_part() {
        for text in ["0/3", "4/3", "1", "1/0", "a/b", "1/3/5", "-1/3", ""] {
            let error = Shard::parse(text).unwrap_err();
            assert!(error.kind == ErrorKind::Usage && error.hint.unwrap().contains("2/8"), "{text}");
        }
    }
}
