//! The laws by name: built-in laws, and laws that a program has registered.

use super::PoseError;
use super::control_law::{ControlLaw, MEMORY, Map};
use super::laws::{Diffc, HInfinity, LogcPd, Lq, PredefinedTime, Proportional};
use dq_common::UnknownName;
use std::fmt;
use std::ops::Deref;
use std::str::FromStr;
use std::sync::{LazyLock, PoisonError, RwLock};
use thiserror::Error;

/// A control law by name. It dereferences to its [`ControlLaw`].
#[derive(Clone, Copy)]
pub struct Law {
    number: usize,
    law: &'static dyn ControlLaw,
}

/// Number of entries in a controller's list of gains. Each built-in or registered law has its own entry; all other laws share the
/// last entry.
pub(super) const MOST: usize = 16;

/// The index of the last entry in a controller's list of gains. All laws that are neither built in nor registered share this entry.
/// The entries before it belong to the built-in and registered laws. So this is also the largest number of these laws.
const UNLISTED: usize = MOST - 1;

/// The reason why a law was not registered.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum RegisterError {
    /// Another law has this name.
    #[error("there is a law called {0:?} already")]
    Name(&'static str),
    /// The name has other characters than lower-case letters, digits and underscores.
    #[error("the name {0:?} is not made of lower-case letters, digits and underscores")]
    Letters(&'static str),
    /// The largest possible number of laws is registered already.
    #[error("there is room for {UNLISTED} laws")]
    Room,
    /// The law's memory is larger than [`MEMORY`](super::MEMORY).
    #[error("the law remembers {0} numbers, and there is room for {MEMORY}")]
    Memory(usize),
}

static NAMES: LazyLock<RwLock<&'static Names>> = LazyLock::new(|| RwLock::new(Names::of(Law::ALL.to_vec())));

/// The laws and their names, for the lifetime of the program.
struct Names {
    laws: Vec<Law>,
    names: Vec<&'static str>,
    parameters: Vec<&'static str>,
}

impl Names {
    /// Creates the list, and leaks its names. This happens once at the start of a program, and again for each law that is
    /// registered.
    fn of(laws: Vec<Law>) -> &'static Self {
        let parameter = |law: &Law| &*format!("gains.{}", law.name()).leak();
        Box::leak(Box::new(Self {
            names: laws.iter().map(|law| law.name()).collect(),
            parameters: laws.iter().map(parameter).collect(),
            laws,
        }))
    }
}

