//! Highlights: whether there is one, how sharp it is, with which distribution and Fresnel reflectance, and
//! whether it is normalized.

use lumbre_optics::{Distribution, Fresnel};

use super::Subject;
use crate::shader::{Feature, Variant};

pub(super) fn call(subject: &Subject<'_>, variant: &mut Variant) {
    let object = subject.object;
    variant.set(Feature::Matt, subject.lit && !object.specular);
    variant.set(Feature::SharpHighlights, object.sharp);
    if object.specular {
        let (distribution, fresnel) = (object.distribution, object.fresnel);
        let chosen = (distribution, fresnel) != (Distribution::default(), Fresnel::default());
        variant.set(Feature::EnergyConserving, object.energy_conserving);
        variant.set(Feature::Microfacets, chosen);
        variant.set(Feature::DistributionCosinePower, distribution == Distribution::CosinePower);
        variant.set(Feature::DistributionGaussian, distribution == Distribution::Gaussian);
        variant.set(Feature::FresnelConductor, matches!(fresnel, Fresnel::Conductor { .. }));
        variant.set(Feature::FresnelNormalReflectance, fresnel == Fresnel::NormalReflectance);
    }
}
