//! The built-in arms: parameter files embedded in the program.

macro_rules! arm {
    ($name:literal) => {
        ($name, include_str!(concat!("msg_config/arms/", $name, ".yaml")))
    };
}

/// The parameter file of each built-in arm, by its name.
pub const ARMS: [(&str, &str); 9] = [
    ("puma560", super::BUILTIN_FILE),
    arm!("ur3e"),
    arm!("ur5e"),
    arm!("ur10e"),
    arm!("panda"),
    arm!("fr3"),
    arm!("xarm6"),
    arm!("xarm7"),
    arm!("iiwa14"),
];

/// Returns the name and the parameter file of the built-in arm `name`; `None` if no built-in arm has this name.
pub fn arm_file(name: &str) -> Option<(&'static str, &'static str)> {
    ARMS.into_iter().find(|(known, _)| *known == name)
}
