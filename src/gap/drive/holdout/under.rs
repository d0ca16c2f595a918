//! A recording, and a model under which it is scored

use crate::gap::drive::ekf::effect_set::EffectSet;
use crate::gap::drive::ekf::noise::Process;
use crate::gap::drive::record::Record;

/// A recording, and a model under which it is scored.
#[derive(Clone, Copy)]
pub(crate) struct Under<'a> {
    pub(super) record: &'a Record,
    pub(super) claimed: &'a EffectSet,
    pub(super) process: Process,
}
