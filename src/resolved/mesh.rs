//! Triangle meshes of files: Wavefront OBJ and STL.
//!
//! Metres once scaled. Colours, textures and the materials of the file are excluded: a component has one material.

use std::collections::HashSet;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::triangle::Body;
use super::triangle::Triangle;
use super::triangle::double_area;
use crate::base::error::{Error, Result};
use crate::base::vector::Vector;

/// Most triangles of one file: half a gigabyte of them in memory.
const MAX_TRIANGLES: usize = 4_000_000;

/// The triangles of an OBJ or STL file, each corner times `scale_m`; triangles without area are excluded, and
/// of several in the same place all but one.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be opened; [`Error::Table`] for another ending, a damaged file, a mesh without
/// triangles, with more than four million, or with corners that are not finite.
pub fn read_mesh(path: &Path, scale_m: f64) -> Result<Vec<Triangle<Body>>> {
    let damaged = |problem: String| Error::Table { path: path.to_owned(), line: None, problem };
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let mut corners: Vec<[[f32; 3]; 3]> = match ending.as_deref() {
        Some("obj") => {
            let mut reader = BufReader::new(File::open(path).map_err(|e| Error::io(path, e))?);
            let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
            let (models, _) = tobj::load_obj_buf(&mut reader, &options, |_| Ok(Default::default()))
                .map_err(|e| damaged(format!("no OBJ: {e}")))?;
            let mut all = Vec::new();
            for mesh in models.iter().map(|m| &m.mesh) {
                let at = |i: &u32| mesh.positions.get(3 * *i as usize..3 * *i as usize + 3).map(|p| [p[0], p[1], p[2]]);
                for three in mesh.indices.chunks_exact(3) {
                    match (at(&three[0]), at(&three[1]), at(&three[2])) {
                        (Some(a), Some(b), Some(c)) => all.push([a, b, c]),
                        _ => return Err(damaged(format!("a face names the vertices {three:?}, which are not there"))),
                    }
                }
            }
            all
        }
        Some("stl") => {
            let mut reader = BufReader::new(File::open(path).map_err(|e| Error::io(path, e))?);
            let read = stl_io::create_stl_reader(&mut reader).map_err(|e| damaged(format!("no STL: {e}")))?;
            let mut all = Vec::new();
            for triangle in read {
                let triangle = triangle.map_err(|e| damaged(format!("STL, triangle {}: {e}", all.len() + 1)))?;
                all.push(triangle.vertices.map(|v| [v[0], v[1], v[2]]));
                if all.len() > MAX_TRIANGLES {
                    break;
                }
            }
            all
        }
        _ => return Err(damaged("a mesh is .obj or .stl".into())),
    };
    if corners.len() > MAX_TRIANGLES {
        return Err(damaged(format!("more than {MAX_TRIANGLES} triangles")));
    }
    if let Some(bad) = corners.iter().find(|t| t.iter().flatten().any(|x| !x.is_finite())) {
        return Err(damaged(format!("a corner is not finite: {bad:?}")));
    }
    // of triangles in the same place a ray would meet each
    let mut seen = HashSet::new();
    corners.retain(|triangle| seen.insert(place_of(triangle)));
    let scaled = |p: [f32; 3]| Vector::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])) * scale_m;
    let triangles: Vec<Triangle<Body>> =
        corners.into_iter().map(|t| t.map(scaled)).filter(|t| double_area(t).norm() > 0.0).collect();
    if triangles.is_empty() {
        return Err(damaged("no triangle in it".into()));
    }
    Ok(triangles)
}

/// The corners of a triangle as bits, the smallest first: the same for every corner it may begin with, another for its
/// back.
fn place_of(triangle: &[[f32; 3]; 3]) -> [[u32; 3]; 3] {
    let mut place = triangle.map(|corner| corner.map(f32::to_bits));
    let first = (0..3).min_by_key(|k| place[*k]).unwrap_or(0);
    place.rotate_left(first);
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron of volume 1/6, fronts outwards.
    const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

    fn volume(triangles: &[Triangle<Body>]) -> f64 {
        triangles.iter().map(|[a, b, c]| a.dot(&b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn one_body_as_obj_and_as_stl_is_the_same_body() {
        let folder = tempfile::tempdir().unwrap();
        let obj = folder.path().join("t.obj");
        std::fs::write(&obj, OBJ).unwrap();
        let triangles = read_mesh(&obj, 2.0).unwrap();
        assert!((volume(&triangles) - 8.0 / 6.0).abs() < 1e-12);
        let stl = folder.path().join("t.STL");
        let mut text = "solid t\n".to_owned();
        for t in &triangles {
            text.push_str("facet normal 0 0 0\nouter loop\n");
            t.iter().for_each(|v| text.push_str(&format!("vertex {} {} {}\n", v.x(), v.y(), v.z())));
            text.push_str("endloop\nendfacet\n");
        }
        std::fs::write(&stl, text + "endsolid t\n").unwrap();
        assert_eq!(read_mesh(&stl, 1.0).unwrap(), triangles);
    }

    #[test]
    fn triangles_in_the_same_place_count_once_and_their_back_is_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fan.obj");
        std::fs::write(&path, format!("{OBJ}f 1 {}\n", "2 3 ".repeat(50_000))).unwrap();
        // the fan is the face 1 3 2 and its back, fifty thousand times each
        assert_eq!(read_mesh(&path, 1.0).unwrap().len(), 5);
    }

    #[test]
    fn damaged_and_foreign_files_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [("a.obj", "v 0 0 0\nf 1 2 3\n"), ("b.obj", ""), ("c.stl", "solid"), ("d.ply", "ply")] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            let error = read_mesh(&path, 1.0).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }
}
