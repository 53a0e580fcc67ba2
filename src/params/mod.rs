//! What any ROS 2 node has: values, declarations, the store, parameter files, and their errors.

mod declaration;
mod declarer;
mod error;
mod file;
mod given;
mod list;
mod nearest;
mod store;
mod value;

pub use declaration::{Constraint, Declaration};
pub use declarer::{Declarer, Row};
pub use error::ParameterError;
pub use file::{FileParameter, FileParameters, parameters_for};
pub use given::Given;
pub use list::List;
pub use nearest::nearest;
pub use store::ParameterStore;
pub use value::Value;
#[cfg(feature = "tools")]
pub(crate) use value::one_line;
