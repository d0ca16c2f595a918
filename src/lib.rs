//! gyroid identifies how a cheap gyro drifts while it warms up, and hands the result to a navigation filter.
//!
//! # The pipeline
//!
//! ```text
//! recorded log ──► ingest ──► identify ──► validate ──► gyroid.toml ──► navigate ──► pose
//!                                                            │
//!                                                            ├──► simulate ──► what should have been recorded
//!                                                            │                                │
//! recorded drive ──► ingest ──► gap ◄────────────────────────┴────────────────────────────────┘
//!                               └──► the effects that the simulator lacks, back into gyroid.toml
//! ```
//!
//! # The equation
//!
//! At rest, `t` counted from power-on, the gyro's error is
//!
//! ```text
//! e(t) = C1 (1 - exp(-t/T)) + C2                       (2)
//! de/dt = (C1 + C2 - e)/T,  e(0) = C2                  (3)
//! e[k+1] = decay e[k] + (1 - decay)(C1 + C2)           (5j) with decay = T/(T+Ts); exactly: exp(-Ts/T)
//! ```
//!
//! (Alessandri, Bartolini, Pavanati, Punta, Vinci, *An application of the extended Kalman filter for integrated navigation
//! in mobile robotics*; after Barshan and Durrant-Whyte, IEEE Trans. Robotics and Automation 11 (1995) 328.
//! Their discrete equation (4) is misprinted: its second coefficient must be Ts/(T+Ts), as (5j) has it.)
//!
//! [`identify`] fits C1, C2 and T by nonlinear least squares, from no starting values and on unevenly sampled time. Its
//! covariance and its intervals allow for a random walk of the bias under the white noise. [`validate`] asks whether
//! the residuals are white at every averaging time at once, at a joint level that is right by permutation.
//! [`identify::terms`] estimates the noise beside it: quantisation, angle random walk, bias instability, rate random walk, ramp
//! and Gauss-Markov terms together, the Allan family ([`noise`]) beside them.
//! [`config`] is the file that everything downstream reads; [`navigate`] is an extended Kalman filter that consumes it,
//! [`simulate`] the simulator that makes logs from it.
//!
//! [`gap`] compares simulator and recording, names the effects that the simulator lacks and measures how far they close the gap;
//! the effects themselves are in [`effects`], and [`mod@bench`] proves the diagnosis on sealed cases.
//!
//! # A log, step by step
//!
//! `gyroid fit log.parquet -o gyroid.toml`, each step with its place:
//!
//! 1. [`cli`] claims every output before anything is read.
//! 2. [`ingest::read_gyro_within`] tells the format by the file's content and finds the columns by their names and units.
//! 3. It sets the clock right, takes out what is doubled or disordered, and notes all of that in an [`ingest::Audit`].
//! 4. The result is a [`signal::Log`] in SI units on a [`signal::TimeAxis`], or, of a large log, its sums: a [`signal::Reduced`].
//! 5. [`identify::fit`] solves C1 and C2 linearly for each T, and minimises over ln T alone.
//! 6. It estimates the random walk of the bias beside the white noise, and widens the covariance by it.
//! 7. It profiles the likelihood for the intervals, and compares the warm-up with a constant and a line.
//! 8. [`identify::fit_temperature`] holds the same log against its temperature, where there is one.
//! 9. [`validate::whiteness`] tests the residuals at every averaging time, at one joint level.
//! 10. [`report::FitReport`] draws the verdict from steps 5 to 9, and words, picture and page from it.
//! 11. [`export::configuration`] makes the [`config::Config`] that the filter reads, with its checksum.
//! 12. [`files::OutputFile`] puts it in its place, whole or not at all.
//!
//! The steps of a diagnosis are in [`gap`].
//!
//! # Units
//!
//! All inside is SI and `f64`: rad/s, s, m, N·m, °C, V. A name carries its unit (`rate_rad_s`). Conversions happen where logs
//! come in ([`ingest`]) and reports go out ([`report`]). Time counts from power-on wherever that is known.
//!
//! # Floors
//!
//! A module uses the floors below it and its own; a test keeps that.
//!
//! | floor | modules |
//! |---|---|
//! | 0 | [`error`], [`files`], [`progress`], [`units`], [`math`] |
//! | 1 | [`signal`] |
//! | 2 | [`ingest`], [`bias`], [`noise`], [`traction`], [`vehicle`], [`config`], [`model`] |
//! | 3 | [`identify`], [`validate`], [`navigate`], [`simulate`] |
//! | 4 | [`population`], [`study`], [`effects`], [`live`] |
//! | 5 | [`gap`], [`mod@bench`] |
//! | 6 | [`export`], [`report`], `ros` (feature `ros2`) |
//! | 7 | [`cli`] |
//!
//! The library never prints (what [`cli`] is for aside), never exits, and does not panic on input: every [`Error`] names the input, the place in
//! it, what was found and the hint.
//!
//! # From samples to a configuration
//!
//! ```
//! use gyroid::export::{ConfigurationOptions, configuration};
//! use gyroid::identify::{FitOptions, fit};
//! use gyroid::math::random::Stream;
//! use gyroid::report::{FitReport, LogFacts, Verdict};
//! use gyroid::signal::TimeAxis;
//! use gyroid::units::RateUnit;
//! use gyroid::validate::{Options, whiteness};
//!
//! // twenty minutes of a gyro at 2 Hz, C1 = 2e-3 rad/s, C2 = -5e-3 rad/s, T = 240 s, noise 2e-4 rad/s
//! let mut draw = Stream::new(1, 0);
//! let rate_rad_s: Vec<f64> = (0..2400)
//!     .map(|i| 2e-3 * (1.0 - (-0.5 * f64::from(i) / 240.0).exp()) - 5e-3 + 2e-4 * draw.normal())
//!     .collect();
//! let time = TimeAxis::Uniform { start_s: 0.0, step_s: 0.5, len: 2400 };
//!
//! let fit = fit(&time, &rate_rad_s, &FitOptions::default())?;
//! assert!(fit.identifiable);
//! let [low, high] = fit.time_constant_s.ci95;
//! assert!(low < 240.0 && 240.0 < high);
//!
//! let residuals = fit.residuals(&time, &rate_rad_s);
//! let validation = whiteness(&time, &residuals, &fit.jacobian(&time), &Options::default());
//! assert!(validation.white);
//!
//! let log = LogFacts {
//!     name: "simulation".into(),
//!     column: "rate_rad_s".into(),
//!     unit: RateUnit::RadPerS,
//!     sha256: String::new(),
//!     temperature_c: None,
//!     notes: Vec::new(),
//!     audit: serde_json::Value::Null,
//! };
//! let report = FitReport::new(log, fit, validation);
//! assert_eq!(report.verdict(), Verdict::FitForUse);
//! let config = configuration(&report, None, &ConfigurationOptions::default())?;
//! let text = config.to_toml()?;
//! let discrete = gyroid::config::Config::parse(&text, "gyroid.toml")?.require_gyro()?.discrete.unwrap();
//! // the filter's recursion ends in the warm state, C1 + C2
//! let warm = (0..100_000).fold(discrete.initial, |e, _| discrete.step(e));
//! assert!((warm - -3e-3).abs() < 1e-4);
//! # Ok::<(), gyroid::Error>(())
//! ```
#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub)]
// the manual leads into every room: `cargo doc --document-private-items`
#![allow(rustdoc::private_intra_doc_links)]

// the command line names the library as its other users do
extern crate self as gyroid;

pub(crate) mod bench;
pub mod bias;
pub mod cli;
pub mod config;
pub mod effects;
pub mod error;
pub mod export;
pub mod files;
pub(crate) mod fleet;
pub mod gap;
pub mod identify;
pub mod ingest;
pub mod live;
pub mod math;
pub mod model;
pub mod navigate;
pub mod noise;
pub(crate) mod population;
pub(crate) mod progress;
pub mod report;
pub(crate) mod robot;
#[cfg(feature = "ros2")]
pub mod ros;
pub mod signal;
pub mod simulate;
pub(crate) mod study;
pub mod traction;
pub mod units;
pub(crate) mod unwind;
pub mod validate;
pub mod vehicle;

pub use error::{Error, ErrorKind, Result};
