//! Tracks beside the log's reference, row by row, as tables and plots want them.

use super::Settings;
use super::align::{Alignment, Pair};
use super::reference::{ErrorSums, Reference, ReferenceErrors};
use super::wrap_angle;
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Log, increasing_times};

/// Positions and headings of a track, one a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track<'a> {
    /// x, m.
    pub x_m: &'a [f64],
    /// y, m.
    pub y_m: &'a [f64],
    /// Heading, rad.
    pub heading_rad: &'a [f64],
}

/// A track beside the reference, aligned with it where the settings or a missing heading require it.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The alignment; `None` where the track is compared as it is.
    pub alignment: Option<Alignment>,
    /// The track in the reference's frame, m, one a row of the log.
    pub x_m: Vec<f64>,
    /// The track in the reference's frame, m, one a row of the log.
    pub y_m: Vec<f64>,
    /// Rows of the log that have a reference position; what follows has one value for each.
    pub rows: Vec<usize>,
    /// Their times, s.
    pub time_s: Vec<f64>,
    /// The reference there, m.
    pub reference_x_m: Vec<f64>,
    /// The reference there, m.
    pub reference_y_m: Vec<f64>,
    /// Distance there, m.
    pub position_error_m: Vec<f64>,
    /// Heading error there (track minus reference, wrapped), rad; NaN where the reference has none. `None` if it never
    /// has.
    pub heading_error_rad: Option<Vec<f64>>,
}

/// Compares a track with the reference of `log`; `None` if there is none, or the track cannot be aligned with it.
///
/// # Errors
/// [`ErrorKind::Time`] if time does not run forward; [`ErrorKind::Value`] if the track has another number
/// of rows than the log.
pub fn compare(config: &Config, log: &Log, settings: &Settings, track: &Track) -> Result<Option<Comparison>> {
    let times = increasing_times(log)?;
    if [track.x_m, track.y_m, track.heading_rad].iter().any(|c| c.len() != times.len()) {
        let found = format!("a track of {} rows beside a log of {}", track.x_m.len(), times.len());
        return Err(Error::new(ErrorKind::Value, &log.source, found));
    }
    let Some(reference) = Reference::new(log, config.pose.as_ref()) else { return Ok(None) };
    let (rows, pairs) = pairs(&reference, &times, track);
    let alignment = match reference.share(settings) {
        None => None,
        Some(share) => match Alignment::of_first_part(&pairs, share, reference.still_m()) {
            None => return Ok(None),
            found => found,
        },
    };
    let place = |p: [f64; 2]| alignment.map_or(p, |a| a.apply(p));
    let turned = alignment.map_or(0.0, |a| a.rotation_rad);
    let (x_m, y_m) = track.x_m.iter().zip(track.y_m).map(|(x, y)| <(f64, f64)>::from(place([*x, *y]))).unzip();
    let distance = |pair: &Pair| {
        let (at, q) = (place(pair.track), pair.reference);
        (at[0] - q[0]).hypot(at[1] - q[1])
    };
    let turn = |row: &usize| {
        let heading = reference.at(*row).and_then(|pose| pose.heading);
        heading.map_or(f64::NAN, |h| wrap_angle(track.heading_rad[*row] + turned - h))
    };
    Ok(Some(Comparison {
        alignment,
        x_m,
        y_m,
        time_s: pairs.iter().map(|p| p.time_s).collect(),
        reference_x_m: pairs.iter().map(|p| p.reference[0]).collect(),
        reference_y_m: pairs.iter().map(|p| p.reference[1]).collect(),
        position_error_m: pairs.iter().map(distance).collect(),
        heading_error_rad: reference.has_heading().then(|| rows.iter().map(turn).collect()),
        rows,
    }))
}

/// Rows that have a reference, and the track there.
fn pairs(reference: &Reference, times: &[f64], track: &Track) -> (Vec<usize>, Vec<Pair>) {
    let at = |(row, &time_s): (usize, &f64)| {
        let pair = Pair { time_s, track: [track.x_m[row], track.y_m[row]], reference: reference.at(row)?.position };
        Some((row, pair))
    };
    times.iter().enumerate().filter_map(at).unzip()
}

