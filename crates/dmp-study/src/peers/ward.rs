//! Agglomerative clustering by Ward's criterion.

/// A cluster while clusters are merged.
#[derive(Debug)]
struct Cluster {
    mean: [f64; 3],
    members: Vec<usize>,
}

/// Clusters of `points` such that no two could be merged at a height below `threshold`, each as ascending
/// indices, by ascending first index.
///
/// The height of merging A and B is √(2·|A|·|B| / (|A| + |B|)) times the distance of their means: that of
/// Ward linkage as `SciPy` and scikit-learn have it. Chains of nearest neighbours find the same merges as
/// taking the closest pair again and again does (Murtagh 1983), in O(n²) time and O(n) memory.
pub(super) fn ward(points: &[[f64; 3]], threshold: f64) -> Vec<Vec<usize>> {
    let single = |(k, &mean): (usize, &[f64; 3])| Cluster { mean, members: vec![k] };
    let mut clusters: Vec<Cluster> = points.iter().enumerate().map(single).collect();
    let mut open: Vec<usize> = (0..points.len()).collect();
    let mut done: Vec<Vec<usize>> = Vec::new();
    let mut chain: Vec<usize> = Vec::new();
    while let Some(&tip) = chain.last().or(open.last()) {
        if chain.is_empty() {
            chain.push(tip);
        }
        let before = chain.len().checked_sub(2).map(|k| chain[k]);
        match nearest(&clusters, &open, tip, before).filter(|&(height, _)| height < threshold * threshold) {
            // Merging others brings nothing nearer than it was: this one stays as it is.
            None => {
                chain.pop();
                remove(&mut open, tip);
                done.push(std::mem::take(&mut clusters[tip].members));
            }
            Some((_, other)) if Some(other) == before => {
                chain.truncate(chain.len() - 2);
                remove(&mut open, tip);
                let gone = std::mem::take(&mut clusters[tip].members);
                let (mine, theirs) = (clusters[other].members.len() as f64, gone.len() as f64);
                let gone_mean = clusters[tip].mean;
                let kept = &mut clusters[other];
                kept.mean =
                    std::array::from_fn(|k| (mine * kept.mean[k] + theirs * gone_mean[k]) / (mine + theirs));
                kept.members.extend(gone);
            }
            Some((_, other)) => chain.push(other),
        }
    }
    done.iter_mut().for_each(|members| members.sort_unstable());
    done.sort_unstable();
    done
}

/// The open cluster nearest to `tip` and the square of the height of merging them; of two equally near,
/// `before`, so that a chain ends.
fn nearest(clusters: &[Cluster], open: &[usize], tip: usize, before: Option<usize>) -> Option<(f64, usize)> {
    let height = |other: usize| squared_height(&clusters[tip], &clusters[other]);
    let mut best = before.map(|other| (height(other), other));
    for &other in open.iter().filter(|&&other| other != tip) {
        let height = height(other);
        if best.is_none_or(|(least, _)| height < least) {
            best = Some((height, other));
        }
    }
    best
}

#[inline]
fn squared_height(a: &Cluster, b: &Cluster) -> f64 {
    let (na, nb) = (a.members.len() as f64, b.members.len() as f64);
    let apart = [a.mean[0] - b.mean[0], a.mean[1] - b.mean[1], a.mean[2] - b.mean[2]];
    2.0 * na * nb / (na + nb) * (apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2])
}

fn remove(open: &mut Vec<usize>, cluster: usize) {
    if let Ok(at) = open.binary_search(&cluster) {
        open.remove(at);
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::tests::random;
    use super::*;

    /// The closest pair of all, again and again, from the members themselves.
    fn closest_pairs(points: &[[f64; 3]], threshold: f64) -> Vec<Vec<usize>> {
        let mut clusters: Vec<Vec<usize>> = (0..points.len()).map(|k| vec![k]).collect();
        let mean = |members: &[usize]| -> [f64; 3] {
            std::array::from_fn(|c| members.iter().map(|&k| points[k][c]).sum::<f64>() / members.len() as f64)
        };
        let height = |a: &[usize], b: &[usize]| {
            let (ma, mb) = (mean(a), mean(b));
            let square: f64 = (0..3).map(|c| (ma[c] - mb[c]) * (ma[c] - mb[c])).sum();
            let (na, nb) = (a.len() as f64, b.len() as f64);
            (2.0 * na * nb / (na + nb) * square).sqrt()
        };
        loop {
            let mut best = (threshold, 0, 0);
            for a in 0..clusters.len() {
                for b in 0..a {
                    let height = height(&clusters[a], &clusters[b]);
                    if height < best.0 {
                        best = (height, a, b);
                    }
                }
            }
            if best.1 == best.2 {
                break;
            }
            let gone = clusters.swap_remove(best.1);
            clusters[best.2].extend(gone);
        }
        clusters.iter_mut().for_each(|members| members.sort_unstable());
        clusters.sort_unstable();
        clusters
    }

    #[test]
    fn the_chain_merges_what_the_closest_pairs_merge() {
        for (seed, spread, threshold) in [(1, 0.02, 0.1), (2, 0.1, 0.1), (3, 0.3, 0.5), (4, 0.001, 0.1)] {
            let mut next = random(seed);
            let points: Vec<[f64; 3]> = (0..120)
                .map(|k| {
                    let mut point = [0.0; 3];
                    point[k % 3] = 1.0;
                    point.map(|c| c + spread * (next() + next() - 1.0))
                })
                .collect();
            let got = ward(&points, threshold);
            assert_eq!(got, closest_pairs(&points, threshold));
            assert!((3..120).contains(&got.len()), "{}", got.len());
        }
    }

    #[test]
    fn ties_and_trifles_end() {
        assert!(ward(&[], 0.1).is_empty());
        assert_eq!(ward(&[[0.0; 3]], 0.1), [[0]]);
        assert_eq!(ward(&[[0.0; 3]; 9], 0.1).len(), 1);
        let lattice: Vec<[f64; 3]> = (0..64).map(|k| [f64::from(k % 8), f64::from(k / 8), 0.0]).collect();
        assert_eq!(ward(&lattice, 1.0).len(), 64);
        assert!(ward(&lattice, 1.01).len() <= 32);
        assert_eq!(ward(&lattice, 1e9).len(), 1);
    }
}
