//! The laws as one table: what is fed back, and which map makes joint velocities of it.

use super::names::named;

named! {
    /// Which law turns the pose error into joint velocities.
    "controller" Law {
        /// R⁸ difference × transpose: the paper's difference feedback (eq. 16–20).
        Diffc = "diffc",
        /// Error's dual quaternion, `q* q_d − 1`, × damped inverse. That is the R⁸ difference as seen from the tool, not `J₈⁺ (q_d − q)`.
        DiffcInverse = "diffc_inverse",
        /// Screw logarithm × damped inverse: the paper's logarithmic feedback on SE(3) (eq. 28–30).
        Logc = "logc",
        /// Screw logarithm × transpose.
        LogcTranspose = "logc_transpose",
        /// Decoupled logarithm × damped inverse: rotation and translation each on their own geodesic (paper §10.1; Bullo &
        /// Murray 1995).
        DoubleGeodesic = "double_geodesic",
        /// Decoupled logarithm × transpose.
        DoubleGeodesicTranspose = "double_geodesic_transpose",
        /// Unit quaternion's vector part × damped inverse: closed-loop inverse kinematics as it is most often built
        /// (Chiaverini & Siciliano 1999).
        UnitQuaternion = "unit_quaternion",
        /// Unit quaternion's vector part × transpose.
        UnitQuaternionTranspose = "unit_quaternion_transpose",
        /// diffc_inverse with gains from the weights of a quadratic cost (after Marinho, Figueredo & Adorno, IROS 2015).
        Lq = "lq",
        /// unit_quaternion with gains from bounds on how far disturbances carry (Figueredo, Adorno & Ishihara 2021,
        /// arXiv 1811.05436).
        HInfinity = "h_infinity",
        /// logc with a gain that grows at both ends, so that the time to arrive has a bound that is set in advance
        /// (Aldana-López et al. 2019, arXiv 1809.07012).
        PredefinedTime = "predefined_time",
    }
}

/// What is fed back: the error between tool and goal as six numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// The difference of the dual quaternions: with the transpose `q_d − q` in R⁸, else the same as seen from the tool, `q* q_d − 1`.
    R8,
    /// The logarithm of SE(3).
    ScrewLog,
    /// Rotation vector and translation, each by itself.
    DecoupledLog,
    /// Twice the vector part of the error's quaternion, and the translation by itself.
    UnitQuaternion,
}

/// How six numbers become joint velocities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// `Jᵀ`.
    Transpose,
    /// `J⁺ = Jᵀ(JJᵀ + λ²I)⁻¹`.
    DampedInverse,
}

impl Law {
    /// Every law, in the order of its names.
    pub const ALL: [Self; 11] = [
        Self::Diffc,
        Self::DiffcInverse,
        Self::Logc,
        Self::LogcTranspose,
        Self::DoubleGeodesic,
        Self::DoubleGeodesicTranspose,
        Self::UnitQuaternion,
        Self::UnitQuaternionTranspose,
        Self::Lq,
        Self::HInfinity,
        Self::PredefinedTime,
    ];

    /// The law's place in the table.
    pub fn cell(self) -> (Metric, Map) {
        match self {
            Self::Diffc => (Metric::R8, Map::Transpose),
            Self::DiffcInverse | Self::Lq => (Metric::R8, Map::DampedInverse),
            Self::LogcTranspose => (Metric::ScrewLog, Map::Transpose),
            Self::Logc | Self::PredefinedTime => (Metric::ScrewLog, Map::DampedInverse),
            Self::DoubleGeodesicTranspose => (Metric::DecoupledLog, Map::Transpose),
            Self::DoubleGeodesic => (Metric::DecoupledLog, Map::DampedInverse),
            Self::UnitQuaternionTranspose => (Metric::UnitQuaternion, Map::Transpose),
            Self::UnitQuaternion | Self::HInfinity => (Metric::UnitQuaternion, Map::DampedInverse),
        }
    }
}
