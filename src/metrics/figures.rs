//! The figures of a motion (numbers such as its settling time), and their names in statuses and files.

use serde::{Deserialize, Serialize};

/// Declares [`Figures`], with the name that each figure has in statuses and files. The name ends with the unit.
macro_rules! figures {
    ($($(#[$doc:meta])* $field:ident: $kind:ty = $name:literal,)*) => {
        /// The figures of a motion: numbers such as its settling time and the length of the tool's path.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct Figures { $($(#[$doc])* #[serde(rename = $name)] pub $field: $kind,)* }

        impl Figures {
            /// Yields each figure with its name. The value is `None` if the figure is not known, for example because the motion has
            /// not settled yet.
            pub fn named(&self) -> impl Iterator<Item = (&'static str, Option<f64>)> {
                [$(($name, Option::from(self.$field)),)*].into_iter()
            }

            /// Builds the figures. `value` returns the value for a figure's name, or `None` if there is no value. The figure is
            /// then `None`, or 0 if its type is not an `Option`.
            pub fn from_named(value: impl Fn(&str) -> Option<f64>) -> Self {
                Self { $($field: Named(value($name)).into(),)* }
            }
        }
    };
}

/// The value of a figure, to convert to the type of the figure. For a figure of the type `f64`, `None` becomes 0.
struct Named(Option<f64>);

impl From<Named> for Option<f64> {
    fn from(Named(value): Named) -> Self {
        value
    }
}

impl From<Named> for f64 {
    fn from(Named(value): Named) -> Self {
        value.unwrap_or_default()
    }
}

figures! {
    /// Time since the motion began \[s\]. The other figures that are times are also measured from the beginning of the motion.
    elapsed: f64 = "elapsed_s",
    /// The time from which the angle to the goal stays below 2 % of its initial value, or within the goal tolerance if that is
    /// larger \[s\]; `None` while the angle is larger than both.
    settling_time_rotation: Option<f64> = "settling_time_2_percent_rotation_s",
    /// The time from which the distance to the goal stays below 2 % of its initial value, or within the goal tolerance if that is
    /// larger \[s\]; `None` while the distance is larger than both.
    settling_time_position: Option<f64> = "settling_time_2_percent_position_s",
    /// The time at which the goal tolerances were first met \[s\]; `None` if they have not been met.
    arrival_time: Option<f64> = "arrival_time_s",
    /// Length of the tool's path so far \[m\].
    path_length: f64 = "path_length_m",
    /// Distance of the tool from its start \[m\].
    straight_line: f64 = "straight_line_m",
    /// The path's length divided by the distance of the tool from its start; `None` if the distance is below a millimeter.
    path_ratio: Option<f64> = "path_ratio",
    /// Distance to the goal \[m\].
    position_error: f64 = "position_error_m",
    /// Angle to the goal \[rad\].
    rotation_error: f64 = "rotation_error_rad",
    /// Largest joint speed commanded [rad/s, prismatic: m/s].
    peak_joint_speed: f64 = "peak_joint_speed_rad_s",
    /// How far the tool went past the goal \[m\], measured along a line that ends at the goal. The line begins at the tool's position
    /// when the goal last moved. If the goal never moved, the line begins at the tool's position at the start of the motion.
    overshoot: f64 = "overshoot_m",
    /// Control effort `∫|θ̇|² dt` [rad²/s].
    effort: f64 = "effort_rad2_s",
    /// The smallest singular value of the controlled pose's Jacobian during the motion; `None` if it was not computed.
    smallest_singular_value: Option<f64> = "min_singular_value",
    /// Number of times that the motion stalled.
    stalls: f64 = "stalls",
}

impl Figures {
    /// Returns the later of the two settling times to 2 % \[s\]; `None` unless both errors have settled.
    pub fn settling_time(&self) -> Option<f64> {
        Some(self.settling_time_rotation?.max(self.settling_time_position?))
    }
}
