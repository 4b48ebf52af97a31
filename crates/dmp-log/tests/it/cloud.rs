use crate::common::assert_says;
use dmp_log::{CloudFormat, CloudSummary, LengthUnit, LogError, read_cloud};
use std::fs;
use std::path::{Path, PathBuf};

type Points = Vec<[f64; 3]>;

pub(crate) fn read(path: &Path) -> Result<(CloudSummary, Points), LogError> {
    let mut points = Points::new();
    let summary = read_cloud(path, None, |batch| {
        assert!(!batch.is_empty() && batch.len() <= 65_536);
        points.extend_from_slice(batch);
        Ok::<(), LogError>(())
    })?;
    assert_eq!(summary.points, points.len() as u64);
    Ok((summary, points))
}

pub(crate) fn error(path: &Path) -> String {
    read(path).unwrap_err().to_string()
}

/// Writes `count` points on a line, format 1 (or 6, which LAZ keeps in layers), far from 0, 0, 0 as maps are.
fn write_las(path: &Path, count: u32, format: u8) -> Points {
    write_las_at(path, count, format, [500_000.0, 4_000_000.0])
}

/// The same near the sensor.
pub(crate) fn write_las_scan(path: &Path, count: u32, format: u8) -> Points {
    write_las_at(path, count, format, [0.0; 2])
}

fn write_las_at(path: &Path, count: u32, format: u8, [east, north]: [f64; 2]) -> Points {
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(format).unwrap();
    let transform = |offset| las::Transform { scale: 0.001, offset };
    builder.transforms = las::Vector { x: transform(east), y: transform(north), z: transform(0.0) };
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    let mut points = Points::new();
    for k in 0..count {
        let place = [east + f64::from(k) * 0.25, north + 0.5, f64::from(k % 100) * 0.125];
        let [x, y, z] = place;
        let gps_time = writer.header().point_format().has_gps_time.then_some(f64::from(k));
        let color = writer.header().point_format().has_color.then(las::Color::default);
        writer.write_point(las::Point { x, y, z, gps_time, color, ..las::Point::default() }).unwrap();
        points.push(place);
    }
    writer.close().unwrap();
    points
}

fn assert_near(a: &Points, b: &Points) {
    assert_eq!(a.len(), b.len());
    assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6));
}

fn las_files(folder: &tempfile::TempDir, count: u32) -> Vec<(PathBuf, Points, CloudFormat)> {
    let cases =
        [("a.las", 1, CloudFormat::Las), ("b.laz", 1, CloudFormat::Laz), ("c.laz", 6, CloudFormat::Laz)];
    cases
        .into_iter()
        .map(|(name, format, kind)| {
            let path = folder.path().join(name);
            let points = write_las(&path, count, format);
            (path, points, kind)
        })
        .collect()
}

#[test]
fn las_and_laz_are_read_in_batches() {
    let folder = tempfile::tempdir().unwrap();
    for (path, points, format) in las_files(&folder, 140_000) {
        let (summary, read) = read(&path).unwrap();
        assert_eq!(summary.format, format);
        assert_near(&read, &points);
    }
    for (path, ..) in las_files(&folder, 0) {
        assert_eq!(read(&path).unwrap().0.points, 0);
    }
}

#[test]
fn row_03_a_cut_or_lying_las_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (path, _, format) in las_files(&folder, 3000) {
        let bytes = fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap();
        let change = |at: usize, with: &[u8]| {
            let mut changed = bytes.clone();
            changed[at..at + with.len()].copy_from_slice(with);
            fs::write(&path, changed).unwrap();
            error(&path)
        };
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert_says(
            &error(&path),
            &[name, "byte", if format == CloudFormat::Las { "3,000 points" } else { "cut?" }],
        );
        fs::write(&path, &bytes[..100]).unwrap();
        assert_says(&error(&path), &[name, "byte 96", "a file of 100 bytes"]);
        assert_says(&change(24, &[9]), &[name, "byte 24", "version 9.4"]);
        assert_says(&change(96, &u32::MAX.to_le_bytes()), &[name, "byte 96", "4294967295"]);
        assert_says(&change(131, &f64::NAN.to_le_bytes()), &[name, "byte 131", "scale of NaN"]);
        assert_says(&change(105, &3_u16.to_le_bytes()), &[name, "byte 105", "3 bytes"]);
        // The largest count that a header can claim, in the old and in the new place.
        assert_says(
            &change(107, &u32::MAX.to_le_bytes()),
            &[name, "byte", if format == CloudFormat::Las { "4,294,967,295" } else { "4294967295" }],
        );
        let mut huge = bytes.clone();
        huge[107..111].fill(0);
        huge[247..255].fill(0xff);
        fs::write(&path, huge).unwrap();
        assert_says(&error(&path), &[name, "18,446,744,073,709,551,615 points"]);
        // An extended record of 2^63 bytes.
        let mut extended = bytes.clone();
        extended[235..243].copy_from_slice(&100_u64.to_le_bytes());
        extended[243..247].copy_from_slice(&1_u32.to_le_bytes());
        extended[120..128].copy_from_slice(&(1_u64 << 63).to_le_bytes());
        fs::write(&path, extended).unwrap();
        assert_says(&error(&path), &[name, "byte 100", "extended record of 9223372036854775808 bytes"]);
    }
}

