//! Map metrics without ground truth that others use, as baselines.
