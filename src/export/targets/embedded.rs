//! e\[k+1\] = decay · e\[k\] + drive, e\[0\] = initial:   corrected = rate - e, as C11 and as Rust that needs no `std`
//!
//! The recursion of [`crate::bias::Discrete`] at the rate of the firmware, in the scheme of the configuration. Numbers stand with all
//! their digits, and each step rounds twice as the library does, so that both agree to the last bit where a compiler fuses no
//! product with a sum. Samples that are missed are made up for in ⌈log₂ n⌉ steps: n steps are one of decayⁿ.

use super::super::number::Known;
use super::super::sheet::Sheet;
use super::super::source::Source;
use super::super::target::Target;
use crate::bias::{Discrete, Scheme};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

/// Language of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Language {
    C,
    Rust,
}

static C: About = About {
    id: "c",
    program: "C11 firmware, without libraries",
    file: "gyro_bias.h",
    keys: &[
        Key { name: "SAMPLE_TIME_S", unit: "s", meaning: "time between two samples, 1/f" },
        Key { name: "DECAY", unit: "1", meaning: "factor of the last error" },
        Key { name: "DRIVE_RAD_S", unit: "rad/s", meaning: "added at each sample, (1 - decay) (C1 + C2)" },
        Key { name: "INITIAL_RAD_S", unit: "rad/s", meaning: "C2, the error at a cold power-on" },
        Key { name: "WARM_RAD_S", unit: "rad/s", meaning: "C1 + C2, the error of the warm gyro" },
        Key { name: "WHITE_STD_RAD_S", unit: "rad/s", meaning: "white noise of one sample, N / sqrt(sample time)" },
    ],
    needs: "C1, C2, T, N; the rate of the firmware (--rate, else that of the configuration)",
    convention: "double precision; subtract e[k] from sample k, then advance",
    source: "the recursion of gyroid itself (src/bias/discrete.rs)",
    warm_up: "this file subtracts it",
    comment: Comment::Slashes,
};

static RUST: About =
    About { id: "rust", program: "Rust firmware, without std, as a module", file: "gyro_bias.rs", ..C };

pub(super) struct Embedded {
    pub(super) language: Language,
}

impl Target for Embedded {
    fn about(&self) -> &'static About {
        match self.language {
            Language::C => &C,
            Language::Rust => &RUST,
        }
    }

    fn first_line(&self) -> Option<&'static str> {
        // a formatter leaves digits alone, which clippy would group
        (self.language == Language::Rust).then_some("#![allow(clippy::all, dead_code)]")
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        sheet.note(source.rate_text()?);
        let step_s = 1.0 / source.rate_hz()?;
        let scheme = source.gyro.discrete.map_or(Scheme::Exact, |d| d.scheme);
        let discrete = Discrete::new(&source.gyro.warm_up(), step_s, scheme)?;
        sheet.note(format!("scheme: {scheme}, as `gyroid navigate` runs it"));
        sheet.note(
            "a gyro that was off for less than three time constants is still warm: start it with the error of then, \
             C1 h + C2 with h from 0 (cold) to 1 (warm)",
        );
        if source.gyro.temperature.is_some() {
            sheet.note("the error by temperature ([gyro.temperature]) is not in this file: it follows the time alone");
        }
        let white_std = source.angle_random_walk()?.times(1.0 / step_s.sqrt());
        if self.language == Language::C {
            sheet.line("#ifndef GYRO_BIAS_H");
            sheet.line("#define GYRO_BIAS_H");
            sheet.line("");
        }
        let put = |sheet: &mut Sheet, key: &'static str, number: Known| {
            sheet.put_double(key, number, |v| match self.language {
                Language::C => format!("#define GYRO_BIAS_{key} ({v})"),
                Language::Rust => format!("pub const {key}: f64 = {v};"),
            });
        };
        put(sheet, "SAMPLE_TIME_S", Known::exact(step_s));
        put(sheet, "DECAY", Known::exact(discrete.decay));
        put(sheet, "DRIVE_RAD_S", Known::exact(discrete.drive));
        put(sheet, "INITIAL_RAD_S", Known::exact(discrete.initial));
        put(sheet, "WARM_RAD_S", source.warm_bias());
        put(sheet, "WHITE_STD_RAD_S", white_std);
        sheet.line("");
        let code = match self.language {
            Language::C => include_str!("embedded.h"),
            Language::Rust => include_str!("embedded_module.rs"),
        };
        code.lines().for_each(|line| sheet.line(line));
        Ok(())
    }
}
