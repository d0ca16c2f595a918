//! Statements of the paper, row by row, and whether they hold: its equations, its figures, its claims.
//!
//! Rows that a measurement decides take their status from the study at hand.

use super::{StudyReport, factor};
use crate::report::numbers::{probability, significant};
use crate::study::{Comparison, Estimator};
use crate::traction::Surface;
use crate::units::{RAD_S_PER_DEG_S, duration_text};
use crate::vehicle::{Forcing, Motion, Slipping, advance};

/// How a statement of the paper fares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Status {
    /// It holds here as it stands.
    Reproduced,
    /// It holds after a change, which is named.
    Corrected,
    /// It does not hold, or cannot be tried; the reason is named.
    NotReproducible,
}

impl Status {
    /// Its name in tables.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::Corrected => "corrected",
            Self::NotReproducible => "not reproducible",
        }
    }

    /// Reproduced if `holds`.
    fn measured(holds: bool) -> Self {
        if holds { Self::Reproduced } else { Self::NotReproducible }
    }
}

/// A statement of the paper.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Claim {
    /// Equation, figure or section.
    pub place: &'static str,
    /// The statement in words of our own.
    pub says: &'static str,
    /// Whether it holds here.
    pub status: Status,
    /// Where it is in the library, what was changed, what was measured.
    pub here: String,
}

/// Text in place of a measurement whose estimators were left out.
const NOT_RUN: &str = "the estimators that would tell did not run";

fn claim(place: &'static str, says: &'static str, status: Status, here: impl Into<String>) -> Claim {
    Claim { place, says, status, here: here.into() }
}

use Status::{Corrected, NotReproducible, Reproduced};

impl StudyReport {
    /// All rows: equations, figures, claims in the order of the sections.
    #[must_use]
    pub(crate) fn claims(&self) -> Vec<Claim> {
        let mut rows = self.equations();
        rows.extend(self.figure_rows());
        rows.extend(self.model_claims());
        rows.extend(self.filter_claims());
        rows
    }

    fn equations(&self) -> Vec<Claim> {
        let euler = self.euler_limit();
        let gyro = self.setup.truth.gyro.as_ref();
        let too_large = gyro.zip(self.setup.truth.sample_time_s).map_or_else(String::new, |(g, step_s)| {
            format!(": here {} times too large", significant(g.time_constant_s / step_s, 3))
        });
        vec![
            claim(
                "(1)",
                "a wheel's force accelerates the mass, and the torque less force times radius spins it up",
                Corrected,
                "the mass is the robot's, as in (5), not the wheel's; viscous friction and rolling resistance are added: \
                 `vehicle::Slipping`",
            ),
            claim(
                "(2)",
                "the gyro's error at rest rises exponentially from C2 to C1 + C2",
                Reproduced,
                "`bias::WarmUp`, fitted by `gyroid fit`",
            ),
            claim(
                "(3)",
                "the same as a differential equation, begun at C2 with the slope C1/T",
                Reproduced,
                "`bias::Scheme::Exact` carries it without error from sample to sample; `navigate` holds it as a state",
            ),
            claim(
                "(4)",
                "its discrete form; the input's coefficient is printed as T/(T + Ts)",
                Corrected,
                format!(
                    "that must be Ts/(T + Ts), as (5j) has it; as printed the recursion ends at T/Ts times C1 + C2{too_large}"
                ),
            ),
            claim(
                "(5a)",
                "x grows by the velocity along x times Ts",
                Corrected,
                "an Euler step cuts the corners of a turn; `vehicle::advance` integrates v cos θ over the step, of order 6",
            ),
            claim("(5b)", "y likewise", Corrected, "v sin θ likewise"),
            claim(
                "(5c)",
                "θ grows by the yaw rate times Ts",
                Corrected,
                "closed form, with the change of the yaw rate inside the step: `vehicle::advance`",
            ),
            claim(
                "(5d)",
                "the difference of the wheels' forces turns the robot, with the robot's radius as lever",
                Corrected,
                "the lever is the half track, which equals the radius only where the wheels stand on the rim; `vehicle::AsPrinted` \
                 keeps the radius",
            ),
            claim("(5e)", "the sum of the forces, along θ, changes the velocity along x", Corrected, self.constraint()),
            claim("(5f)", "and that along y", Corrected, "as (5e): y' = v sin θ"),
            claim("(5g)", "torque less traction spins the left wheel", Corrected, euler.clone()),
            claim("(5h)", "likewise the right wheel", Corrected, euler),
            claim(
                "(5i)",
                "the sum of the forces changes the speed along the direction of motion",
                Reproduced,
                "`vehicle::Slipping`; the only equation of translation that is kept",
            ),
            claim(
                "(5j)",
                "the gyro's error by backward Euler",
                Reproduced,
                "`bias::Scheme::BackwardEuler`, for who wants it; it acts as a time constant longer by Ts/2, the default is exact",
            ),
        ]
    }

