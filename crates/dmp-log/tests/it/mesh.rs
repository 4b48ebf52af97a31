//! Triangle meshes: what is read, what is refused, and that no bytes are trusted.

use crate::common::{assert_says, refusals};
use dmp_log::{LogError, MeshFormat, MeshSummary, is_mesh, read_cloud, read_mesh};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

type Triangles = Vec<[[f64; 3]; 3]>;

pub(crate) fn read(path: &Path) -> Result<(MeshSummary, Triangles), LogError> {
    let mut triangles = Triangles::new();
    let summary = read_mesh(path, |batch| {
        assert!(!batch.is_empty() && batch.len() <= 16_384);
        triangles.extend_from_slice(batch);
        Ok::<(), LogError>(())
    })?;
    assert_eq!(summary.triangles, triangles.len() as u64);
    Ok((summary, triangles))
}

/// Five corners far from the origin, 1 mm apart.
const CORNERS: [[f64; 3]; 5] = [
    [458_000.001, 5_421_000.002, 100.0],
    [458_001.0, 5_421_000.0, 100.0],
    [458_001.0, 5_421_001.0, 100.5],
    [458_000.5, 5_421_001.5, 100.0],
    [458_000.0, 5_421_001.0, 99.999],
];
/// A triangle, a pentagon, and a face of two corners.
const FACES: [&[u32]; 3] = [&[0, 1, 2], &[0, 1, 2, 3, 4], &[3, 4]];

fn expected() -> Triangles {
    [[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 3, 4]].map(|corners| corners.map(|k: usize| CORNERS[k])).to_vec()
}

fn header(format: &str, corners: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n\
        element edge 1\nproperty list uchar float weights\nproperty short kind\n\
        element face 3\nproperty uchar flags\nproperty list uchar int {corners}\n\
        property list ushort double uv\nend_header\n"
    )
}

fn text_body() -> String {
    let mut body = String::new();
    for [x, y, z] in CORNERS {
        writeln!(body, "{x} {y} {z}").unwrap();
    }
    body += "2 0.5 0.25 7\n";
    for face in FACES {
        let corners: Vec<String> = face.iter().map(u32::to_string).collect();
        writeln!(body, "\n9 {} {} 1 0.5", face.len(), corners.join(" ")).unwrap();
    }
    body
}

fn binary_body(big_endian: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut put = |little: &[u8]| {
        let start = bytes.len();
        bytes.extend_from_slice(little);
        if big_endian {
            bytes[start..].reverse();
        }
    };
    CORNERS.as_flattened().iter().for_each(|c| put(&c.to_le_bytes()));
    put(&[2]);
    put(&0.5_f32.to_le_bytes());
    put(&0.25_f32.to_le_bytes());
    put(&7_i16.to_le_bytes());
    for face in FACES {
        put(&[9]);
        put(&[face.len() as u8]);
        face.iter().for_each(|corner| put(&corner.to_le_bytes()));
        put(&1_u16.to_le_bytes());
        put(&0.5_f64.to_le_bytes());
    }
    bytes
}

const OBJ: &str = "# made by hand\nmtllib a.mtl\no thing\nv 458000.001 5421000.002 100.0 1.0\n\
    v 458001 5421000 100 0.5 0.5 0.5\r\nvn 0 0 1\nv 458001 5421001 100.5\ng part\nf 1//1 2//1 3//1 # first\n\
    v 458000.5 5421001.5 100\nv\t458000 5421001 99.999\nusemtl red\ns off\nf 1 2/7 3/8/1 -2 -1\nl 1 2\nf 4 5\n";

fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// The same mesh in every format.
pub(crate) fn files() -> Vec<(&'static str, Vec<u8>)> {
    let ply = |format: &str, corners: &str, body: &[u8]| [header(format, corners).as_bytes(), body].concat();
    vec![
        ("text.ply", ply("ascii", "vertex_indices", text_body().as_bytes())),
        ("little.ply", ply("binary_little_endian", "vertex_index", &binary_body(false))),
        ("big.ply", ply("binary_big_endian", "vertex_indices", &binary_body(true))),
        ("mesh.OBJ", OBJ.as_bytes().to_vec()),
    ]
}

#[test]
fn every_format_gives_the_same_triangles() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files() {
        let path = write(&folder, name, &bytes);
        let (summary, triangles) = read(&path).unwrap();
        assert_eq!(triangles, expected(), "{name}");
        assert_eq!((summary.vertices, summary.thin_faces), (5, 1), "{name}");
        let obj = name.ends_with("OBJ");
        assert_eq!(summary.format, if obj { MeshFormat::Obj } else { MeshFormat::Ply });
        assert!(is_mesh(&path).unwrap());
    }
}

