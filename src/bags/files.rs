//! Which files make up a bag.

use super::error::BagError;
use super::metadata;
use super::unreadable::UnreadableParts;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The files of a bag's directory in their order, each once: those that its metadata name, or else all that have a bag's endings.
pub(super) fn files_of(directory: &Path, losses: &mut UnreadableParts) -> Result<Vec<PathBuf>, BagError> {
    let files = match metadata::read(directory) {
        Ok(Some(metadata)) if metadata.is_packed_otherwise() => {
            let why = format!("it is compressed as {}: zstd alone is read", metadata.compression_format);
            return Err(BagError::not_a_bag(directory, why));
        }
        Ok(Some(metadata)) => metadata.relative_file_paths,
        Ok(None) => Vec::new(),
        Err(why) => {
            losses.add_line(format!("{why}: its files are taken by their names"));
            Vec::new()
        }
    };
    let mut seen = BTreeSet::new();
    // Old versions put the directory's name before the file's; a bag's files are in its directory.
    let in_directory = |path: &String| Some(directory.join(Path::new(path).file_name()?));
    let files: Vec<_> =
        files.iter().filter_map(in_directory).filter(|path| seen.insert(path.clone())).collect();
    if files.is_empty() { list(directory) } else { Ok(files) }
}

/// The bag's files where no metadata name them, by the number at the end of their names.
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

/// 12 of `run_12.mcap` and of `run_12.mcap.zstd`.
fn number(path: &Path) -> Option<u64> {
    path.file_name()?.to_str()?.rsplit_once('_')?.1.split('.').next()?.parse().ok()
}
