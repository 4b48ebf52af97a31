//! Lists that are extended before they are written.

/// Extends a list to at least this length. Call it before vectors are in registers, which it would spill.
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
