//! Tests of contact against closed forms and independent integrations.

mod admittance;
mod sensor;
mod sign_watch;

use crate::Compliance;
use dq_params::ParameterStore;

/// Returns the parameters at their defaults.
fn defaults() -> Compliance {
    ParameterStore::of::<Compliance>().and_then(|store| store.read()).unwrap()
}
