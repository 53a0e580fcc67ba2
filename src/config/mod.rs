//! What our parameters mean: each declared once, with type, unit, range, default and description.

mod common;
mod cycle;
mod dual;
mod initial;
mod plant;
mod servo;

pub use common::ArmParameters;
pub use cycle::CycleParameters;
pub use dual::DualParameters;
pub use initial::Given;
pub use plant::PlantParameters;
pub use servo::ServoParameters;

use crate::params::{Declaration, ParameterError, ParameterStore};

/// The parameter file that is built in: the PUMA 560 of the reference work.
pub const BUILTIN_FILE: &str = include_str!("../../msg_config/puma560.yaml");

/// The parameters of one kind of node.
pub trait NodeParameters: Sized {
    /// The node's default name.
    const NODE_NAME: &'static str;

    /// Each parameter, declared.
    fn declarations() -> Vec<Declaration>;

    /// The typed parameters of `store`.
    ///
    /// # Errors
    /// [`ParameterError`] where values do not fit each other.
    fn from_store(store: &ParameterStore) -> Result<Self, ParameterError>;

    /// A store with the declarations at their defaults.
    fn store() -> ParameterStore {
        let of_all = [
            ServoParameters::declarations(),
            DualParameters::declarations(),
            PlantParameters::declarations(),
        ];
        ParameterStore::new(
            Self::declarations(),
            of_all.iter().flatten().map(|declared| declared.name).collect(),
        )
    }
}
