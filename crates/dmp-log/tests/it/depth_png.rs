//! Depth images that other programs wrote, and images that are damaged or none.

use crate::common::{assert_says, open_error, read_all};
use dmp_log::{LogOptions, encode_depth_png, open_log, outline_log};
use dmp_sensor::Scan;
use std::fs;
use std::path::{Path, PathBuf};

/// The same without a lens.
const CAMERA: &str =
    r#"{"width":12,"height":9,"intrinsic_matrix":[10,0,0,0,10,0,5.5,4,1],"depth_scale":1000}"#;
/// A `camera.json` for the small images.
pub(crate) const CAMERA_FILE: &str = r#"{"width":12,"height":9,"intrinsic_matrix":[10,0,0,0,10,0,5.5,4,1],"distortion":[0.1,0,0,0,0],"depth_scale":1000}"#;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/depth")
}

/// The small images there.
pub(crate) fn files() -> Vec<Vec<u8>> {
    let theirs: [&[u8]; 6] = [
        include_bytes!("../fixtures/depth/magick.png"),
        include_bytes!("../fixtures/depth/magick_interlaced.png"),
        include_bytes!("../fixtures/depth/opencv_avg.png"),
        include_bytes!("../fixtures/depth/opencv_none.png"),
        include_bytes!("../fixtures/depth/opencv_paeth.png"),
        include_bytes!("../fixtures/depth/opencv_up.png"),
    ];
    std::iter::once(image()).chain(theirs.map(<[u8]>::to_vec)).collect()
}

/// Puts the camera beside images: their values are millimetres.
fn options(folder: &Path) -> LogOptions {
    fs::write(folder.join("camera.json"), CAMERA).unwrap();
    LogOptions::default()
}

fn depths_mm(image: &[u8]) -> Vec<u16> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("00000.png"), image).unwrap();
    let [width, height] = [16, 20].map(|at| u32::from_be_bytes(image[at..at + 4].try_into().unwrap()));
    let size = format!("\"width\":{width},\"height\":{height}");
    fs::write(folder.path().join("camera.json"), CAMERA.replace("\"width\":12,\"height\":9", &size)).unwrap();
    let log = open_log(folder.path(), &LogOptions::default()).unwrap();
    assert!(log.summary().damage.is_empty(), "{:?}", log.summary().damage);
    let scan = read_all(&*log).remove(0);
    scan.points_in_sensor_m.iter().map(|point| (f64::from(point[2]) * 1000.0).round() as u16).collect()
}

/// `values.txt` was written by the programs that read the images there.
#[test]
fn images_of_other_programs_are_read_to_the_last_pixel() {
    let text = fs::read_to_string(fixtures().join("values.txt")).unwrap();
    let (mut images, mut compared, mut large) = (0, 0, 0);
    let mut image: (usize, Vec<u16>) = (0, Vec::new());
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split(' ').collect();
        match words.as_slice() {
            ["image", name, width, height, sum] => {
                let width: usize = width.parse().unwrap();
                let values = depths_mm(&fs::read(fixtures().join(name)).unwrap());
                assert_eq!(values.len(), width * height.parse::<usize>().unwrap(), "{name}");
                assert_eq!(
                    values.iter().map(|value| u64::from(*value)).sum::<u64>().to_string(),
                    *sum,
                    "{name}"
                );
                (images, image) = (images + 1, (width, values));
            }
            [row, column, value] => {
                let pixel = row.parse::<usize>().unwrap() * image.0 + column.parse::<usize>().unwrap();
                assert_eq!(image.1[pixel].to_string(), *value, "{line}");
                (compared, large) = (compared + 1, large + usize::from(image.1[pixel] > 255));
            }
            _ => panic!("{line}"),
        }
    }
    assert!(images >= 10 && compared > 900 && large > 800, "{images} {compared} {large}");
    // The images hold rows of every filter, and one is interlaced.
    assert!(fs::read(fixtures().join("magick_interlaced.png")).unwrap()[28] == 1);
}

