//! Compares patches with maps fused from the same points.

use super::block::{block_edge_m, covariance_step_units2};
use super::*;
use crate::grid::{Lattice, UNITS_PER_M};
use crate::{Durability, FuseBuffers, MapFuser, Origin, Store, Surfel, TileId, TileSource};
use proptest::prelude::*;

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn turned(yaw: f64, tilt: f64) -> [[f64; 3]; 3] {
    let rotation = nalgebra::Rotation3::from_euler_angles(tilt, 0.0, yaw);
    std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)]))
}

/// The point of a patch at a position in the world.
fn in_patch(placement: &Placement, world: [f64; 3]) -> [f64; 3] {
    let from_origin: [f64; 3] = std::array::from_fn(|k| world[k] - placement.origin_in_world_m[k]);
    std::array::from_fn(|k| (0..3).map(|j| placement.rotation[j][k] * from_origin[j]).sum())
}

fn patches(lattice: Lattice, clouds: &[Vec<[f64; 3]>]) -> Patches {
    let folder = tempfile::tempdir().unwrap();
    let writer = PatchWriter::new(lattice, clouds.len(), folder.path()).unwrap();
    for (number, cloud) in clouds.iter().enumerate().rev() {
        let mut patch = PatchBuilder::new(lattice);
        for part in cloud.chunks(700) {
            patch.add(part).unwrap();
        }
        assert_eq!(patch.points(), cloud.len() as u64);
        writer.put(number, patch).unwrap();
    }
    writer.finish().unwrap()
}

/// The fuser's map of the same points.
fn fused(lattice: Lattice, points: &[[f64; 3]]) -> Store {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(lattice, 64 << 20, folder.path()).unwrap();
    fuser.add(points, None, &mut FuseBuffers::default()).unwrap();
    let path = folder.path().join("m.dmpmap");
    fuser.finish(&path, &Origin::of(""), Durability::Temporary, &|_, _| ()).unwrap();
    Store::open_once(&path).unwrap()
}

/// Floor and walls over the corner of four tiles.
fn room() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for i in 0..200 {
        for j in 0..200 {
            let (a, b) = (f64::from(i) * 0.05 - 5.0, f64::from(j) * 0.05 - 5.0);
            points.extend([[a, b, 1.0 + 0.02 * a], [a, 4.9 - 0.01 * b, b + 6.0]]);
        }
    }
    points
}

#[test]
fn a_patch_where_it_was_made_is_the_map_of_its_points() {
    for voxel_m in [0.2, 0.5] {
        let lattice = Lattice::new(voxel_m).unwrap();
        let points = room();
        let patches = patches(lattice, &[points.clone(), Vec::new()]);
        assert!(patches.voxels() > 500 && patches.file_bytes() == 20 * patches.voxels());
        let placement = Placement { rotation: IDENTITY, origin_in_world_m: [0.0; 3] };
        let placed = PlacedPatches::new(&patches, vec![placement; 2]).unwrap();
        let store = fused(lattice, &points);
        let mut surfels = 0;
        for (x, y) in (-2..2).flat_map(|x| (-2..2).map(move |y| (x, y))) {
            let tile = TileId { y, x };
            let [mine, theirs] = [placed.load_tile(tile).unwrap(), store.load(tile).unwrap()];
            let Some(theirs) = theirs else {
                assert!(mine.is_none_or(|tile| tile.surfels.is_empty()));
                continue;
            };
            let mut mine = mine.unwrap();
            assert_eq!((mine.own, mine.surfels.len()), (theirs.own, theirs.surfels.len()), "{tile}");
            surfels += mine.own;
            // Means and covariances are rounded; z has another origin.
            let dz = (mine.base_z_m() - theirs.base_z_m()) as f32;
            mine.surfels.iter_mut().for_each(|surfel| surfel.centre_in_tile_m[2] += dz);
            for a in &mine.surfels[..mine.own] {
                let apart = |b: &&Surfel| {
                    (0..3).map(|k| (a.centre_in_tile_m[k] - b.centre_in_tile_m[k]).abs()).fold(0.0, f32::max)
                };
                let nearest =
                    theirs.surfels[..theirs.own].iter().min_by(|b, c| apart(b).total_cmp(&apart(c)));
                let b = nearest.unwrap();
                let cos: f32 = (0..3).map(|k| a.normal[k] * b.normal[k]).sum();
                assert!(apart(&b) < 2e-3 && cos.abs() > 0.9999, "{a:?} {b:?}");
            }
            let extent = placed.tile_extent(tile).unwrap();
            let theirs = store.tile_extent(tile).unwrap();
            assert!(extent.z_range_m[0] <= theirs.z_range_m[0] && extent.z_range_m[1] >= theirs.z_range_m[1]);
        }
        assert!(surfels > 500);
    }
}

