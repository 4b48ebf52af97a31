//! A cache under a byte budget, which lets go first what is used last.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How much memory a cached value holds.
pub trait Weight {
    /// Bytes.
    fn weight_bytes(&self) -> usize;
}

/// Values under a byte budget, loaded once by the first thread that asks; others wait for it.
///
/// When the budget is exceeded the values whose next use is furthest off are let go, as far as that is
/// [foreseen](Self::foreseeing), and among those alike the ones unused for longest. One that is in use lives on
/// until its last user drops it, so the budget can be exceeded by what is in use at the moment.
///
/// A value that is in memory costs a look-up; to let one go costs a look at all of them.
pub struct BudgetCache<K, V> {
    budget_bytes: usize,
    next_use: Box<NextUse<K>>,
    inner: Mutex<Inner<K, V>>,
}

/// When a value will be used next, seen from the use of another one that was just loaded: the larger, the later.
pub type NextUse<K> = dyn Fn(&K, &K) -> u64 + Send + Sync;

impl<K, V> std::fmt::Debug for BudgetCache<K, V> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BudgetCache").field("budget_bytes", &self.budget_bytes).finish_non_exhaustive()
    }
}

#[derive(Debug)]
struct Inner<K, V> {
    slots: HashMap<K, Slot<V>>,
    clock: u64,
    bytes: usize,
    loads: u64,
}

#[derive(Debug)]
struct Slot<V> {
    value: Arc<Mutex<Option<Arc<V>>>>,
    last_use: u64,
    bytes: usize,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic while loading leaves an empty slot or a whole value, nothing in between.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<K: Copy + Eq + Hash, V: Weight> BudgetCache<K, V> {
    /// An empty cache.
    pub fn new(budget_bytes: usize) -> Self {
        Self::foreseeing(budget_bytes, Box::new(|_, _| 0))
    }

    /// An empty cache that asks when values will be used next. It is asked whenever a value is to be let go.
    pub fn foreseeing(budget_bytes: usize, next_use: Box<NextUse<K>>) -> Self {
        let inner = Inner { slots: HashMap::new(), clock: 0, bytes: 0, loads: 0 };
        Self { budget_bytes, next_use, inner: Mutex::new(inner) }
    }

    /// The value of `key`, from memory or by `load`.
    ///
    /// # Errors
    /// Those of `load`; nothing is remembered then.
    pub fn get<E>(&self, key: K, load: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        let value = {
            let mut inner = lock(&self.inner);
            inner.clock += 1;
            let now = inner.clock;
            let empty = || Slot { value: Arc::default(), last_use: now, bytes: 0 };
            let slot = inner.slots.entry(key).or_insert_with(empty);
            slot.last_use = now;
            Arc::clone(&slot.value)
        };
        let mut content = lock(&value);
        if let Some(ready) = &*content {
            return Ok(Arc::clone(ready));
        }
        let loaded = Arc::new(load()?);
        *content = Some(Arc::clone(&loaded));
        drop(content);
        self.account(key, &value, loaded.weight_bytes());
        Ok(loaded)
    }

    fn account(&self, key: K, value: &Arc<Mutex<Option<Arc<V>>>>, bytes: usize) {
        let mut inner = lock(&self.inner);
        inner.loads += 1;
        // Another thread may have let the slot go meanwhile; then the value belongs to its users alone.
        match inner.slots.get_mut(&key) {
            Some(slot) if Arc::ptr_eq(&slot.value, value) => slot.bytes = bytes,
            _ => return,
        }
        inner.bytes += bytes;
        while inner.bytes > self.budget_bytes {
            let loaded = inner.slots.iter().filter(|&(&k, slot)| k != key && slot.bytes > 0);
            let latest = loaded.max_by_key(|(k, slot)| ((self.next_use)(k, &key), Reverse(slot.last_use)));
            let Some((&latest, _)) = latest else { break };
            if let Some(slot) = inner.slots.remove(&latest) {
                inner.bytes -= slot.bytes;
            }
        }
    }

    /// How often a value had to be loaded so far.
    pub fn loads(&self) -> u64 {
        lock(&self.inner).loads
    }

    /// Bytes of the values remembered now.
    pub fn bytes(&self) -> usize {
        lock(&self.inner).bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Block(usize);
    impl Weight for Block {
        fn weight_bytes(&self) -> usize {
            self.0
        }
    }

    #[test]
    fn the_longest_unused_goes_first_and_loads_are_counted() {
        let cache = BudgetCache::new(250);
        let load = || Ok::<_, ()>(Block(100));
        for key in [1, 2, 1, 3, 1, 2] {
            cache.get(key, load).unwrap();
        }
        // 3 pushed out 2, 2 pushed out 3; 1 stayed.
        assert_eq!((cache.loads(), cache.bytes()), (4, 200));
        // A value larger than the budget is given all the same.
        assert_eq!(cache.get(7, || Ok::<_, ()>(Block(500))).unwrap().0, 500);
    }

    #[test]
    fn what_is_used_last_of_all_goes_first() {
        // 1 and 2 are needed soon, 9 never again: though it was used last, it goes.
        let cache = BudgetCache::foreseeing(250, Box::new(|&key: &u64, _| key));
        let load = || Ok::<_, ()>(Block(100));
        for key in [1, 2, 9, 9, 3, 1, 2] {
            cache.get(key, load).unwrap();
        }
        // 9 pushed out 2; 3 pushed out 9; 2 pushed out 3; 1 stayed.
        assert_eq!((cache.loads(), cache.bytes()), (5, 200));
    }

    #[test]
    fn a_failed_load_leaves_nothing_behind() {
        let cache: BudgetCache<i32, Block> = BudgetCache::new(10);
        assert!(cache.get(1, || Err("no")).is_err());
        assert!(cache.get(1, || Ok::<_, &str>(Block(5))).is_ok());
        assert_eq!(cache.bytes(), 5);
    }

    #[test]
    fn many_threads_load_each_value_once() {
        let cache = BudgetCache::new(usize::MAX);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..200).for_each(|k| drop(cache.get(k % 20, || Ok::<_, ()>(Block(1))))));
            }
        });
        assert_eq!(cache.loads(), 20);
    }
}
