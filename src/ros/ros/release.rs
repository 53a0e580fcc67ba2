//! The release of ROS 2 that this program was built for.
//!
//! Humble and older releases announce nodes on `ros_discovery_info` with GIDs of 24 bytes, later releases with GIDs of 16 bytes.
//! ros2-client supports one of the two lengths, which is chosen when ros2-client is built.

/// A group of releases that announce nodes with GIDs of the same length, named after one of these releases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Release {
    /// ROS 2 Humble and older releases.
    Humble,
    /// ROS 2 Iron and every later release.
    Jazzy,
}

/// The release that this program was built for.
pub(super) const BUILT_FOR: Release = match ros2_client::gid::GID_LENGTH {
    24 => Release::Humble,
    _ => Release::Jazzy,
};

/// The values of `ROS_DISTRO` for the releases that announce nodes like Humble.
const LIKE_HUMBLE: [&str; 3] = ["foxy", "galactic", "humble"];

impl Release {
    /// Returns the release that the value of `ROS_DISTRO` names.
    fn of_distribution(name: &str) -> Self {
        if LIKE_HUMBLE.contains(&name) { Self::Humble } else { Self::Jazzy }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Humble => "ROS 2 Humble",
            Self::Jazzy => "ROS 2 Jazzy and other releases from Iron on",
        }
    }

    /// Returns how to build this program for the release.
    fn remedy(self) -> &'static str {
        match self {
            Self::Humble => "build this program with --no-default-features --features humble",
            Self::Jazzy => "build this program without --features humble",
        }
    }
}

/// Returns a warning if this program was not built for the release `name`, which is the value of `ROS_DISTRO`.
pub(super) fn warning_of_distribution(name: &str) -> Option<String> {
    let theirs = Release::of_distribution(name);
    (theirs != BUILT_FOR).then(|| {
        let (ours, remedy) = (BUILT_FOR.name(), theirs.remedy());
        format!("ROS_DISTRO={name}, but this program was built for {ours}: {remedy}")
    })
}

/// Returns the warning that `domain` has nodes of a release for which this program was not built.
pub(super) fn warning_of_announcements(theirs: Release, domain: u16) -> String {
    format!(
        "domain {domain} has nodes of {}, but this program was built for {}. Those nodes cannot read its announcements, and may fail: {}, \
         or use another ROS_DOMAIN_ID",
        theirs.name(),
        BUILT_FOR.name(),
        theirs.remedy()
    )
}
