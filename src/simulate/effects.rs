//! The tables `[[effect]]` of a configuration, at work in one simulation.

use super::Options;
use crate::config::{Config, EffectTable};
use crate::error::{Error, ErrorKind, Result};
use crate::model::drive::DriveEffect;
use crate::model::{EffectSource, GyroEffect, Scene};
use std::collections::BTreeMap;

/// Seeds of effects that stand in the file twice differ by this (2⁶⁴ over the golden ratio).
const NEXT_SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// Effects of a drive: those of the gyro whether it moves or not, and those of the robot.
#[derive(Default)]
pub(super) struct OfDrive {
    pub gyro: Vec<Box<dyn GyroEffect>>,
    pub robot: Vec<Box<dyn DriveEffect>>,
}

/// Effects of a gyro at rest.
pub(super) fn of_gyro(
    config: &Config,
    scene: &Scene,
    options: &Options,
    source: Option<&dyn EffectSource>,
) -> Result<Vec<Box<dyn GyroEffect>>> {
    let Some(source) = source else {
        refuse(config, "gyro")?;
        return Ok(Vec::new());
    };
    with_seeds(config, options)
        .into_iter()
        .map(|(table, seed)| source.gyro_effect(&table.id, &table.parameters, scene, seed))
        .collect()
}

/// Effects of a drive in `scene`. An id that is known at rest and in drives is made for the drive.
pub(super) fn of_drive(
    config: &Config,
    scene: &Scene,
    options: &Options,
    source: Option<&dyn EffectSource>,
) -> Result<OfDrive> {
    let mut made = OfDrive::default();
    let Some(source) = source else {
        refuse(config, "robot")?;
        return Ok(made);
    };
    let span_s = scene.time.span_s();
    for (EffectTable { id, parameters }, seed) in with_seeds(config, options) {
        if source.is_of_drives(id) {
            if config.traction.is_some() {
                return Err(Error::new(
                    ErrorKind::Config,
                    "configuration",
                    format!("{id} changes a robot that rolls, and this one slips by [traction]"),
                )
                .at("`[[effect]]`")
                .hint("delete the table [traction]; the effect wheel.slip slips as well"));
            }
            made.robot.push(source.drive_effect(id, parameters, span_s, seed)?);
        } else {
            made.gyro.push(source.gyro_effect(id, parameters, scene, seed)?);
        }
    }
    Ok(made)
}

/// Without a source no effect can be made.
fn refuse(config: &Config, what: &str) -> Result<()> {
    if config.effects.is_empty() {
        return Ok(());
    }
    let ids: Vec<_> = config.effects.iter().map(|e| e.id.as_str()).collect();
    let found = format!("the nominal {what} has no effects, and the file has {}", ids.join(", "));
    Err(Error::new(ErrorKind::Config, "configuration", found)
        .at("`[[effect]]`")
        .hint(format!("delete the tables [[effect]] to simulate the nominal {what}")))
}

/// The tables, each with its seed: an effect that stands there twice draws twice.
fn with_seeds<'a>(config: &'a Config, options: &Options) -> Vec<(&'a EffectTable, u64)> {
    let mut seen: BTreeMap<&str, u64> = BTreeMap::new();
    let seed = |table: &'a EffectTable| {
        let count = seen.entry(table.id.as_str()).or_default();
        let seed = options.seeds.sensors.wrapping_add(count.wrapping_mul(NEXT_SEED));
        *count += 1;
        (table, seed)
    };
    config.effects.iter().map(seed).collect()
}