#[test]
fn patches_of_one_surface_make_one_surface_wherever_they_are_seen_from() {
    let lattice = Lattice::new(0.2).unwrap();
    let points = room();
    let placements: Vec<Placement> = (0..6)
        .map(|k| Placement {
            rotation: turned(0.7 * f64::from(k), 0.05 * f64::from(k)),
            origin_in_world_m: [f64::from(k) - 3.0, 0.3 * f64::from(k), 2.0],
        })
        .collect();
    let share = |k: usize| points.iter().skip(k).step_by(6).copied();
    let clouds: Vec<Vec<[f64; 3]>> =
        placements.iter().enumerate().map(|(k, p)| share(k).map(|x| in_patch(p, x)).collect()).collect();
    let patches = patches(lattice, &clouds);
    let placed = PlacedPatches::new(&patches, placements).unwrap();
    let (mut flat, mut all) = (0, 0);
    for (x, y) in (-1..1).flat_map(|x| (-1..1).map(move |y| (x, y))) {
        let tile = placed.load_tile(TileId { y, x }).unwrap().unwrap();
        for surfel in &tile.surfels {
            let centre: [f64; 3] =
                std::array::from_fn(|k| f64::from(surfel.centre_in_tile_m[k]) + tile.origin_in_world_m[k]);
            let floor = centre[2] - 1.0 - 0.02 * centre[0];
            let wall = centre[1] - 4.9 + 0.01 * (centre[2] - 6.0);
            all += 1;
            flat += usize::from(floor.abs().min(wall.abs()) < 2e-3);
        }
    }
    // Where floor and wall meet, a voxel has both.
    assert!(all > 3000 && flat as f64 > 0.97 * f64::from(all), "{flat} of {all}");
}

/// Floor and wall seen from rotated keyframes, at positions beyond the precision of f32.
#[test]
fn normals_are_those_of_the_surfaces_far_from_the_origin() {
    let lattice = Lattice::new(0.2).unwrap();
    for far_m in [[0.0; 3], [5e6, -4.2e6, 300.0]] {
        let world: Vec<[f64; 3]> =
            room().into_iter().map(|point| std::array::from_fn(|k| point[k] + far_m[k])).collect();
        let placements: Vec<Placement> = (1..4)
            .map(|k| Placement {
                rotation: turned(0.7 * f64::from(k), 0.15 * f64::from(k)),
                origin_in_world_m: [far_m[0] + f64::from(k), far_m[1] - 0.3 * f64::from(k), far_m[2] + 2.0],
            })
            .collect();
        let share = |k: usize| world.iter().skip(k).step_by(3).copied();
        let of_patch = |(k, p): (usize, &Placement)| share(k).map(|x| in_patch(p, x)).collect();
        let clouds: Vec<Vec<[f64; 3]>> = placements.iter().enumerate().map(of_patch).collect();
        let patches = patches(lattice, &clouds);
        let placed = PlacedPatches::new(&patches, placements).unwrap();
        let [low, high] = placed.tile_bounds().unwrap();
        let (mut floors, mut walls) = (0, 0);
        for (x, y) in (low.x..=high.x).flat_map(|x| (low.y..=high.y).map(move |y| (x, y))) {
            let Some(tile) = placed.load_tile(TileId { y, x }).unwrap() else { continue };
            for surfel in &tile.surfels[..tile.own] {
                let [x, y, z]: [f64; 3] = std::array::from_fn(|k| {
                    f64::from(surfel.centre_in_tile_m[k]) + tile.origin_in_world_m[k] - far_m[k]
                });
                // Where floor and wall meet, a cell has points of both.
                let (normal, off_m) = match (y < 4.0, z > 2.0) {
                    (true, false) => ([-0.02, 0.0, 1.0], z - 1.0 - 0.02 * x),
                    (false, true) => ([0.0, 1.0, 0.01], y - 4.9 + 0.01 * (z - 6.0)),
                    _ => continue,
                };
                (floors, walls) = (floors + usize::from(z < 2.0), walls + usize::from(z > 2.0));
                let normal = nalgebra::Vector3::from(normal).normalize();
                let cos = normal.dot(&nalgebra::Vector3::from(surfel.normal.map(f64::from))).abs();
                let off_deg = cos.min(1.0).acos().to_degrees();
                assert!(off_deg < 1.0, "{off_deg} degrees at {x} {y} {z} from {far_m:?}");
                assert!(off_m.abs() < 2e-3, "{off_m} m at {x} {y} {z} from {far_m:?}");
            }
        }
        assert!(floors > 1500 && walls > 1500, "{floors} and {walls} surfels");
    }
}

