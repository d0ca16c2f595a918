//! Free forms: what competes as 'unknown'. Each is flexible in one respect (time, a covariate, its rate, the spectrum, the
//! phase of something periodic) and pays for its freedom in evidence, so that it wins only where no named effect fits.

mod covariate;
mod periodic;
mod spectrum;
mod time;

pub(crate) use covariate::{CovariateForm, Follows, RateForm};
pub(crate) use periodic::Comb;
pub(crate) use spectrum::FreeSpectrum;
pub(crate) use time::SmoothTime;