/// Registers your own law, and returns it.
///
/// The law is then one of [`Law::all`]: the parameter `controller` accepts its name, and the parameter `gains.<name>` has its gains. Every
/// safety rule applies to it, `compare` runs it, figures have a color for it, and `replay` repeats it. Parameters that were declared
/// earlier do not accept it, so register laws first in `main`.
///
/// # Errors
/// [`RegisterError`] if the name is invalid or taken, or if the space for laws is used up.
///
/// # Your law
/// The law of this example moves along the logarithm X at a speed that hardly depends on the distance: `ξ = k X/√(|X|² + ε²)`. Only
/// near the goal, within the boundary layer of width ε, the speed decreases, so that it does not jump at the goal (Slotine & Li 1991,
/// §7.2). Here the law drives the built-in arm. A law can also remember numbers from cycle to cycle ([`ControlLaw::memory_size`]); see
/// the integral law and the sliding-mode law in the example `laws_with_memory`.
///
/// ```
/// use dq_kinematics::arm::ArmState;
/// use dq_config::{NodeParameters, ServoParameters};
/// use dq_kinematics::control::{
///     AngularLinear, ControlLaw, LawMemory, PoseError, RegisterError, nearer_goal, pose_error, register,
/// };
/// use dq_params::Value;
///
/// struct BoundaryLayer;
///
/// impl ControlLaw for BoundaryLayer {
///     fn name(&self) -> &'static str {
///         "boundary_layer"
///     }
///     fn error(&self, error: &PoseError) -> AngularLinear {
///         error.screw_log()
///     }
///     fn twist_gains(&self, gains: [f64; 2], (angular, linear): &AngularLinear) -> [f64; 2] {
///         let size = (angular.norm_squared() + linear.norm_squared() + 0.1_f64.powi(2)).sqrt();
///         gains.map(|gain| gain / size)
///     }
/// }
///
/// let law = register(&BoundaryLayer)?;
/// assert_eq!(register(&BoundaryLayer).err(), Some(RegisterError::Name("boundary_layer")));
/// let (mut store, _warnings) = ServoParameters::start("/dq_servo", Vec::new())?;
/// store.override_initial("controller", Value::from_yaml("boundary_layer")?)?;
/// store.override_initial("gains.boundary_layer", Value::from_yaml("[0.5, 0.5]")?)?;
/// let parameters = ServoParameters::from_store(&store)?;
/// let (chain, controller) = (parameters.arms.chain(), parameters.settings.controller);
/// assert_eq!(controller.law, law);
/// let goal = chain.forward_kinematics(&[0.4, -0.9, 0.3, 0.2, 1.2, 0.0])?;
/// let (mut theta, mut theta_dot) = ([0.0, -1.2, 0.1, 0.4, 1.0, 0.3], [0.0; 6]);
/// let (mut arm, mut memory, mut command) = (ArmState::new(chain), LawMemory::default(), [0.0; 6]);
/// for _cycle in 0..5000 {
///     chain.evaluate(&theta, &mut arm)?;
///     let nearer = nearer_goal(&goal, &arm.base_from_tool());
///     memory.joint_velocity(&controller, &arm, &nearer, (&command, 0.002), &mut theta_dot);
///     command = theta_dot;
///     theta.iter_mut().zip(&theta_dot).for_each(|(angle, speed)| *angle += 0.002 * speed);
/// }
/// assert!(pose_error(&arm, &goal).translation().norm() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// In `main` of your own program, register the law first, and then call `dq_servo::cli::main`.
pub fn register(law: &'static dyn ControlLaw) -> Result<Law, RegisterError> {
    let name = law.name();
    let is_right = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
    if name.is_empty() || !name.bytes().all(is_right) {
        return Err(RegisterError::Letters(name));
    }
    if law.memory_size() > MEMORY {
        return Err(RegisterError::Memory(law.memory_size()));
    }
    let mut names = NAMES.write().unwrap_or_else(PoisonError::into_inner);
    if names.names.contains(&name) {
        return Err(RegisterError::Name(name));
    }
    let number = names.laws.len();
    if number >= UNLISTED {
        return Err(RegisterError::Room);
    }
    let law = Law { number, law };
    *names = Names::of(names.laws.iter().copied().chain([law]).collect());
    Ok(law)
}

fn names() -> &'static Names {
    *NAMES.read().unwrap_or_else(PoisonError::into_inner)
}

