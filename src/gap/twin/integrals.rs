//! ∫ f dt of readings, by the trapezoidal rule, from every second one

/// Integral of one channel from its first reading on.
#[derive(Debug, Clone)]
pub(super) struct Integral {
    times_s: Vec<f64>,
    values: Vec<f64>,
    sums: Vec<f64>,
}

impl Integral {
    /// Of the finite ones of `values`; of two halves of them, `half` picks the even (0) or odd ones (1), whose errors are
    /// independent. None with fewer than two.
    pub(super) fn half(times_s: &[f64], values: &[f64], half: usize) -> Option<Self> {
        let there = times_s.iter().zip(values).filter(|(_, v)| v.is_finite());
        Self::over(there.enumerate().filter(|(i, _)| i % 2 == half).map(|(_, (t, v))| (*t, *v)))
    }

    /// Of all finite values.
    pub(super) fn whole(times_s: &[f64], values: &[f64]) -> Option<Self> {
        Self::over(times_s.iter().zip(values).filter(|(_, v)| v.is_finite()).map(|(t, v)| (*t, *v)))
    }

    /// Of a torque, which holds from its row to the next.
    pub(super) fn held(times_s: &[f64], values: &[f64]) -> Option<Self> {
        let mut doubled = Vec::with_capacity(2 * values.len());
        for (k, (t, v)) in times_s.iter().zip(values).enumerate() {
            doubled.push((*t, *v));
            doubled.extend(times_s.get(k + 1).map(|next| (*next, *v)));
        }
        Self::over(doubled.into_iter())
    }

    fn over(readings: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let (times_s, values): (Vec<f64>, Vec<f64>) = readings.unzip();
        let mut sums = vec![0.0; times_s.len()];
        for k in 1..times_s.len() {
            sums[k] = sums[k - 1] + 0.5 * (times_s[k] - times_s[k - 1]) * (values[k] + values[k - 1]);
        }
        (times_s.len() > 1).then_some(Self { times_s, values, sums })
    }

    /// Up to `t_s`; beyond its ends NaN.
    pub(super) fn at(&self, t_s: f64) -> f64 {
        let k = self.times_s.partition_point(|t| *t <= t_s);
        if k == 0 || (k == self.times_s.len() && t_s > self.times_s[k - 1]) {
            return f64::NAN;
        }
        if k == self.times_s.len() {
            return self.sums[k - 1];
        }
        let (span, u) = (self.times_s[k] - self.times_s[k - 1], t_s - self.times_s[k - 1]);
        let slope = if span > 0.0 { (self.values[k] - self.values[k - 1]) / span } else { 0.0 };
        self.sums[k - 1] + u * (self.values[k - 1] + 0.5 * slope * u)
    }

    /// Between two times.
    pub(super) fn between(&self, window: [f64; 2]) -> f64 {
        self.at(window[1]) - self.at(window[0])
    }

    /// First and last time, s.
    pub(super) fn span_s(&self) -> [f64; 2] {
        [self.times_s[0], self.times_s[self.times_s.len() - 1]]
    }
}
