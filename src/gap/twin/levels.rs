//! σ²_g = ⟨d_g (d_g - d_w)⟩/6,   σ²_w = ⟨d_w (d_w - d_g)⟩/6,   d(k) = x(k-1) - 2 x(k) + x(k+1)
//!
//! White noise of the gyro (g) and of the yaw rate that the wheels tell (w), in a drive without torques: nothing tells its motion, but
//! what both read is motion, and what one reads alone is its noise (Grubbs 1948, Estimating precision of measuring instruments).
//! Second differences leave what changes from reading to reading, and 6 σ² of white noise. A recording is compared with the
//! simulator's log: what the two instruments do not share of the motion stands in both.

use super::compared::{Compared, Inherited, Said, presence};
use crate::config::{Config, EffectTable};
use crate::effects::drive::DriveExplanation;
use crate::effects::{About, Library, Parameters};
use crate::gap::answer::{EffectAnswer, Place, Verdict};
use crate::gap::drive::preprocess::level::price;
use crate::gap::drive::record::Record;
use crate::gap::selection::findings::Findings;
use crate::gap::trace::{Decision, Step, TraceStage};
use crate::math::robust::{SECOND_DIFFERENCE, mad_std, median};
use crate::model::drive::Instrument;

/// Stretches of a log over each of which the products are averaged: their scatter tells the error, also where noise comes and goes.
const BLOCKS: usize = 64;
/// Fewest products in one of them.
const FEWEST: usize = 16;
/// Standard deviation of a median of n normal values over that of one, times √n: √(π/2).
const OF_MEDIAN: f64 = 1.253_314_137_315_5;
/// Standard deviations by which what both read may fall before one of them is late: then neither reads what the other does.
const LATE: f64 = 4.0;
/// Smallest variance of a reading over that of the twin.
const LEAST: f64 = 1e-2;

/// Variances of white noise in a log, rad²/s².
struct Whites {
    gyro: Said,
    /// Of one wheel.
    wheels: Said,
    /// Of the yaw rate that gyro and wheels both read.
    common: Said,
    /// Number of products.
    count: usize,
}

/// Noise of an instrument that differs between simulator and recording.
#[derive(Debug, Clone, Copy)]
pub(super) struct LevelChange {
    of: Instrument,
    /// Its effect.
    about: &'static About,
    /// Variance of a reading in the simulator's log, rad²/s².
    simulator: Said,
    /// The same in the recording.
    real: Said,
    /// Evidence that they differ, one parameter paid, nats.
    nats: f64,
}

impl LevelChange {
    /// Standard deviations of the recording's and of the simulator's noise over that of the simulator, and their ratio.
    fn ratios(&self) -> [Said; 3] {
        let over = |variance: Said| {
            let value = (variance.value.max(0.0) / self.simulator.value).sqrt();
            let of_square = variance.std / self.simulator.value;
            // √x is as good as straight where x is far from zero
            Said { value, std: of_square / (2.0 * value.max(of_square.sqrt())) }
        };
        let [real, simulator] = [self.real, self.simulator].map(over);
        [real, simulator, Said { value: real.value, std: real.std.hypot(real.value * simulator.std) }]
    }

    /// Standard deviation of the twin's noise with the change, over that of the twin, which holds motion as well.
    fn over_twin(&self, twin: &Config, step_s: f64) -> f64 {
        let own = match self.of {
            Instrument::Gyro => twin.gyro.as_ref().map_or(0.0, |g| g.angle_random_walk_rad_sqrt_s.powi(2) / step_s),
            _ => twin.encoder.as_ref().map_or(0.0, |e| e.speed_noise_std_rad_s.powi(2)),
        };
        (1.0 + (self.real.value - self.simulator.value) / own).max(LEAST).sqrt()
    }

    /// Changes the noise of `twin`, whose rows are `step_s` apart.
    pub(super) fn enter(&self, twin: &mut Config, step_s: f64) {
        let by = self.over_twin(twin, step_s);
        match (self.of, &mut twin.gyro, &mut twin.encoder) {
            (Instrument::Gyro, Some(gyro), _) => gyro.angle_random_walk_rad_sqrt_s *= by,
            (Instrument::Wheels, _, Some(encoder)) => encoder.speed_noise_std_rad_s *= by,
            _ => {}
        }
    }

