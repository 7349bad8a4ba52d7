//! Bodies of outputs such as `Plate` for the lit view, with few triangles.
use super::mesh::PageMesh;
use glam::Vec3;
use shibo_graph::{Graph, GraphOutput};
use std::collections::HashMap;

/// The most triangles of a body that is shown.
const MOST: u32 = 200_000;
/// Cosine of the greatest angle between triangles that look like one smooth surface: 40°.
const SMOOTH: f32 = 0.766;

/// The most triangles of a model, which cannot be made coarser before it is read.
const MOST_READ: usize = 2_000_000;
/// A point with more triangles is the middle of a fan.
const FAN: usize = 64;

/// The names of the outputs that are bodies.
pub fn bodies(graph: &Graph) -> Vec<&str> {
    let is_body = |output: &&GraphOutput| output.export.as_ref().is_some_and(|export| export.target.target.is_body());
    graph.outputs.iter().filter(is_body).map(|output| output.name.as_str()).collect()
}

/// Makes an output write its body with few triangles, as [`shown_body`] reads it. False if the output is no body.
pub fn preview_body(graph: &mut Graph, output: &str) -> bool {
    let found = graph.outputs.iter_mut().find(|found| found.name == output);
    let Some(export) = found.and_then(|found| found.export.as_mut()) else { return false };
    let Some(preview) = export.target.preview(f64::from(MOST)) else { return false };
    export.target = preview;
    true
}

/// The mesh and the report, as JSON, of the files that an output with a preview has written.
///
/// # Errors
/// Fails with the reason if the files are missing or torn, or if the body has too many triangles.
pub fn shown_body(files: &[(String, Vec<u8>)]) -> Result<(PageMesh, Vec<u8>), String> {
    let ending = |end: &str| files.iter().find(|(name, _)| name.ends_with(end)).map(|(_, bytes)| bytes.as_slice());
    let torn = || "the body cannot be shown: it is not as it was written".to_owned();
    let (ply, report) = ending(".ply").zip(ending(".json")).ok_or_else(torn)?;
    let (places, triangles) = read(ply).ok_or_else(torn)?;
    if triangles.len() > MOST_READ {
        let count = triangles.len();
        return Err(format!("the body cannot be shown: it has {count} triangles; {MOST_READ} can be shown"));
    }
    Ok((sent(&places, &triangles), report.to_vec()))
}

/// Points in mm, z up, and triangles.
type Triangles = (Vec<Vec3>, Vec<[u32; 3]>);

/// Reads a PLY file of this program: points of three numbers, triangles of a count and three numbers.
fn read(ply: &[u8]) -> Option<Triangles> {
    const END: &[u8] = b"end_header\n";
    let start = ply.windows(END.len()).position(|window| window == END)? + END.len();
    let head = std::str::from_utf8(&ply[..start]).ok()?;
    let count = |of: &str| head.lines().find_map(|line| line.strip_prefix(of)?.trim().parse::<usize>().ok());
    let (points, triangles) = (count("element vertex")?, count("element face")?);
    let (places, faces) = ply[start..].split_at_checked(12 * points)?;
    let number = |bytes: &[[u8; 4]], at: usize| bytes.get(at).copied().unwrap_or_default();
    let place = |bytes: &[u8; 12]| {
        let numbers = bytes.as_chunks::<4>().0;
        Vec3::from([0, 1, 2].map(|at| f32::from_le_bytes(number(numbers, at))))
    };
    let face = |bytes: &[u8; 13]| {
        let numbers = bytes[1..].as_chunks::<4>().0;
        [0, 1, 2].map(|at| u32::from_le_bytes(number(numbers, at)))
    };
    let places: Vec<Vec3> = places.as_chunks::<12>().0.iter().map(place).collect();
    let (faces, rest) = faces.as_chunks::<13>();
    let faces: Vec<[u32; 3]> = faces.iter().map(face).collect();
    let known = |face: &[u32; 3]| face.iter().all(|corner| (*corner as usize) < points);
    (rest.is_empty() && faces.len() == triangles && faces.iter().all(known)).then_some((places, faces))
}

