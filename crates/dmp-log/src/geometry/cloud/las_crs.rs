//! The records of a LAS file that say in which coordinate system it is.

use crate::ParseError;
use crate::geometry::laz::las_bytes::{Bytes, VLR_HEAD_BYTES};
use std::io::{Read, Seek};

pub(super) const EVLR_HEAD_BYTES: u64 = 60;
/// The records that say in which coordinate system a file is, all by one user.
const USER: &[u8] = b"LASF_Projection";
const IDS: [u16; 3] = [2112, 34_735, 34_736];

/// A record of the coordinate system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct CrsRecord {
    pub(super) id: u16,
    pub(super) data: Vec<u8>,
}

/// The records of the coordinate system, in front of the points and, since version 1.4, behind them. Those
/// of more than 64 KiB are passed over, and so is what does not fit in the file.
pub(super) fn records<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    header_bytes: u64,
    data_at: u64,
    minor: u8,
) -> Result<Vec<CrsRecord>, ParseError> {
    let mut found = Vec::new();
    let mut at = header_bytes;
    for _ in 0..bytes.u32(100, "the number of records")? {
        if at + VLR_HEAD_BYTES > data_at {
            break;
        }
        let size = u64::from(bytes.u16(at + 20, "a record")?);
        if at + VLR_HEAD_BYTES + size > data_at {
            break;
        }
        keep(bytes, at, at + VLR_HEAD_BYTES, size, &mut found)?;
        at += VLR_HEAD_BYTES + size;
    }
    if minor < 4 {
        return Ok(found);
    }
    let mut at = bytes.u64(235, "the first extended record")?;
    for _ in 0..bytes.u32(243, "the number of extended records")? {
        let Some(data_at) = at.checked_add(EVLR_HEAD_BYTES).filter(|&data_at| data_at <= bytes.length) else {
            break;
        };
        let size = bytes.u64(at + 20, "an extended record")?;
        let Some(end) = data_at.checked_add(size).filter(|&end| end <= bytes.length) else { break };
        keep(bytes, at, data_at, size, &mut found)?;
        at = end;
    }
    Ok(found)
}

fn keep<R: Read + Seek>(
    bytes: &mut Bytes<'_, R>,
    at: u64,
    data_at: u64,
    size: u64,
    found: &mut Vec<CrsRecord>,
) -> Result<(), ParseError> {
    let user: [u8; 16] = bytes.at(at + 2, "a record")?;
    let id = bytes.u16(at + 18, "a record")?;
    // One of a kind: the first counts.
    let wanted = user.starts_with(USER) && IDS.contains(&id) && found.iter().all(|record| record.id != id);
    if let Some(size) = u16::try_from(size).ok().filter(|_| wanted) {
        found.push(CrsRecord { id, data: bytes.many(data_at, size.into(), "a record")? });
    }
    Ok(())
}
