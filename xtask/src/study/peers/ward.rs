//! Agglomerative clustering by Ward's criterion.

use super::grid::dot;

/// A cluster while clusters are merged.
struct Cluster {
    mean: [f64; 3],
    members: Vec<usize>,
}

impl Cluster {
    /// The square of the height of merging A and B: √(2·|A|·|B| / (|A| + |B|)) times the distance of their means, as in
    /// `SciPy` and scikit-learn.
    fn squared_height(&self, other: &Self) -> f64 {
        let (na, nb) = (self.members.len() as f64, other.members.len() as f64);
        let apart: [f64; 3] = std::array::from_fn(|k| self.mean[k] - other.mean[k]);
        2.0 * na * nb / (na + nb) * dot(&apart, &apart)
    }

    fn merged(mut self, other: Self) -> Self {
        let (na, nb) = (self.members.len() as f64, other.members.len() as f64);
        self.mean = std::array::from_fn(|k| (na * self.mean[k] + nb * other.mean[k]) / (na + nb));
        self.members.extend(other.members);
        self
    }
}

/// Clusters of `points` such that no two could be merged at a height below `threshold`, as indices.
///
/// Chains of nearest neighbours find the same merges as the closest pair again and again (Murtagh 1983), in O(n²).
pub(super) fn ward(points: &[[f64; 3]], threshold: f64) -> Vec<Vec<usize>> {
    let single = |(k, &mean): (usize, &[f64; 3])| Cluster { mean, members: vec![k] };
    let mut open: Vec<Cluster> = points.iter().enumerate().map(single).collect();
    let mut done = Vec::new();
    // Each is the nearest of the one before.
    let mut chain: Vec<Cluster> = Vec::new();
    while let Some(tip) = chain.pop().or_else(|| open.pop()) {
        // The one before comes first: of two equally near it is taken, so that a chain ends.
        let before = chain.last().map(|before| (tip.squared_height(before), None));
        let others = open.iter().enumerate().map(|(k, other)| (tip.squared_height(other), Some(k)));
        let nearest = before.into_iter().chain(others).min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest.filter(|(height, _)| *height < threshold * threshold) {
            // Merging others brings nothing nearer: it stays as it is.
            None => done.push(tip.members),
            Some((_, Some(k))) => {
                chain.push(tip);
                chain.push(open.swap_remove(k));
            }
            Some((_, None)) => open.extend(chain.pop().map(|before| before.merged(tip))),
        }
    }
    done
}

#[cfg(test)]
mod tests {
    use super::super::sharpness::tests::random;
    use super::*;

    /// The closest pair of all, again and again.
    fn closest_pairs(points: &[[f64; 3]], threshold: f64) -> Vec<Vec<usize>> {
        let single = |(k, &mean): (usize, &[f64; 3])| Cluster { mean, members: vec![k] };
        let mut clusters: Vec<Cluster> = points.iter().enumerate().map(single).collect();
        loop {
            let pairs = (0..clusters.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
            let heights = pairs.map(|(a, b)| (clusters[a].squared_height(&clusters[b]), a, b));
            match heights.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((height, a, b)) if height < threshold * threshold => {
                    let gone = clusters.swap_remove(a);
                    let kept = clusters.swap_remove(b);
                    clusters.push(kept.merged(gone));
                }
                _ => return clusters.into_iter().map(|cluster| cluster.members).collect(),
            }
        }
    }

    fn sorted(mut clusters: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
        clusters.iter_mut().for_each(|members| members.sort_unstable());
        clusters.sort_unstable();
        clusters
    }

    #[test]
    fn the_chain_merges_what_the_closest_pairs_merge() {
        for (seed, spread, threshold) in
            [(1, 0.02, 0.1), (2000, 0.1, 0.1), (3000, 0.3, 0.5), (4000, 0.001, 0.1)]
        {
            let mut next = random(seed);
            let mut point = |k: usize| {
                let mut point = [0.0; 3];
                point[k % 3] = 1.0;
                point.map(|c| c + spread * (next() + next() - 1.0))
            };
            let points: Vec<[f64; 3]> = (0..120).map(&mut point).collect();
            let got = sorted(ward(&points, threshold));
            assert_eq!(got, sorted(closest_pairs(&points, threshold)));
            assert!((3..120).contains(&got.len()), "{}", got.len());
        }
    }

    #[test]
    fn ties_end() {
        let lattice: Vec<[f64; 3]> = (0..64).map(|k| [f64::from(k % 8), f64::from(k / 8), 0.0]).collect();
        for (points, threshold, expected) in [
            (&[][..], 0.1, 0..1),
            (&[[0.0; 3]; 9][..], 0.1, 1..2),
            (&lattice, 1.0, 64..65),
            (&lattice, 1.01, 1..33),
            (&lattice, 1e9, 1..2),
        ] {
            assert!(expected.contains(&ward(points, threshold).len()));
        }
    }
}
