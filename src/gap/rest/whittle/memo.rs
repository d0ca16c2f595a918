//! Values that are computed once and read by sets that are fitted side by side.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Values by key.
pub(crate) struct Memo<K, V>(Mutex<HashMap<K, V>>);

impl<K, V> Default for Memo<K, V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: Eq + Hash, V: Clone> Memo<K, V> {
    /// The value of `key`; computed by `make` where it is not there. Two threads may compute it both, and must find the same.
    pub(crate) fn get(&self, key: K, make: impl FnOnce() -> V) -> V {
        if let Some(found) = self.values().get(&key) {
            return found.clone();
        }
        let made = make();
        self.values().entry(key).or_insert(made).clone()
    }

    fn values(&self) -> MutexGuard<'_, HashMap<K, V>> {
        // a thread that panics leaves whole entries
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
