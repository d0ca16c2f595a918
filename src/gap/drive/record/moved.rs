//! reading(t) = y(t - τ), stamped τ earlier:   whole rows of τ are moved, the rest is left to the model
//!
//! Where sensors share their rows, the diffusion of the speeds depends on the rows: readings move from row to row.

use super::Record;
use crate::model::drive::Instrument;

impl Record {
    /// Whether most readings of the wheels stand in rows in which the gyro reads, or there is no gyro.
    pub(crate) fn wheels_share_rows(&self) -> bool {
        let Some(gyro) = &self.gyro_rad_s else { return true };
        let wheels = &self.wheels_rad_s[0];
        let both = gyro.iter().zip(wheels).filter(|(g, w)| g.is_finite() && w.is_finite()).count();
        2 * both > wheels.iter().filter(|w| w.is_finite()).count()
    }

    /// With the readings of one instrument this many rows earlier, in each drive; the last rows have none.
    pub(crate) fn earlier(&self, of: Instrument, rows: usize) -> Self {
        self.by_drive(|_, drive| {
            let mut out = drive.clone();
            let gyro = out.gyro_rad_s.iter_mut().filter(|_| of == Instrument::Gyro);
            let wheels = out.wheels_rad_s.iter_mut().filter(|_| of == Instrument::Wheels);
            let pose = out.pose.iter_mut().flatten().filter(|_| of == Instrument::Pose);
            for readings in gyro.chain(wheels).chain(pose) {
                let rows = rows.min(readings.len());
                readings.rotate_left(rows);
                let kept = readings.len() - rows;
                readings[kept..].fill(f64::NAN);
            }
            out
        })
    }

    /// Whole rows in a delay of one instrument, s; zero where gyro and wheels do not share rows.
    pub(crate) fn whole_rows(&self, of: Instrument, delay_s: f64) -> usize {
        let moves = of == Instrument::Pose || self.wheels_share_rows();
        if moves { (delay_s / self.step_s * (1.0 + 1e-9)).floor().max(0.0) as usize } else { 0 }
    }

    /// With the readings of one instrument, late by `delay_s`, moved earlier by whole rows, and the remaining delay, s.
    /// None where there is no whole row to move.
    pub(crate) fn by_whole_rows(&self, of: Instrument, delay_s: f64) -> (Option<Self>, f64) {
        let rows = self.whole_rows(of, delay_s);
        if rows == 0 {
            return (None, delay_s);
        }
        (Some(self.earlier(of, rows)), (delay_s - rows as f64 * self.step_s).max(0.0))
    }
}
