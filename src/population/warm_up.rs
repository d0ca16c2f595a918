//! The warm-up of each of many logs: its fit, and the test of the residuals.

use super::row::Row;
use super::run::Analysis;
use crate::bias::EarthRate;
use crate::error::Result;
use crate::identify::{self, FitOptions, Loss};
use crate::ingest::GyroRecording;
use crate::signal::TimeAxis;
use crate::validate;
use serde_json::{Value, json};

/// How the logs are fitted and tested: all alike.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct WarmUp {
    /// The Earth's rotation as part of C2, for logs that were recorded in one place.
    pub earth: Option<EarthRate>,
    /// Options of the fit.
    pub fit: FitOptions,
    /// Options of the whiteness test.
    pub whiteness: validate::Options,
}

impl Analysis for WarmUp {
    type Row = Row;

    fn options(&self) -> Vec<(&'static str, Value)> {
        let (fixed, usual) = (self.fit.fixed, validate::Options::default());
        vec![
            ("latitude_deg", json!(self.earth.map(|e| e.latitude_deg))),
            ("c1_rad_s", json!(fixed.c1_rad_s)),
            ("c2_rad_s", json!(fixed.c2_rad_s)),
            ("time_constant_s", json!(fixed.time_constant_s)),
            ("loss", json!((self.fit.loss == Loss::Huber).then_some(self.fit.loss))),
            ("weighting", json!(self.fit.weighting)),
            ("level", json!(Some(self.whiteness.level).filter(|v| *v != usual.level))),
            ("draws", json!(Some(self.whiteness.draws).filter(|v| *v != usual.draws))),
            ("seed", json!(Some(self.whiteness.seed).filter(|v| *v != usual.seed))),
        ]
    }

    fn fill(&self, row: &mut Row, recording: &GyroRecording, time: &TimeAxis, rate: &[f64]) -> Result<()> {
        let fit = identify::fit(time, rate, &self.fit)?;
        let left = fit.without_colour(fit.residuals(time, rate));
        let validation = validate::whiteness(time, &left, &fit.jacobian(time), &self.whiteness);
        row.earth_rate_rad_s = self.earth.map(|e| e.vertical_rad_s);
        row.fill(recording, &fit, &validation);
        Ok(())
    }
}
