use super::*;
use crate::{Durability, FuseScratch, MapFuser, Store, Surfel, TileId, TileSource};
use proptest::prelude::*;

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn turned(yaw: f64, tilt: f64) -> [[f64; 3]; 3] {
    let rotation = nalgebra::Rotation3::from_euler_angles(tilt, 0.0, yaw);
    std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)]))
}

/// The point of a patch that comes to lie at a place in the world.
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
            patch.add(part.iter().copied()).unwrap();
        }
        assert_eq!(patch.points(), cloud.len() as u64);
        writer.put(number, patch).unwrap();
    }
    writer.finish().unwrap()
}

/// The map that the fuser makes of the same points.
fn fused(lattice: Lattice, points: &[[f64; 3]]) -> Store {
    let folder = tempfile::tempdir().unwrap();
    let fuser = MapFuser::new(lattice, 64 << 20, folder.path()).unwrap();
    fuser.add(points, None, &mut FuseScratch::default()).unwrap();
    let path = folder.path().join("m.dmpmap");
    fuser.finish(&path, "", Durability::Scratch, &|_, _| ()).unwrap();
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
            let tile = TileId { x, y };
            let [mine, theirs] = [placed.load_tile(tile).unwrap(), store.load(tile).unwrap()];
            let Some(theirs) = theirs else {
                assert!(mine.is_none_or(|tile| tile.surfels.is_empty()));
                continue;
            };
            let mut mine = mine.unwrap();
            assert_eq!((mine.own, mine.surfels.len()), (theirs.own, theirs.surfels.len()), "{tile}");
            surfels += mine.own;
            // Means and covariances are rounded, z counts from elsewhere.
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
        let tile = placed.load_tile(TileId { x, y }).unwrap().unwrap();
        for surfel in &tile.surfels {
            let centre: [f64; 3] =
                std::array::from_fn(|k| f64::from(surfel.centre_in_tile_m[k]) + tile.origin_in_world_m[k]);
            let floor = centre[2] - 1.0 - 0.02 * centre[0];
            let wall = centre[1] - 4.9 + 0.01 * (centre[2] - 6.0);
            all += 1;
            flat += usize::from(floor.abs().min(wall.abs()) < 2e-3);
        }
    }
    // Where floor and wall meet a voxel has both.
    assert!(all > 3000 && flat as f64 > 0.97 * f64::from(all), "{flat} of {all}");
}

proptest! {
    #[test]
    fn voxels_add_up_whatever_the_placements(
        clouds in prop::collection::vec(prop::collection::vec(prop::array::uniform3(-30.0..30.0_f64), 1..60), 1..5),
        yaw in -3.0..3.0_f64, tilt in -0.5..0.5_f64, origin in prop::array::uniform3(-1e5..1e5_f64),
    ) {
        let lattice = Lattice::new(0.5).unwrap();
        let patches = patches(lattice, &clouds);
        let placement = |k: usize| Placement {
            rotation: turned(yaw + k as f64, tilt),
            origin_in_world_m: [origin[0] + 9.0 * k as f64, origin[1], origin[2]],
        };
        let placements: Vec<_> = (0..clouds.len()).map(placement).collect();
        let placed = PlacedPatches::new(&patches, placements.clone()).unwrap();
        // The oracle: every voxel of every patch, one by one, into a sorted map.
        let mut expected = std::collections::BTreeMap::<_, u64>::new();
        for (number, placement) in placements.iter().enumerate() {
            let mut voxels = Vec::new();
            for (index, block) in patches.blocks(number).iter().enumerate() {
                voxels.clear();
                patches.read(number, index..index + 1, &mut voxels).unwrap();
                for voxel in &voxels {
                    let corner = block.corner_m(block_edge_m(&lattice));
                    let mean: [f64; 3] = std::array::from_fn(|k| corner[k] + f64::from(voxel.mean_units[k]) / UNITS_PER_M);
                    let world: [f64; 3] = std::array::from_fn(|k| {
                        placement.origin_in_world_m[k]
                            + (0..3).map(|j| placement.rotation[k][j] * mean[j]).sum::<f64>()
                    });
                    let tile = lattice.tile_of(world).unwrap();
                    *expected.entry(tile).or_default() += u64::from(voxel.count);
                }
            }
        }
        let points: usize = clouds.iter().map(Vec::len).sum();
        prop_assert_eq!(expected.values().sum::<u64>(), points as u64);
        let mut found = 0;
        for tile in placed.tiles.keys() {
            let mut gathered = super::gathered::Gathered::default();
            placed.put_together(*tile, &placed.tiles[tile].blocks, &mut gathered).unwrap();
            let own = |c: u16| (2..2 + lattice.tile_voxels() as u16).contains(&c);
            let in_tile = gathered.by_cell().filter(|r| own(r.voxel().x) && own(r.voxel().y));
            let count: u64 = in_tile.map(|r| r.moments.count).sum();
            // A mean on a border may be rounded to either side.
            let known = expected.get(tile).copied().unwrap_or(0);
            prop_assert!(count.abs_diff(known) <= 1, "{} {}", count, known);
            found += count;
        }
        prop_assert_eq!(found, points as u64);
    }
}

#[test]
fn what_is_no_place_is_refused() {
    let lattice = Lattice::new(0.2).unwrap();
    let mut patch = PatchBuilder::new(lattice);
    for point in [[f64::NAN, 0.0, 0.0], [0.0, 1e9, 0.0]] {
        assert!(patch.add([[1.0; 3], point]).is_err());
    }
    assert_eq!(patch.points(), 0);
    let patches = patches(lattice, &[vec![[1.0; 3]]]);
    let far = Placement { rotation: IDENTITY, origin_in_world_m: [6e7, 0.0, 0.0] };
    assert!(PlacedPatches::new(&patches, vec![far]).is_err());
}
