//! A recording drawn from what is believed: coefficients, paths, jumps, noise, outliers, lattice.

use super::StateSpaceModel;
use crate::error::Result;
use crate::math::random::Stream;

impl StateSpaceModel {
    /// One recording, rad/s: stream `stream` of `seed`. Everything is drawn, also what a real unit would keep from run to run.
    ///
    /// # Errors
    /// As `StateSpaceModel::check`.
    pub(crate) fn simulate(&self, seed: u64, stream: u64) -> Result<Vec<f64>> {
        self.check()?;
        let mut draw = Stream::new(seed, stream);
        let mut y: Vec<f64> = (0..self.rows).map(|k| self.fixed_at(k)).collect();
        for c in &self.coefficients {
            let beta = c.mean + c.std * draw.normal();
            y.iter_mut().zip(&c.column).for_each(|(y, x)| *y += beta * x);
        }
        for m in &self.markov {
            let std = m.variance.sqrt();
            let mut state = m.initial_variance.sqrt() * draw.normal();
            for y in &mut y {
                *y += state;
                state = m.decay * state + std * draw.normal();
            }
        }
        for o in &self.oscillators {
            let (std, drive) = (o.variance.sqrt(), o.drive_variance().sqrt());
            let (sin, cos) = o.angle_rad.sin_cos();
            let [mut re, mut im] = [std * draw.normal(), std * draw.normal()];
            for y in &mut y {
                *y += re;
                (re, im) = (
                    o.decay * (cos * re - sin * im) + drive * draw.normal(),
                    o.decay * (sin * re + cos * im) + drive * draw.normal(),
                );
            }
        }
        self.add_jumps(&mut y, &mut draw);
        self.add_noise(&mut y, &mut draw)?;
        if let Some(outliers) = &self.outliers {
            for y in &mut y {
                if draw.uniform() < outliers.probability {
                    *y += outliers.std_rad_s * draw.normal();
                }
            }
        }
        if let Some(lsb) = self.lattice_lsb_rad_s {
            y.iter_mut().for_each(|y| *y = lsb * (*y / lsb).round());
        }
        Ok(y)
    }

    fn add_jumps(&self, y: &mut [f64], draw: &mut Stream) {
        if let Some(telegraph) = &self.telegraph {
            let leave = telegraph.leave(self.step_s);
            let mut level = usize::from(draw.uniform() < telegraph.high_probability());
            for y in y.iter_mut() {
                *y += telegraph.levels_rad_s[level];
                if draw.uniform() < leave[level] {
                    level = 1 - level;
                }
            }
        }
        if let Some(step) = &self.step {
            let at = step.at.start + (draw.uniform() * step.at.len() as f64) as usize;
            y.iter_mut().skip(at).for_each(|y| *y += step.size_rad_s);
        }
    }

    fn add_noise(&self, y: &mut [f64], draw: &mut Stream) -> Result<()> {
        let Some(low_pass) = &self.low_pass else {
            for (k, y) in y.iter_mut().enumerate() {
                *y += self.white_std_at(k) * draw.normal();
            }
            return Ok(());
        };
        if self.rows == 0 {
            return Ok(());
        }
        // the first state from the stationary covariance, by its Cholesky factor
        let order = low_pass.order();
        let covariance = nalgebra::DMatrix::from_row_slice(order, order, &low_pass.stationary_covariance()?);
        let normal = nalgebra::DVector::from_fn(order, |_, _| draw.normal());
        let first = match covariance.cholesky() {
            Some(factor) => factor.l() * normal,
            None => nalgebra::DVector::zeros(order), // singular to rounding: it fills itself
        };
        let mut x: Vec<f64> = first.iter().map(|v| v * self.white_std_at(0)).collect();
        for (k, y) in y.iter_mut().enumerate() {
            if k > 0 {
                low_pass.advance(&mut x);
                x[0] += self.white_std_at(k) * draw.normal();
            }
            *y += low_pass.ma.iter().zip(&x).map(|(b, x)| b * x).sum::<f64>();
        }
        Ok(())
    }
}
