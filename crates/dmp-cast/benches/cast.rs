//! The caster's parts in a made-up street, through its public functions: `cargo bench -p dmp-cast`.
//!
//! For changes to the caster, whose parts these are; how fast it is on real work says `cargo xtask bench cast`.

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use dmp_cast::{CastBuffers, CastSettings, Caster, Grouping, Path, Query, Wanted};
use dmp_map::{LooseSurfels, TileSource as _, WorldSurfel};

/// Length of the street to each side, metres.
const HALF_LENGTH_M: f64 = 60.0;
/// Half its width, metres.
const HALF_WIDTH_M: f64 = 8.0;
/// Height of its walls, metres.
const WALL_M: f64 = 8.0;
const VOXEL_M: f64 = 0.2;
/// Inside a tile, not quite in the middle of the street.
const SENSOR_IN_WORLD_M: [f64; 3] = [5.0, 1.0, 1.8];
/// Segments of the drive along it; every surfel was seen from three of them.
const SEGMENTS: i32 = 12;

/// A floor between two walls, a disc in each voxel, none quite in its plane.
fn street() -> Vec<WorldSurfel> {
    let steps = |metres: f64| (metres / VOXEL_M) as i32;
    let mut surfels = Vec::new();
    for i in -steps(HALF_LENGTH_M)..steps(HALF_LENGTH_M) {
        let x = (f64::from(i) + 0.5) * VOXEL_M;
        let mut add = |y: f64, z: f64, normal: [f32; 3]| {
            // The same every time, and like noise.
            let hash = ((surfels.len() as u32).wrapping_mul(2_654_435_761) >> 16 & 0xff) as f32 / 255.0 - 0.5;
            let off_m = f64::from(0.04 * hash);
            let tilted: [f32; 3] =
                std::array::from_fn(|k| if normal[k] == 0.0 { 0.1 * hash } else { normal[k] });
            let length = tilted.iter().map(|n| n * n).sum::<f32>().sqrt();
            let at = (f64::from(SEGMENTS) * (x + HALF_LENGTH_M) / (2.0 * HALF_LENGTH_M)) as i32;
            surfels.push(WorldSurfel {
                centre_in_world_m: [x, y + off_m * f64::from(normal[1]), z + off_m * f64::from(normal[2])],
                normal: tilted.map(|n| n / length),
                third_lowest: at - 1,
                third_highest: at + 1,
            });
        };
        for j in -steps(HALF_WIDTH_M)..steps(HALF_WIDTH_M) {
            add((f64::from(j) + 0.5) * VOXEL_M, 0.0, [0.0, 0.0, 1.0]);
        }
        for j in 0..steps(WALL_M) {
            let z = (f64::from(j) + 0.5) * VOXEL_M;
            add(-HALF_WIDTH_M, z, [0.0, 1.0, 0.0]);
            add(HALF_WIDTH_M, z, [0.0, -1.0, 0.0]);
        }
    }
    surfels
}

fn map() -> LooseSurfels {
    LooseSurfels::new(32.0, 0.8 * VOXEL_M, street()).unwrap_or_else(|error| panic!("{error}"))
}

/// A quarter of a turn of a sensor with 64 beams and 2048 columns, from along the street to across it, column by
/// column as they fire.
fn scan() -> Vec<Query> {
    let [_, y, z] = SENSOR_IN_WORLD_M;
    let mut queries = Vec::new();
    for column in 0..512 {
        let (sin, cos) = (f64::from(column) * std::f64::consts::TAU / 2048.0).sin_cos();
        for beam in 0..64 {
            let (up, level) = (-25.0 + 40.0 * f64::from(beam) / 63.0).to_radians().sin_cos();
            let direction_in_world = [level * cos, level * sin, up];
            let to_wall_m = (HALF_WIDTH_M - y) / (level * sin);
            let to_floor_m = if up < 0.0 { z / -up } else { f64::INFINITY };
            queries.push(Query {
                origin_in_world_m: SENSOR_IN_WORLD_M,
                direction_in_world,
                measured_m: to_wall_m.min(to_floor_m).min(100.0),
                segment: Some(SEGMENTS / 2),
            });
        }
    }
    queries
}

fn first() -> CastSettings {
    CastSettings { wanted: Wanted::First, ..CastSettings::default() }
}

/// Trees of all tiles. Nothing is kept, so every ray straight down builds the tree of its tile.
fn build(criterion: &mut Criterion) {
    let map = map();
    let edge_m = map.tile_edge_m();
    let down = |x: i32, y: i32| Query {
        origin_in_world_m: [(f64::from(x) + 0.5) * edge_m, (f64::from(y) + 0.5) * edge_m, WALL_M + 1.0],
        direction_in_world: [0.0, 0.0, -1.0],
        measured_m: WALL_M,
        segment: None,
    };
    let rays: Vec<Query> = map.tiles().map(|tile| down(tile.id.x, tile.id.y)).collect();
    let surfels = map.tiles().map(|tile| tile.own as u64).sum();
    let caster = Caster::new(map, first(), 0).with(Path::best(), Grouping::Single);
    let (mut answers, mut buffers) = (Vec::new(), CastBuffers::default());
    let mut group = criterion.benchmark_group("build");
    group.throughput(Throughput::Elements(surfels));
    group.bench_function("tiles", |bencher| {
        bencher.iter(|| caster.cast(black_box(&rays), &mut answers, &mut buffers));
    });
    group.finish();
}

fn cast(criterion: &mut Criterion) {
    let rays = scan();
    let mut group = criterion.benchmark_group("cast");
    group.throughput(Throughput::Elements(rays.len() as u64));
    let mut measure = |name: &str, settings: CastSettings, path: Path, grouping: Grouping| {
        let caster = Caster::new(map(), settings, usize::MAX).with(path, grouping);
        let (mut answers, mut buffers) = (Vec::new(), CastBuffers::default());
        group.bench_function(name, |bencher| {
            bencher.iter(|| caster.cast(black_box(&rays), &mut answers, &mut buffers));
        });
    };
    let bounded = CastSettings { beyond_m: 5.0, ..first() };
    for path in Path::all() {
        measure(&format!("first, single, {}", path.name()), first(), path, Grouping::Single);
        measure(&format!("first, packets, {}", path.name()), first(), path, Grouping::Auto);
    }
    let three = CastSettings { wanted: Wanted::Three, ..first() };
    measure("first, packets, bounded", bounded, Path::best(), Grouping::Auto);
    measure("three, single", three, Path::best(), Grouping::Single);
    measure("three, packets", three, Path::best(), Grouping::Auto);
    measure("three, packets, bounded", CastSettings { beyond_m: 5.0, ..three }, Path::best(), Grouping::Auto);
    // Nothing is within reach: what is left is the bringing of rays into order and into their first tile.
    let reaches_nothing = CastSettings { horizon_m: 0.5 * SENSOR_IN_WORLD_M[2], ..first() };
    measure("nothing met, single", reaches_nothing, Path::best(), Grouping::Single);
    measure("nothing met, packets", reaches_nothing, Path::best(), Grouping::Auto);
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    build(&mut criterion);
    cast(&mut criterion);
    criterion.final_summary();
}
