//! The built-in laws, written like a user's own law.

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
