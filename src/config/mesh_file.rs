//! The mesh files that a robot description names.

use dq_common::text::cut;
use mesh_loader::Scene;
use std::fs::File;
use std::io::{self, Read};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

/// The largest mesh file that is read \[bytes\].
const LARGEST: u64 = 64 << 20;

/// The files that are read at all.
const KINDS: [&str; 3] = ["stl", "dae", "obj"];

/// The mesh `file`. `description` is the robot description's own file, if it came from one.
///
/// # Errors
/// Why there is none.
pub fn load(file: &str, description: Option<&Path>) -> Result<Scene, String> {
    let of_ros = |variable: &str| std::env::var(variable).unwrap_or_default();
    let folders = ["AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"].map(of_ros);
    let path = find(file, description, &folders).ok_or_else(|| format!("{} is not there", cut(file)))?;
    let load = || mesh_loader::Loader::default().custom_reader(read).load(&path);
    // What is wrong in a file must not end who reads it.
    let scene = catch_unwind(load).map_err(|_| format!("{} is no mesh", path.display()))?;
    scene.map_err(|why| format!("{}: {why}", path.display()))
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("it is no file"));
    }
    let mut bytes = Vec::new();
    if file.take(LARGEST + 1).read_to_end(&mut bytes)? as u64 > LARGEST {
        return Err(io::Error::other(format!("it has more than {LARGEST} bytes")));
    }
    Ok(bytes)
}

/// Where the file is: a `package://` in an installed prefix, in a folder of packages, or in a folder above the description's own file.
fn find(file: &str, description: Option<&Path>, [prefixes, packages]: &[String; 2]) -> Option<PathBuf> {
    let kind = Path::new(file).extension()?.to_str()?.to_lowercase();
    if !KINDS.contains(&kind.as_str()) {
        return None;
    }
    let Some((package, inside)) = file.strip_prefix("package://").and_then(|rest| rest.split_once('/'))
    else {
        let path = Path::new(file.strip_prefix("file://").unwrap_or(file));
        let beside = description.and_then(Path::parent).unwrap_or(Path::new(""));
        return Some(beside.join(path)).filter(|path| path.is_file());
    };
    let each =
        |list: &str| list.split(':').filter(|part| !part.is_empty()).map(PathBuf::from).collect::<Vec<_>>();
    let shares = each(prefixes).into_iter().map(|prefix| prefix.join("share"));
    let above = description.into_iter().flat_map(Path::ancestors).skip(1).map(Path::to_path_buf);
    let folders = shares.chain(each(packages)).chain(above);
    let of_folder = |folder: PathBuf| {
        let is_package = folder.file_name().is_some_and(|name| name == package);
        let own = is_package.then(|| folder.join(inside));
        [Some(folder.join(package).join(inside)), own].into_iter().flatten().find(|path| path.is_file())
    };
    folders.into_iter().find_map(of_folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNER: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n";

    #[test]
    fn files_are_found_as_ros_finds_them_and_beside_the_description() {
        let root = tempfile::tempdir().unwrap();
        let mesh = root.path().join("share/arm/meshes/link.STL");
        std::fs::create_dir_all(mesh.parent().unwrap()).unwrap();
        std::fs::write(&mesh, CORNER).unwrap();
        let text = |path: &Path| path.to_str().unwrap().to_owned();
        let nowhere = || ["".to_owned(), "".to_owned()];
        let inside = root.path().join("share/arm/urdf/arm.urdf");
        std::fs::create_dir_all(inside.parent().unwrap()).unwrap();
        let named = "package://arm/meshes/link.STL";
        assert_eq!(find(named, None, &nowhere()), None);
        assert_eq!(find(named, Some(&inside), &nowhere()), Some(mesh.clone()));
        for folders in [
            [format!("/nowhere:{}", text(root.path())), String::new()],
            [String::new(), text(&root.path().join("share"))],
            [String::new(), text(&root.path().join("share/arm"))],
        ] {
            assert_eq!(find(named, None, &folders), Some(mesh.clone()), "{folders:?}");
        }
        assert_eq!(find(&format!("file://{}", text(&mesh)), None, &nowhere()), Some(mesh.clone()));
        let beside = find("../meshes/link.STL", Some(&inside), &nowhere());
        assert_eq!(beside.unwrap().canonicalize().unwrap(), mesh.canonicalize().unwrap());
        assert_eq!(find("/etc/passwd", None, &nowhere()), None);
    }
}
