//! Lists that grow ahead of what is written into them.

/// Makes a list at least so long. To be called where nothing is at hand yet that would have to be put aside.
#[inline(always)]
pub(crate) fn grow_to(list: &mut Vec<u32>, length: usize) {
    #[cold]
    #[inline(never)]
    fn grow(list: &mut Vec<u32>, length: usize) {
        list.resize(2 * length, 0);
    }
    if list.len() < length {
        grow(list, length);
    }
}
