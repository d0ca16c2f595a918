//! A noise model: the readings, the deviations of the Allan family with the model's, and the terms.

use super::drive::{IMU, imu};
use super::messages::Header;
use super::protobuf::{Band, Curve, Quantity, Verdict};
use super::recording::Recording;
use crate::error::Result;
use crate::files::OutputFile;
use crate::report::NoiseReport;
use crate::signal::TimeAxis;

/// A noise model for a recording.
pub(crate) struct NoiseRecording<'a> {
    /// The model.
    pub report: &'a NoiseReport,
    /// Times and readings, rad/s, where the log was held in memory.
    pub readings: Option<(&'a TimeAxis, &'a [f64])>,
}

impl NoiseRecording<'_> {
    /// Writes the recording.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Io`] if the disk refuses.
    pub(crate) fn write(&self, file: OutputFile) -> Result<()> {
        let first_s = self.readings.filter(|(time, _)| !time.is_empty()).map_or(0.0, |(time, _)| time.at(0));
        let mut to = Recording::new(file, first_s)?;
        let verdict = to.topic("/gyroid/verdict")?;
        to.put(&verdict, first_s, &self.verdict())?;
        let topic = to.topic("/gyroid/curve")?;
        let model = &self.report.model;
        for (deviation, points) in &model.deviations {
            let of_model: Vec<f64> = points.iter().map(|p| model.allan_deviation(p.tau_s)).collect();
            let interval = Band {
                name: "95 % interval".into(),
                low: points.iter().map(|p| p.ci95[0]).collect(),
                high: points.iter().map(|p| p.ci95[1]).collect(),
            };
            let of_model = Band { name: "Allan deviation of the terms".into(), low: of_model.clone(), high: of_model };
            let curve = Curve {
                name: format!("{} deviation over averaging time", deviation.id()),
                x_unit: "s".into(),
                unit: "rad/s".into(),
                x: points.iter().map(|p| p.tau_s).collect(),
                recorded: points.iter().map(|p| p.deviation_rad_s).collect(),
                bands: vec![interval, of_model],
            };
            to.put(&topic, first_s, &curve)?;
        }
        if let Some((time, rates)) = self.readings {
            let topic = to.topic("/imu/data_raw")?;
            for (k, rate) in rates.iter().enumerate().filter(|(_, rate)| rate.is_finite()) {
                let header = Header::new(to.stamp(time.at(k)), IMU);
                to.put(&topic, time.at(k), &imu(header, *rate, 0.0))?;
            }
        }
        to.finish()
    }

    fn verdict(&self) -> Verdict {
        let quantities = self.report.model.terms.iter().map(|term| Quantity {
            name: term.id.id().into(),
            unit: term.unit.into(),
            value: term.estimate,
            std: term.std,
            ci95: term.ci95.to_vec(),
        });
        Verdict {
            command: "noise".into(),
            verdict: if self.report.fits() { "fit_for_use" } else { "not_fit_for_use" }.into(),
            text: self.report.text(),
            quantities: quantities.collect(),
        }
    }
}
