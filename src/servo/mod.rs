//! The servo cycle: (state, goal, clock) → command and status. Every safety rule lives here.
//!
//! No I/O, no clock, no threads: time is an argument, so that each rule is tested in fake time.
//!
//! Who drives an arm with a [`Servo`] gives the servo once a cycle what has come, above all the arm's joint state
//! ([`Servo::cycle`]), then sends the arm what [`Servo::output`] gives, and sends nothing where that gives none, as before the arm is
//! driven for the first time.
//!
//! The built-in arm under logc, ten cycles on its way to a goal, with joints that follow at once:
//!
//! ```
//! use dq_servo::config::{NodeParameters, ServoParameters};
//! use dq_servo::control::Law;
//! use dq_servo::servo::{Event, GoalReading, JointReading, Sent, Servo, State};
//! use std::time::Duration;
//!
//! let (parameters, _warnings) = ServoParameters::start("/dq_servo", Vec::new())?; // with the built-in arm, as nothing else is given
//! let ServoParameters { arms, joints, goal_frame, tool_frame, mut settings, period, .. } =
//!     ServoParameters::from_store(&parameters)?;
//! settings.controller.law = Law::Logc;
//! let names = joints[0].names().to_vec();
//! let mut servo = Servo::new(arms, joints, &goal_frame, settings, period)?.with_tool_frame(&tool_frame);
//! assert_eq!(servo.output(), None); // nothing is to be sent yet
//! let mut angles = [0.0, 0.4, -0.8, 0.0, 0.6, 0.0]; // [rad]
//! let mut speeds = [0.0; 6]; // [rad/s]
//! let (orientation_xyzw, waited, sent) = ([0.0, 1.0, 0.0, 0.0], Duration::ZERO, Sent::default());
//! let goal = GoalReading { position: [0.5, 0.2, 0.4], orientation_xyzw, frame_id: "", stamp: 0, waited, sent };
//! for cycle in 1..=10 {
//!     let state = JointReading { names: &names, positions: &angles, velocities: &speeds, source: 0, stamp_age: None };
//!     let goal = (cycle == 1).then_some(Event::Goal(goal));
//!     servo.cycle(cycle * period, [Event::JointState(0, state)].into_iter().chain(goal));
//!     if let Some(output) = servo.output() {
//!         speeds.copy_from_slice(output); // velocities, as the built-in interface takes; positions under the others
//!     }
//!     angles.iter_mut().zip(&speeds).for_each(|(angle, speed)| *angle += period.as_secs_f64() * speed);
//! }
//! assert_eq!(servo.status().state, State::Tracking);
//! assert!(!servo.at_rest());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arbiter;
mod arms;
mod carried;
mod close_pair;
mod consent;
mod cycle;
mod escape;
mod event;
mod filters;
mod goal;
mod goal_error;
mod held;
mod interface;
mod joints;
mod limits;
mod link;
mod motion;
mod motion_record;
mod oscillation;
mod position_limits;
mod progress;
mod reason;
mod reconfiguration;
mod rejection;
mod search;
mod setpoint;
mod settings;
mod settings_error;
mod stability;
mod stall;
mod state;
mod status;
mod sticks;
mod stream;
mod twist;
mod violation;

pub use arms::{Arms, ToolSpeed};
pub use close_pair::ClosePair;
pub use consent::{Asked, Asker, Consent, Contended, Revocation, Revoked, Rivals, Sent};
pub use cycle::{STREAM, Servo};
pub use event::{Event, GoalMotion, GoalReading, TwistReading};
pub use filters::Replaced;
pub use goal::{Goal, is_own_frame};
pub use goal_error::GoalError;
pub use held::Held;
pub use interface::Interface;
pub use joints::JointOrder;
pub use limits::{Limits, STOP_TIME};
pub use link::{ArmFigures, Contact, JointReading, longest_way, stamp_age, way};
pub use motion::{Figures, MotionMeter, Settling};
use motion_record::MotionLog;
pub use motion_record::{MOTIONS, Motion, Outcome};
pub use position_limits::PositionLimits;
pub use reason::Reason;
pub use reconfiguration::{Detour, NoWayRound, Reconfiguration, Reconfigure};
pub use rejection::{Rejection, RejectionCounts};
pub use search::{Found, STARTS, Search};
pub use settings::{BeyondReach, GoalFrameMode, GoalFrames, Posture, Settings, Tolerance};
pub use settings_error::SettingsError;
pub use stability::{Demand, largest_rate};
pub use stall::{Reach, Stall};
pub use state::State;
pub use status::{Input, Status};
pub use twist::Twist;
pub use violation::Violation;
