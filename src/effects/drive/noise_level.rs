//! white noise of an instrument ~ N(0, (n σ_nominal)²)

use super::contract::{DriveExplanation, Driving};
use super::on_log::{OnLog, Stage, channels};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::effects::parts::Checked;
use crate::error::Result;
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Instrument};

const OVER: &str = "noise_over_nominal";
const PARAMETERS: &[Parameter] =
    &[Parameter { name: OVER, meaning: "n", bounds: [0.01, 100.0], null: Some(1.0), required: true }];

/// White noise of one instrument that is larger or smaller than stated.
pub(super) struct NoiseLevel {
    instrument: Instrument,
    about: About,
}

/// Of the gyro.
pub(super) static GYRO: NoiseLevel = NoiseLevel {
    instrument: Instrument::Gyro,
    about: About {
        id: "gyro.noise_level",
        title: "gyro noise off nominal",
        equation: "reading = ω + e(t) + N(0, n² σ²): σ is the stated white noise",
        source: "IEEE Std 952-1997, annex C: angle random walk",
        channel: "gyro",
        deficient: "gyro measurement: its white noise is not as large as stated",
        condition: None,
        parameters: PARAMETERS,
        remedy: "Enter the angle random walk that this gyro has, and look at its mounting where that is larger than its data sheet's.",
    },
};

/// Of both encoders.
pub(super) static WHEELS: NoiseLevel = NoiseLevel {
    instrument: Instrument::Wheels,
    about: About {
        id: "encoder.noise_level",
        title: "encoder noise off nominal",
        equation: "reading_i = wheel_i + N(0, n² σ²) of both wheels: σ is the stated white noise",
        source: "Borenstein, Everett and Feng, Where am I? (1996), section 1.1",
        channel: "wheels",
        deficient: "wheel measurement: its white noise is not as large as stated",
        condition: None,
        parameters: PARAMETERS,
        remedy: "Enter the noise that these encoders have.",
    },
};

/// Of the external reference, position and heading alike.
pub(super) static POSE: NoiseLevel = NoiseLevel {
    instrument: Instrument::Pose,
    about: About {
        id: "pose.noise_level",
        title: "reference noise off nominal",
        equation: "reading = [x, y, θ] + N(0, n² σ²): σ is the stated white noise of each",
        source: "Merriaux et al., A study of Vicon system positioning performance (2017)",
        channel: "pose",
        deficient: "pose measurement: its white noise is not as large as stated",
        condition: None,
        parameters: PARAMETERS,
        remedy: "Enter the noise that this reference has.",
    },
};

impl Driving for NoiseLevel {
    fn about(&self) -> &'static About {
        match self.instrument {
            Instrument::Gyro => &GYRO.about,
            Instrument::Wheels => &WHEELS.about,
            Instrument::Pose => &POSE.about,
        }
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        match self.instrument {
            Instrument::Gyro => Tried::gyro(&[("noise_over_nominal", 2.0)]),
            Instrument::Wheels => Tried::wheels(&[("noise_over_nominal", 2.0)]),
            Instrument::Pose => Tried::pose(&[("noise_over_nominal", 2.0)]),
        }
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::NoiseLevel(self.instrument)
    }

    fn on_log(&self, parameters: &Parameters) -> std::result::Result<OnLog, &'static str> {
        if parameters.get(OVER).is_some_and(|over| *over < 1.0) {
            return Err("noise cannot be taken out of a log: lower it where the simulator draws it");
        }
        let value = "value + std(name) * np.sqrt(noise_over_nominal**2 - 1) * rng.normal(size=t.size)";
        Ok(OnLog::drawn(Stage::Noise, channels(self.instrument), value))
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        let over = Checked::of(self.about(), parameters)?.value(OVER)?;
        Ok(Box::new(Work { instrument: self.instrument, over }))
    }
}

struct Work {
    instrument: Instrument,
    over: f64,
}

impl DriveEffect for Work {
    fn noise_over_nominal(&self, instrument: Instrument) -> f64 {
        if instrument == self.instrument { self.over } else { 1.0 }
    }

    fn in_filter(&self) -> InFilter {
        InFilter::Noise(self.instrument, self.over)
    }
}
