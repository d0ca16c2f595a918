//! A folder of its own, in which the program runs as a user runs it.
#![allow(dead_code, reason = "each test uses a part of it")]

use assert_cmd::Command;
use std::path::PathBuf;
use std::process::Output;

/// The folder; it goes with the test.
pub struct Place {
    dir: tempfile::TempDir,
}

impl Place {
    /// With these files.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let place = Self { dir: tempfile::tempdir().unwrap() };
        files.iter().for_each(|(name, text)| place.write(name, text));
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn has(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// Runs the program; words are parted by single spaces.
    pub fn run(&self, line: &str) -> Output {
        let mut command = Command::cargo_bin("gyroid").unwrap();
        command.current_dir(self.dir.path()).args(line.split(' ')).output().unwrap()
    }

    /// What it prints.
    #[track_caller]
    pub fn ok(&self, line: &str) -> String {
        let output = self.run(line);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    /// What it prints where the result is not fit for use: exit code 3.
    #[track_caller]
    pub fn unfit(&self, line: &str) -> String {
        let output = self.run(line);
        assert_eq!(output.status.code(), Some(3), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    /// That it fails with this code, and names all `parts`.
    #[track_caller]
    pub fn refused(&self, line: &str, code: i32, parts: &[&str]) {
        let output = self.run(line);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}: {text}");
        for part in parts {
            assert!(text.contains(part), "{line}: {text} lacks {part}");
        }
    }
}
