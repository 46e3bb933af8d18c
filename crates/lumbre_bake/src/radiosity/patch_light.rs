//! Direct light of patches as the mean of the direct light of the texels on them, which is known already, and more
//! accurately than from a few shadow rays of the patch. Patches with too few texels cast shadow rays instead.

use glam::{DVec3, Vec2, Vec3};

use super::patch_index::PatchIndex;
use super::patches::Patches;
use crate::chunks::in_chunks;
use crate::coverage::{CoveredTexels, Footprint, Texel, barycentric};
use crate::direct_light::DirectLight;
use crate::monitor::BakeMonitor;
use crate::sampling::{Sequence, Stream};
use crate::scene::{BakeScene, Receiver, Side};
use crate::sources::Sources;
use crate::{BakeError, BakeOptions, Quality};

/// Fewest texels that a patch's light is computed from, in each half of them. The share of fewer texels that lies
/// beyond the patch's border would be too large.
const MIN_TEXELS: f64 = 2.0;

/// Shadow rays to each source from a patch, for each of two halves.
const SHADOW_RAYS: u32 = 8;
/// The same from a smaller one, unless a reference is baked: the less it reflects into the scene, the less its noise
/// matters. A power of two, as [`SHADOW_RAYS`].
const SHADOW_RAYS_OF_SMALL: u32 = 4;
/// A patch is small if it has less than this share of the mean area. Patches are cut to one size, so that only
/// small triangles that are not in a cluster, small clusters and pieces of cut cells are smaller than most.
const SMALL: f32 = 0.5;

/// Mean direct irradiance of each patch, mixed lights included, by two halves of its texels, the fields of a
/// chessboard. `None` where there are too few texels. Texels that walls divide are left out, since they hold the light
/// of both sides of the wall.
pub(crate) fn patch_light(
    texels: &CoveredTexels<'_>,
    direct: &DirectLight,
    patches: &Patches,
) -> Vec<Option<[Vec3; 2]>> {
    let mut divided = vec![false; texels.list.len()];
    texels.divided.iter().for_each(|texel| divided[texel.place()] = true);
    let mut sums = vec![[(DVec3::ZERO, 0.0f64); 2]; patches.list.len()];
    let undivided = texels.list.iter().zip(&direct.texels).zip(divided).filter(|(_, divided)| !divided);
    for ((texel, direct), _) in undivided {
        let (half, light) = (((texel.x + texel.y) & 1) as usize, direct.total().as_dvec3());
        for_each_point(texels.scene, texel, |triangle, at, share| {
            if let Some(patch) = patches.at(triangle, Side::Front, at) {
                let (sum, weight) = &mut sums[patch.place()][half];
                *sum += light * share;
                *weight += share;
            }
        });
    }
    let mean = |halves: [(DVec3, f64); 2]| {
        let has_enough = halves.iter().all(|(_, weight)| *weight >= MIN_TEXELS);
        has_enough.then(|| halves.map(|(sum, weight)| (sum / weight).as_vec3()))
    };
    sums.into_iter().map(mean).collect()
}

/// Calls `visit` with evenly spread points of the surface that a texel shows: the triangle, barycentric weights, and
/// the share of the texel that the point stands for.
fn for_each_point(scene: &BakeScene, texel: &Texel, mut visit: impl FnMut(u32, (f32, f32), f64)) {
    match &texel.footprint {
        Footprint::Whole(triangle) => {
            let corner = Vec2::new(texel.x as f32, texel.y as f32);
            for offset in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
                if let Some(at) =
                    barycentric(&scene.triangles[*triangle as usize], corner + Vec2::from(offset))
                {
                    visit(*triangle, at, 0.25);
                }
            }
        }
        // Together they count for one texel at most; few points cover only a part of it.
        Footprint::Points(points) => {
            let share = 1.0 / points.len().max(16) as f64;
            points.iter().for_each(|point| visit(point.triangle, point.at, share));
        }
        Footprint::Hidden => {}
    }
}

/// Direct irradiance of each patch by two independent halves of samples, and the rays that it took. `open` is the share
/// of each patch that is not inside other geometry; patches whose light is `known` cast no rays.
pub(super) fn direct_halves(
    sources: &Sources<'_>,
    patches: &Patches,
    open: &[f32],
    known: &[Option<[Vec3; 2]>],
    options: &BakeOptions,
    monitor: &mut BakeMonitor<'_>,
) -> Result<([Vec<Vec3>; 2], u64), BakeError> {
    let mut halves = [Vec::new(), Vec::new()];
    let mut rays = 0;
    let area = patches.list.iter().map(|patch| f64::from(patch.area)).sum::<f64>();
    let mean_area = (area / patches.list.len().max(1) as f64) as f32;
    for (number, half) in (0..).zip(&mut halves) {
        let results: Vec<(Vec3, u32)> = in_chunks(patches.list.len(), monitor, |place| {
            match known.get(place) {
                Some(Some(halves)) if open[place] > 0.0 => return (halves[number as usize], 0),
                _ => {}
            }
            let index = PatchIndex::new(place);
            let sequence = Sequence::new(options.seed, Stream::PatchLight(number), index.0);
            let is_small =
                patches.list[place].area < SMALL * mean_area && options.quality != Quality::Reference;
            let shadow_rays = if is_small { SHADOW_RAYS_OF_SMALL } else { SHADOW_RAYS };
            patch_direct(sources, patches, index, open[place], shadow_rays, sequence)
        })?;
        rays += results.iter().map(|(_, rays)| u64::from(*rays)).sum::<u64>();
        *half = results.into_iter().map(|(direct, _)| direct).collect::<Vec<Vec3>>();
    }
    Ok((halves, rays))
}