    /// As an effect of the answer; no surer than its evidence makes it.
    fn answer(&self, findings: &Findings, temperature: f64) -> EffectAnswer {
        let [.., ratio] = self.ratios();
        let name = self.about.size().to_owned();
        EffectAnswer {
            evidence_nats: Some(self.nats),
            parameters: Parameters::from([(name.clone(), ratio.value)]),
            std: Parameters::from([(name, ratio.std)]),
            ..EffectAnswer::new(self.about.id, presence(self.nats, findings, temperature))
        }
    }

    fn held(&self) -> Inherited {
        let [real, simulator, difference] = self.ratios();
        let simulator = Some(simulator);
        Inherited {
            id: self.about.id.into(),
            parameter: self.about.size().into(),
            real,
            simulator,
            difference,
            is_gap: true,
        }
    }
}

/// Median of the means of as many stretches, with its standard deviation.
fn of_stretches(products: &[f64]) -> Said {
    let length = products.len().div_ceil(BLOCKS);
    let mut means: Vec<f64> = products.chunks(length).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
    let value = median(&mut means);
    let root = (means.len() as f64).sqrt();
    Said { value, std: OF_MEDIAN * mad_std(&mut means, value) / root }
}

fn whites(record: &Record) -> Option<Whites> {
    let gyro = record.gyro_rad_s.as_ref()?;
    let rolled: Vec<f64> = (0..record.len()).map(|k| record.rolling(k)[1]).collect();
    let bend = |x: &[f64], k: usize| x[k - 1] - 2.0 * x[k] + x[k + 1];
    let both: Vec<[f64; 2]> = record
        .drives()
        .flat_map(|rows| rows.start + 1..rows.end.saturating_sub(1))
        .map(|k| [bend(gyro, k), bend(&rolled, k)])
        .filter(|d| d.iter().all(|d| d.is_finite()))
        .collect();
    if both.len() < BLOCKS * FEWEST {
        return None;
    }
    let mean = |product: &dyn Fn([f64; 2]) -> f64| {
        let each: Vec<f64> = both.iter().map(|d| product(*d) / SECOND_DIFFERENCE).collect();
        of_stretches(&each)
    };
    // a yaw rate is the difference of two wheels, each with noise of its own
    let robot = &record.belief.robot;
    let share = robot.radius_m.iter().map(|r| (r / (2.0 * robot.half_track_m)).powi(2)).sum::<f64>();
    let rolling = mean(&|[g, w]| w * (w - g));
    Some(Whites {
        gyro: mean(&|[g, w]| g * (g - w)),
        wheels: Said { value: rolling.value / share, std: rolling.std / share },
        common: mean(&|[g, w]| g * w),
        count: both.len(),
    })
}

/// Noise of gyro and wheels that differs by `least_nats` between the simulator's log and a recording of the same step, both without
/// torques; none without a gyro.
pub(super) fn changes(simulator: &Record, real: &Record, library: &Library, least_nats: f64) -> Vec<LevelChange> {
    let (Some(there), Some(here)) = (whites(simulator), whites(real)) else { return Vec::new() };
    let z = |a: Said, b: Said| (b.value - a.value) / a.std.hypot(b.std);
    if z(there.common, here.common) < -LATE {
        return Vec::new();
    }
    let price = price(here.count.min(there.count));
    // rounding that is coarser than the noise of the wheels hides it
    let rounded = [simulator, real].iter().any(|r| r.wheel_lsb_rad_s().is_some());
    [(Instrument::Gyro, there.gyro, here.gyro), (Instrument::Wheels, there.wheels, here.wheels)]
        .into_iter()
        .filter(|(of, ..)| *of != Instrument::Wheels || !rounded)
        .filter_map(|(of, simulator, real)| {
            let nats = 0.5 * z(simulator, real).powi(2) - price;
            // less than its own error is not told: the ratio is then the least that is likely
            let simulator = Said { value: simulator.value.max(simulator.std), ..simulator };
            let own = |e: &DriveExplanation| matches!(e, DriveExplanation::NoiseLevel(level) if *level == of);
            let about = library.driving().find(|e| own(&e.explanation()))?.about();
            Some(LevelChange { of, about, simulator, real, nats })
        })
        .filter(|change| change.nats >= least_nats)
        .collect()
}