/// The expected sums of all patch voxels that fall into one voxel of the map.
#[derive(Debug, Clone, Default)]
struct Expected {
    count: u64,
    sum: [i64; 3],
    /// Second moments of the means, plus the spread of the points about them.
    products: [f64; 6],
    voxels: u64,
}

/// The oracle: adds every voxel of every patch, one by one, into a sorted map by the voxel's position in the world.
/// `None` where a mean lies so near to the middle between two lattice units that the last bits decide its rounding: a
/// voxel moves whole, so many points would be elsewhere.
fn added_up(
    lattice: &Lattice,
    patches: &Patches,
    placements: &[Placement],
) -> Option<std::collections::BTreeMap<[i64; 3], Expected>> {
    let mut expected = std::collections::BTreeMap::<_, Expected>::new();
    for (number, placement) in placements.iter().enumerate() {
        let rotation = nalgebra::Matrix3::from_fn(|i, j| placement.rotation[i][j]);
        for (index, block) in patches.blocks(number).iter().enumerate() {
            let mut voxels = Vec::new();
            patches.read(number, index..index + 1, &mut voxels).unwrap();
            for voxel in &voxels {
                let corner = block.corner_m(block_edge_m(lattice));
                let mean = nalgebra::Vector3::from_fn(|k, _| {
                    corner[k] + f64::from(voxel.mean_units[k]) / UNITS_PER_M
                });
                let world = rotation * mean + nalgebra::Vector3::from(placement.origin_in_world_m);
                let units = world * UNITS_PER_M;
                if units.iter().any(|c| ((c - c.floor()) - 0.5).abs() < 1e-5) {
                    return None;
                }
                let units: [i64; 3] = units.map(|c| c.round() as i64).into();
                let edge = i64::from(lattice.voxel_units());
                let offset = units.map(|c| c.rem_euclid(edge));
                let [xx, xy, xz, yy, yz, zz] = voxel.covariance_steps.map(f64::from);
                let spread = nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
                    * covariance_step_units2(lattice);
                let from_corner = nalgebra::Vector3::from(offset.map(|c| c as f64));
                let products = (rotation * spread * rotation.transpose()
                    + from_corner * from_corner.transpose())
                    * f64::from(voxel.count);
                let of_voxel = expected.entry(units.map(|c| c.div_euclid(edge))).or_default();
                of_voxel.count += u64::from(voxel.count);
                of_voxel.voxels += 1;
                for (sum, offset) in of_voxel.sum.iter_mut().zip(offset) {
                    *sum += i64::from(voxel.count) * offset;
                }
                for (sum, at) in
                    of_voxel.products.iter_mut().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)])
                {
                    *sum += products[at];
                }
            }
        }
    }
    Some(expected)
}