    /// (5e, f) against the corrected ones: a robot that turns without force.
    fn constraint(&self) -> String {
        let m = Motion { speed_m_s: 0.5, yaw_rate_rad_s: 0.5, ..Motion::default() };
        let after = advance(&m, &Forcing::default(), 10.0);
        // as printed nothing turns the velocity: the robot slides straight on along x
        let apart = (after.x_m - 5.0).hypot(after.y_m);
        format!(
            "the sideways force that holds the wheels in their track is missing, so that the velocity does not turn with \
             the robot: at 0.5 m/s and 0.5 rad/s without traction the two are {} m apart after 10 s \
             (`vehicle::AsPrinted` keeps it); x' = v cos θ instead",
            significant(apart, 2)
        )
    }

    /// Where the printed Euler step of the wheels diverges.
    fn euler_limit(&self) -> String {
        let truth = &self.setup.truth;
        let robot = truth.vehicle.as_ref().zip(truth.traction.as_ref()).map(|(v, t)| Slipping::new(v, t));
        let Some(robot) = robot else { return "the robot studied has no [traction]".into() };
        let rate = robot.slip_rate_per_s(0.5);
        let mut text = format!(
            "slip decays at {} 1/s at 0.5 m/s: the printed Euler step diverges beyond {} of sample time",
            significant(rate, 3),
            duration_text(2.0 / rate)
        );
        if let Some(step_s) = truth.sample_time_s {
            text += &format!(", and the sample time is {}", duration_text(step_s));
        }
        text + "; `vehicle::Slipping::step` is implicit and L-stable, `euler` is kept to compare"
    }

