//! 1 - Σ ν²/Σ (z - z̄)²,   Σ ν²/(n S),   Σ w_k w_{k+1}/Σ w²,   w = ν/√S: how well the twin predicts the log that it was fitted to

use super::refine::{Fitting, Normal};
use super::told::ChannelFit;
use crate::gap::drive::ekf::noise::Channel;
use crate::math::NORMAL_975;
use crate::signal::names;

/// Correlation of neighbours beyond which none is told from one.
const MOST_CORRELATED: f64 = 0.999;

/// Name of a channel in a log.
fn name(channel: Channel) -> &'static str {
    match channel {
        Channel::WheelLeft => names::WHEEL_LEFT,
        Channel::WheelRight => names::WHEEL_RIGHT,
        Channel::Gyro => names::GYRO_Z,
        Channel::X => names::X,
        Channel::Y => names::Y,
        Channel::Heading => names::HEADING,
    }
}

/// How far a twin is from standing for its simulator.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Misfit {
    /// Channel that it predicts worst.
    pub channel: String,
    /// Factor by which evidence against the twin is too large: of the innovations' variance over the expected one, and of the
    /// readings over the independent ones among them, (1 + ρ)/(1 - ρ) where neighbours correlate by ρ (Bartlett 1946).
    pub factor: f64,
}

/// Largest factor of the channels, by the ends of 95 % intervals that are nearest to a twin that holds; none where that is one.
pub(super) fn misfit(channels: &[ChannelFit]) -> Option<Misfit> {
    let one = |c: &ChannelFit| {
        let correlation = (c.lag_one - NORMAL_975 / (c.readings as f64).sqrt()).clamp(0.0, MOST_CORRELATED);
        let factor = (c.nis_mean / c.nis_mean_bounds95[1]).max(1.0) * (1.0 + correlation) / (1.0 - correlation);
        Misfit { channel: c.channel.clone(), factor }
    };
    channels.iter().map(one).filter(|m| m.factor > 1.0).max_by(|a, b| a.factor.total_cmp(&b.factor))
}

/// One-step predictions by channel, what is drawn anew in each run taken as `normal` estimates it.
pub(super) fn channels(fitting: &Fitting, normal: &Normal) -> Vec<ChannelFit> {
    let record = &fitting.record;
    let mut whites: [Vec<f64>; 6] = Default::default();
    let mut squares = [0.0; 6];
    fitting.innovations(normal, |channel, white, std| {
        whites[channel as usize].push(white);
        squares[channel as usize] += (white * std).powi(2);
    });
    let readings = |channel: Channel| -> Vec<f64> {
        let values: Option<&Vec<f64>> = match channel {
            Channel::WheelLeft => Some(&record.wheels_rad_s[0]),
            Channel::WheelRight => Some(&record.wheels_rad_s[1]),
            Channel::Gyro => record.gyro_rad_s.as_ref(),
            Channel::X => record.pose.as_ref().map(|p| &p[0]),
            Channel::Y => record.pose.as_ref().map(|p| &p[1]),
            Channel::Heading => record.pose.as_ref().map(|p| &p[2]),
        };
        values.into_iter().flatten().copied().filter(|v| v.is_finite()).collect()
    };
    let one = |channel: Channel| {
        let (white, square) = (&whites[channel as usize], squares[channel as usize]);
        let n = white.len() as f64;
        let read = readings(channel);
        let mean = read.iter().sum::<f64>() / read.len().max(1) as f64;
        let variance = read.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / read.len().max(1) as f64;
        let sum: f64 = white.iter().map(|w| w * w).sum();
        // mean of n squares of standard normal numbers: variance 2/n
        let half = NORMAL_975 * (2.0 / n).sqrt();
        (white.len() > 2 && variance > 0.0).then(|| ChannelFit {
            channel: name(channel).into(),
            explained_one_step: 1.0 - square / n / variance,
            nis_mean: sum / n,
            nis_mean_bounds95: [1.0 - half, 1.0 + half],
            lag_one: white.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / sum,
            readings: white.len(),
        })
    };
    Channel::ALL.into_iter().filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn fit(nis_mean: f64, lag_one: f64) -> ChannelFit {
        let readings = 10_000;
        let half = NORMAL_975 * (2.0 / readings as f64).sqrt();
        ChannelFit {
            channel: "gyro_z_rad_s".into(),
            explained_one_step: 0.9,
            nis_mean,
            nis_mean_bounds95: [1.0 - half, 1.0 + half],
            lag_one,
            readings,
        }
    }

    #[test]
    fn a_twin_that_holds_has_no_misfit() {
        assert_eq!(misfit(&[fit(1.02, 0.015), fit(0.98, -0.3)]), None);
    }

    /// The mean of an AR(1) process scatters by the factor more than that of white noise of variance one.
    #[test]
    fn evidence_is_too_large_by_the_scatter_of_a_mean() {
        let (correlation, variance, long, runs) = (0.6_f64, 3.0_f64, 2000, 2000);
        let draw = &mut Stream::new(3, 0);
        let mut square = 0.0;
        for _ in 0..runs {
            let mut x = variance.sqrt() * draw.normal();
            let mut sum = 0.0;
            for _ in 0..long {
                sum += x;
                x = correlation * x + (variance * (1.0 - correlation * correlation)).sqrt() * draw.normal();
            }
            square += sum * sum / f64::from(long);
        }
        let scattered = square / f64::from(runs);
        let told = misfit(&[fit(1.0, 0.0), fit(variance, correlation)]).unwrap().factor;
        // the factor takes the near ends of intervals: 2.8 % of the variance, 0.02 of the correlation, which is worth 6 %;
        // the mean of 2000 squares scatters by 3 %
        assert!(told < scattered * 1.1 && told > scattered * 0.8, "{told} {scattered}");
    }
}
