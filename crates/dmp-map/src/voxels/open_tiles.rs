//! Sums of tiles in memory, under a byte budget.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use dmp_disk::{DiskError, TileId};

use crate::grid::MixHasher;

/// Number of locks over which tiles are spread, so that threads rarely wait for each other.
const SHARDS: usize = 64;

/// The sums of each tile, in memory within a byte budget.
#[derive(Debug)]
pub(crate) struct OpenTiles<T> {
    budget_bytes: usize,
    shards: Vec<Mutex<Shard<T>>>,
    bytes: AtomicUsize,
    clock: AtomicU64,
}

type Shard<T> = HashMap<TileId, Open<T>, BuildHasherDefault<MixHasher>>;

#[derive(Debug, Default)]
struct Open<T> {
    sums: T,
    last_use: u64,
}

/// The memory of a tile's sums.
pub(crate) trait Sums: Default {
    /// Bytes.
    fn bytes(&self) -> usize;
}

/// Ignores poisoning: a lock whose holder panicked still has whole sums, and the panic ends the run.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T: Sums> OpenTiles<T> {
    pub(crate) fn new(budget_bytes: usize) -> Self {
        Self {
            budget_bytes,
            shards: (0..SHARDS).map(|_| Mutex::new(Shard::default())).collect(),
            bytes: AtomicUsize::new(0),
            clock: AtomicU64::new(0),
        }
    }

    pub(crate) fn budget_bytes(&self) -> usize {
        self.budget_bytes
    }

    fn shard(&self, tile: TileId) -> MutexGuard<'_, Shard<T>> {
        lock(&self.shards[tile.x.wrapping_add(tile.y.wrapping_mul(7)).rem_euclid(SHARDS as i32) as usize])
    }

    /// Adds to the sums of a tile, which only grow.
    pub(crate) fn add(&self, tile: TileId, add: impl FnOnce(&mut T)) {
        let mut shard = self.shard(tile);
        let open = shard.entry(tile).or_default();
        let before = open.sums.bytes();
        add(&mut open.sums);
        open.last_use = self.clock.fetch_add(1, Ordering::Relaxed);
        // Counted while the tile is locked: so spilling it subtracts exactly what was added.
        self.bytes.fetch_add(open.sums.bytes() - before, Ordering::Relaxed);
    }

    /// If over the budget, passes the least recently used tiles to `put_aside` until three quarters of it remain.
    pub(crate) fn keep_budget(
        &self,
        put_aside: impl Fn(TileId, T) -> Result<(), DiskError>,
    ) -> Result<(), DiskError> {
        if self.bytes.load(Ordering::Relaxed) <= self.budget_bytes {
            return Ok(());
        }
        let mut ages: Vec<(u64, TileId)> = Vec::new();
        for shard in &self.shards {
            ages.extend(lock(shard).iter().map(|(&tile, open)| (open.last_use, tile)));
        }
        ages.sort_unstable();
        for (_, tile) in ages {
            if self.bytes.load(Ordering::Relaxed) <= self.budget_bytes / 4 * 3 {
                break;
            }
            // Another thread may have spilled it or added to it: both are fine.
            let Some(sums) = self.take(tile) else { continue };
            put_aside(tile, sums)?;
        }
        Ok(())
    }

    /// Removes a tile's sums, if any.
    pub(crate) fn take(&self, tile: TileId) -> Option<T> {
        let sums = self.shard(tile).remove(&tile)?.sums;
        self.bytes.fetch_sub(sums.bytes(), Ordering::Relaxed);
        Some(sums)
    }

    /// Reads a tile's sums, if any.
    pub(crate) fn look<R>(&self, tile: TileId, look: impl FnOnce(&T) -> R) -> Option<R> {
        self.shard(tile).get(&tile).map(|open| look(&open.sums))
    }

    /// The tiles in memory, in no order.
    pub(crate) fn tiles(&self) -> Vec<TileId> {
        self.shards.iter().flat_map(|shard| lock(shard).keys().copied().collect::<Vec<_>>()).collect()
    }
}
