//! Light sources: emissive triangles and punctual lights, each in a tree, and the direct light that they bring to a
//! receiver. Computing it for every texel is the task of `direct_light`.

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
pub(crate) mod sampled_receiver;
pub(crate) mod share_variance;
pub(crate) mod shared_samples;
pub(crate) mod source_tree;

pub(crate) use direct::{Direct, VisibilitySummary};
pub(crate) use emitters::Emitter;
pub(crate) use light_cut::LightCut;
pub(crate) use light_sources::Sources;
pub(crate) use sampled_receiver::SampledReceiver;
