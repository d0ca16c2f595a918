//! M e^m,  Jc e^j,  b e^t,  r e^s,  r_l e^{-ρ/2}, r_r e^{ρ/2},  c + f,  e(t) + C1 (1 - exp(-t/T))

use crate::effects::Parameters;
use crate::effects::drive::{Coordinate, ModelChange, Touches};
use crate::model::drive::{DriveEffect, Moving, Robot};

/// Place of each constant among the coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Constant {
    /// ln M
    Mass,
    /// ln Jc
    Inertia,
    /// ln b
    Track,
    /// ln r, of both
    Radius,
    /// ln (r_r/r_l)
    RadiusRatio,
    /// c, N·m·s
    Viscous,
    /// C1, rad/s, at the time constant of [`warming`]
    WarmUp,
}

impl Constant {
    /// All, in order.
    pub(super) const ALL: [Self; 7] =
        [Self::Mass, Self::Inertia, Self::Track, Self::Radius, Self::RadiusRatio, Self::Viscous, Self::WarmUp];
}

const fn coordinate(scale: f64) -> Coordinate {
    Coordinate { scale: [scale, scale], bounds: [-1e3, 1e3] }
}

/// The constants of the nominal model as a change of it, warming up with the time constant `.0`, s.
pub(super) struct Constants(pub f64);

/// Time constants of a warm-up that are tried, s: from a log's seconds to a slow sensor's minutes.
static TRIED: [Constants; 6] =
    [Constants(10.0), Constants(30.0), Constants(90.0), Constants(200.0), Constants(450.0), Constants(1000.0)];

/// The constants with each time constant that is tried.
pub(super) fn warming() -> &'static [Constants] {
    &TRIED
}

impl ModelChange for Constants {
    fn coordinates(&self) -> &'static [Coordinate] {
        const ALL: [Coordinate; 7] = [
            coordinate(0.1),
            coordinate(0.1),
            coordinate(0.05),
            coordinate(0.05),
            coordinate(0.02),
            coordinate(1e-3),
            coordinate(1e-3),
        ];
        &ALL
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work { theta: std::array::from_fn(|i| theta[i]), time_constant_s: self.0 })
    }

    fn parameters(&self, _: &[f64]) -> Parameters {
        Parameters::new()
    }

    fn theta(&self, _: &Parameters) -> Vec<f64> {
        vec![0.0; Constant::ALL.len()]
    }

    fn touches(&self) -> Touches {
        Touches { gyro: true, ..Touches::ROBOT }
    }

    fn is_rigid(&self) -> bool {
        true
    }
}

struct Work {
    theta: [f64; 7],
    time_constant_s: f64,
}

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        let of = |c: Constant| self.theta[c as usize];
        robot.mass_kg *= of(Constant::Mass).exp();
        robot.yaw_inertia_kg_m2 *= of(Constant::Inertia).exp();
        robot.half_track_m *= of(Constant::Track).exp();
        let half = 0.5 * of(Constant::RadiusRatio);
        for (radius, ratio) in robot.radius_m.iter_mut().zip([-half, half]) {
            *radius *= (of(Constant::Radius) + ratio).exp();
        }
        robot.viscous_friction_n_m_s += of(Constant::Viscous);
    }

    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        let warm = -(-at.since_power_on_s / self.time_constant_s).exp_m1();
        rate_rad_s + self.theta[Constant::WarmUp as usize] * warm
    }
}
