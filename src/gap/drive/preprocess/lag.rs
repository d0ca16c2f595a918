//! y(t + n) = ŷ(t) + c' φ(t) + residual:   n rows by which the readings y of an instrument are late
//!
//! ŷ is the prediction of a filter that excludes the instrument, and φ holds what may differ beside a delay: a constant,
//! and for wheels a share of their speed and the lead of a rim that slips, |ŷ| (f, f |f|, f³), f the force over the
//! load. Without these, slip would look like a delay: both show where the robot accelerates.

use crate::gap::drive::ekf::innovations::run;
use crate::gap::drive::ekf::models::Models;
use crate::gap::drive::ekf::noise::{Channel, Noise};
use crate::gap::drive::options::LARGE;
use crate::gap::drive::record::Record;
use crate::model::drive::Instrument;
use nalgebra::{SMatrix, SVector};

/// Longest lag that is looked for, s: past rates are stored for this time.
pub(crate) const LONGEST_S: f64 = 0.4;
/// Fewest pairs of rows that are compared.
const FEWEST: f64 = 64.0;
/// Number of functions in φ.
const WIDTH: usize = 5;
/// Share of the largest diagonal element that keeps normal equations regular where functions are alike.
const RIDGE: f64 = 1e-9;

type Phi = SVector<f64, WIDTH>;

/// One stream of an instrument beside its prediction.
struct Stream {
    reads: Vec<f64>,
    predicted: Vec<f64>,
    phi: Vec<Phi>,
}

/// Normal equations of the difference between readings and prediction.
#[derive(Default)]
struct Sums {
    count: f64,
    gram: SMatrix<f64, WIDTH, WIDTH>,
    by: Phi,
    square: f64,
}

impl Sums {
    /// Mean of the squared residuals.
    fn scatter(&self) -> Option<f64> {
        if self.count < FEWEST {
            return None;
        }
        let ridge = RIDGE * self.gram.diagonal().max();
        let solved = (self.gram + SMatrix::identity() * ridge).cholesky()?.solve(&self.by);
        Some((self.square - solved.dot(&self.by)) / self.count)
    }
}

/// Rows by which the readings of `of` are late; none where they are on time, or nothing else tells what they read.
pub(crate) fn late_rows(record: &Record, of: Instrument, noise: &Noise) -> Option<f64> {
    let streams = streams(record, of, noise)?;
    let scatter = |rows: usize| {
        let mut sums = Sums::default();
        for stream in &streams {
            for drive in record.drives() {
                let late = &stream.reads[drive.clone()][rows.min(drive.len())..];
                let there = stream.predicted[drive.clone()].iter().zip(&stream.phi[drive]);
                for (apart, phi) in late.iter().zip(there).map(|(y, (p, phi))| (y - p, phi)) {
                    if apart.is_finite() {
                        sums.count += 1.0;
                        sums.gram.ger(1.0, phi, phi, 1.0);
                        sums.by.axpy(apart, phi, 1.0);
                        sums.square += apart * apart;
                    }
                }
            }
        }
        Some((sums.count, sums.scatter()?))
    };
    let (count, on_time) = scatter(0)?;
    let all = (1..=(LONGEST_S / record.step_s) as usize).filter_map(|n| Some((n, scatter(n)?.1)));
    let (rows, least) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
    if 0.5 * count * (on_time / least).ln() <= LARGE {
        return None;
    }
    // the vertex of the parabola through the least and its neighbours
    let [before, after] = [rows - 1, rows + 1].map(|n| scatter(n).map_or(least, |s| s.1));
    let bend = before + after - 2.0 * least;
    Some(rows as f64 + if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 })
}

/// Readings of the instrument without its own error, and their predictions by a filter without them.
fn streams(record: &Record, of: Instrument, noise: &Noise) -> Option<Vec<Stream>> {
    let (channels, logged) = match of {
        Instrument::Gyro => (Channel::Gyro as usize..Channel::Gyro as usize + 1, record.gyro_rad_s.is_some()),
        // without torques a late wheel is sought otherwise
        Instrument::Wheels => (0..2, record.torques_n_m.is_some()),
        Instrument::Pose => return None,
    };
    if !logged {
        return None;
    }
    let mut aside = *noise;
    aside.exclude(channels.clone());
    let empty = || Stream {
        reads: vec![f64::NAN; record.len()],
        predicted: vec![f64::NAN; record.len()],
        phi: vec![Phi::zeros(); record.len()],
    };
    let mut streams: Vec<Stream> = channels.clone().map(|_| empty()).collect();
    let _ = run(record, &Models::plain(record), &aside, &[], |i| {
        let place = i.channel as usize;
        if !channels.contains(&place) {
            return;
        }
        let stream = &mut streams[place - channels.start];
        let reading = match (of, &record.gyro_rad_s) {
            (Instrument::Gyro, Some(gyro)) => {
                gyro[i.row] - record.belief.warm_up.error_rad_s(record.since_power_on_s[i.row])
            }
            _ => record.wheels_rad_s[place][i.row],
        };
        let predicted = reading - i.white * i.std;
        (stream.reads[i.row], stream.predicted[i.row]) = (reading, predicted);
        stream.phi[i.row][0] = 1.0;
        if of == Instrument::Wheels {
            let robot = record.robot(record.load_kg(i.row));
            let f = record.torques(i.row.saturating_sub(1))[place] / (robot.radius_m[place] * robot.wheel_load_n());
            let speed = predicted.abs();
            stream.phi[i.row] = Phi::from([1.0, predicted, speed * f, speed * f * f.abs(), speed * f.powi(3)]);
        }
    });
    Some(streams)
}