    fn figure_rows(&self) -> Vec<Claim> {
        let slip = self.slip_against_rolling();
        let better = |quantities: &[usize]| {
            Status::measured(slip.is_some_and(|c| quantities.iter().all(|i| c.factor_ci95[*i][0] > 1.0)))
        };
        let measured = |names: &[&str], first: usize, file: &str| {
            let part = names.iter().enumerate().map(|(k, name)| {
                let i = first + k;
                let Some(c) = &slip else { return NOT_RUN.to_string() };
                let ratio = factor(c.factor[i], c.factor_ci95[i]);
                let won = significant(100.0 * c.won[i], 3);
                format!("{name}: error without slip model over error with it {ratio}, nearer in {won} % of the runs")
            });
            format!("`{file}`; {}{}", part.collect::<Vec<_>>().join("; "), self.little_slip())
        };
        let one_run = |i: usize, file: &str| {
            let end = |e: Estimator| self.example_end(e, i);
            let (unit, per_si) = if i == 2 { ("°", 1.0 / RAD_S_PER_DEG_S) } else { ("m", 1.0) };
            let text = |e| end(e).map_or_else(|| "unknown".into(), |v: f64| significant(v.abs() * per_si, 2));
            let here = format!(
                "`{file}`; off at the end: {} {unit} with the slip model, {} {unit} without",
                text(Estimator::Slip),
                text(Estimator::Rolling)
            );
            let status = match (end(Estimator::Slip), end(Estimator::Rolling)) {
                (Some(_), Some(_)) => Reproduced,
                _ => NotReproducible,
            };
            (status, here)
        };
        let [five, six, seven] =
            [(0, "figure_5_x"), (1, "figure_6_y"), (2, "figure_7_heading")].map(|(i, file)| one_run(i, file));
        vec![
            claim(
                "Figure 1",
                "the robot on two wheels in its frame",
                Reproduced,
                "a drawing; its conventions are those of `vehicle`: θ counter-clockwise from x, left and right wheel",
            ),
            self.autocorrelation_row(),
            claim(
                "Figure 3",
                "the RMS error of x over 100 runs is smaller with the slip model",
                better(&[0]),
                measured(&["x"], 0, "figure_3_rms_x"),
            ),
            claim(
                "Figure 4",
                "so are those of y and θ",
                better(&[1, 2]),
                measured(&["y", "θ"], 1, "figure_4_rms_y_heading"),
            ),
            claim("Figure 5", "x and its two estimates in one run", five.0, five.1),
            claim("Figure 6", "y and its two estimates in one run", six.0, six.1),
            claim("Figure 7", "θ and its two estimates in one run", seven.0, seven.1),
        ]
    }

    fn autocorrelation_row(&self) -> Claim {
        let says =
            "the residuals' autocorrelation shows the identified error model to be valid; captioned as that of x";
        let validation = &self.identification.validation;
        let Some(level) = validation.levels.first() else {
            return claim("Figure 2", says, NotReproducible, "too few samples, or residuals that do not vary");
        };
        let r = level.whiteness.autocorrelation.get(1..).unwrap_or_default();
        let outside = r.iter().filter(|r| r.abs() > level.whiteness.autocorrelation_bound).count();
        let here = format!(
            "`figure_2_autocorrelation`, of the error model's residuals, as the text says, not of x; {}: {outside} of {} \
             lags outside the 95 % bounds, joint p {} over all averaging times",
            self.identification.log.name,
            r.len(),
            probability(validation.joint_p_value)
        );
        claim("Figure 2", says, if validation.white { Corrected } else { NotReproducible }, here)
    }

    /// Error of `estimator` in the example run's last row.
    fn example_end(&self, estimator: Estimator, quantity: usize) -> Option<f64> {
        let example = self.study.example.as_ref()?;
        let (_, poses) = example.estimates.iter().find(|(e, _)| *e == estimator)?;
        Some(poses.last()?[quantity] - example.truth.last()?[quantity])
    }

    /// How large the slips were: the reason where the slip model does not pay.
    fn little_slip(&self) -> String {
        self.largest_slip().map_or_else(String::new, |s| {
            format!("; on {} the wheels slip by {} % at most", self.ground.replace('_', " "), significant(100.0 * s, 2))
        })
    }

    /// Claim on the error model: heading error without it over that with it, for filters and the gyro alone.
    fn error_model_row(&self) -> Claim {
        let heading = |this: Estimator, other: Estimator| self.study.compare(this, other);
        let text =
            |c: Option<Comparison>| c.map_or_else(|| NOT_RUN.to_string(), |c| factor(c.factor[2], c.factor_ci95[2]));
        let filter = heading(Estimator::Slip, Estimator::SlipWithoutErrorModel);
        let here = format!(
            "`error_model`; heading error without the error model over that with it: filter with slip {}, without slip {}; \
             gyro integrated alone: raw {}, zeroed at the start {} (its sources speak of about 5)",
            text(filter),
            text(heading(Estimator::Rolling, Estimator::RollingWithoutErrorModel)),
            text(heading(Estimator::GyroReckoningModelled, Estimator::GyroReckoning)),
            text(heading(Estimator::GyroReckoningModelled, Estimator::GyroReckoningZeroed))
        );
        let holds = filter.is_some_and(|c| c.factor_ci95[2][0] > 1.0);
        claim(
            "Section 1",
            "cheap gyros drift, and a model of the error improves the estimate",
            Status::measured(holds),
            here,
        )
    }

