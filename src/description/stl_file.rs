//! Reads the triangles of STL files. Also reads files that mesh-loader (0.1) rejects although programs write them: binary files
//! that begin with "solid", binary files with trailing data, and text files without a name.

use mesh_loader::{Material, Mesh, Scene};

/// The size of the header of a binary file \[bytes\].
const HEAD: usize = 80;
/// The size of the field with the number of triangles, after the header \[bytes\].
const COUNT: usize = 4;
/// The size of each triangle \[bytes\].
const TRIANGLE: usize = 50;

/// The size of a triangle's normal, which precedes its corners: three numbers of four bytes.
const NORMAL: usize = 12;

/// Reads the triangles of an STL file.
///
/// # Errors
/// The reason why the triangles cannot be read.
pub(crate) fn read(bytes: &[u8]) -> Result<Scene, String> {
    let corners = match binary(bytes) {
        Some(triangles) => triangles.flat_map(corners_of).collect(),
        None => text(bytes)?,
    };
    if corners.is_empty() || corners.len() % 3 != 0 {
        return Err(format!("it ends after {} corners of triangles", corners.len()));
    }
    let mut mesh = Mesh::default();
    mesh.faces =
        (0..corners.len() as u32 / 3).map(|face| [0, 1, 2].map(|corner| 3 * face + corner)).collect();
    mesh.vertices = corners;
    let mut scene = Scene::default();
    (scene.meshes, scene.materials) = (vec![mesh], vec![Material::default()]);
    Ok(scene)
}

/// Returns the triangles of a binary file; `None` for a text file.
fn binary(bytes: &[u8]) -> Option<std::slice::ChunksExact<'_, u8>> {
    let (head, triangles) = bytes.split_at_checked(HEAD + COUNT)?;
    let count = u32::from_le_bytes(*head.last_chunk()?) as usize;
    let size = count.saturating_mul(TRIANGLE);
    let begins_as_text =
        head.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let is_binary = size == triangles.len() || !begins_as_text || bytes.contains(&0);
    // Some programs write no number of triangles, or a wrong number. Then all data counts.
    let known = triangles.get(..size).filter(|_| count > 0).unwrap_or(triangles);
    is_binary.then(|| known.chunks_exact(TRIANGLE))
}

fn corners_of(triangle: &[u8]) -> impl Iterator<Item = [f32; 3]> {
    let number = move |at: usize| {
        f32::from_le_bytes([triangle[at], triangle[at + 1], triangle[at + 2], triangle[at + 3]])
    };
    (0..3).map(move |corner| [0, 1, 2].map(|axis| number(NORMAL + 12 * corner + 4 * axis)))
}

/// Reads the corners of a text file, one per line.
fn text(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let text = String::from_utf8_lossy(bytes).to_ascii_lowercase();
    let lines = text.split(['\n', '\r']).filter_map(|line| line.trim().strip_prefix("vertex"));
    let corner = |line: &str| {
        let numbers: Option<Vec<f32>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        let corner = numbers.and_then(|numbers| numbers.try_into().ok());
        corner.ok_or_else(|| format!("the corner {line:?} is no three numbers"))
    };
    lines.map(corner).collect()
}
