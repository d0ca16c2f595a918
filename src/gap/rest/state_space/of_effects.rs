//! State-space model of a simulator with effects: effects and parameters → [`StateSpaceModel`]

use super::{Coefficient, LowPass, Markov, Oscillator, Outliers, StateSpaceModel, Step, Telegraph, flicker};
use crate::effects::{Explanation, Library, NoiseState, Parameters};
use crate::error::{Error, ErrorKind, Result};
use crate::model::Scene;

/// Order of the ARMA filter that colours the white noise.
const LOW_PASS_ORDER: usize = 12;

/// Predictive model of the nominal simulator with `effects` for a recording in `scene`. Quantities drawn anew in each
/// run (phase of a tone, time of a step, random path) are random in the model.
///
/// # Errors
/// [`ErrorKind::Config`] if the library does not know an effect or a parameter is missing; [`ErrorKind::Column`] if the
/// recording lacks the quantity that an effect is a function of.
pub(crate) fn believed(scene: &Scene, library: &Library, effects: &[(String, Parameters)]) -> Result<StateSpaceModel> {
    let mut b = StateSpaceModel::nominal(scene);
    for (id, parameters) in effects {
        let effect = library.by_id(id).ok_or_else(|| {
            Error::new(ErrorKind::Config, "configuration", format!("no effect at rest is called {id:?}"))
        })?;
        let about = effect.about();
        let value = |name: &str| {
            parameters.get(name).copied().ok_or_else(|| {
                Error::new(ErrorKind::Config, "configuration", "the parameter is missing")
                    .at(format!("`effect.{id}.{name}`"))
            })
        };
        let missing = || {
            let found = format!("nothing that {id} could follow: temperature or supply is not logged, or constant");
            Error::new(ErrorKind::Column, "recording", found).hint("log it, or leave the effect out")
        };
        match effect.explanation(scene).ok_or_else(missing)? {
            Explanation::Signal(s) | Explanation::Line(s) => match s.shape(scene, parameters).filter(|_| !s.is_event())
            {
                None if s.is_event() => b.step = Some(any_time(scene, value(about.size())?)),
                // without a shape a parameter is missing
                None => {
                    about.parameters.iter().filter(|p| p.required).try_for_each(|p| value(p.name).map(drop))?;
                    return Err(missing());
                }
                Some(shape) => {
                    let columns = s.columns(scene, &shape);
                    match s.coefficients(scene, &shape, parameters) {
                        Some(known) => {
                            let fixed = b.fixed_rad_s.get_or_insert_with(|| vec![0.0; scene.len()]);
                            if let Some(offset) = s.offset(scene, &shape) {
                                fixed.iter_mut().zip(&offset).for_each(|(f, v)| *f += v);
                            }
                            for (column, c) in columns.iter().zip(known) {
                                fixed.iter_mut().zip(&column.values).for_each(|(f, v)| *f += c * v);
                            }
                        }
                        None => {
                            let stds = s.prior_std(parameters).unwrap_or_default();
                            let open = columns.into_iter().zip(stds);
                            b.coefficients.extend(open.map(|(c, std)| Coefficient {
                                column: c.values,
                                mean: 0.0,
                                std,
                            }));
                        }
                    }
                }
            },
            Explanation::Noise(n) => {
                let theta = n.names().into_iter().map(value).collect::<Result<Vec<f64>>>()?;
                match n.state(&theta).ok_or_else(missing)? {
                    NoiseState::Walk(walk) => b.markov.push(Markov::random_walk(walk, scene.step_s)),
                    NoiseState::Flicker(instability) => b.markov.extend(flicker(instability, scene.len())?.states),
                    NoiseState::Exponential { time_s, std_rad_s } => {
                        b.markov.push(Markov::gauss_markov(time_s, std_rad_s, scene.step_s));
                    }
                    NoiseState::Band { center_hz, width_hz, std_rad_s } => {
                        b.oscillators.push(Oscillator::band(center_hz, width_hz, std_rad_s, scene.step_s));
                    }
                }
            }
            Explanation::Level(n) => {
                let theta = n.names().into_iter().map(value).collect::<Result<Vec<f64>>>()?;
                b.white_std_rad_s *= n.spectrum(scene, &theta, std::f64::consts::PI).sqrt();
            }
            Explanation::Filter(n) => {
                let or_usual = |name: &str| match n.unless_stated(name) {
                    Some(usual) => Ok(parameters.get(name).copied().unwrap_or(usual)),
                    None => value(name),
                };
                let theta = n.names().into_iter().map(or_usual).collect::<Result<Vec<f64>>>()?;
                b.low_pass = Some(LowPass::from_power(|omega| n.spectrum(scene, &theta, omega), LOW_PASS_ORDER)?);
            }
            Explanation::Variance(s) => {
                let columns = s.columns(scene, &[]);
                let known = s.coefficients(scene, &[], parameters).ok_or_else(missing)?;
                let ln = |row: usize| columns.iter().zip(&known).map(|(c, a)| a * c.values[row]).sum::<f64>();
                b.white_scale = Some((0..scene.len()).map(|row| (0.5 * ln(row)).clamp(-10.0, 10.0).exp()).collect());
            }
            Explanation::TurnOn => {
                if let Some(c2) = b.coefficients.first_mut() {
                    c2.mean += value(about.size())?;
                }
            }
            Explanation::TwoLevels => {
                let (spacing, dwell) = (value(about.name(0))?, value(about.name(1))?);
                let ratio = parameters.get(about.name(2)).copied().unwrap_or(1.0);
                // the ratio is of the upper level's dwell time over the lower one's, their mean is given
                let low = 2.0 * dwell / (1.0 + ratio);
                let least = scene.step_s;
                b.telegraph = Some(Telegraph::centred(spacing, [low.max(least), (ratio * low).max(least)]));
            }
            Explanation::Outliers { usual_size } => {
                let size_rad_s = parameters.get(about.name(1)).copied();
                let std_rad_s = size_rad_s.unwrap_or(usual_size * scene.white_std_rad_s);
                b.outliers = Some(Outliers { probability: value(about.size())?, std_rad_s });
            }
            Explanation::Lattice => b.lattice_lsb_rad_s = Some(value(about.size())?),
        }
    }
    Ok(b)
}

fn any_time(scene: &Scene, size_rad_s: f64) -> Step {
    let margin = scene.len() / 200;
    Step { size_rad_s, at: margin..scene.len() - margin }
}
