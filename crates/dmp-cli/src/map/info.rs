use std::io::Write;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;
use dmp_map::Store;
use serde::Serialize;

use crate::{Exit, text};

/// Tell what a map holds: extent, tiles, surfels, bytes, segments, what it was made of
///
/// Looks at the directory alone, whatever the size of the map; `dmp map verify` reads all of it.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  dmp map info maps/truth.dmpmap")]
pub(crate) struct MapInfoArgs {
    /// The map
    #[arg(value_name = "MAP")]
    map: PathBuf,
    /// Print one JSON object (schema dmp-map-info/1)
    #[arg(long, help_heading = "Output")]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Info<'a> {
    schema: &'static str,
    path: String,
    bytes: u64,
    provenance: &'a str,
    voxel_m: f64,
    disc_radius_m: f64,
    tile_edge_m: f64,
    tiles: usize,
    surfels: u64,
    /// Discs over a border, kept in the tile next door too.
    border_copies: u64,
    bytes_per_surfel: Option<f64>,
    largest_tile_surfels: u64,
    /// Smallest and largest x, y and z that a disc may reach, world metres; by whole tiles in x and y.
    extent_m: Option<[[f64; 3]; 2]>,
    /// The first and the last segment that any three observations of a surfel are known of.
    segments: Option<[i32; 2]>,
}

pub(super) fn run(arguments: &MapInfoArgs, out: &mut impl Write) -> anyhow::Result<Exit> {
    let map = Store::open(&arguments.map)?;
    let bytes = std::fs::metadata(&arguments.map)
        .with_context(|| format!("{}: cannot look at the file", arguments.map.display()))?
        .len();
    let info = Info::new(&map, bytes);
    if arguments.json {
        serde_json::to_writer_pretty(&mut *out, &info).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        info.print(out)?;
    }
    Ok(Exit::Done)
}

impl<'a> Info<'a> {
    fn new(map: &'a Store, bytes: u64) -> Self {
        let (surfels, lattice) = (map.surfels(), map.lattice());
        let extents = || map.entries().map(|entry| entry.extent);
        let low_z = extents().map(|extent| extent.z_range_m[0]).fold(f64::INFINITY, f64::min);
        let high_z = extents().map(|extent| extent.z_range_m[1]).fold(f64::NEG_INFINITY, f64::max);
        let extent_m = map.bounds().map(|[low, high]| {
            let (low, high) = (lattice.tile_corner_m(low), lattice.tile_corner_m(high));
            let edge_m = lattice.tile_edge_m();
            [[low[0], low[1], low_z], [high[0] + edge_m, high[1] + edge_m, high_z]]
        });
        let first = extents().map(|extent| extent.min_third_lowest).min().unwrap_or(i32::MAX);
        let last = extents().map(|extent| extent.max_third_highest).max().unwrap_or(i32::MIN);
        Self {
            schema: "dmp-map-info/1",
            path: map.path().display().to_string(),
            bytes,
            provenance: map.provenance(),
            voxel_m: lattice.voxel_m(),
            disc_radius_m: lattice.disc_radius_m(),
            tile_edge_m: lattice.tile_edge_m(),
            tiles: map.entries().count(),
            surfels,
            border_copies: map.entries().map(|entry| u64::from(entry.borders.surfels)).sum(),
            bytes_per_surfel: (surfels > 0).then(|| bytes as f64 / surfels as f64),
            largest_tile_surfels: map.entries().map(dmp_map::TileEntry::surfels).max().unwrap_or(0),
            extent_m,
            segments: (first <= last).then_some([first, last]),
        }
    }

    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        writeln!(out, "{}", self.path)?;
        let per_surfel =
            self.bytes_per_surfel.map_or(String::new(), |bytes| format!(", {bytes:.2} B a surfel"));
        writeln!(out, "size       {}{per_surfel}", text::bytes(self.bytes))?;
        writeln!(
            out,
            "surfels    {}, discs of {:.3} m radius, voxels of {:.3} m",
            text::count(self.surfels),
            self.disc_radius_m,
            self.voxel_m
        )?;
        writeln!(
            out,
            "tiles      {} of {:.2} m, the largest with {}; {} over borders",
            text::count(self.tiles as u64),
            self.tile_edge_m,
            text::counted(self.largest_tile_surfels, "surfel"),
            text::counted(self.border_copies, "copy").replace("copys", "copies")
        )?;
        if let Some([low, high]) = self.extent_m {
            let axis = |k: usize| format!("{:.1} to {:.1}", low[k], high[k]);
            writeln!(out, "extent     x {}, y {}, z {} m", axis(0), axis(1), axis(2))?;
        }
        match self.segments {
            Some([first, last]) => writeln!(out, "segments   {first} to {last}")?,
            None => writeln!(out, "segments   none known: returns cannot be told from those it was made of")?,
        }
        writeln!(out, "made       {}", self.provenance)
    }
}
