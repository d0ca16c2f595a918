//! real = nominal + World: everything in which a real robot and its sensors differ from the nominal simulator
//!
//! [`World::nominal`] differs in nothing. An effect sets its own fields; several effects set theirs side by side.

use super::grip::Grip;
use crate::bench::worlds::noise_level::Loudness;

/// All that is different.
#[derive(Debug, Clone)]
pub(super) struct World {
    pub body: Body,
    pub motors: Motors,
    pub wheels: Wheels,
    pub encoders: Encoders,
    pub gyro: Gyro,
    pub pose: Pose,
}

/// Mass and floor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    pub mass_factor: f64,
    pub inertia_factor: f64,
    /// Centre of mass ahead of the axle.
    pub com_offset_m: f64,
    /// The offset's share that the load shifts back for each m/s² of acceleration.
    pub slosh_s2_m: f64,
    pub slope_rad: f64,
    pub uphill_heading_rad: f64,
    /// Relative depth, length in m and phase of the floor's waves on the slope.
    pub undulation: [f64; 3],
    /// When a load falls off, s, and which share of the mass it is.
    pub load_falls: Option<[f64; 2]>,
    /// k in force = -k v|v|, kg/m.
    pub drag_kg_m: f64,
    /// Coulomb friction of left and right wheel, N·m.
    pub coulomb_n_m: [f64; 2],
    /// Moment that casters take after a reversal, N·m, and over which way they turn, m.
    pub caster_n_m: f64,
    pub caster_way_m: f64,
    pub rolling: Rolling,
}

/// force = -coefficient · weight · tanh(v/smooth) (1 + stribeck exp(-(v/v_s)²) + rise |v|)
#[derive(Debug, Clone, Copy)]
pub(super) struct Rolling {
    pub coefficient: f64,
    pub smooth_m_s: f64,
    pub stribeck: f64,
    pub stribeck_m_s: f64,
    pub rise_s_m: f64,
    /// At each wheel, so that turning on the spot costs too; else at the body's middle.
    pub at_wheels: bool,
}

impl Rolling {
    /// Force over weight against the speed `v`.
    pub(crate) fn share(&self, v: f64) -> f64 {
        let bend = 1.0 + self.stribeck * (-(v / self.stribeck_m_s).powi(2)).exp() + self.rise_s_m * v.abs();
        self.coefficient * (v / self.smooth_m_s).tanh() * bend
    }
}

/// From the commanded torque to that of the wheel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motors {
    pub gain: [f64; 2],
    pub lag_s: f64,
    pub dead_band_n_m: f64,
    pub limit_n_m: f64,
    /// Share of the torque that is gone at the end of the log, and the bend of its way there.
    pub sag: f64,
    pub sag_bend: f64,
}

/// Wheels, track, and how they touch the floor.
#[derive(Debug, Clone)]
pub(super) struct Wheels {
    pub radius_factor: [f64; 2],
    pub track_factor: f64,
    /// Growth of the half track over the nominal one for each m/s above 0.5 m/s: a robot that skids turns about another
    /// point when it is fast.
    pub track_bend_s_m: f64,
    /// Relative growth of both radii for each m/s.
    pub growth_s_m: f64,
    /// Relative growth of both radii when warm, and how fast they warm, s.
    pub heating: f64,
    pub heating_s: f64,
    /// Relative ripple of one radius over a turn: which wheel, how much, where.
    pub eccentric: Option<(usize, f64, f64)>,
    pub grip: Option<Grip>,
    /// k in lateral velocity → -k v ω, the lag of it, s, and its bend with |v ω|.
    pub skid_s: f64,
    pub skid_lag_s: f64,
    pub skid_bend_s2_m: f64,
}

/// The encoders.
#[derive(Debug, Clone)]
pub(super) struct Encoders {
    pub lsb_rad_s: f64,
    pub offset: f64,
    /// Wheel that misses ticks, and its bursts: from, to in s, share lost.
    pub missed: Option<(usize, Vec<[f64; 3]>)>,
    pub lag_s: f64,
    pub delay_s: f64,
    /// Relative jitter of the delay.
    pub delay_jitter: f64,
    /// Noise grows by this for each rad/s.
    pub noise_growth_s: f64,
    pub loud: Loudness,
}