    /// Whether a filter that holds the wheels to roll is surer than it may be.
    fn rolling_row(&self) -> Claim {
        let nees = |e: Estimator| self.study.of(e).and_then(|e| e.nees.as_ref());
        let says = "wheels that roll without slip are not always a realistic assumption";
        let (Some(slip), Some(rolling)) = (nees(Estimator::Slip), nees(Estimator::Rolling)) else {
            return claim("Section 2", says, NotReproducible, NOT_RUN);
        };
        let holds = rolling.mean > rolling.bounds95[1] && rolling.mean > slip.mean;
        let here = format!(
            "`nees`; mean NEES of the filter that assumes it {}, of the filter with slip {}, 3 being right{}",
            significant(rolling.mean, 3),
            significant(slip.mean, 3),
            self.little_slip()
        );
        claim("Section 2", says, Status::measured(holds), here)
    }

    /// How the heading of the integrated gyro goes astray.
    fn growth_row(&self) -> Claim {
        let says = "even small errors of a gyro grow with time when its rate is integrated";
        let Some(gyro) = self.study.of(Estimator::GyroReckoning) else {
            return claim("Section 2", says, NotReproducible, NOT_RUN);
        };
        let heading = &gyro.rms_over_time[2];
        let halfway = heading.get(heading.len() / 2).copied().unwrap_or(f64::NAN);
        let end = gyro.rms_end[2];
        let here = format!(
            "`error_model`; heading of the raw gyro: {} ° rms after half the time, {} ° at the end",
            significant(halfway / RAD_S_PER_DEG_S, 3),
            significant(end / RAD_S_PER_DEG_S, 3)
        );
        claim("Section 2", says, Status::measured(end > halfway), here)
    }

    fn model_claims(&self) -> Vec<Claim> {
        let fit = &self.identification.fit;
        vec![
            self.error_model_row(),
            self.rolling_row(),
            self.growth_row(),
            claim(
                "Section 2",
                "the force between wheel and ground enters as Ft",
                NotReproducible,
                format!(
                    "its law is not given; four are offered by name (`traction`), this study takes {} on {}",
                    self.setup.truth.traction.map_or("none", |t| t.law.name()),
                    self.ground.replace('_', " ")
                ),
            ),
            claim("Section 2", "each wheel has a mass m", Corrected, "m enters no equation, and is left out"),
            claim(
                "Section 2",
                "masses, inertias, sample time, noise and courses of the simulations",
                NotReproducible,
                "none is given, so that no curve can be compared by its numbers; the ones used here are in the configuration",
            ),
            claim(
                "Section 5",
                "C1, C2 and T were identified by least squares from recorded data",
                Reproduced,
                format!(
                    "the method: `identify::fit` on {} finds T = {} s (95 %: {} to {} s); the paper's data and values are \
                     not given",
                    self.identification.log.name,
                    significant(fit.time_constant_s.estimate, 4),
                    significant(fit.time_constant_s.ci95[0], 4),
                    significant(fit.time_constant_s.ci95[1], 4)
                ),
            ),
        ]
    }