/// Some points around each position: voxels with one point and with several.
fn some_points(places: &[([f64; 3], usize)]) -> Vec<[f64; 3]> {
    let around = |k: usize| [0.02 * k as f64, 0.03 * (k * k % 5) as f64, 0.05 * (k % 3) as f64];
    let of_place = |&(place, count): &([f64; 3], usize)| {
        (0..count).map(move |n| std::array::from_fn(|k| place[k] + around(n)[k]))
    };
    places.iter().flat_map(of_place).collect()
}

proptest! {
    #[test]
    fn voxels_add_up_whatever_the_placements(
        places in prop::collection::vec(
            prop::collection::vec((prop::array::uniform3(-30.0..30.0_f64), 1..8_usize), 1..40), 1..5),
        yaw in -3.0..3.0_f64, tilt in -0.5..0.5_f64, origin in prop::array::uniform3(-1e5..1e5_f64),
    ) {
        let lattice = Lattice::new(0.5).unwrap();
        let clouds: Vec<_> = places.iter().map(|places| some_points(places)).collect();
        let patches = patches(lattice, &clouds);
        let placement = |k: usize| Placement {
            rotation: turned(yaw + k as f64, tilt),
            origin_in_world_m: [origin[0] + 9.0 * k as f64, origin[1], origin[2]],
        };
        let placements: Vec<_> = (0..clouds.len()).map(placement).collect();
        let placed = PlacedPatches::new(&patches, placements.clone()).unwrap();
        let expected = added_up(&lattice, &patches, &placements);
        // One case in fifty or so; the runner gives up if they are many.
        prop_assume!(expected.is_some());
        let expected = expected.unwrap();
        let points: usize = clouds.iter().map(Vec::len).sum();
        prop_assert_eq!(expected.values().map(|voxel| voxel.count).sum::<u64>(), points as u64);
        let (mut found, edge) = (0, i64::from(lattice.tile_voxels()));
        for (tile, reach) in &placed.tiles {
            let mut gathered = super::gathered::Gathered::default();
            placed.put_together(*tile, &reach.blocks, &mut gathered).unwrap();
            // A tile, and a cell around it.
            let corner = [tile.x, tile.y].map(|n| i64::from(n) * edge - 2);
            let around = |voxel: &[i64; 3]| (0..2).all(|k| (0..edge + 4).contains(&(voxel[k] - corner[k])));
            prop_assert_eq!(gathered.by_cell().count(), expected.keys().filter(|voxel| around(voxel)).count());
            for record in gathered.by_cell() {
                let at = record.voxel();
                let [x, y] = [i64::from(at.x), i64::from(at.y)];
                let known = expected.get(&[corner[0] + x, corner[1] + y, i64::from(at.z)]);
                prop_assert!(known.is_some(), "nothing is at {:?} of {}", at, tile);
                let (moments, known) = (&record.moments, known.unwrap());
                prop_assert_eq!((moments.count, moments.sum), (known.count, known.sum));
                for (sum, known_sum) in moments.products.iter().zip(known.products) {
                    // Every addend is rounded.
                    let off = (*sum as f64 - known_sum).abs();
                    prop_assert!(off <= 0.51 * known.voxels as f64, "{} {}", sum, known_sum);
                }
                let is_own = |c: i64| (2..2 + edge).contains(&c);
                found += if is_own(x) && is_own(y) { moments.count } else { 0 };
            }
        }
        prop_assert_eq!(found, points as u64);
    }
}

#[test]
fn what_is_no_place_is_refused() {
    let lattice = Lattice::new(0.2).unwrap();
    let mut patch = PatchBuilder::new(lattice);
    for point in [[f64::NAN, 0.0, 0.0], [0.0, 1e9, 0.0]] {
        assert!(patch.add(&[[1.0; 3], point]).is_err());
    }
    assert_eq!(patch.points(), 0);
    let patches = patches(lattice, &[vec![[1.0; 3]]]);
    let far = Placement { rotation: IDENTITY, origin_in_world_m: [6e7, 0.0, 0.0] };
    assert!(PlacedPatches::new(&patches, vec![far]).is_err());
}