pub(crate) fn image() -> Vec<u8> {
    encode_depth_png([12, 9], &(0..12 * 9).map(|k| k * 601).collect::<Vec<u16>>()).unwrap()
}

/// An image by the crate `png` itself, of any kind.
fn other_image(color: png::ColorType, depth: png::BitDepth, size_px: [u32; 2]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size_px[0], size_px[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![0; 9]);
    }
    let row = color.samples() * size_px[0] as usize * if depth == png::BitDepth::Sixteen { 2 } else { 1 };
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![0; row * size_px[1] as usize]).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn what_is_no_depth_image_is_skipped_with_its_name_and_the_rest_is_read() {
    use png::{BitDepth::*, ColorType::*};
    let whole = image();
    let mut bad_crc = whole.clone();
    bad_crc[19] ^= 4;
    let mut huge = whole.clone();
    huge[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let crc = crc32fast::hash(&huge[12..29]).to_be_bytes();
    huge[29..33].copy_from_slice(&crc);
    let mut large = huge.clone();
    large[16..24].copy_from_slice(&[0, 0, 0x04, 0, 0, 0, 0x04, 0]);
    let crc = crc32fast::hash(&large[12..29]).to_be_bytes();
    large[29..33].copy_from_slice(&crc);
    let cases: [(&str, Vec<u8>, &str); 10] = [
        ("eight", other_image(Grayscale, Eight, [12, 9]), "8 bits of gray, expected 16 of gray"),
        ("colour", other_image(Rgb, Sixteen, [12, 9]), "16 bits of red, green and blue"),
        ("palette", other_image(Indexed, Eight, [12, 9]), "8 bits of a palette"),
        ("size", other_image(Grayscale, Sixteen, [9, 12]), "9 x 12 pixels, not 12 x 9"),
        ("crc", bad_crc, "the CRC"),
        ("huge", huge, "16384 x 16384 pixels, expected 1 to 16,777,216"),
        ("large", large, "1024 x 1024 pixels cannot be in"),
        ("cut", whole[..20].to_vec(), "the file ends at byte 20, within its head"),
        ("empty", Vec::new(), "no PNG"),
        (
            "text",
            b"hello, this is a text and no image at all".to_vec(),
            "no PNG: the file starts with [68, 65",
        ),
    ];
    for (name, bytes, said) in &cases {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::write(root.join("00000.png"), &whole).unwrap();
        fs::write(root.join("00001.png"), bytes).unwrap();
        fs::write(root.join("00002.png"), &whole).unwrap();
        let log = open_log(root, &options(root)).unwrap();
        let [damage] = log.summary().damage.as_slice() else { panic!("{name}: {:?}", log.summary().damage) };
        assert_says(&damage.place, &["00001.png"]);
        assert_says(&damage.what, &[said, "; the image is skipped"]);
        assert_eq!(read_all(&*log).len(), 2, "{name}");
        assert_eq!(log.summary().bytes, (2 * whole.len() + bytes.len()) as u64);
        if *name != "size" {
            fs::remove_file(root.join("00000.png")).unwrap();
            fs::remove_file(root.join("00002.png")).unwrap();
            let error = open_log(root, &options(root)).unwrap_err();
            assert!(!error.is_usage());
            assert_says(&error.to_string(), &["no depth image can be read; ", "00001.png: ", said]);
        }
    }
}

#[test]
fn an_image_of_the_list_that_is_not_there_is_skipped() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    fs::create_dir_all(root.join("depth/2.5.png")).unwrap();
    fs::write(root.join("depth/0.5.png"), image()).unwrap();
    fs::write(root.join("depth.txt"), "0.5 depth/0.5.png\n1.5 depth/1.5.png\n2.5 depth/2.5.png\n").unwrap();
    let log = open_log(root, &options(root)).unwrap();
    assert_eq!(log.frames().len(), 1);
    let damage = &log.summary().damage;
    assert_eq!(damage.len(), 2);
    assert_says(&damage[0].place, &["1.5.png"]);
    assert_says(&damage[1].what, &["no such file; the image is skipped"]);
    fs::write(root.join("depth.txt"), "0.5 depth/0.5.png\n1.5\n").unwrap();
    assert_says(&open_error(root, &options(root)), &["depth.txt: line 2: 1 columns", "cut?"]);
}

