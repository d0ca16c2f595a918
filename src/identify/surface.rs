//! A sum of squares over T, C1 and C2 at their best: what the search and the profile intervals look at. Plain least
//! squares over the samples is one ([`super::projection`]), squares weighed by a random walk the other
//! ([`super::weighted`]).

/// Best linear parameters at one T.
#[derive(Debug, Clone, Copy)]
pub(super) struct Linear {
    pub c1: f64,
    /// Counts from the moments' reference.
    pub c2: f64,
    pub rss: f64,
}

/// Sum of squares as a function of T.
pub(super) trait Surface {
    /// Best linear parameters at `time_constant`, and the sum of squares with them.
    fn linear_at(&self, time_constant: f64) -> Linear;

    /// Inverse normal matrix of (c1, c2) at `time_constant`; zero for a given one.
    fn inverse_normal(&self, time_constant: f64) -> [[f64; 2]; 2];

    /// Time since power-on of the zero of g's clock, s.
    fn clock_s(&self) -> f64;

    /// Rate that c2 is measured from, rad/s.
    fn reference(&self) -> f64;

    /// The sum of squares at ln T.
    fn rss(&self, ln_t: f64) -> f64 {
        self.linear_at(ln_t.exp()).rss
    }
}
