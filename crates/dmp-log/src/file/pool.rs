//! The threads of whoever calls: those of the pool of rayon that the call is made in. Without one nothing here has threads.

use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};

/// Items that a thread looks at before what was found is asked for.
const ITEMS_A_THREAD: usize = 8;

/// Threads of the pool that this is called in; 1 where it is called in none.
pub(crate) fn threads() -> usize {
    rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads())
}

/// What `look` makes of each item, in the order of the items. Looks at a few of them ahead where there are threads for it.
pub(crate) fn in_order<T: Sync, R: Send>(
    items: &[T],
    look: impl Fn(&T) -> R + Sync,
) -> impl Iterator<Item = R> {
    let threads = threads();
    let together = if threads > 1 { threads * ITEMS_A_THREAD } else { 1 };
    items.chunks(together).flat_map(move |items| -> Vec<R> {
        match items {
            [item] => vec![look(item)],
            items => items.par_iter().map(&look).collect(),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn answers_come_in_order_and_without_a_pool_one_by_one() {
        let items: Vec<usize> = (0..1000).collect();
        let squares: Vec<usize> = items.iter().map(|item| item * item).collect();
        let looked = AtomicUsize::new(0);
        let square = |item: &usize| {
            looked.fetch_add(1, Ordering::Relaxed);
            item * item
        };
        assert_eq!(threads(), 1);
        assert_eq!(in_order(&items, square).take(3).collect::<Vec<_>>(), squares[..3]);
        assert_eq!(looked.load(Ordering::Relaxed), 3);
        for threads_asked in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads_asked).build().unwrap();
            pool.install(|| {
                assert_eq!(threads(), threads_asked);
                assert_eq!(in_order(&items, square).collect::<Vec<_>>(), squares);
            });
        }
    }
}
