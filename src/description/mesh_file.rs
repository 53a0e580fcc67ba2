//! Reads the mesh files that a robot description refers to.

use super::{collada_file, stl_file};
use dq_common::text::cut;
use dq_common::text_file;
use mesh_loader::{Loader, Scene};
use std::panic::catch_unwind;
use std::path::{Component, Path, PathBuf};

/// The size of the largest mesh file that is read \[bytes\].
const LARGEST: u64 = 64 << 20;

/// The file types that are read.
const KINDS: [&str; 3] = ["stl", "dae", "obj"];

/// Loads the mesh `file`, in meters. `description` is the robot description's own file, if it has one.
///
/// # Errors
/// The reason why the mesh cannot be read.
pub fn load(file: &str, description: Option<&Path>) -> Result<Scene, String> {
    let of_ros = |variable: &str| std::env::var(variable).unwrap_or_default();
    let folders = ["AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"].map(of_ros);
    let path = find(file, description, &folders).ok_or_else(|| missing(file))?;
    let read = |path: &Path| text_file::bytes(path, LARGEST);
    let load = || {
        let bytes = read(&path).map_err(|why| why.to_string())?;
        match kind(file).as_deref() {
            Some("stl") => stl_file::read(&bytes),
            Some("dae") => collada_file::read(&bytes, &path),
            _ => {
                let read = Loader::default().custom_reader(read).load_from_slice(&bytes, &path);
                read.map_err(|why| why.to_string())
            }
        }
    };
    // An error in a file must not end the program.
    let scene = catch_unwind(load).map_err(|_| format!("{} is no mesh", path.display()))?;
    let scene: Scene = scene.map_err(|why| format!("{}: {why}", path.display()))?;
    let is_number = |corner: &[f32; 3]| corner.iter().all(|number| number.is_finite());
    match scene.meshes.iter().flat_map(|mesh| &mesh.vertices).all(is_number) {
        true => Ok(scene),
        false => Err(format!("{} has corners that are no numbers", path.display())),
    }
}

fn missing(file: &str) -> String {
    let file = cut(file);
    match file.starts_with("package://") {
        true => format!("{file} is not there"),
        false => {
            format!("{file} is not there, or neither in a package of ROS nor beside the description's file")
        }
    }
}

fn kind(file: &str) -> Option<String> {
    Some(Path::new(file).extension()?.to_str()?.to_lowercase())
}

/// Returns the path of the mesh `file`; `None` if the file is not found. `description` is the path of the robot description's own
/// file, if it has one. `folders` has the values of `AMENT_PREFIX_PATH` and `ROS_PACKAGE_PATH`.
///
/// - The package of a `package://` name is searched in the folders of ROS packages and in the folders above `description`.
/// - A file with any other name must be in a ROS package, in the folder of `description`, or in a folder next to that folder. A
///   description from the network has no file of its own, so it can only refer to files in packages.
fn find(file: &str, description: Option<&Path>, folders: &[String; 2]) -> Option<PathBuf> {
    kind(file).filter(|kind| KINDS.contains(&kind.as_str()))?;
    let above = description.into_iter().flat_map(Path::ancestors).skip(1).map(Path::to_path_buf);
    let in_packages = packages(folders).chain(above);
    if let Some((package, inside)) = file.strip_prefix("package://").and_then(|rest| rest.split_once('/')) {
        let inside = inside_of(Path::new(inside)).filter(|_| ![".", "..", ""].contains(&package))?;
        let of_folder = |folder: PathBuf| {
            let is_package = folder.file_name().is_some_and(|name| name == package);
            let own = is_package.then(|| folder.join(&inside));
            [Some(folder.join(package).join(&inside)), own].into_iter().flatten().find(|path| path.is_file())
        };
        return in_packages.into_iter().find_map(of_folder);
    }
    let named = Path::new(file.strip_prefix("file://").unwrap_or(file));
    let beside = description.map(|description| description.parent().unwrap_or(Path::new("")));
    let path = beside.map_or_else(|| named.to_path_buf(), |beside| beside.join(named));
    let is_beside = || match (named.is_absolute(), beside) {
        (_, None) => false,
        (true, Some(beside)) => path.strip_prefix(beside).is_ok_and(|rest| inside_of(rest).is_some()),
        (false, Some(_)) => inside_of(named.strip_prefix("..").unwrap_or(named)).is_some(),
    };
    // A package is a subfolder of these folders. A file in the folder itself belongs to no package.
    let is_packaged = || {
        packages(folders).any(|folder| {
            path.strip_prefix(&folder)
                .is_ok_and(|rest| inside_of(rest).is_some_and(|inside| inside.components().count() > 1))
        })
    };
    Some(&path).filter(|path| (is_beside() || is_packaged()) && path.is_file()).cloned()
}

/// Yields the folders in which ROS has its packages: `share` in each folder of the list `prefixes`, and each folder of the list
/// `packages`. Colons separate the folders of a list.
fn packages([prefixes, packages]: &[String; 2]) -> impl Iterator<Item = PathBuf> {
    let each = |list: &'_ str| {
        list.split(':').filter(|part| !part.is_empty()).map(PathBuf::from).collect::<Vec<_>>()
    };
    let shares = each(prefixes).into_iter().map(|prefix| prefix.join("share"));
    shares.chain(each(packages))
}

/// Returns the path if it leads only into subfolders; `None` if it leads anywhere else.
fn inside_of(path: &Path) -> Option<PathBuf> {
    let only_down = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    only_down.then(|| path.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNER: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n";

    #[test]
    fn files_are_found_in_ros_packages_and_near_the_description() {
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
        let beside = find("../meshes/link.STL", Some(&inside), &nowhere());
        assert_eq!(beside.unwrap().canonicalize().unwrap(), mesh.canonicalize().unwrap());
    }

    #[test]
    fn a_description_cannot_read_other_files_of_the_host() {
        let root = tempfile::tempdir().unwrap();
        let place = |name: &str| {
            let path = root.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, CORNER).unwrap();
            path
        };
        let secret = place("secret.stl");
        let packaged = place("share/arm/meshes/link.stl");
        let beside = place("home/robot/meshes/link.stl");
        let own = root.path().join("home/robot/arm.urdf");
        let folders = [root.path().to_str().unwrap().to_owned(), String::new()];
        let absolute =
            |path: &Path| [path.to_str().unwrap().to_owned(), format!("file://{}", path.display())];
        for from in [None, Some(own.as_path())] {
            for name in absolute(&packaged) {
                assert_eq!(find(&name, from, &folders), Some(packaged.clone()), "{name}");
            }
            let outside = [
                "package://../secret.stl",
                "package://arm/../../secret.stl",
                "package://arm/../../../secret.stl",
                "package:///secret.stl",
                "../../secret.stl",
                "meshes/../../../secret.stl",
                "file://../../secret.stl",
            ];
            let through = format!("{}/share/arm/../../secret.stl", root.path().display());
            for name in outside.map(str::to_owned).into_iter().chain(absolute(&secret)).chain([through]) {
                assert_eq!(find(&name, from, &folders), None, "{name}");
            }
        }
        // Only a description with a file can refer to neighboring files.
        for name in ["meshes/link.stl".to_owned()].into_iter().chain(absolute(&beside)) {
            assert_eq!(find(&name, Some(&own), &folders), Some(beside.clone()), "{name}");
            assert_eq!(find(&name, None, &folders), None, "{name}");
        }
        assert_eq!(find("/etc/passwd", Some(&own), &folders), None);
    }
}
