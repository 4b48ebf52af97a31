//! Codes of surfels as columns of bytes, arranged for zstd.
//!
//! The surfels of a cell share its normal: there are columns of cells, then columns of surfels. Every column is cut
//! into planes, the lowest bytes of all its values first. Each plane is compressed separately, so that unrelated bytes
//! do not spoil its statistics.

use std::io::Write;

use crate::grid::{DEPTH_STEPS, Lattice};
use crate::surfels::{NormalCode, SLOPE_STEPS, SurfelCode};

/// Bytes of the columns of cells: steps of z, y and x, the voxels with a surfel, the two words of the normal.
const CELL_COLUMNS: [usize; 6] = [4, 2, 2, 1, 3, 3];
pub(super) const CELL_BYTES: usize = 15;
/// Bytes of the columns of surfels: the place across, the depth, the steps of support.
const SURFEL_COLUMNS: [usize; 5] = [2, 2, 3, 4, 4];
pub(super) const SURFEL_BYTES: usize = 15;
/// Position of the normal's axis, above its first slope.
const AXIS_SHIFT: u32 = 20;
const ZSTD_LEVEL: i32 = 1;

/// Codes as a zstd frame, and their number of cells.
pub(super) fn pack(codes: &[SurfelCode]) -> std::io::Result<(Vec<u8>, u32)> {
    // A cell has its voxels in order, once each; anything else starts another cell.
    let one_cell = |a: &SurfelCode, b: &SurfelCode| {
        cell_of(a) == cell_of(b) && place_of(a) < place_of(b) && a.normal == b.normal
    };
    let cells: Vec<&[SurfelCode]> = codes.chunk_by(one_cell).filter(|cell| !cell.is_empty()).collect();

    let mut columns = Columns::new(cells.len() * CELL_BYTES + codes.len() * SURFEL_BYTES)?;
    let first = |k: usize| cells.iter().map(move |cell| cell_of(&cell[0])[k]);
    for (k, bytes) in [(2, CELL_COLUMNS[0]), (1, CELL_COLUMNS[1]), (0, CELL_COLUMNS[2])] {
        let mut last = 0i32;
        let step = |value: i32| value.wrapping_sub(std::mem::replace(&mut last, value)) as u32;
        columns.put(bytes, first(k).map(step))?;
    }
    let mask = |cell: &&[SurfelCode]| cell.iter().map(|code| 1 << place_of(code)).sum::<u32>();
    columns.put(CELL_COLUMNS[3], cells.iter().map(mask))?;
    let slope = |cell: &&[SurfelCode], k: usize| (cell[0].normal.slope_steps[k] + SLOPE_STEPS) as u32;
    let with_axis = |cell| slope(cell, 0) | (cell[0].normal.axis as u32) << AXIS_SHIFT;
    columns.put(CELL_COLUMNS[4], cells.iter().map(with_axis))?;
    columns.put(CELL_COLUMNS[5], cells.iter().map(|cell| slope(cell, 1)))?;

    columns.put(SURFEL_COLUMNS[0], codes.iter().map(|code| code.across_steps[0]))?;
    columns.put(SURFEL_COLUMNS[1], codes.iter().map(|code| code.across_steps[1]))?;
    columns.put(SURFEL_COLUMNS[2], codes.iter().map(|code| code.depth_steps))?;
    let mut last = 0;
    let step = |code: &SurfelCode| {
        zigzag(code.third_lowest.wrapping_sub(std::mem::replace(&mut last, code.third_lowest)))
    };
    columns.put(SURFEL_COLUMNS[3], codes.iter().map(step))?;
    let span = |code: &SurfelCode| zigzag(code.third_highest.wrapping_sub(code.third_lowest));
    columns.put(SURFEL_COLUMNS[4], codes.iter().map(span))?;
    Ok((columns.zstd.finish()?, cells.len() as u32))
}

/// z, y and x of the 2 v cell that contains a code's voxel, reversed.
fn cell_of(code: &SurfelCode) -> [i32; 3] {
    code.voxel.map(|v| v >> 1)
}

/// The index of a code's voxel in its cell.
fn place_of(code: &SurfelCode) -> u32 {
    let [x, y, z] = code.voxel.map(|v| (v & 1) as u32);
    z << 2 | y << 1 | x
}

/// Maps small numbers of either sign to small unsigned numbers.
fn zigzag(value: i32) -> u32 {
    (value << 1 ^ value >> 31) as u32
}

fn unzigzag(value: u32) -> i32 {
    (value >> 1) as i32 ^ -((value & 1) as i32)
}

struct Columns {
    zstd: zstd::stream::write::Encoder<'static, Vec<u8>>,
    plane: Vec<u8>,
}

