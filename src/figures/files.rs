//! Files, each written whole.

use super::DrawError;
use std::io::ErrorKind;
use std::path::Path;

/// Writes a file at once: there is the whole one or what was there before.
///
/// # Errors
/// [`DrawError::Output`].
pub fn write(path: &Path, content: &[u8]) -> Result<(), DrawError> {
    let mut draft = path.as_os_str().to_owned();
    draft.push(".new");
    let written = std::fs::write(&draft, content).and_then(|()| std::fs::rename(&draft, path));
    written.map_err(|why| {
        // It may not be there, and what is said is why.
        let _ = std::fs::remove_file(&draft);
        DrawError::Output { file: path.display().to_string(), why: why.to_string() }
    })
}

/// Makes a folder if it is not there.
///
/// # Errors
/// [`DrawError::Output`].
pub fn make_folder(folder: &Path) -> Result<(), DrawError> {
    std::fs::create_dir_all(folder).map_err(|why| {
        let is_file = why.kind() == ErrorKind::AlreadyExists;
        let why = if is_file { "it is no folder".to_owned() } else { why.to_string() };
        DrawError::Output { file: folder.display().to_string(), why }
    })
}