/// Declares the built-in laws.
macro_rules! built_in {
    ($($(#[$doc:meta])* $law:ident = $number:literal: $is:expr,)*) => {
        #[allow(non_upper_case_globals, reason = "each is one of a list, as variants are")]
        impl Law {
            $($(#[$doc])* pub const $law: Self = Self { number: $number, law: &$is };)*

            /// All built-in laws, in the order of their numbers.
            pub const ALL: [Self; 12] = [$(Self::$law),*];
        }
    };
}

/// Creates a law that feeds back gain times error.
const fn proportional<E>(name: &'static str, error: E, map: Map) -> Proportional<E> {
    Proportional { name, error, map }
}

built_in! {
    /// The difference in R⁸, mapped by the transposed Jacobian: the paper's difference feedback (eq. 16–20).
    Diffc = 0: Diffc,
    /// The dual quaternion of the error, `q* q_d − 1`, mapped by the damped inverse. The error is the difference in R⁸ between the
    /// goal and the tool, both as seen from the tool. This law is not the pseudoinverse of the 8×n pose Jacobian times `q_d − q`.
    DiffcInverse = 1: proportional("diffc_inverse", PoseError::difference, Map::DampedInverse),
    /// The screw logarithm, mapped by the damped inverse: the paper's logarithmic feedback on SE(3) (eq. 28–30).
    Logc = 2: proportional("logc", PoseError::screw_log, Map::DampedInverse),
    /// The screw logarithm, mapped by the transposed Jacobian.
    LogcTranspose = 3: proportional("logc_transpose", PoseError::screw_log, Map::Transpose),
    /// The decoupled logarithm, mapped by the damped inverse. Rotation and translation move on separate geodesics (paper §10.1; Bullo
    /// & Murray 1995).
    DoubleGeodesic = 4: proportional("double_geodesic", PoseError::decoupled_log, Map::DampedInverse),
    /// The decoupled logarithm, mapped by the transposed Jacobian.
    DoubleGeodesicTranspose = 5: proportional("double_geodesic_transpose", PoseError::decoupled_log, Map::Transpose),
    /// The vector part of the unit quaternion, mapped by the damped inverse: the most common closed-loop inverse kinematics
    /// (Chiaverini & Siciliano 1999).
    UnitQuaternion = 6: proportional("unit_quaternion", PoseError::vector_part, Map::DampedInverse),
    /// The vector part of the unit quaternion, mapped by the transposed Jacobian.
    UnitQuaternionTranspose = 7: proportional("unit_quaternion_transpose", PoseError::vector_part, Map::Transpose),
    /// diffc_inverse, with gains from the weights of a quadratic cost (after Marinho, Figueredo & Adorno, IROS 2015).
    Lq = 8: Lq,
    /// unit_quaternion, with gains from bounds on the effect of disturbances (Figueredo, Adorno & Ishihara 2021, arXiv 1811.05436).
    HInfinity = 9: HInfinity,
    /// logc with a gain that depends on the size of the error, so that the time to arrive has a preset bound (Aldana-López et al.
    /// 2019, arXiv 1809.07012).
    PredefinedTime = 10: PredefinedTime,
    /// The second-order version of logc, which remembers the desired twist: the PD law on SE(3) (paper §10.2; Bullo & Murray 1995).
    LogcPd = 11: LogcPd,
}

impl Law {
    /// Yields all laws. Registered laws come last.
    pub fn all() -> impl ExactSizeIterator<Item = Self> + Clone {
        names().laws.iter().copied()
    }

    /// Returns the names of all laws.
    pub fn names() -> &'static [&'static str] {
        &names().names
    }

    /// Returns the name of the parameter that has the law's gains.
    pub fn parameter(self) -> &'static str {
        names().parameters[self.number]
    }

    /// Creates a law that is not registered, so that parameters cannot name it. Use it for a law that is created after the
    /// parameters were declared, as in Python.
    ///
    /// # Panics
    /// If the law's memory is larger than [`MEMORY`](super::MEMORY).
    pub fn unlisted(law: &'static dyn ControlLaw) -> Self {
        assert!(law.memory_size() <= MEMORY, "the memory of {} is too large", law.name());
        Self { number: UNLISTED, law }
    }

    /// Returns the law's index among all laws.
    pub fn number(self) -> usize {
        self.number
    }
}

impl Deref for Law {
    type Target = dyn ControlLaw;

    fn deref(&self) -> &Self::Target {
        self.law
    }
}

impl PartialEq for Law {
    fn eq(&self, other: &Self) -> bool {
        let listed = self.number != UNLISTED;
        self.number == other.number && (listed || std::ptr::addr_eq(self.law, other.law))
    }
}

impl Eq for Law {}

impl fmt::Debug for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Law {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        Self::all().find(|law| law.name() == name).ok_or_else(|| UnknownName {
            kind: "controller",
            name: name.to_owned(),
            expected: Self::names().join(", "),
        })
    }
}