/// The gyro.
#[derive(Debug, Clone)]
pub(super) struct Gyro {
    pub scale: f64,
    pub asymmetry: f64,
    pub asymmetry_width_rad_s: f64,
    pub rectification_rad_s_per_m2_s2: f64,
    pub rectification_bend: f64,
    pub rectification_lag_s: f64,
    pub delay_s: f64,
    /// Relative jitter of the delay.
    pub delay_jitter: f64,
    /// Bias for each m/s² forwards.
    pub g_sensitivity_s_m: f64,
    /// Bias sin(n θ + φ): amplitude in rad/s, n, φ.
    pub heading_error: [f64; 3],
    /// Noise grows by this for each m/s.
    pub noise_growth_s_m: f64,
    pub loud: Loudness,
    /// Added to the bias, one value a row; empty for nothing.
    pub path_rad_s: Vec<f64>,
}

/// The external reference.
#[derive(Debug, Clone)]
pub(super) struct Pose {
    pub delay_s: f64,
    /// Relative jitter of the delay.
    pub delay_jitter: f64,
    pub drift: f64,
    pub scale: f64,
    pub lever_m: [f64; 2],
    /// Share of samples that are off, and their size over the noise.
    pub outliers: f64,
    pub outlier_size: f64,
    pub loud: Loudness,
}

impl Wheels {
    /// Half the track over the nominal one at the forward speed `v`, m/s.
    pub(crate) fn half_track_factor(&self, v: f64) -> f64 {
        self.track_factor + self.track_bend_s_m * (v.abs() - 0.5)
    }
}

impl World {
    pub(crate) fn nominal() -> Self {
        Self {
            body: Body {
                mass_factor: 1.0,
                inertia_factor: 1.0,
                com_offset_m: 0.0,
                slosh_s2_m: 0.0,
                slope_rad: 0.0,
                uphill_heading_rad: 0.0,
                undulation: [0.0, 1.0, 0.0],
                load_falls: None,
                drag_kg_m: 0.0,
                coulomb_n_m: [0.0; 2],
                caster_n_m: 0.0,
                caster_way_m: 0.1,
                rolling: Rolling {
                    coefficient: 0.0,
                    smooth_m_s: 0.02,
                    stribeck: 0.0,
                    stribeck_m_s: 0.1,
                    rise_s_m: 0.0,
                    at_wheels: true,
                },
            },
            motors: Motors {
                gain: [1.0; 2],
                lag_s: 0.0,
                dead_band_n_m: 0.0,
                limit_n_m: f64::INFINITY,
                sag: 0.0,
                sag_bend: 1.0,
            },
            wheels: Wheels {
                radius_factor: [1.0; 2],
                track_factor: 1.0,
                track_bend_s_m: 0.0,
                growth_s_m: 0.0,
                heating: 0.0,
                heating_s: 100.0,
                eccentric: None,
                grip: None,
                skid_s: 0.0,
                skid_lag_s: 0.1,
                skid_bend_s2_m: 0.0,
            },
            encoders: Encoders {
                lsb_rad_s: 0.0,
                offset: 0.0,
                missed: None,
                lag_s: 0.0,
                delay_s: 0.0,
                delay_jitter: 0.0,
                noise_growth_s: 0.0,
                loud: Loudness::NOMINAL,
            },
            gyro: Gyro {
                scale: 0.0,
                asymmetry: 0.0,
                asymmetry_width_rad_s: 0.05,
                rectification_rad_s_per_m2_s2: 0.0,
                rectification_bend: 0.0,
                rectification_lag_s: 0.0,
                delay_s: 0.0,
                delay_jitter: 0.0,
                g_sensitivity_s_m: 0.0,
                heading_error: [0.0, 1.0, 0.0],
                noise_growth_s_m: 0.0,
                loud: Loudness::NOMINAL,
                path_rad_s: Vec::new(),
            },
            pose: Pose {
                delay_s: 0.0,
                delay_jitter: 0.0,
                drift: 0.0,
                scale: 1.0,
                lever_m: [0.0; 2],
                outliers: 0.0,
                outlier_size: 0.0,
                loud: Loudness::NOMINAL,
            },
        }
    }
}
