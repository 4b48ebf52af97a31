//! Writing depth images as TUM RGB-D has them.

use super::folder::{commit, create_folder, new_output, write_file};
use crate::LogError;
use crate::file::ns_to_seconds;
use crate::logs::is_scale;
use dmp_disk::OutputFolder;
use dmp_sensor::PinholeCamera;
use png::{BitDepth, ColorType, Compression, Encoder};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

/// Writes depth images in the layout of TUM RGB-D: `depth/SECONDS.png` with 16 bits of gray, `depth.txt`, and
/// `camera.json` with the camera (as `Open3D` has it, with `distortion` and `depth_scale`). The same images give the
/// same bytes. The folder gets its name in [`DepthFolderWriter::finish`]; without it nothing is left behind.
///
/// ```
/// use dmp_log::{DepthFolderWriter, LogOptions, open_log};
/// use dmp_sensor::{Distortion, PinholeCamera, Scan};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("room");
/// let camera = PinholeCamera::new([4, 3], [5.0, 5.0], [1.5, 1.0], Distortion::NONE)?;
/// let mut writer = DepthFolderWriter::create(&path, &camera, 5000.0)?;
/// writer.write_image(1_000_000_000, &[10_000; 12])?;
/// writer.finish()?;
///
/// let log = open_log(&path, &LogOptions::default())?;
/// assert_eq!(log.summary().camera, Some(camera));
/// let mut scan = Scan::default();
/// log.reader()?.read(0, &mut scan)?;
/// assert_eq!(scan.points_in_sensor_m[0], [-0.6, -0.4, 2.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct DepthFolderWriter {
    output: OutputFolder,
    size_px: [u32; 2],
    stamps_ns: BTreeSet<i64>,
    list: String,
}

impl DepthFolderWriter {
    /// Starts a log that will be the folder `path`, where there must be nothing yet, of images by `camera` whose
    /// values are in `units_per_m` units a metre.
    ///
    /// # Errors
    /// When there is something, when the units make no sense, and when the folder cannot be created.
    pub fn create(path: &Path, camera: &PinholeCamera, units_per_m: f64) -> Result<Self, LogError> {
        if !is_scale(units_per_m) {
            let problem = format!("{units_per_m} units of depth a metre: it must be more than 0");
            return Err(LogError::Option { path: path.into(), problem });
        }
        let output = new_output(path)?;
        create_folder(&output.path().join("depth"))?;
        let camera_file = camera_json(camera, units_per_m);
        write_file(&output.path().join("camera.json"), camera_file.as_bytes())?;
        let list = "# depth maps\n# file: 'camera.json' has the camera\n# timestamp filename\n".to_owned();
        Ok(Self { output, size_px: camera.size_px(), stamps_ns: BTreeSet::new(), list })
    }

    /// Appends an image: a value for each pixel, row by row, 0 where nothing was seen.
    ///
    /// # Errors
    /// When there are more or fewer values than pixels, when an image with this stamp was written before, and when
    /// the disk is full.
    pub fn write_image(&mut self, stamp_ns: i64, depths: &[u16]) -> Result<(), LogError> {
        let image = encode(self.size_px, depths).map_err(|problem| self.unwritable(problem))?;
        self.write_encoded(stamp_ns, &image)
    }

    /// Appends an image that [`encode_depth_png`] made, for the camera's size.
    ///
    /// # Errors
    /// When an image with this stamp was written before, and when the disk is full.
    pub fn write_encoded(&mut self, stamp_ns: i64, png: &[u8]) -> Result<(), LogError> {
        if !self.stamps_ns.insert(stamp_ns) {
            return Err(self.unwritable(format!("the stamp {} s was there before", ns_to_seconds(stamp_ns))));
        }
        let seconds = ns_to_seconds(stamp_ns);
        let seconds = seconds.strip_suffix("000").unwrap_or(&seconds);
        write_file(&self.output.path().join("depth").join(format!("{seconds}.png")), png)?;
        // Writing to a string cannot fail.
        let _ = writeln!(self.list, "{seconds} depth/{seconds}.png");
        Ok(())
    }

    /// Where the folder is made until it has its name: what is to be in it besides goes here.
    pub fn folder(&self) -> &Path {
        self.output.path()
    }

    /// Writes the list of images and gives the folder its name.
    ///
    /// # Errors
    /// When the disk is full or the folder cannot be renamed.
    pub fn finish(self) -> Result<(), LogError> {
        write_file(&self.output.path().join("depth.txt"), self.list.as_bytes())?;
        commit(self.output)
    }

    fn unwritable(&self, problem: String) -> LogError {
        let frame = self.stamps_ns.len() as u64;
        LogError::Unwritable { path: self.output.target().into(), frame, problem }
    }
}

/// A depth image as PNG with 16 bits of gray: a value for each pixel of `size_px` (width, height), row by row. So that
/// images can be packed by several threads: that takes longer than to write them.
///
/// # Errors
/// When there are more or fewer values than pixels, or no pixels.
pub fn encode_depth_png(size_px: [u32; 2], depths: &[u16]) -> Result<Vec<u8>, LogError> {
    encode(size_px, depths).map_err(|problem| LogError::Unwritable { path: "PNG".into(), frame: 0, problem })
}

fn encode([width, height]: [u32; 2], depths: &[u16]) -> Result<Vec<u8>, String> {
    if u64::from(width) * u64::from(height) != depths.len() as u64 {
        return Err(format!("{} values for {width} x {height} pixels", depths.len()));
    }
    let values: Vec<u8> = depths.iter().flat_map(|depth| depth.to_be_bytes()).collect();
    let mut image = Vec::new();
    let mut encoder = Encoder::new(&mut image, width, height);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Sixteen);
    encoder.set_compression(Compression::Fast);
    let write = |encoder: Encoder<'_, &mut Vec<u8>>| {
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&values)?;
        writer.finish()
    };
    write(encoder).map_err(|e| e.to_string())?;
    Ok(image)
}

/// The camera as `Open3D` writes it, column by column.
fn camera_json(camera: &PinholeCamera, units_per_m: f64) -> String {
    let ([width, height], [fx, fy], [cx, cy]) = (camera.size_px(), camera.focal_px(), camera.centre_px());
    let lens = camera.distortion();
    let ([k1, k2, k3], [p1, p2]) = (lens.radial, lens.tangential);
    format!(
        "{{\n  \"width\": {width},\n  \"height\": {height},\n  \"intrinsic_matrix\": [{fx}, 0, 0, 0, {fy}, 0, {cx}, {cy}, 1],\n  \
         \"distortion\": [{k1}, {k2}, {p1}, {p2}, {k3}],\n  \"depth_scale\": {units_per_m}\n}}\n"
    )
}
