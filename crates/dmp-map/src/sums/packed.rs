//! Records of voxels in few bytes.

use bytemuck::Zeroable as _;

use crate::voxels::VoxelRecord;

/// Most records of a block: one block of each merged file is in memory.
pub(super) const BLOCK: usize = 4096;
/// Bytes of a record.
pub(super) const RECORD_BYTES: usize = size_of::<VoxelRecord>();
/// Most numbers have few digits, and these are alike: the fastest level gains almost everything.
const LEVEL: i32 = 1;

/// The first bytes of all records, then the second ones, and so on: most of them are 0. Then compressed.
pub(super) fn pack(records: &[VoxelRecord], planes: &mut Vec<u8>) -> std::io::Result<Vec<u8>> {
    let bytes: &[u8] = bytemuck::cast_slice(records);
    planes.clear();
    for plane in 0..RECORD_BYTES {
        planes.extend(bytes.iter().skip(plane).step_by(RECORD_BYTES));
    }
    zstd::bulk::compress(planes, LEVEL)
}

/// The inverse, for this many records.
pub(super) fn unpack(packed: &[u8], records: usize) -> Result<Vec<VoxelRecord>, String> {
    let length = records * RECORD_BYTES;
    let planes = zstd::bulk::decompress(packed, length).map_err(|e| format!("cannot decompress: {e}"))?;
    if planes.len() != length {
        return Err(format!("it holds {} bytes, not those of {records} records", planes.len()));
    }
    let mut unpacked = vec![VoxelRecord::zeroed(); records];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut unpacked);
    for (plane, of_plane) in planes.chunks_exact(records.max(1)).enumerate() {
        bytes.iter_mut().skip(plane).step_by(RECORD_BYTES).zip(of_plane).for_each(|(to, from)| *to = *from);
    }
    Ok(unpacked)
}
