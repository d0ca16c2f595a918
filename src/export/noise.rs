//! From a noise model to the configuration: `[gyro.noise.terms]`, which exports read, N and K, which simulator and
//! filter read too, and the low-pass and bands, which the simulator makes.

use crate::config::{Config, GaussMarkovTerm, NarrowBand, Noise, NoiseProvenance, NoiseTerm, NoiseTerms};
use crate::error::{Error, ErrorKind, Result};
use crate::identify::terms::{NoiseModel, TermEstimate};
use crate::ingest::Axis;
use crate::noise::TermKind;
use crate::report::{LogFacts, NoiseReport};

/// Which logs may speak for a configuration, and who asks.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NoiseOptions {
    /// Take terms of another log than that of the fit, such as a longer one of the same gyro.
    pub other_log: bool,
    /// Take terms of another axis than that of the fit.
    pub other_axis: bool,
    /// The command that asked for it.
    pub command: String,
    /// Version of the program.
    pub version: String,
}

/// Checks that the noise of `log` may be written into `config`. By default that is only the noise of the log and axis
/// that were fitted. A configuration without provenance is not checked.
///
/// # Errors
/// [`ErrorKind::Usage`] if the log or its axis is another, and `options` do not allow that.
pub fn check_origin(config: &Config, log: &LogFacts, options: &NoiseOptions) -> Result<()> {
    let Some(fitted) = &config.provenance else { return Ok(()) };
    let same_axis = match (Axis::of_column(&fitted.column), Axis::of_column(&log.column)) {
        (Some(a), Some(b)) => a == b,
        _ => fitted.column.is_empty() || fitted.column == log.column,
    };
    let refuse = |found: String, hint: &str| Err(Error::new(ErrorKind::Usage, "configuration", found).hint(hint));
    if !same_axis && !options.other_axis {
        let found = format!("was fitted to column {:?}, and these are the terms of {:?}", fitted.column, log.column);
        return refuse(found, "name the fitted axis with --axis, or write them all the same with --other-axis");
    }
    if fitted.log_sha256 != log.sha256 && !options.other_log {
        let found = format!(
            "was fitted to {} (sha256 {}), and these are the terms of {} (sha256 {})",
            fitted.log,
            short(&fitted.log_sha256),
            log.name,
            short(&log.sha256)
        );
        return refuse(found, "name that log, or write those of another log of the same gyro with --other-log");
    }
    Ok(())
}

/// `config` with the terms of `report` in place of its own noise: `[gyro.noise.terms]` with 95 % intervals, and N and K
/// where simulator and filter read them. A walk that the fit found and that is not among these terms is removed: they
/// describe its contribution. The output's quantization step stays. A signed configuration gets `[provenance.noise]`;
/// its checksum is made anew when it is written.
///
/// # Errors
/// As [`check_origin`]; [`ErrorKind::Config`] without `[gyro]`; [`ErrorKind::Numeric`] if a term has no standard deviation.
pub fn with_noise(config: &Config, report: &NoiseReport, options: &NoiseOptions) -> Result<Config> {
    check_origin(config, &report.log, options)?;
    let mut gyro = config.require_gyro()?.clone();
    let terms = terms(&report.model)?;
    if let Some(n) = terms.angle_random_walk_rad_sqrt_s {
        gyro.angle_random_walk_rad_sqrt_s = n.estimate;
    }
    gyro.noise = Some(Noise {
        rate_random_walk_rad_s_sqrt_s: terms.rate_random_walk_rad_s_sqrt_s.map(|k| k.estimate),
        quantization_lsb_rad_s: gyro.noise.as_ref().and_then(|n| n.quantization_lsb_rad_s),
        terms: Some(terms),
        ..coloured(&report.model.terms)
    });
    let mut out = config.clone();
    out.gyro = Some(gyro);
    if let Some(provenance) = &mut out.provenance {
        provenance.noise = Some(NoiseProvenance {
            log: report.log.name.clone(),
            log_sha256: report.log.sha256.clone(),
            column: report.log.column.clone(),
            gyroid_version: options.version.clone(),
            command: options.command.clone(),
        });
    }
    Ok(out)
}

/// The low-pass and the bands among `terms`, with their intervals.
pub(super) fn coloured(terms: &[TermEstimate]) -> Noise {
    let low_pass = terms.iter().find(|t| t.id == TermKind::Bandwidth);
    Noise {
        bandwidth_cutoff_hz: low_pass.map(|t| t.estimate),
        bandwidth_cutoff_ci95_hz: low_pass.map(|t| t.ci95),
        bandwidth_form: low_pass.and_then(|t| t.low_pass),
        narrow_band: terms.iter().filter_map(band).collect(),
        ..Noise::default()
    }
}

fn band(t: &TermEstimate) -> Option<NarrowBand> {
    let (center, width) = (t.center_hz?, t.bandwidth_hz?);
    Some(NarrowBand {
        center_hz: center.estimate,
        bandwidth_hz: width.estimate,
        std_rad_s: t.estimate,
        form: t.band,
        center_ci95_hz: Some(center.ci95),
        bandwidth_ci95_hz: Some(width.ci95),
        std_ci95_rad_s: Some(t.ci95),
    })
}

fn terms(model: &NoiseModel) -> Result<NoiseTerms> {
    let of = |kind: TermKind| model.term(kind).map(number).transpose();
    let markov = match model.term(TermKind::GaussMarkov) {
        None => None,
        Some(t) => {
            let NoiseTerm { estimate, std, ci95 } = number(t)?;
            let missing = || not_known(t, "correlation time");
            let time = t.correlation_time_s.ok_or_else(missing)?;
            let correlation_time_ci95_s = Some(time.ci95);
            Some(GaussMarkovTerm { estimate, std, ci95, correlation_time_s: time.estimate, correlation_time_ci95_s })
        }
    };
    Ok(NoiseTerms {
        quantization_rad: of(TermKind::Quantization)?,
        angle_random_walk_rad_sqrt_s: of(TermKind::AngleRandomWalk)?,
        bias_instability_rad_s: of(TermKind::BiasInstability)?,
        rate_random_walk_rad_s_sqrt_s: of(TermKind::RateRandomWalk)?,
        rate_ramp_rad_s2: of(TermKind::RateRamp)?,
        gauss_markov_rad_s: markov,
    })
}

fn number(t: &TermEstimate) -> Result<NoiseTerm> {
    if t.std.is_nan() {
        return Err(not_known(t, "standard deviation"));
    }
    // the ends are found to a hundredth of a standard deviation
    let ci95 = [t.ci95[0].min(t.estimate), t.ci95[1].max(t.estimate)];
    Ok(NoiseTerm { estimate: t.estimate, std: t.std, ci95 })
}

fn not_known(t: &TermEstimate, what: &str) -> Error {
    let found = format!("the {what} of {} could not be computed", t.id.title());
    Error::new(ErrorKind::Numeric, "log", found).hint("leave the term out with --terms, or record a longer log")
}

fn short(sha256: &str) -> &str {
    sha256.get(..12).unwrap_or(sha256)
}
