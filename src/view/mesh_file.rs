//! The mesh files that a robot description names.

use super::surface::Triangle;
use crate::arm::Rgb;
use nalgebra::{Point3, Vector3};
use std::fs::File;
use std::io::{self, Read};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

/// The largest mesh file that is read \[bytes\].
const LARGEST: u64 = 64 << 20;

/// The files that are read at all.
const KINDS: [&str; 3] = ["stl", "dae", "obj"];

/// The triangles of the mesh `file`, as it is, and their colours where it has some. `description` is the robot description's own file,
/// if it came from one.
///
/// # Errors
/// Why there are none.
pub(super) fn triangles(
    file: &str,
    description: Option<&Path>,
) -> Result<Vec<(Triangle, Option<Rgb>)>, String> {
    let of_ros = |variable: &str| std::env::var(variable).unwrap_or_default();
    let folders = ["AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"].map(of_ros);
    let path = find(file, description, &folders).ok_or_else(|| format!("{file} is not there"))?;
    let load = || mesh_loader::Loader::default().custom_reader(read).load(&path);
    // What is wrong in a file must not end who reads it.
    let scene = catch_unwind(load).map_err(|_| format!("{} is no mesh", path.display()))?;
    let scene = scene.map_err(|why| format!("{}: {why}", path.display()))?;
    let color = |at: usize| scene.materials.get(at).and_then(|material| material.color.diffuse);
    let triangles = scene.meshes.iter().enumerate().flat_map(|(at, mesh)| {
        let color = color(at).map(|[red, green, blue, _]| [red, green, blue]);
        mesh.faces.iter().filter_map(move |face| Some((triangle(mesh, *face)?, color)))
    });
    Ok(triangles.collect())
}

/// None of a face that has no such corners, or no area.
fn triangle(mesh: &mesh_loader::Mesh, face: [u32; 3]) -> Option<Triangle> {
    let [a, b, c] =
        face.map(|at| mesh.vertices.get(at as usize).map(|place| Point3::from(place.map(f64::from))));
    let corners = [a?, b?, c?];
    let flat = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).try_normalize(1e-18)?;
    let normal = |at: u32| {
        let given = mesh.normals.get(at as usize).map(|normal| Vector3::from(normal.map(f64::from)));
        given.and_then(|normal| normal.try_normalize(1e-9)).unwrap_or(flat)
    };
    let triangle = [0, 1, 2].map(|at| (corners[at], normal(face[at])));
    let is_finite = |(place, normal): &(Point3<f64>, Vector3<f64>)| {
        place.iter().chain(normal.iter()).all(|part| part.is_finite())
    };
    triangle.iter().all(is_finite).then_some(triangle)
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

    #[test]
    fn meshes_are_read_and_what_is_none_has_a_reason() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, content: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, content).unwrap();
            path.to_str().unwrap().to_owned()
        };
        let [(triangle, color)] = triangles(&write("a.stl", CORNER.as_bytes()), None).unwrap()[..] else {
            panic!()
        };
        assert_eq!((triangle[1].0, triangle[0].1, color), (Point3::new(1.0, 0.0, 0.0), Vector3::z(), None));
        let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
        assert_eq!(triangles(&write("b.obj", square.as_bytes()), None).unwrap().len(), 2);
        for damaged in ["solid s\nfacet normal", "v 0 0\nf 1 2 9", "<COLLADA></COLLADA", ""] {
            for kind in ["stl", "obj", "dae"] {
                let read = triangles(&write(&format!("c.{kind}"), damaged.as_bytes()), None);
                assert!(read.is_err() || read.is_ok_and(|read| read.is_empty()), "{kind}: {damaged}");
            }
        }
        assert!(triangles("no.stl", None).unwrap_err().contains("is not there"));
    }
}
