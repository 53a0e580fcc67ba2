//! The built-in laws. Each implements [`ControlLaw`](super::ControlLaw), as a law that a user adds does.

mod diffc;
mod h_infinity;
mod logc_pd;
mod lq;
mod predefined_time;
mod proportional;

pub use diffc::Diffc;
pub use h_infinity::HInfinity;
pub use logc_pd::LogcPd;
pub use lq::Lq;
pub use predefined_time::PredefinedTime;
pub use proportional::Proportional;
