//! How well two orders of the same runs agree: Kendall tau-b and Spearman rho.
