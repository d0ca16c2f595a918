//! Ids for the tests of other modules, each as its effect states it: such tests spell no id.

use super::Effect;

/// One function an effect, which returns its id.
macro_rules! ids {
    ($($name:ident: $effect:expr),+ $(,)?) => {
        $(pub(crate) fn $name() -> &'static str {
            $effect.about().id
        })+
    };
}
pub(super) use ids;

ids! {
    bandwidth: super::bandwidth::Bandwidth,
    bias_step: super::bias_step::BiasStep,
    gauss_markov: super::gauss_markov::GaussMarkov,
    outliers: super::outliers::Outliers,
    rate_ramp: super::rate_ramp::RateRamp,
    rate_random_walk: super::rate_random_walk::RateRandomWalk,
    tone: super::tone::Tone,
    warm_up: super::warm_up::AnotherWarmUp,
}
