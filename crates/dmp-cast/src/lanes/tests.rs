//! Tests every operation of every path against one lane at a time.

use super::*;

const VALUES: [f32; 12] =
    [0.0, -0.0, 1.0, -2.5, 1e-40, -1e-30, 1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.1, 3.25];

/// Sixteen pairs in which every value meets every other, at some lane, for some `turn`.
fn operands(turn: usize) -> ([f32; 16], [f32; 16]) {
    (
        std::array::from_fn(|k| VALUES[(k + turn) % VALUES.len()]),
        std::array::from_fn(|k| VALUES[(k + turn * 5 + turn / VALUES.len()) % VALUES.len()]),
    )
}

fn same(got: &[f32], wanted: impl Fn(usize) -> f32, what: &str) {
    for (k, got) in got.iter().enumerate() {
        let wanted = wanted(k);
        assert!(
            got.to_bits() == wanted.to_bits() || (got.is_nan() && wanted.is_nan()),
            "{what} lane {k}: {got} {wanted}"
        );
    }
}

fn check<L: Lanes>(simd: L::Simd) {
    let stored = |lanes: L| {
        let mut out = [0.0; 16];
        lanes.store(&mut out);
        out[..L::COUNT].to_vec()
    };
    let bits = |holds: &dyn Fn(usize) -> bool| (0..L::COUNT).map(|k| u32::from(holds(k)) << k).sum::<u32>();
    for turn in 0..VALUES.len() * VALUES.len() {
        let (a, b) = operands(turn);
        let (va, vb) = (L::load(simd, &a), L::load(simd, &b));
        same(&stored(va + vb), |k| a[k] + b[k], "+");
        same(&stored(va - vb), |k| a[k] - b[k], "-");
        same(&stored(va * vb), |k| a[k] * b[k], "*");
        same(&stored(va / vb), |k| a[k] / b[k], "/");
        same(&stored(va.min(vb)), |k| if a[k] < b[k] { a[k] } else { b[k] }, "min");
        same(&stored(va.max(vb)), |k| if a[k] > b[k] { a[k] } else { b[k] }, "max");
        same(&stored(va.abs()), |k| a[k].abs(), "abs");
        same(&stored(L::splat(simd, a[3])), |_| a[3], "splat");
        assert_eq!(va.lt(vb).bits(), bits(&|k| a[k] < b[k]), "<");
        assert_eq!(va.le(vb).bits(), bits(&|k| a[k] <= b[k]), "<=");
        assert_eq!(va.equal(vb).bits(), bits(&|k| a[k] == b[k]), "==");
        assert_eq!((va.lt(vb) | vb.lt(va)).bits(), bits(&|k| a[k] < b[k] || b[k] < a[k]), "|");
        assert_eq!((va.le(vb) & vb.le(va)).bits(), bits(&|k| a[k] <= b[k] && b[k] <= a[k]), "&");
        let mask = (turn * 40503) as u32 & ((1 << L::COUNT) - 1);
        assert_eq!(L::mask_of(simd, mask).bits(), bits(&|k| mask >> k & 1 == 1));
        let chosen = stored(va.where_or(L::mask_of(simd, mask), vb));
        same(&chosen, |k| if mask >> k & 1 == 1 { a[k] } else { b[k] }, "where");
        // Packing keeps the marked lanes, in order.
        let values: [u32; 16] = std::array::from_fn(|k| (k + turn) as u32 * 7);
        let (mut packed, mut numbers) = ([0; 16], [0; 16]);
        L::pack(L::tagged(simd, &values, 3, 5), mask, &mut packed);
        L::pack_lanes(simd, 100, mask, &mut numbers);
        let set: Vec<usize> = (0..L::COUNT).filter(|k| mask >> k & 1 == 1).collect();
        for (to, &from) in set.iter().enumerate() {
            assert_eq!((packed[to], numbers[to]), (values[from] << 3 | 5, 100 + from as u32), "lane {from}");
        }
        let finite = a.map(|v| if v.is_nan() { 0.5 } else { v });
        let lanes = L::load(simd, &finite);
        let of = |pick: fn(f32, f32) -> f32| finite[..L::COUNT].iter().copied().reduce(pick);
        assert_eq!((Some(lanes.smallest()), Some(lanes.largest())), (of(f32::min), of(f32::max)));
        let ints: [i32; 16] = std::array::from_fn(|k| [i32::MIN, -1, 0, 7, i32::MAX][(k + turn) % 5]);
        for bound in [i32::MIN, -1, 0, 3, i32::MAX] {
            assert_eq!(L::below(simd, &ints, bound).bits(), bits(&|k| ints[k] < bound));
            assert_eq!(L::above(simd, &ints, bound).bits(), bits(&|k| ints[k] > bound));
        }
    }
}

fn check_both<S: Simd>(simd: S) {
    check::<S::Eight>(simd.eight());
    check::<S::Sixteen>(simd.sixteen());
}

#[test]
fn the_portable_path_does_what_it_says() {
    check_both(Portable);
    // Its implementation depends on the target.
    check::<portable::Four>(Portable);
    check::<pair::Pair<portable::Four>>(Portable);
}

#[cfg(target_arch = "x86_64")]
#[test]
fn the_vector_paths_do_what_they_say() {
    if let Some(simd) = Avx2::found() {
        check_both(simd);
    }
    match Avx512::found() {
        Some(simd) => check_both(simd),
        None => eprintln!("skipped: this processor has no AVX-512"),
    }
}