#[test]
fn row_03_a_lying_laz_chunk_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (path, ..) in las_files(&folder, 3000).split_off(1) {
        let bytes = fs::read(&path).unwrap();
        let data_at = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
        let table_at = u64::from_le_bytes(bytes[data_at..data_at + 8].try_into().unwrap()) as usize;
        let change = |at: usize, with: &[u8]| {
            let mut changed = bytes.clone();
            changed[at..at + with.len()].copy_from_slice(with);
            fs::write(&path, changed).unwrap();
            error(&path)
        };
        assert_says(&change(table_at + 4, &u32::MAX.to_le_bytes()), &["4294967295 chunks", "3000 points"]);
        assert_says(&change(data_at, &u64::MAX.to_le_bytes()), &["chunk table", "cut?"]);
        assert_says(&change(data_at, &(1_u64 << 40).to_le_bytes()), &["byte 1099511627776"]);
        let items_at =
            data_at - bytes[..data_at].windows(14).rev().position(|w| w == b"laszip encoded").unwrap() - 14
                + 52;
        assert_says(&change(items_at + 32, &0_u16.to_le_bytes()), &["0 items"]);
        assert_says(&change(items_at + 36, &999_u16.to_le_bytes()), &["999 bytes"]);
        if path.ends_with("c.laz") {
            let layer_at = data_at + 8 + 30 + 4;
            assert_says(
                &change(layer_at, &0xffff_fff0_u32.to_le_bytes()),
                &["chunk claims to reach byte", "past its end at byte"],
            );
        }
    }
}

const HEADER: &str = "comment made by hand\nelement camera 2\nproperty float f\nproperty uchar u\n\
    element vertex 3\nproperty double x\nproperty uchar red\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n";
const EXPECTED: [[f64; 3]; 3] = [[500_000.125, -2.5, 3.0], [1.0, 2.0, 3.0], [-4.0, 5.0, 0.5]];

fn ply(folder: &tempfile::TempDir, format: &str, header: &str, body: &[u8]) -> PathBuf {
    let path = folder.path().join("map.ply");
    let mut bytes = format!("ply\nformat {format} 1.0\n{header}").into_bytes();
    bytes.extend_from_slice(body);
    fs::write(&path, bytes).unwrap();
    path
}

fn binary(big_endian: bool) -> Vec<u8> {
    let order = |mut bytes: Vec<u8>| {
        if big_endian {
            bytes.reverse();
        }
        bytes
    };
    let mut bytes = vec![0xaa; 10];
    for [x, y, z] in EXPECTED {
        bytes.extend(order(x.to_le_bytes().into()));
        bytes.push(7);
        bytes.extend(order((y as f32).to_le_bytes().into()));
        bytes.extend(order((z as f32).to_le_bytes().into()));
    }
    bytes.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    bytes
}

#[test]
fn ply_is_read_in_every_encoding() {
    let folder = tempfile::tempdir().unwrap();
    let text = "1 2\n3 4\n\n500000.125 7 -2.5 3\r\n1e0 7 2 3\n-4 7 5. .5 \n3 0 1 2\n";
    for (format, body) in [
        ("ascii", text.as_bytes().to_vec()),
        ("binary_little_endian", binary(false)),
        ("binary_big_endian", binary(true)),
    ] {
        let (summary, points) = read(&ply(&folder, format, HEADER, &body)).unwrap();
        assert_eq!((summary.format, points.as_slice()), (CloudFormat::Ply, &EXPECTED[..]), "{format}");
    }
}