impl Columns {
    fn new(bytes: usize) -> std::io::Result<Self> {
        let mut zstd = zstd::stream::write::Encoder::new(Vec::new(), ZSTD_LEVEL)?;
        zstd.set_pledged_src_size(Some(bytes as u64))?;
        Ok(Self { zstd, plane: Vec::new() })
    }

    fn put(&mut self, bytes: usize, values: impl Iterator<Item = u32>) -> std::io::Result<()> {
        let values: Vec<u32> = values.collect();
        for k in 0..bytes {
            self.plane.clear();
            self.plane.extend(values.iter().map(|value| (value >> (8 * k)) as u8));
            self.zstd.write_all(&self.plane)?;
            // Ends the block and thus its statistics.
            self.zstd.flush()?;
        }
        Ok(())
    }
}

/// Whose surfels a blob has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Whose {
    Own,
    Neighbours,
}

/// Reads a blob's planes.
struct Planes<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Planes<'a> {
    /// The next column of `rows` values of `N` bytes; the caller has checked the length of all.
    fn next<const N: usize>(&mut self, rows: usize) -> Column<'a, N> {
        let column = Column(std::array::from_fn(|k| {
            let start = self.at + k * rows;
            self.bytes.get(start..start + rows).unwrap_or_default()
        }));
        self.at += N * rows;
        column
    }
}

struct Column<'a, const N: usize>([&'a [u8]; N]);

impl<const N: usize> Column<'_, N> {
    /// A row's value; 0 past the end.
    #[inline]
    fn get(&self, row: usize) -> u32 {
        let byte = |k: usize| u32::from(self.0[k].get(row).copied().unwrap_or_default()) << (8 * k);
        (0..N).map(byte).sum()
    }
}

/// Passes on the codes of an uncompressed blob, which must have `surfels` in `cells`.
///
/// # Errors
/// When its length differs, or a number in it is not valid for codes.
pub(super) fn unpack(
    bytes: &[u8],
    [cells, surfels]: [usize; 2],
    lattice: &Lattice,
    whose: Whose,
    mut each: impl FnMut(&SurfelCode),
) -> Result<(), String> {
    if bytes.len() != cells * CELL_BYTES + surfels * SURFEL_BYTES {
        return Err(format!("{} bytes are not {surfels} surfels in {cells} cells", bytes.len()));
    }
    let mut planes = Planes { bytes, at: 0 };
    let (z_steps, y_steps, x_steps) =
        (planes.next::<4>(cells), planes.next::<2>(cells), planes.next::<2>(cells));
    let (masks, slopes) = (planes.next::<1>(cells), [planes.next::<3>(cells), planes.next::<3>(cells)]);
    let across = [planes.next::<2>(surfels), planes.next::<2>(surfels)];
    let depths = planes.next::<3>(surfels);
    let support_steps = [planes.next::<4>(surfels), planes.next::<4>(surfels)];

    let edge_cells = (lattice.tile_voxels() / 2) as i32;
    let most_units = lattice.voxel_units() - 1;
    let (most_across, most_depth) = (most_units * lattice.across_steps(), most_units * DEPTH_STEPS);
    let (mut x, mut y, mut z) = (0u16, 0u16, 0i32);
    let (mut surfel, mut third_lowest) = (0, 0i32);
    for cell in 0..cells {
        x = x.wrapping_add(x_steps.get(cell) as u16);
        y = y.wrapping_add(y_steps.get(cell) as u16);
        z = z.wrapping_add(z_steps.get(cell) as i32);
        let place = [x, y].map(|c| i32::from(c as i16));
        let inside = place.map(|c| (0..edge_cells).contains(&c)) == [true; 2];
        let near = place.map(|c| (-1..=edge_cells).contains(&c)) == [true; 2];
        if !near || inside != (whose == Whose::Own) {
            return Err(format!("cell {cell} of {cells} is at {place:?} of {edge_cells} a tile"));
        }
        let mask = masks.get(cell);
        if mask == 0 || surfel + mask.count_ones() as usize > surfels {
            return Err(format!(
                "cell {cell} of {cells} has voxels {mask:08b} after {surfel} of {surfels} surfels"
            ));
        }
        let normal = normal_of(slopes[0].get(cell), slopes[1].get(cell))
            .ok_or_else(|| format!("cell {cell} of {cells} has no normal"))?;
        for bit in (0..8).filter(|bit| mask >> bit & 1 == 1) {
            third_lowest = third_lowest.wrapping_add(unzigzag(support_steps[0].get(surfel)));
            let span = unzigzag(support_steps[1].get(surfel));
            let code = SurfelCode {
                voxel: [
                    2 * place[0] + (bit & 1),
                    2 * place[1] + (bit >> 1 & 1),
                    z.wrapping_mul(2) + (bit >> 2),
                ],
                normal,
                across_steps: [across[0].get(surfel), across[1].get(surfel)],
                depth_steps: depths.get(surfel),
                third_lowest,
                third_highest: third_lowest.wrapping_add(span),
            };
            let [a, b] = code.across_steps;
            if a.max(b) > most_across || code.depth_steps > most_depth {
                let depth = code.depth_steps;
                return Err(format!(
                    "surfel {surfel} is at {a} and {b} of {most_across}, {depth} of {most_depth} steps"
                ));
            }
            each(&code);
            surfel += 1;
        }
    }
    if surfel == surfels { Ok(()) } else { Err(format!("its cells have {surfel} of {surfels} surfels")) }
}

