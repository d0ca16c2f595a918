/// Error of the gyro, rad/s, at the next sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroBias {
    pub error_rad_s: f64,
}

impl GyroBias {
    /// After a cold power-on.
    pub const COLD: Self = Self { error_rad_s: INITIAL_RAD_S };

    /// After a power-on that finds the gyro with this error, rad/s.
    pub const fn at(error_rad_s: f64) -> Self {
        Self { error_rad_s }
    }

    /// The rate of the next sample without the error, rad/s.
    pub fn correct(&mut self, rate_rad_s: f64) -> f64 {
        let corrected = rate_rad_s - self.error_rad_s;
        self.error_rad_s = DECAY * self.error_rad_s + DRIVE_RAD_S;
        corrected
    }

    /// Samples that were missed.
    pub fn skip(&mut self, mut samples: u64) {
        let (mut left, mut decay) = (self.error_rad_s - WARM_RAD_S, DECAY);
        while samples > 0 {
            if samples % 2 == 1 {
                left *= decay;
            }
            decay *= decay;
            samples /= 2;
        }
        self.error_rad_s = WARM_RAD_S + left;
    }
}
