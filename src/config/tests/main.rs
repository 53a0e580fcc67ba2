//! The parameters of our nodes, and the arms that they describe.

mod described;
mod described_limits;
mod lenient;
mod meshes;
mod parameters;
mod setup;
mod urdf_1_2;