fn normal_of(with_axis: u32, second: u32) -> Option<NormalCode> {
    let axis = (with_axis >> AXIS_SHIFT) as usize;
    let steps = [with_axis & ((1 << AXIS_SHIFT) - 1), second];
    let slope_steps = steps.map(|steps| steps as i32 - SLOPE_STEPS);
    let known = axis < 3 && slope_steps.iter().all(|steps| steps.abs() <= SLOPE_STEPS);
    known.then_some(NormalCode { axis, slope_steps })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn code(own: bool) -> impl Strategy<Value = SurfelCode> {
        let lattice = Lattice::new(0.5).unwrap();
        let (edge_cells, most, steps) =
            (lattice.tile_voxels() as i32 / 2, lattice.voxel_units() - 1, lattice.across_steps());
        let (x, z) = (if own { 0..2 * edge_cells } else { -2..0 }, -9..9i32);
        let slope = -SLOPE_STEPS..=SLOPE_STEPS;
        let normal = (0..3usize, [slope.clone(), slope]);
        let normal = normal.prop_map(|(axis, slope_steps)| NormalCode { axis, slope_steps });
        let support = [any::<i32>(), any::<i32>()];
        let across = 0..=most * steps;
        let inside = ([across.clone(), across], 0..=most * DEPTH_STEPS);
        ((x, 0..2 * edge_cells, z), normal, inside, support).prop_map(
            |((x, y, z), normal, inside, support)| SurfelCode {
                voxel: [x, y, z],
                normal,
                across_steps: inside.0,
                depth_steps: inside.1,
                third_lowest: support[0],
                third_highest: support[1],
            },
        )
    }

    fn read(
        packed: &[u8],
        rows: [usize; 2],
        lattice: &Lattice,
        whose: Whose,
    ) -> Result<Vec<SurfelCode>, String> {
        let bytes = zstd::bulk::decompress(packed, rows[0] * CELL_BYTES + rows[1] * SURFEL_BYTES).unwrap();
        let mut codes = Vec::new();
        unpack(&bytes, rows, lattice, whose, |code| codes.push(*code))?;
        Ok(codes)
    }

    proptest! {
        #[test]
        fn what_is_packed_comes_back_in_its_order(
            codes in prop::collection::vec(code(true), 0..200), copies in prop::collection::vec(code(false), 1..50),
        ) {
            let lattice = Lattice::new(0.5).unwrap();
            // Neighbours in a cell too, of one normal or not.
            let mut codes = codes;
            for k in 1..codes.len() {
                if k % 3 > 0 {
                    codes[k].voxel = codes[k - 1].voxel;
                    codes[k].voxel[k % 2] ^= 1;
                }
                if k % 5 > 0 {
                    codes[k].normal = codes[k - 1].normal;
                }
            }
            for (codes, whose, other) in [(&codes, Whose::Own, Whose::Neighbours), (&copies, Whose::Neighbours, Whose::Own)] {
                let (packed, cells) = pack(codes).unwrap();
                let rows = [cells as usize, codes.len()];
                prop_assert_eq!(&read(&packed, rows, &lattice, whose).unwrap(), codes);
                prop_assert!(codes.is_empty() || read(&packed, rows, &lattice, other).is_err());
            }
        }

        #[test]
        fn bytes_that_are_no_codes_are_refused_or_are_some(
            bytes in prop::collection::vec(any::<u8>(), 15 * 12), cells in 1..12usize, few in any::<bool>(),
        ) {
            // A valid checksum does not prove that we wrote the data.
            let lattice = Lattice::new(0.5).unwrap();
            let mut bytes = bytes;
            if few {
                bytes.iter_mut().for_each(|byte| *byte &= 1);
            }
            let mut codes = 0;
            let read = unpack(&bytes, [cells, 12 - cells], &lattice, Whose::Own, |_| codes += 1);
            prop_assert!(read.is_err() || codes == 12 - cells);
        }
    }
}
