//! What simulated worlds are made of, towns and cities alike: shapes that rays meet, houses, what stands in streets.

pub(crate) mod building;
pub(crate) mod relief;
pub(crate) mod shape;
pub(crate) mod solid;
pub(crate) mod street;
