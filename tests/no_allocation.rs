//! A step of a filter allocates nothing: counted, not believed.

use gyroid::config::Config;
use gyroid::live::{Corrector, Settings as Live, Start};
use gyroid::navigate::{Filter, Input, MotionModel, RollingFilter, Sensor, Settings, SlipFilter};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator as it comes.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations of this thread while `of` runs.
fn allocations(of: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.with(Cell::get);
    of();
    ALLOCATIONS.with(Cell::get) - before
}

const TEXT: &str = "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
    [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
    turn_on_bias_std_rad_s = 2e-4\n\
    [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
    wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
    [encoder]\nspeed_noise_std_rad_s = 0.02\n[pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n\
    [traction.law.burckhardt]\nc1 = 0.1946\nc2 = 94.129\nc3 = 0.0646\n";

/// Standstill, a hard start on snow with wheels that spin, unknown accelerations, uneven steps, a missing reading, poses.
fn drive<const N: usize, M: MotionModel<N>>(filter: &mut Filter<N, M>) {
    for k in 0..300_u32 {
        let wheel = 0.2 * f64::from(k.saturating_sub(100));
        filter.update(Sensor::Gyro, if k % 7 == 0 { f64::NAN } else { 0.01 });
        filter.update(Sensor::WheelLeft, wheel);
        filter.update(Sensor::WheelRight, 1.2 * wheel);
        if k % 20 == 0 {
            let _ = [Sensor::PoseX, Sensor::PoseY, Sensor::PoseHeading].map(|sensor| filter.update(sensor, 0.0));
        }
        let torque = if k > 100 { 0.6 } else { 0.0 };
        let input = if k % 50 == 0 { Input::Accelerations([0.1, 0.2]) } else { Input::Torques([torque, 0.9 * torque]) };
        filter.predict(input, if k % 30 == 0 { 0.08 } else { 0.01 });
        let _ = filter.slips();
    }
}

#[test]
fn a_step_allocates_nothing() {
    let config = Config::parse(TEXT, "robot.toml").unwrap();
    let settings = Settings { gate_probability: Some(0.9999), ..Settings::default() };
    let (mut rolling, _) = RollingFilter::new(&config, &settings, 20.0).unwrap();
    let (mut slip, _) = SlipFilter::new(&config, &settings, 20.0).unwrap();
    assert_eq!(allocations(|| drive(&mut rolling)), 0);
    assert_eq!(allocations(|| drive(&mut slip)), 0);
    // the count does count
    assert!(allocations(|| drop(std::hint::black_box(vec![0_u8; 16]))) > 0);
    assert!(rolling.mean().iter().chain(slip.mean().iter()).all(|v| v.is_finite()));
}

/// Rest, motion, clocks that are set, stamps again, readings that are none, and the copy that a second thread is given.
fn correct(corrector: &mut Corrector, wheels: bool) {
    for k in 0..4000_i64 {
        let t = 0.005 * k as f64;
        let moving = (1000..2000).contains(&k);
        if wheels && k % 4 == 0 {
            corrector.wheels(!moving, t);
        }
        corrector.temperature(if k % 100 == 0 { f64::NAN } else { 30.0 }, t);
        let rate = if moving { 0.3 } else { 8e-3 };
        let set = if k > 3000 { 3_600_000_000_000 } else { 0 };
        let stamp_ns = 5_000_000 * (k - i64::from(k % 50 == 0)) + set;
        let _ = corrector.sample(stamp_ns, t, if k % 70 == 0 { f64::NAN } else { rate });
        let _ = (corrector.nis(), corrector.clone());
    }
}

#[test]
fn a_live_correction_allocates_nothing() {
    let table = "[gyro.temperature]\nreference_c = 30.0\nbias_rad_s = 8e-3\nsensitivity_rad_s_k = 2e-4\n";
    let text = TEXT.replace("[vehicle]", &format!("{table}[vehicle]"));
    let config = Config::parse(&text, "robot.toml").unwrap();
    for (wheels, temperature) in [(true, false), (false, false), (true, true)] {
        let settings = Live { wheels, temperature, ..Live::default() };
        let (mut corrector, _) = Corrector::new(&config, settings, &Start::default()).unwrap();
        assert_eq!(allocations(|| correct(&mut corrector, wheels)), 0, "{settings:?}");
        assert!(corrector.blocks()[0] > 5, "{settings:?} {:?}", corrector.blocks());
    }
}