/// As a compressed scan of another folder: its name, and the end of the run.
#[test]
fn a_damaged_body_is_an_error_when_it_is_read() {
    let whole = image();
    let data_at = whole.windows(4).position(|part| part == b"IDAT").unwrap() + 4;
    let mut flipped = whole.clone();
    flipped[data_at + 9] ^= 0x55;
    let mut other_crc = whole.clone();
    let crc_at = whole.len() - 13;
    other_crc[crc_at] ^= 1;
    for bytes in
        [&whole[..data_at + 20], &whole[..whole.len() - 12], &whole[..whole.len() - 3], &flipped, &other_crc]
    {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("00000.png"), bytes).unwrap();
        let log = open_log(folder.path(), &options(folder.path())).unwrap();
        let error = log.reader().unwrap().read(0, &mut Scan::default()).unwrap_err();
        assert!(!error.is_usage());
        assert_says(&error.to_string(), &["00000.png: byte "]);
    }
    // And one that is replaced meanwhile.
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("00000.png"), &whole).unwrap();
    let log = open_log(folder.path(), &options(folder.path())).unwrap();
    fs::write(folder.path().join("00000.png"), &whole[..60]).unwrap();
    let error = log.reader().unwrap().read(0, &mut Scan::default()).unwrap_err().to_string();
    assert_says(&error, &["changed since it was opened", "60 now"]);
    assert_says(
        &log.reader().unwrap().read(1, &mut Scan::default()).unwrap_err().to_string(),
        &["frame 1", "has 1 scans"],
    );
}

#[test]
fn parts_are_the_same_images_and_bytes_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let images = 20_u16;
    for k in 0..images {
        let values: Vec<u16> = (0..12 * 9).map(|pixel| pixel * 7 + k).collect();
        fs::write(folder.path().join(format!("{k:05}.png")), encode_depth_png([12, 9], &values).unwrap())
            .unwrap();
    }
    let whole = open_log(folder.path(), &options(folder.path())).unwrap();
    let (heads, scans) = (whole.bytes_read().unwrap(), read_all(&*whole));
    assert_eq!(heads, u64::from(images) * 33);
    assert_eq!(whole.bytes_read().unwrap(), heads + whole.summary().bytes);
    let ends: Vec<usize> = whole.groups().iter().map(|group| group.end).collect();
    assert_eq!(ends, [8, 16, 20]);
    let outline = outline_log(folder.path(), &options(folder.path())).unwrap();
    assert_eq!(outline.scans().iter().map(|scan| scan.bytes).sum::<u64>(), whole.summary().bytes);
    let part = outline.open(&[3, 7, 19]).unwrap();
    assert_eq!(part.summary().camera, whole.summary().camera);
    let read = read_all(&*part);
    assert_eq!(read, [3, 7, 19].map(|k| scans[k].clone()));
    assert_eq!(read_all(&outline.load(&[3, 7, 19]).unwrap()), read);
    assert_eq!(part.scans_in_log(), 20);
}

#[test]
fn a_folder_of_photographs_is_said_to_be_none() {
    let folder = tempfile::tempdir().unwrap();
    let photograph = other_image(png::ColorType::Rgb, png::BitDepth::Eight, [640, 480]);
    fs::write(folder.path().join("a.png"), photograph).unwrap();
    let error = open_error(folder.path(), &LogOptions::default());
    assert_says(
        &error,
        &["no depth image can be read", "a.png: 8 bits of red, green and blue, expected 16 of gray"],
    );
    fs::write(folder.path().join("a.txt"), "").unwrap();
    fs::remove_file(folder.path().join("a.png")).unwrap();
    assert_says(
        &open_error(folder.path(), &LogOptions::default()),
        &["not a format known here", "depth/*.png"],
    );
}