/// Direct irradiance of a patch by so many shadow rays to each source, and the rays that it took in all. `open` is the
/// share of the patch that is not inside other geometry: the part inside receives nothing, so that the mean over the
/// whole patch is divided by that share.
pub(crate) fn patch_direct(
    sources: &Sources<'_>,
    patches: &Patches,
    index: PatchIndex,
    open: f32,
    shadow_rays: u32,
    sequence: Sequence,
) -> (Vec3, u32) {
    let (scene, patch) = (sources.scene, &patches.list[index.place()]);
    // The light on a patch that reflects nothing, usually a lamp's, is not needed.
    if open <= 0.0 || patch.reflectance == Vec3::ZERO {
        return (Vec3::ZERO, 0);
    }
    let point = |x: f32, y: f32| {
        let (face, (u, v)) = patches.point(patch, [x, y]);
        let triangle = &scene.triangles[face as usize];
        let normal = triangle.side_normal(patch.side);
        let position = triangle.position(u, v);
        let origin = scene.off_surface(face, patch.side, position);
        let shading = triangle.shading_normal(u, v);
        let shading = if patch.side == Side::Front { shading } else { -shading };
        Some(Receiver { position, origin, geometric_normal: normal, normal: shading })
    };
    let direct = sources.irradiance(sequence, shadow_rays, &point);
    (direct.total() / open, direct.rays)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};
    use lumbre_mesh::shapes;
    use lumbre_optics::{BakeMode, Light};

    use super::*;
    use crate::coverage::{FootprintPoint, receiver};
    use crate::direct_light::direct_light;
    use crate::monitor::BakeMonitor;
    use crate::radiosity::form_factor_tests::patches_of;
    use crate::sampling::{Sequence, Stream};
    use crate::scene::laid_out::laid_out;
    use crate::scene::{PlacedLight, PlacedPrimitive, SceneObject, StaticScene};
    use crate::sources::Sources;
    use crate::{BakeOptions, Density};

    /// For a block in a room under a lamp, the light of patches by texels agrees with that by 1,024 rays to the lamp
    /// from each patch.
    #[test]
    fn light_by_texels_agrees_with_light_by_shadow_rays() {
        let mut room = shapes::cuboid(Vec3::new(4.0, 3.0, 4.0), 2);
        room.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
        room.normals.iter_mut().for_each(|normal| *normal = -*normal);
        let object = |mesh, x: f64, y: f64, z: f64| {
            let transform = DAffine3::from_translation(DVec3::new(x, y, z));
            let placed = PlacedPrimitive { mesh: Arc::new(mesh), transform, ..PlacedPrimitive::default() };
            SceneObject::new("", vec![placed])
        };
        let objects = vec![object(room, 0.0, 0.0, 0.0), object(shapes::cuboid(Vec3::ONE, 1), 0.3, -1.0, 0.4)];
        let lamp = Light { radius: 0.1, bake: BakeMode::Static, ..Light::point(Vec3::ONE) };
        let lights =
            vec![PlacedLight { light: lamp, position: DVec3::new(-0.5, 1.0, 0.2), axis: DVec3::NEG_Y }];
        let input = StaticScene { objects, lights, ..StaticScene::default() }.checked().unwrap();
        let options = BakeOptions { density: Density::TexelsPerMeter(14.0), ..BakeOptions::default() };
        let (layout, scene) = laid_out(&input.objects, input.space(), &options);
        let sources = Sources::new(&scene, Vec::new(), input.lights.clone(), Vec3::ZERO);
        let mut carry_on = |_| ControlFlow::Continue(());
        let mut monitor = BakeMonitor::new(&mut carry_on, None);
        let (texels, _) = CoveredTexels::new(&scene, &layout, &mut monitor).unwrap();
        let (direct, _) = direct_light(&sources, &texels, &[], &options, &mut monitor).unwrap();
        let patches = patches_of(&scene, 6.0 * texels.side);
        let light = patch_light(&texels, &direct, &patches);

        let (mut known, mut squares, mut sum) = (0.0, 0.0, 0.0);
        for (index, (patch, light)) in patches.list.iter().zip(&light).enumerate() {
            let Some(halves) = light else { continue };
            let point = |x: f32, y: f32| {
                let (triangle, at) = patches.point(patch, [x, y]);
                Some(receiver(&scene, &FootprintPoint { triangle, at, offset: Vec2::ZERO }))
            };
            let sequence = Sequence::new(1, Stream::Test(92), index as u32);
            let expected = sources.irradiance(sequence, 1024, &point).total().x;
            let mean = 0.5 * (halves[0].x + halves[1].x);
            known += 1.0;
            squares += (mean - expected).powi(2);
            sum += expected;
        }
        let relative = (squares / known).sqrt() / (sum / known);
        println!("{known} of {} patches, {:.2} % apart", light.len(), 100.0 * relative);
        assert!(known > 0.8 * light.len() as f32, "{known} of {}", light.len());
        // Texels on the border hold light of the adjacent patch, which differs where a shadow's edge lies.
        assert!(relative < 0.03, "{relative}");
    }
}
