//! How a gyro is mounted in its robot, on the command line.

use clap::Args;
use gyroid::Error;
use gyroid::ingest::Mounting;

/// How the gyro is mounted.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = super::log_values::LOG_OPTIONS)]
pub(crate) struct MountingArgs {
    /// How the sensor is mounted in the robot: degrees about the robot's fixed axes, first roll, then pitch, then yaw (REP
    /// 103); a log of three axes is turned into the robot's frame
    #[arg(
        long,
        value_name = "ROLL,PITCH,YAW",
        allow_hyphen_values = true,
        value_parser = parse_mounting,
        conflicts_with = "mounting_quaternion"
    )]
    pub mounting: Option<Mounting>,
    /// The same as a unit quaternion, from the sensor's frame to the robot's
    #[arg(long, value_name = "X,Y,Z,W", allow_hyphen_values = true, value_parser = parse_mounting_quaternion)]
    mounting_quaternion: Option<Mounting>,
}

impl MountingArgs {
    /// The mounting that was stated; `None` without either option.
    pub(super) fn given(&self) -> Option<Mounting> {
        self.mounting.or(self.mounting_quaternion)
    }
}

fn parse_mounting(text: &str) -> std::result::Result<Mounting, String> {
    let angles = numbers(text, "three angles in degrees, such as 180,0,0")?;
    Mounting::from_roll_pitch_yaw_deg(angles).map_err(|e| refused(&e))
}

fn parse_mounting_quaternion(text: &str) -> std::result::Result<Mounting, String> {
    let quaternion = numbers(text, "four numbers, such as 1,0,0,0 for half a turn about x")?;
    Mounting::from_quaternion(quaternion).map_err(|e| refused(&e))
}

fn numbers<const N: usize>(text: &str, wanted: &str) -> std::result::Result<[f64; N], String> {
    let all: std::result::Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    all.ok().and_then(|all| all.try_into().ok()).ok_or_else(|| format!("write {wanted}"))
}

fn refused(error: &Error) -> String {
    format!("{}; {}", error.found, error.hint.as_deref().unwrap_or_default())
}
