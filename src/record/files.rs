//! Which files make up a bag.

use super::error::BagError;
use super::metadata;
use std::path::{Path, PathBuf};

/// The files of a bag's directory in their order.
pub(super) fn files_of(directory: &Path) -> Result<Vec<PathBuf>, BagError> {
    let Some(metadata) = metadata::read(directory)? else { return list(directory) };
    if !metadata.compression_format.is_empty() {
        let what = format!("{}, mode {}", metadata.compression_format, metadata.compression_mode);
        return Err(compressed(directory, &what));
    }
    if metadata.relative_file_paths.is_empty() {
        return Err(BagError::not_a_bag(directory, "its metadata name no files"));
    }
    // Old versions put the directory's name before the file's; a bag's files are in its directory.
    let in_directory = |path: &String| Some(directory.join(Path::new(path).file_name()?));
    Ok(metadata.relative_file_paths.iter().filter_map(in_directory).collect())
}

/// The bag's files where no metadata name them, by the number at the end of their names.
fn list(directory: &Path) -> Result<Vec<PathBuf>, BagError> {
    let entries = directory.read_dir().map_err(BagError::read(directory))?;
    let has = |path: &Path, extension: &str| path.extension().is_some_and(|it| it == extension);
    let paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    if let Some(packed) = paths.iter().find(|path| has(path, "zstd")) {
        return Err(compressed(packed, "zstd, whole files"));
    }
    let mut files: Vec<_> = paths.into_iter().filter(|path| has(path, "mcap") || has(path, "db3")).collect();
    if files.is_empty() {
        return Err(BagError::not_a_bag(directory, "it has no metadata.yaml and no .mcap or .db3 file"));
    }
    files.sort_by_cached_key(|path| (number(path), path.clone()));
    Ok(files)
}

/// 12 of `run_12.mcap`.
fn number(path: &Path) -> Option<u64> {
    path.file_stem()?.to_str()?.rsplit_once('_')?.1.parse().ok()
}

/// What rosbag2 compressed is told apart, not read.
pub(super) fn compressed(path: &Path, what: &str) -> BagError {
    BagError::Compressed { path: path.to_owned(), what: what.to_owned() }
}
