//! One file a target, one line in [`registry()`].

mod ardupilot;
mod embedded;
mod gazebo;
mod gnss_ins_sim;
mod gtsam;
mod isaac_lab;
mod kalibr;
mod kf_gins;
mod lio_sam;
mod matlab;
mod openvins;
mod orb_slam3;
mod px4;
mod robot_localization;
mod ros2_control;
mod rotors;
mod vins_fusion;

use super::target::Target;

/// Every target, one line each.
static REGISTRY: [&dyn Target; 19] = [
    &kalibr::Kalibr,
    &openvins::OpenVins,
    &orb_slam3::OrbSlam3,
    &vins_fusion::VinsFusion,
    &gtsam::Gtsam,
    &lio_sam::LioSam { ros: lio_sam::Ros::One },
    &lio_sam::LioSam { ros: lio_sam::Ros::Two },
    &px4::Px4,
    &ardupilot::ArduPilot,
    &gazebo::Gazebo,
    &rotors::Rotors,
    &robot_localization::RobotLocalization,
    &ros2_control::Ros2Control,
    &isaac_lab::IsaacLab,
    &matlab::Matlab,
    &kf_gins::KfGins,
    &gnss_ins_sim::GnssInsSim,
    &embedded::Embedded { language: embedded::Language::C },
    &embedded::Embedded { language: embedded::Language::Rust },
];

/// Every target.
#[must_use]
pub fn registry() -> &'static [&'static dyn Target] {
    &REGISTRY
}

/// The target `id`.
#[must_use]
pub fn by_id(id: &str) -> Option<&'static dyn Target> {
    registry().iter().copied().find(|t| t.about().id == id)
}