    fn filter_claims(&self) -> Vec<Claim> {
        let rms = |e: Estimator| self.study.of(e).map_or([f64::NAN; 3], |e| e.rms);
        let [slip, reckoned, unscented] =
            [Estimator::Slip, Estimator::DeadReckoning, Estimator::SlipUnscented].map(rms);
        let pose = |rms: [f64; 3]| {
            let [x, y, heading] = [rms[0], rms[1], rms[2] / RAD_S_PER_DEG_S].map(|v| significant(v, 2));
            format!("{x} m, {y} m, {heading} °")
        };
        let inside = self.slips_inside_two_std();
        let against = self.slip_against_rolling();
        let crucial = against.is_some_and(|c| c.factor_ci95.iter().all(|ci| ci[0] > 1.0));
        let nees = self.study.of(Estimator::Slip).and_then(|e| e.nees.as_ref());
        vec![
            claim(
                "Section 1",
                "gyro and wheel encoders give position and attitude by an extended Kalman filter",
                Reproduced,
                format!(
                    "`navigate::SlipFilter`: x, y, heading rms {}; only relative to the start, for nothing measured here \
                     shows the pose itself",
                    pose(slip)
                ),
            ),
            claim(
                "Section 3",
                "a linear filter on the kinematics is the other approach",
                NotReproducible,
                "it is named without equations; kinematics alone are tried as dead reckoning",
            ),
            claim(
                "Section 3",
                "the dynamics as further information can spare sensors",
                Status::measured((0..3).all(|i| slip[i] < reckoned[i])),
                format!("torques, gyro and encoders: rms {}; encoders alone: {}", pose(slip), pose(reckoned)),
            ),
            claim(
                "Section 4",
                "the filter linearises about its last estimate, so that gains are computed as it runs",
                Reproduced,
                "`navigate::Filter`, with exact derivatives, and the covariance in factors that stay definite",
            ),
            claim(
                "Section 4",
                "means and covariances are only approximations, and nothing warrants convergence",
                Status::measured(nees.is_some()),
                nees.map_or_else(
                    || "no covariance to compare".into(),
                    |n| {
                        format!(
                            "`nees`; as good as this: mean NEES {} where 3 is right, inside its 95 % bounds for {} % of the \
                             time; on sigma points instead of derivatives: rms {}",
                            significant(n.mean, 3),
                            significant(100.0 * n.inside, 3),
                            pose(unscented)
                        )
                    },
                ),
            ),
            claim(
                "Section 4",
                "the filter also estimates slip and the gyro's error",
                // ± 2 std hold 95.4 %; one run's slips are correlated in time, so that the share scatters
                Status::measured(inside.is_some_and(|i| i > 0.9)),
                inside.map_or_else(
                    || "the robot studied has no [traction]".into(),
                    |i| format!("`slip`; true slips within ± 2 std at {} % of the times of one run", significant(100.0 * i, 3)),
                ),
            ),
            claim(
                "Section 5",
                "measurements are generated with model (5), 100 times",
                Corrected,
                format!("with the corrected model, {} times; the noise of each run is drawn anew", self.study.runs),
            ),
            claim(
                "Section 6",
                "the slip model is crucial for a precise position",
                Status::measured(crucial),
                against.map_or_else(
                    || NOT_RUN.to_string(),
                    |c| {
                        let [x, y, heading] = [0, 1, 2].map(|i| factor(c.factor[i], c.factor_ci95[i]));
                        format!(
                            "factors between the errors: x {x}, y {y}, θ {heading}; the slip filter is nearer in all three \
                             in {} % of the runs{}{}",
                            significant(100.0 * self.won_in_all(), 3),
                            self.little_slip(),
                            self.on_grip()
                        )
                    },
                ),
            ),
        ]
    }

    /// Factors of the slip model on dry asphalt, in words; empty if that was not studied.
    fn on_grip(&self) -> String {
        let dry = self.grounds.iter().find(|g| g.surface == Surface::DryAsphalt);
        let factors = dry.and_then(|g| g.study.compare(Estimator::Slip, Estimator::Rolling));
        factors.map_or_else(String::new, |c| {
            let [x, y, heading] = c.factor.map(|f| significant(f, 3));
            format!("; on dry asphalt the factors are {x}, {y}, {heading}")
        })
    }
}
