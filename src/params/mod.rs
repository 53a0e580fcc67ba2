//! What any ROS 2 node has: values, declarations, the store, parameter files, and their errors.

mod declaration;
mod error;
mod file;
mod nearest;
mod store;
mod value;

pub use declaration::{Constraint, Declaration};
pub use error::ParameterError;
pub use file::{FileParameter, FileParameters, parameters_for};
pub use nearest::nearest;
pub use store::ParameterStore;
pub use value::Value;