/// The mesh for the page, with smooth normals except at edges.
fn sent(places: &[Vec3], triangles: &[[u32; 3]]) -> PageMesh {
    let of = |corner: u32| places[corner as usize];
    let bounds = places.iter().map(|p| (*p, *p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let middle = bounds.map_or(Vec3::ZERO, |(low, high)| 0.5 * (low + high));
    let reach = places.iter().map(|p| p.distance(middle)).fold(f32::MIN_POSITIVE, f32::max);
    // Twice the area, along the normal.
    let faces: Vec<Vec3> = triangles.iter().map(|[a, b, c]| (of(*b) - of(*a)).cross(of(*c) - of(*a))).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); places.len()];
    for (number, corners) in (0..).zip(triangles) {
        corners.iter().for_each(|corner| around[*corner as usize].push(number));
    }
    let mut known: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    let (mut vertices, mut indices) = (Vec::new(), Vec::with_capacity(3 * triangles.len()));
    for (face, corners) in faces.iter().zip(triangles) {
        let own = face.normalize_or(Vec3::Z);
        for corner in corners {
            let near = &around[*corner as usize];
            let others = near.iter().map(|other| faces[*other as usize]);
            // The middle of a fan is flat.
            let smooth = match near.len() > FAN {
                true => own,
                false => others.filter(|other| other.dot(own) >= SMOOTH * other.length()).sum(),
            };
            let normal = smooth.normalize_or(own);
            let next = u32::try_from(vertices.len()).unwrap_or(u32::MAX);
            indices.push(*known.entry((*corner, normal.to_array().map(f32::to_bits))).or_insert_with(|| {
                // From z up to y up.
                let [p, n, t] = [(of(*corner) - middle) / reach, normal, normal.any_orthonormal_vector()];
                vertices.push([p.x, p.z, -p.y, n.x, n.z, -n.y, t.x, t.z, -t.y, 0.0, 0.0]);
                next
            }));
        }
    }
    let count = u32::try_from(triangles.len()).unwrap_or(u32::MAX);
    let sent =
        PageMesh { vertices, indices, triangles: (0..count).collect(), per_mm: 1.0 / reach, middle: middle.to_array() };
    sent.at_most(MOST as usize, &vec![0; triangles.len()])
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [2.0, 2.0, 0.0],
        [0.0, 0.0, 2.0],
        [2.0, 0.0, 2.0],
        [0.0, 2.0, 2.0],
        [2.0, 2.0, 2.0],
    ];

    /// A cube of 2 mm.
    fn cube() -> Triangles {
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        (CORNERS.map(Vec3::from).to_vec(), sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect())
    }

    #[test]
    fn edges_stay_sharp_and_the_body_lies_around_the_origin() {
        let (places, triangles) = cube();
        let sent = sent(&places, &triangles);
        // Each corner has one vertex for each of its three sides.
        assert_eq!((sent.vertices.len(), sent.indices.len()), (24, 36));
        assert_eq!((sent.middle, sent.per_mm), ([1.0; 3], 1.0 / 3.0_f32.sqrt()));
        for corners in sent.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|corner| sent.vertices[corner as usize]);
            let place = |v: [f32; 11]| Vec3::new(v[0], v[1], v[2]);
            let normal = (place(b) - place(a)).cross(place(c) - place(a)).normalize();
            assert!(normal.dot(Vec3::new(a[3], a[4], a[5])) > 0.999);
        }
    }

    #[test]
    fn reads_its_own_files_and_refuses_torn_ones() {
        let mut file = b"ply\nelement vertex 0000000008\nelement face 0000000012\nend_header\n".to_vec();
        let (places, triangles) = cube();
        file.extend(places.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes));
        for corners in &triangles {
            file.push(3);
            file.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
        }
        assert_eq!(read(&file), Some((places, triangles)));
        assert_eq!(read(&file[..file.len() - 1]), None);
        assert_eq!(read(b"ply\n"), None);
        *file.last_mut().unwrap() = 1;
        assert_eq!(read(&file), None);
    }
}
