//! worth = min over truth i and rival j of E[ln p(logs | i) - ln p(logs | j)]:  which next experiment tells apart what a log leaves open
//!
//! Effects that explain a log alike are its rivals, each with the size that it has when it is fitted to the log. For every
//! experiment and every rival as the truth, the log and the experiment are simulated with the noises of the configuration. The
//! evidence by which the truth would then be preferred is that of the diagnosis: of drives the expected evidence of its
//! linearised model, chance left out (`drives`), at rest the mean over simulated recordings (`at_rest`).
//!
//! The log-likelihood ratio of two laws is normal with the mean E and the variance 2 E, where noise is Gaussian (Cox and Hinkley,
//! Theoretical Statistics (1974), section 9.3). The diagnosis tells effects apart from g nats on, so that it does so with the
//! probability Φ((E - g)/√(2 E)).

mod at_rest;
mod courses;
mod drives;
mod inputs;
mod planned;
mod rivals;
mod worth;

pub use planned::{Options, Plan, Suggestion, plan};
pub use rivals::Rival;
pub use worth::{Command, Pair};

#[cfg(test)]
mod tests;
