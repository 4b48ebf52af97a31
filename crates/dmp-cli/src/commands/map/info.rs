//! `dmp map info`: what a map holds.

use std::io::Write;

use anyhow::Context as _;
use dmp_draw::text;
use dmp_log::shown_path;
use dmp_map::Store;
use serde::Serialize;

use crate::console::{Common, Exit, say, tell};
use crate::options::{Asked, Out, Spec, output, tools};

pub(super) static SPEC: Spec = Spec {
    name: "info",
    about: "Print what a map holds: extent, tiles, surfels, bytes, segments, provenance",
    more: "Reads only the directory, whatever the size of the map; `dmp map verify` reads all of it.",
    after: "Example:\n  dmp map info maps/truth.dmpmap",
    options: &[&[&tools::MAP, &output::JSON]],
    run,
    ..Spec::EMPTY
};

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
    /// Smallest and largest x, y and z that a disc may reach in the frame of the run's trajectory, metres; by whole tiles.
    extent_m: Option<[[f64; 3]; 2]>,
    /// Takes places of the run's trajectory into the frame of the map's tiles: x, y, z (metres), qx, qy, qz, qw.
    world_from_own: [f64; 7],
    /// The first and the last segment that any three observations of a surfel are known of.
    segments: Option<[i32; 2]>,
}

fn run(asked: &Asked, _: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    let path = asked.need(&tools::MAP)?;
    let map = Store::open(&path)?;
    let found = std::fs::metadata(&path);
    let bytes = found.with_context(|| format!("{}: cannot look at the file", path.display()))?.len();
    let info = Info::new(&map, bytes);
    if asked.has(&output::JSON) {
        say::json(out, &info)?;
    } else {
        info.print(out)?;
    }
    Ok(Exit::Done)
}

impl<'a> Info<'a> {
    fn new(map: &'a Store, bytes: u64) -> Self {
        let (surfels, lattice) = (map.surfels(), map.lattice());
        let extents = || map.entries().map(|entry| entry.extent);
        let join = |[low, high]: [[f64; 3]; 2], [other_low, other_high]: [[f64; 3]; 2]| {
            [0, 1].map(|end| {
                std::array::from_fn(|k| match end {
                    0 => f64::min(low[k], other_low[k]),
                    _ => f64::max(high[k], other_high[k]),
                })
            })
        };
        let extent_m = map.entries().map(|entry| map.box_in_own_m(entry)).reduce(join);
        let first = extents().map(|extent| extent.min_third_lowest).min().unwrap_or(i32::MAX);
        let last = extents().map(|extent| extent.max_third_highest).max().unwrap_or(i32::MIN);
        Self {
            schema: "dmp-map-info/2",
            path: shown_path(map.path()),
            bytes,
            provenance: &map.origin().text,
            voxel_m: lattice.voxel_m(),
            disc_radius_m: lattice.disc_radius_m(),
            tile_edge_m: lattice.tile_edge_m(),
            tiles: map.entries().count(),
            surfels,
            border_copies: map.entries().map(|entry| u64::from(entry.borders.surfels)).sum(),
            bytes_per_surfel: (surfels > 0).then(|| bytes as f64 / surfels as f64),
            largest_tile_surfels: map.entries().map(dmp_map::TileEntry::surfels).max().unwrap_or(0),
            extent_m,
            world_from_own: {
                let motion = map.own_from_world().inverse();
                let (t, q) = (motion.translation.vector, motion.rotation.coords);
                [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
            },
            segments: (first <= last).then_some([first, last]),
        }
    }

    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        tell!(out, "{}", self.path)?;
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
            writeln!(out, "extent     x {}, y {}, z {} m, as wide as the tiles", axis(0), axis(1), axis(2))?;
        }
        match self.segments {
            Some([first, last]) => writeln!(out, "segments   {first} to {last}")?,
            None => writeln!(out, "segments   none known: its own returns cannot be identified")?,
        }
        tell!(out, "made       {}", self.provenance)
    }
}