#[test]
fn a_ply_without_faces_is_a_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let body = "end_header\n1 2 3\n";
    for faces in ["", "element face 0\nproperty list uchar int vertex_indices\n"] {
        let text = format!("ply\nformat ascii 1.0\nelement vertex 1\n{xyz}{faces}{body}");
        let path = write(&folder, "cloud.ply", text.as_bytes());
        assert!(!is_mesh(&path).unwrap());
        assert_eq!(read_cloud(&path, None, |_| Ok::<(), LogError>(())).unwrap().points, 1);
    }
    assert!(!is_mesh(&write(&folder, "a.laz", b"LASF")).unwrap());
    assert!(matches!(is_mesh(&folder.path().join("none.obj")), Err(LogError::NotFound { .. })));
}

#[test]
fn row_03_what_is_wrong_is_named_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let error = |name: &str, bytes: &[u8]| read(&write(&folder, name, bytes)).unwrap_err().to_string();
    let [(_, text), (_, little), _, _] = files().try_into().unwrap();
    let text = String::from_utf8(text).unwrap();
    let face = |with: &str| text.replace("9 3 0 1 2", with);
    refusals(
        |text| error("a.ply", text.as_bytes()),
        "a.ply: ",
        &[
            (&face("9 3 0 1 7"), "line 22: | vertex 7 (from 0) of 5"),
            (&face("9 3 0 -1 2"), "line 22: | vertex -1"),
            (&face("9 3 0 1.5 2"), "line 22: | `1.5` is no count or index"),
            (&text.replace("9 3 0 1 2 1 0.5", "9 3 0"), "line 22: | `` is no count or index"),
            (
                &text.replace("element face 3", "element face 18446744073709551615"),
                "line 27: | ends before its last face",
            ),
            (&text.replace("vertex_indices", "corners"), "the faces lack the list `vertex_indices`"),
        ],
    );
    let at = little.len() - 3 * 12 - (3 + 5 + 2) * 4 + 1;
    assert_eq!(little[at], 3, "the first face's count");
    let mut lying = little.clone();
    lying[at] = 255;
    let header_of = |from: &str, to: &str| {
        let split = little.windows(11).position(|w| w == b"end_header\n").unwrap();
        let header = String::from_utf8(little[..split].to_vec()).unwrap().replace(from, to);
        [header.as_bytes(), &little[split..]].concat()
    };
    for (bytes, parts) in [
        (little[..little.len() - 40].to_vec(), &["b.ply: byte ", "ends before its last face"][..]),
        (lying, &["b.ply: byte ", "of 5"]),
        (header_of("list uchar int", "list float int"), &["`vertex_index` has the type `float`"]),
        (header_of("vertex 5", "vertex 4000000000"), &["4,000,000,000 vertices of 24 bytes do not fit"]),
    ] {
        assert_says(&error("b.ply", &bytes), parts);
    }
    let index = |index: &str| format!("v 1 2 3\nf 1 1 {index}\n");
    refusals(
        |text| error("c.obj", text.as_bytes()),
        "c.obj: ",
        &[
            ("v 1 2 3\nv 1 2\n", "line 2: | `` is no coordinate"),
            (&index("0"), "line 2: | `0` names no vertex"),
            (&index("2"), "line 2: | `2` names no vertex"),
            (&index("-2"), "line 2: | `-2` names no vertex"),
            (&index("x"), "line 2: | `x` names no vertex"),
            (&index("/1"), "line 2: | `/1` names no vertex"),
            (&index("99999999999999999999"), "line 2: | `99999999999999999999` names no vertex"),
            ("v 1 2 3\n", "the whole file: 1 vertices and no face"),
            (&"v".repeat(70_000), "line 1: | longer than 65536"),
        ],
    );
}

/// Files of other software: `tests/conformance/mesh/make.py` says which.
#[test]
fn meshes_of_other_software_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance/mesh");
    for name in ["box_ascii.ply", "box_binary.ply", "box.obj"] {
        let (summary, triangles) = read(&folder.join(name)).unwrap();
        assert_eq!((summary.vertices, summary.triangles), (8, 12), "{name}");
        let area = |t: &[[f64; 3]; 3]| {
            let [u, v]: [[f64; 3]; 2] = [1, 2].map(|k| std::array::from_fn(|axis| t[k][axis] - t[0][axis]));
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            0.5 * n.iter().map(|c| c * c).sum::<f64>().sqrt()
        };
        // A box of 2 m × 3 m × 4 m.
        let sum: f64 = triangles.iter().map(area).sum();
        assert!((sum - 52.0).abs() < 1e-4, "{name}: {sum}");
    }
}
