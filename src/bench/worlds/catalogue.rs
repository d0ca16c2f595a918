//! The effects by id.

use super::bias::{Ramp, SecondExponential, Step, Supply, Telegraph, Temperature, Tone, TurnOnShift};
use super::effect::Effect;
use super::noise_level::NoiseLevel;
use super::run::Unit;
use super::sensor::{Bandwidth, Lattice, NoiseGrowth, Outliers};
use super::unlisted::{Bursts, Chirp, Law, Periodic, Response, Ringing, Shots};
use super::unlisted_noise::{HeavyTails, Held, Level, Saturation};
use super::wandering::{Flicker, GaussMarkov, NarrowBand, RandomWalk};
use super::warm_up::WarmUp;
use crate::math::random::Stream;

/// Effects of a gyro at rest that have a name in the contract.
pub(crate) const LISTED: [&str; 18] = [
    "gyro.rate_random_walk",
    "gyro.bias_instability",
    "gyro.gauss_markov",
    "gyro.quantization",
    "gyro.rate_ramp",
    "gyro.second_time_constant",
    "gyro.temperature_sensitivity",
    "gyro.supply_sensitivity",
    "gyro.tone",
    "gyro.bias_step",
    "gyro.outliers",
    "gyro.telegraph_noise",
    "gyro.bandwidth",
    "gyro.noise_growth",
    "gyro.turn_on_shift",
    "gyro.warm_up",
    "gyro.noise_level",
    "gyro.narrow_band_noise",
];

/// Effects that are in no list.
pub(crate) const UNLISTED: [&str; 16] = [
    "x.chirp",
    "x.pulse_train",
    "x.sawtooth",
    "x.square_wave",
    "x.hysteresis",
    "x.temperature_rate",
    "x.supply_threshold",
    "x.shot_relaxation",
    "x.ringing_after_power_on",
    "x.modulated_tone",
    "x.noise_bursts",
    "x.noise_modulation",
    "x.heavy_tails",
    "x.saturation",
    "x.stuck_samples",
    "x.dead_band",
];

/// Effects that real units commonly have in small amounts.
pub(crate) const COMMON: [&str; 9] = [
    "gyro.bias_instability",
    "gyro.gauss_markov",
    "gyro.rate_random_walk",
    "gyro.rate_ramp",
    "gyro.second_time_constant",
    "gyro.supply_sensitivity",
    "gyro.temperature_sensitivity",
    "gyro.bias_step",
    "gyro.noise_growth",
];

/// One effect `id` of `unit`, its form drawn from `s`; none for an id that is in neither list.
pub(super) fn draw(id: &str, unit: &Unit, s: &mut Stream) -> Option<Box<dyn Effect>> {
    Some(match id {
        "gyro.rate_random_walk" => Box::new(RandomWalk::draw(s)),
        "gyro.bias_instability" => Box::new(Flicker::draw(unit.step_s, s)),
        "gyro.gauss_markov" => Box::new(GaussMarkov::draw(s)),
        "gyro.quantization" => Box::new(Lattice::draw(s)),
        "gyro.rate_ramp" => Box::new(Ramp::draw(s)),
        "gyro.second_time_constant" => Box::new(SecondExponential::draw(unit, s)),
        "gyro.temperature_sensitivity" => Box::new(Temperature::draw(s)),
        "gyro.supply_sensitivity" => Box::new(Supply::draw(s)),
        "gyro.tone" => Box::new(Tone::draw(unit, s)),
        "gyro.bias_step" => Box::new(Step::draw(s)),
        "gyro.outliers" => Box::new(Outliers::draw(s)),
        "gyro.telegraph_noise" => Box::new(Telegraph::draw(s)),
        "gyro.bandwidth" => Box::new(Bandwidth::draw(s)),
        "gyro.noise_growth" => Box::new(NoiseGrowth::draw(unit, s)),
        "gyro.turn_on_shift" => Box::new(TurnOnShift::draw(s)),
        "gyro.warm_up" => Box::new(WarmUp::draw(unit, s)),
        "gyro.noise_level" => Box::new(NoiseLevel::draw(s)),
        "gyro.narrow_band_noise" => Box::new(NarrowBand::draw(unit, s)),
        "x.chirp" => Box::new(Chirp::draw(unit, s)),
        "x.pulse_train" => Box::new(Periodic::pulses(s)),
        "x.sawtooth" => Box::new(Periodic::saw(s)),
        "x.square_wave" => Box::new(Periodic::square(s)),
        "x.hysteresis" => Box::new(Response::draw(Law::Hysteresis, s)),
        "x.temperature_rate" => Box::new(Response::draw(Law::Rate, s)),
        "x.supply_threshold" => Box::new(Response::draw(Law::Threshold, s)),
        "x.shot_relaxation" => Box::new(Shots::draw(s)),
        "x.ringing_after_power_on" => Box::new(Ringing::draw(unit, s)),
        "x.modulated_tone" => Box::new(Bursts::draw(unit, s)),
        "x.noise_bursts" => Box::new(Level::bursts(s)),
        "x.noise_modulation" => Box::new(Level::periodic(s)),
        "x.heavy_tails" => Box::new(HeavyTails),
        "x.saturation" => Box::new(Saturation),
        "x.stuck_samples" => Box::new(Held::stuck(s)),
        "x.dead_band" => Box::new(Held::dead_band()),
        _ => return None,
    })
}
