//! What shines: emissive triangles and punctual lights, each in a tree, and the direct light that a receiver takes from them. Not which texels ask:
//! that is `direct_light`.

pub(crate) mod area_light;
pub(crate) mod batches;
pub(crate) mod direct;
pub(crate) mod emitter_bounds;
pub(crate) mod emitter_sample;
pub(crate) mod emitter_tree;
pub(crate) mod emitter_walk;
pub(crate) mod emitters;
pub(crate) mod irradiance;
pub(crate) mod light_cut;
pub(crate) mod light_sources;
pub(crate) mod light_tree;
pub(crate) mod punctual;
pub(crate) mod punctual_irradiance;
pub(crate) mod receiver_quadrature;
pub(crate) mod share_variance;
pub(crate) mod shared_samples;