/// Errors of a track after its first `share` was aligned with the reference; `None` if that part does not spread.
pub(super) fn aligned_errors(
    reference: &Reference,
    times: &[f64],
    track: &Track,
    share: f64,
) -> Option<ReferenceErrors> {
    let (rows, pairs) = pairs(reference, times, track);
    let alignment = Alignment::of_first_part(&pairs, share, reference.still_m())?;
    let mut sums = ErrorSums::default();
    for (row, pair) in rows.iter().zip(&pairs) {
        let [x, y] = alignment.apply(pair.track);
        sums.add(reference, *row, [x, y, track.heading_rad[*row] + alignment.rotation_rad], None);
    }
    Some(ReferenceErrors { alignment: Some(alignment), ..sums.finish()? })
}

/// Note on a track that could not be aligned with the reference.
pub(super) const NOT_ALIGNED: &str =
    "the first part of the track has no two places with a reference: it cannot be laid on it, and errors are not known";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{TimeAxis, names};

    fn config() -> Config {
        Config::parse("schema = 1\nkind = \"driving\"\n", "robot.toml").unwrap()
    }

    /// A reference along y of a robot that believes to drive along x and drifts aside in the second half.
    fn straight(headings: bool) -> (Log, [Vec<f64>; 3]) {
        let n = 101;
        let t: Vec<f64> = (0..n).map(f64::from).collect();
        let mut log = Log::new("test", TimeAxis::Explicit(t.clone()));
        log.push(names::X, vec![5.0; n as usize]).unwrap();
        log.push(names::Y, t.clone()).unwrap();
        if headings {
            log.push(names::HEADING, vec![std::f64::consts::FRAC_PI_2; n as usize]).unwrap();
        }
        let aside = t.iter().map(|t| if *t > 50.0 { 0.1 * (t - 50.0) } else { 0.0 }).collect();
        (log, [t, aside, vec![0.0; n as usize]])
    }

    #[test]
    fn the_first_part_is_laid_on_and_the_rest_shows_the_drift() {
        for headings in [false, true] {
            let (log, [x, y, heading]) = straight(headings);
            let track = Track { x_m: &x, y_m: &y, heading_rad: &heading };
            let settings = Settings { align_share: Some(0.3), ..Settings::default() };
            let c = compare(&config(), &log, &settings, &track).unwrap().unwrap();
            let a = c.alignment.unwrap();
            assert!((a.rotation_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12 && a.rms_m < 1e-12);
            assert!(a.path_share <= 0.3 && a.path_share > 0.28 && a.until_s == a.path_m, "{a:?}");
            assert!(c.position_error_m[50] < 1e-9 && (c.position_error_m[100] - 5.0).abs() < 1e-9);
            let turn = c.heading_error_rad.map(|e| e[100]);
            assert_eq!(turn.is_some(), headings);
            assert!(turn.unwrap_or(0.0).abs() < 1e-12);
        }
    }

    #[test]
    fn positions_alone_are_laid_on_by_default_and_poses_are_not() {
        let track = |[x, y, heading]: &[Vec<f64>; 3], log: &Log, settings: &Settings| {
            compare(&config(), log, settings, &Track { x_m: x, y_m: y, heading_rad: heading }).unwrap().unwrap()
        };
        let (plain, zero) = (Settings::default(), Settings { align_share: Some(0.0), ..Settings::default() });
        let (log, own) = straight(false);
        assert!(track(&own, &log, &plain).alignment.is_some());
        assert!(track(&own, &log, &zero).alignment.is_none());
        let (log, own) = straight(true);
        assert!(track(&own, &log, &plain).alignment.is_none());
    }

    #[test]
    fn a_robot_that_stands_cannot_be_laid_on() {
        let (log, _) = straight(false);
        let still = vec![0.0; log.len()];
        let track = Track { x_m: &still, y_m: &still, heading_rad: &still };
        assert!(compare(&config(), &log, &Settings::default(), &track).unwrap().is_none());
        let short = Track { x_m: &[0.0], ..track };
        assert!(compare(&config(), &log, &Settings::default(), &short).is_err());
    }
}
