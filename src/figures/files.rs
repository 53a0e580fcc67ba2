//! Writes files atomically.

use super::DrawError;
use std::io::ErrorKind;
use std::path::Path;

/// Writes a file atomically: readers see either the complete new file or the previous file.
///
/// # Errors
/// [`DrawError::Output`].
pub fn write(path: &Path, content: &[u8]) -> Result<(), DrawError> {
    let mut draft = path.as_os_str().to_owned();
    draft.push(".new");
    let written = std::fs::write(&draft, content).and_then(|()| std::fs::rename(&draft, path));
    written.map_err(|why| {
        // The draft may not exist, so this error is ignored, and the first error is reported.
        let _ = std::fs::remove_file(&draft);
        DrawError::Output { file: path.display().to_string(), why: why.to_string() }
    })
}

/// Creates a folder if it does not exist.
///
/// # Errors
/// [`DrawError::Output`].
pub fn make_folder(folder: &Path) -> Result<(), DrawError> {
    std::fs::create_dir_all(folder).map_err(|why| {
        let is_file = why.kind() == ErrorKind::AlreadyExists;
        let why = if is_file { "it is not a folder".to_owned() } else { why.to_string() };
        DrawError::Output { file: folder.display().to_string(), why }
    })
}