/// Names the levels in a comparison that was made beside them; `twin`: without them, its rows `step_s` apart.
pub(super) fn name(compared: &mut Compared, changes: &[LevelChange], twin: &Config, step_s: f64, temperature: f64) {
    let Compared { diagnosis, held_against } = compared;
    let (answer, augmented) = (&mut diagnosis.answer, &mut diagnosis.augmented);
    augmented.gyro.clone_from(&twin.gyro);
    augmented.encoder.clone_from(&twin.encoder);
    augmented.provenance = None;
    let mut found: Vec<&LevelChange> = changes.iter().collect();
    found.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    for change in found.iter().rev() {
        let id = change.about.id;
        answer.effects.retain(|e| e.id != id);
        answer.effects.insert(0, change.answer(&diagnosis.findings, temperature));
        answer.together.push(id.into());
        held_against.push(change.held());
        let size = change.over_twin(twin, step_s);
        let parameters = Parameters::from([(change.about.size().to_owned(), size)]);
        augmented.effects.push(EffectTable { id: id.into(), parameters });
        let [simulator, real] = [change.simulator, change.real].map(|s| s.value.max(0.0).sqrt());
        let said = format!(
            "White noise of {}: {real:.3e} rad/s in the recording, {simulator:.3e} rad/s in the simulator's log. What gyro and wheels \
             both read is motion, what one reads alone is its noise.",
            if change.of == Instrument::Gyro { "the gyro" } else { "a wheel" }
        );
        answer.trace.push(Step::new(TraceStage::Naming, id, Decision::Taken, said.as_str()).nats(change.nats));
        answer.notes.push(said);
    }
    if let (Verdict::None, Some(main)) = (answer.verdict, found.first()) {
        let presence = answer.effects.iter().find(|e| e.id == main.about.id).map_or(0.0, |e| e.probability);
        answer.verdict = Verdict::Identified;
        answer.main = Some(main.about.id.into());
        answer.main_probability = presence * (1.0 - answer.unknown_probability);
        answer.none_probability = (1.0 - answer.main_probability - answer.unknown_probability).max(0.0);
        answer.place = Some(Place::of(main.about));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::drive::preprocess::clocks::tests::{recorded, robot};
    use crate::math::random::Stream;

    /// A gyro that is late reads another motion than the wheels: what neither shares with the other is then no noise.
    #[test]
    fn a_late_gyro_is_not_noisy_instruments() {
        let [simulator, mut late] = [1, 2].map(|seed| record(seed, [1.0; 2]));
        late.gyro_rad_s.as_mut().unwrap().rotate_right(3);
        assert!(changes(&simulator, &late, &Library::default(), 3.0).is_empty());
    }

    /// A drive without torques, with gyro and wheels so many times as noisy.
    fn record(seed: u64, [gyro, wheels]: [f64; 2]) -> Record {
        let mut record = Record::new(&robot(), &recorded(90.0, seed, None), 0.0).unwrap();
        record.torques_n_m = None;
        let mut draw = Stream::new(seed, 7);
        let belief = record.belief;
        let mut louder = |readings: &mut Vec<f64>, std: f64, over: f64| {
            readings.iter_mut().for_each(|x| *x += std * (over * over - 1.0).sqrt() * draw.normal());
        };
        louder(record.gyro_rad_s.as_mut().unwrap(), belief.gyro_std_rad_s, gyro);
        record.wheels_rad_s.iter_mut().for_each(|wheel| louder(wheel, belief.wheel_std_rad_s, wheels));
        record
    }

    fn found(over: [f64; 2]) -> Vec<LevelChange> {
        changes(&record(1, [1.0; 2]), &record(2, over), &Library::default(), 3.0)
    }

    #[test]
    fn what_one_instrument_reads_alone_is_its_noise() {
        let record = record(1, [1.0; 2]);
        let told = whites(&record).unwrap();
        for (said, truth) in [(told.gyro, record.belief.gyro_std_rad_s), (told.wheels, record.belief.wheel_std_rad_s)] {
            assert!((said.value - truth * truth).abs() < 4.0 * said.std, "{said:?} for {}", truth * truth);
            assert!(said.std < 0.2 * said.value, "{said:?}");
        }
    }

    #[test]
    fn noise_that_differs_is_told_with_its_size() {
        assert!(found([1.0; 2]).is_empty());
        for (over, of) in [([2.0, 1.0], Instrument::Gyro), ([1.0, 1.5], Instrument::Wheels)] {
            let [change] = found(over)[..] else { panic!("{over:?}") };
            let [.., ratio] = change.ratios();
            assert_eq!(change.of, of);
            assert!((ratio.value - over[0].max(over[1])).abs() < 4.0 * ratio.std && ratio.std < 0.25, "{ratio:?}");
        }
    }
}