#[test]
fn broken_ply_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let vertex = |properties: &str| format!("element vertex 1\n{properties}\nend_header\n");
    let xyz = "property float x\nproperty float y\nproperty float z";
    let cases = [
        (
            "binary_little_endian",
            HEADER.into(),
            binary(false)[..40].to_vec(),
            &["byte", "3 vertices of 17 bytes", "40 bytes"][..],
        ),
        (
            "binary_little_endian",
            vertex(xyz).replace('1', "18446744073709551615"),
            vec![],
            &["18,446,744,073,709,551,615 vertices"],
        ),
        ("ascii", vertex(xyz), b"1 2".to_vec(), &["line 8", "`` in column 3"]),
        ("ascii", vertex(xyz), b"1 2 z".to_vec(), &["line 8", "`z` in column 3"]),
        ("ascii", vertex(xyz), vec![], &["line 8", "after 0 of 1 vertices"]),
        ("ascii", vertex("property float x\nproperty float y"), vec![], &["line 3", "lack x, y or z"]),
        ("ascii", vertex("property int x"), vec![], &["line 4", "`x` is int"]),
        ("ascii", vertex("property quad x"), vec![], &["line 4", "unknown type `quad`"]),
        ("ascii", vertex("property list uchar int v"), vec![], &["line 3", "list `v`"]),
        ("ascii", "element face 1\nend_header\n".into(), vec![], &["line 4", "no element `vertex`"]),
        ("ascii", "element vertex -1\n".into(), vec![], &["line 3", "`-1`"]),
        ("ascii", "element vertex 1\nproperty float x".into(), vec![], &["line 5", "ends in the header"]),
        ("ascii", "nonsense here\n".into(), vec![], &["line 3", "`nonsense here`"]),
        ("middle_endian", vertex(xyz), vec![], &["line 2", "`middle_endian`"]),
        ("ascii", format!("comment {}", "x".repeat(100_000)), vec![], &["line 3", "longer than 65536"]),
    ];
    for (format, header, body, parts) in cases {
        let error = error(&ply(&folder, format, &header, &body));
        assert_says(&error, &["map.ply"]);
        assert_says(&error, parts);
    }
}

#[test]
fn the_sinks_own_error_passes_through() {
    #[derive(Debug)]
    enum Full {
        Disk,
        #[expect(dead_code, reason = "only shown")]
        Log(LogError),
    }
    impl From<LogError> for Full {
        fn from(error: LogError) -> Self {
            Self::Log(error)
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    write_las(&path, 100_000, 1);
    let mut batches = 0;
    let result = read_cloud(&path, None, |_| {
        batches += 1;
        Err(Full::Disk)
    });
    assert!(matches!(result, Err(Full::Disk)));
    assert_eq!(batches, 1);
    fs::write(&path, "%PDF").unwrap();
    assert_says(&error(&path), &["a.las", "LAS, LAZ, PLY, PCD or E57", "[25, 50, 44, 46]"]);
    assert!(matches!(read_cloud(&path, None, |_| Err(Full::Disk)), Err(Full::Log(_))));
}

/// A cloud-optimised point cloud is a LAZ file with chunks of different lengths. This one is in feet on the
/// ground and in US survey feet upwards, by the text in its records.
#[test]
fn copc_is_read_as_laz_and_its_units_are_brought_to_metres() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/autzen.copc.laz");
    let (summary, points) = read(&path).unwrap();
    assert_eq!((summary.format, summary.points), (CloudFormat::Laz, 107));
    assert_says(&summary.unit_note.unwrap(), &["in feet, heights in US survey feet", "well-known text"]);
    let mut as_kept = Points::new();
    let metres = Some(LengthUnit::Metre);
    let summary = read_cloud(&path, metres, |batch| {
        as_kept.extend_from_slice(batch);
        Ok::<(), LogError>(())
    });
    assert_eq!(summary.unwrap().unit_note, None);
    // The bounds that the file claims.
    let of = |axis: usize, pick: fn(f64, f64) -> f64| as_kept.iter().map(|p| p[axis]).reduce(pick).unwrap();
    assert!((of(0, f64::max) - 638_864.3).abs() < 1e-6 && (of(2, f64::min) - 408.14).abs() < 1e-6);
    let scaled = as_kept.iter().map(|p| [p[0] * 0.3048, p[1] * 0.3048, p[2] * 1200.0 / 3937.0]).collect();
    assert_near(&points, &scaled);
}

#[test]
fn row_03_bounds_that_lie_change_no_point() {
    let folder = tempfile::tempdir().unwrap();
    for (path, points, _) in las_files(&folder, 3000) {
        let mut bytes = fs::read(&path).unwrap();
        for (k, lie) in [f64::NAN, f64::INFINITY, -1e300, 0.0, 1.0, -1.0].into_iter().enumerate() {
            bytes[179 + 8 * k..187 + 8 * k].copy_from_slice(&lie.to_le_bytes());
        }
        fs::write(&path, bytes).unwrap();
        assert_near(&read(&path).unwrap().1, &points);
    }
}

/// However much lies between the points and the record behind them.
#[test]
fn a_gap_behind_the_points_is_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.las");
    let points = write_las(&path, 10, 1);
    let mut bytes = fs::read(&path).unwrap();
    let far = 300_u64 << 20;
    bytes[235..243].copy_from_slice(&far.to_le_bytes());
    bytes[243..247].copy_from_slice(&1_u32.to_le_bytes());
    fs::write(&path, bytes).unwrap();
    fs::File::options().write(true).open(&path).unwrap().set_len(far + 60).unwrap();
    assert_near(&read(&path).unwrap().1, &points);
}
