//! Finds the files of a bag.

use super::error::BagError;
use super::metadata;
use super::unreadable::UnreadableParts;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Returns the paths of a bag's files in order, each once. The bag's metadata names these files. If there is no readable metadata,
/// returns all files in `directory` with a file extension of bags, such as `.mcap`.
pub(super) fn files_of(directory: &Path, losses: &mut UnreadableParts) -> Result<Vec<PathBuf>, BagError> {
    let files = match metadata::read(directory) {
        Ok(Some(metadata)) if metadata.is_packed_otherwise() => {
            let why = format!("it is compressed as {}: only zstd is supported", metadata.compression_format);
            return Err(BagError::not_a_bag(directory, why));
        }
        Ok(Some(metadata)) => metadata.relative_file_paths,
        Ok(None) => Vec::new(),
        Err(why) => {
            losses.add_line(format!("{why}: its files are found by their names"));
            Vec::new()
        }
    };
    let mut seen = BTreeSet::new();
    // Old versions of rosbag2 put the name of the bag's directory before each file name. The files are in the directory that was
    // opened, whatever its name.
    let in_directory = |path: &String| Some(directory.join(Path::new(path).file_name()?));
    let files: Vec<_> =
        files.iter().filter_map(in_directory).filter(|path| seen.insert(path.clone())).collect();
    if files.is_empty() { list(directory) } else { Ok(files) }
}

/// Returns the files of a bag without metadata, sorted by the numbers in their names.
fn list(directory: &Path) -> Result<Vec<PathBuf>, BagError> {
    const ENDINGS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".db3.zstd"];
    let entries = directory.read_dir().map_err(BagError::read(directory))?;
    let is_ours = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        ENDINGS.iter().any(|ending| name.ends_with(ending))
    };
    let mut files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_ours).collect();
    if files.is_empty() {
        return Err(BagError::not_a_bag(
            directory,
            "neither metadata.yaml nor the names of its files say what is in it",
        ));
    }
    files.sort_by_cached_key(|path| (number(path), path.clone()));
    Ok(files)
}

/// Returns the number that a recorder put into a file name: 12 for `run_12.mcap`, `run_12.mcap.zstd`, and Lyrical's
/// `12_run_2026_05_23-14_30_00.mcap`.
fn number(path: &Path) -> Option<u64> {
    let name = path.file_name()?.to_str()?.split('.').next()?;
    let (first, rest) = name.split_once('_')?;
    match rest.len().checked_sub(TIME.len()).and_then(|at| rest.get(at..)).filter(|end| is_time(end)) {
        Some(_) => first.parse().ok(),
        None => name.rsplit_once('_')?.1.parse().ok(),
    }
}

/// The format of the local times that rosbag2 puts into file names. Each 0 stands for a digit.
const TIME: &str = "0000_00_00-00_00_00";

/// Returns whether the text has the format [`TIME`].
fn is_time(text: &str) -> bool {
    let alike = |(one, other): (char, char)| if one == '0' { other.is_ascii_digit() } else { one == other };
    text.len() == TIME.len() && TIME.chars().zip(text.chars()).all(alike)
}

/// Returns the name that the ROS release `distro` gives to the file `number` in a bag's directory. Before Lyrical it is the
/// directory's name and the number. From Lyrical on it is the number, the directory's name without a time at its end, and the
/// present time.
pub(super) fn file_name(directory: &Path, number: usize, distro: &str) -> String {
    let name = directory.file_name().unwrap_or_else(|| "bag".as_ref()).to_string_lossy();
    if distro != LYRICAL {
        return format!("{name}_{number}.mcap");
    }
    let time = name.len().checked_sub(TIME.len()).filter(|at| name.get(*at..).is_some_and(is_time));
    let prefix = time.map_or(&*name, |at| name[..at].trim_end_matches('_'));
    let prefix = if prefix.is_empty() { "rosbag2" } else { prefix };
    format!("{number}_{prefix}_{}.mcap", chrono::Local::now().format("%Y_%m_%d-%H_%M_%S"))
}

/// The name of the ROS 2 release of May 2026, as in `ROS_DISTRO`.
pub(super) const LYRICAL: &str = "lyrical";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_numbered_as_each_release_names_them() {
        for (name, expected) in [
            ("run_12.mcap", Some(12)),
            ("run_12.mcap.zstd", Some(12)),
            ("rosbag2_2026_05_23-14_30_00_3.db3", Some(3)),
            ("12_run_2026_05_23-14_30_07.mcap", Some(12)),
            ("0_my_run_2_2026_05_23-14_30_07.mcap.zstd", Some(0)),
            ("7_2026_05_23-14_30_07.db3", Some(7)),
            ("run.mcap", None),
            ("run_2026_05_23-14_30_07.mcap", None),
        ] {
            assert_eq!(number(Path::new(name)), expected, "{name}");
        }
    }

    #[test]
    fn file_names_are_those_of_the_ros_release() {
        let name = |directory: &str, distro: &str| file_name(Path::new(directory), 2, distro);
        assert_eq!(name("/a/run", ""), "run_2.mcap");
        assert_eq!(name("/a/run", "jazzy"), "run_2.mcap");
        for (directory, prefix) in [
            ("/a/run", "2_run_"),
            ("rosbag2_2026_05_23-14_30_00", "2_rosbag2_"),
            ("2026_05_23-14_30_00", "2_rosbag2_"),
        ] {
            let name = name(directory, LYRICAL);
            let time = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(".mcap"));
            assert!(time.is_some_and(is_time), "{name}");
            assert_eq!(number(Path::new(&name)), Some(2));
        }
    }
}
